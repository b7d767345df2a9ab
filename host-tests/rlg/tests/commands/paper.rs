//! `rlg paper`: the statements of `paper.json`, and the figures printed in the paper.
//!
//! One run of every experiment, read by all tests. Its lengths are the short ones: ratios need no more, and the gyros' and
//! the calibration's experiments have the same length in both.

use std::path::PathBuf;
use std::sync::OnceLock;

use assert_cmd::Command;
use serde_json::Value;

struct Output {
    json: Value,
    page: String,
    words: String,
    _folder: tempfile::TempDir,
}

fn output() -> &'static Output {
    static OUTPUT: OnceLock<Output> = OnceLock::new();
    OUTPUT.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("paper");
        let run = Command::cargo_bin("rlg")
            .expect("the command is built")
            .args(["paper", "--short", "--out"])
            .arg(&out)
            .output()
            .expect("it runs");
        let words = String::from_utf8_lossy(&run.stdout).into_owned();
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success(), "{said}");
        let read = |name: &str| std::fs::read_to_string(out.join(name)).expect("a result");
        Output {
            json: serde_json::from_str(&read("paper.json")).expect("JSON"),
            page: read("paper.html"),
            words,
            _folder: folder,
        }
    })
}

fn entries() -> &'static Vec<Value> {
    output().json["entries"].as_array().expect("entries")
}

fn entry(item: &str) -> &'static Value {
    let found = entries().iter().find(|entry| entry["item"] == item);
    found.unwrap_or_else(|| panic!("no entry for {item}"))
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn every_table_and_figure_has_an_entry_with_what_the_contract_names() {
    let items = (1..=13)
        .map(|n| format!("Fig. {n}"))
        .chain((1..=5).map(|n| format!("Table {n}")));
    for item in items {
        let entry = entry(&item);
        for key in ["paper", "ours", "reproduced", "why"] {
            assert!(entry.get(key).is_some(), "{item} lacks {key}");
        }
        assert!(entry["reproduced"].is_boolean(), "{item}");
        let by = entry["criterion"]["by"].as_str();
        let is_drawing = entry["paper"] == "a drawing";
        assert!(
            matches!(by, Some("paper" | "ours" | "both")) != is_drawing,
            "{item}"
        );
        let why = entry["why"].as_str().expect("words");
        assert!(why.ends_with('.') && why.len() > 20, "{item}: {why}");
    }
    assert_eq!(entries().len(), 18);
}

#[test]
fn tables_1_and_2_are_proportional_to_the_acceleration_with_the_coefficient_of_inertia_and_stiffness()
 {
    for item in ["Table 1", "Table 2"] {
        let ours = &entry(item)["ours"];
        // the paper's J/k, of which the mode uses only its frequency
        assert!((number(&ours["coefficient_s2"]) / 7.9e-8 - 1.0).abs() < 1e-9);
        // rounding of a second of integration
        assert!(number(&ours["nonlinearity"]) < 1e-9);
        assert_eq!(entry(item)["reproduced"], true);
    }
}

#[test]
fn table_3_sums_come_back_within_two_per_cent_of_what_was_simulated() {
    let ours = &entry("Table 3")["ours"];
    for (name, simulated) in [("xy+xz", 14.0e-8), ("yx+yz", 14.8e-8), ("zx+zy", 14.3e-8)] {
        let sum = number(&ours["sums_s2"][name]);
        println!("{name}: {sum:e}, {:+.2} %", 100.0 * (sum / simulated - 1.0));
        assert!((sum / simulated - 1.0).abs() <= 0.02, "{name}: {sum:e}");
    }
}

#[test]
fn laser_and_fibre_optic_gyro_differ_by_half_a_degree_an_hour_at_15_hz_and_agree_at_1_hz() {
    let of = |item: &str, key: &str| number(&entry(item)["ours"][key]);
    let (fast, slow) = (
        of("Fig. 4", "difference_deg_h"),
        of("Fig. 5", "difference_deg_h"),
    );
    println!("15 Hz: {fast:.4} deg/h, 1 Hz: {slow:.4} deg/h");
    assert!((fast.abs() - 0.5).abs() <= 0.05);
    assert!(slow.abs() <= 0.05);
    // Ω³φ²/2 (K_xy + K_xz): 0.4953 and 0.0272 °/h; the mode at 593 Hz adds (15/593)² = 6e-4
    assert!((of("Fig. 4", "of_it_flexure_deg_h").abs() / 0.4953 - 1.0).abs() < 0.003);
    // the drift is proportional to the square of the angle; sin²φ/φ² contributes 1e-4 at 0.7°
    let sensitivity = &entry("Fig. 4")["ours"]["flexure_deg_h_at_half_and_twice_the_angle"];
    assert!((number(&sensitivity[1]) / number(&sensitivity[0]) / 16.0 - 1.0).abs() < 1e-3);
}

#[test]
fn the_systems_diverge_by_flexure_alone_and_compensation_takes_nine_tenths_of_it_out() {
    for item in ["Fig. 6", "Fig. 7", "Fig. 8", "Fig. 9"] {
        println!("{item}: {}", entry(item)["why"]);
        assert_eq!(entry(item)["reproduced"], true, "{item}");
    }
    // 0.495 °/h for 120 s less half of both tapers: 0.0163°; the walk adds 3 × 0.0003°
    let ours = &entry("Fig. 8")["ours"];
    let pitch = number(&ours["before_pitch_roll_yaw_deg"][0]).abs();
    let expected = 0.495 / 3600.0 * (number(&ours["seconds"]) - 1.2);
    assert!(
        (pitch - expected).abs() < 0.001,
        "{pitch} against {expected}"
    );
}

#[test]
fn every_row_of_tables_4_and_5_is_reduced_as_the_paper_s_and_by_nine_tenths_where_flexure_is_alone()
{
    for item in ["Table 4", "Table 5"] {
        assert_eq!(
            entry(item)["reproduced"],
            true,
            "{item}: {}",
            entry(item)["why"]
        );
        let rows = entry(item)["ours"]["rows"].as_array().expect("rows");
        assert_eq!(rows.len(), if item == "Table 4" { 6 } else { 4 });
        for row in rows {
            let (name, along) = (&row["name"], &row["along"]);
            let [ours, paper, alone] = [
                "reduction_percent",
                "paper_reduction_percent",
                "alone_percent",
            ]
            .map(|key| number(&row[key]));
            println!(
                "{item} {name} {along}: {ours:.2} % (paper {paper:.2} %), flexure alone {alone:.2} %"
            );
            assert!(alone >= f64::max(90.0, paper), "{item} {name} {along}");
            assert!(
                ours >= paper || row["limited_by"] == "random_walk_and_bias",
                "{item} {name} {along}"
            );
        }
    }
}

#[test]
fn the_signs_as_printed_fail_in_every_experiment() {
    let fig_4 = &entry("Fig. 4")["ours"];
    let left = number(&fig_4["literal_signs_deg_h"]) / number(&fig_4["difference_deg_h"]);
    assert!(left > 0.9, "{left}");
    for item in ["Table 4", "Table 5"] {
        for row in entry(item)["ours"]["rows"].as_array().expect("rows") {
            let left = number(&row["left_by_literal_signs_percent"]);
            assert!(left > 90.0, "{row}");
        }
    }
    let words = output().json["literal_signs"].as_str().expect("words");
    // "Eq. (6)" and "Fig. 4" have points too, but none before a capital
    let sentences = words
        .split(". ")
        .filter(|part| part.starts_with("Eq") || part.starts_with("It"));
    assert_eq!(sentences.count(), 2, "{words}");
    assert!(output().page.contains(words));
}

#[test]
fn the_page_stands_alone_and_the_terminal_stays_within_twenty_lines() {
    let page = &output().page;
    for foreign in ["<script", "http://", "https://", "<link", "@import"] {
        assert!(!page.contains(foreign), "{foreign}");
    }
    // two plots for each of Fig. 4 and 5, five for each of the four pairs of system figures
    assert_eq!(page.matches("<svg class=\"plot\"").count(), 4 + 20);
    assert!(output().words.lines().count() <= 20, "{}", output().words);
}

#[test]
fn a_folder_that_cannot_be_written_is_refused_before_any_work() {
    let folder = tempfile::tempdir().expect("a folder");
    let blocked: PathBuf = folder.path().join("file");
    std::fs::write(&blocked, "x").expect("a file");
    let run = Command::cargo_bin("rlg")
        .expect("the command is built")
        .args(["paper", "--out"])
        .arg(blocked.join("paper"))
        .output()
        .expect("it runs");
    let words = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(2), "{words}");
    assert_eq!(words.lines().count(), 1, "{words}");
}
