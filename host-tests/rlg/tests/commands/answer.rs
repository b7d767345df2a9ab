//! The answer of `rlg diagnose`: its distribution over the streams, its length, its exit code.
//!
//! Recordings are made here from formulas; if `RLG_RECORDINGS` names the folder of the shared ones, those in `outside` are
//! diagnosed, too.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use rlg::command::ideal;
use rlg::diagnose::diagnose;
use rlg::recording::Recording;
use serde_json::Value;

/// Lines of an answer, including the line with the page's path.
const MOST_LINES: usize = 15;

/// Rows per second [Hz].
const RATE_HZ: f64 = 100.0;

/// 20 s about all axes, with a scale error of `scale` and a little noise on gyro x.
pub(super) fn recording(folder: &Path, scale: f64) -> PathBuf {
    let bench = folder.join("bench");
    fs::create_dir_all(&bench).expect("a folder");
    let mut rows = String::from("gx,gy,gz,rx,ry,rz\n");
    let mut state = 7_u64;
    let mut noise = || {
        // The sum of six uniform numbers is approximately normal.
        let sum: f64 = (0..6)
            .map(|_| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            })
            .sum();
        1e-4 * sum * 2_f64.sqrt()
    };
    for row in 0..2000_u32 {
        let time_s = (f64::from(row) + 0.5) / RATE_HZ;
        let rate = [
            0.8 * (3.1 * time_s).sin(),
            0.7 * (2.3 * time_s).sin(),
            0.9 * (1.7 * time_s).cos(),
        ];
        let gyro = [(1.0 + scale) * rate[0], rate[1], rate[2]].map(|rate| rate + noise());
        let reference = rate.map(|rate| rate / RATE_HZ);
        let fields = gyro.iter().chain(&reference);
        let fields: Vec<String> = fields.map(|value| format!("{value:.9e}")).collect();
        let _ = writeln!(rows, "{}", fields.join(","));
    }
    fs::write(bench.join("rows.csv"), rows).expect("written");
    let mut manifest = String::from(
        "format = 1\nname = \"bench\"\n[[table]]\nfile = \"rows.csv\"\nrate_hz = 100.0\n",
    );
    for (quantity, letter) in [("gyro_rate", 'g'), ("reference_increment", 'r')] {
        for axis in ["x", "y", "z"] {
            let _ = writeln!(
                manifest,
                "  [[table.channel]]\n  column = \"{letter}{axis}\"\n  quantity = \"{quantity}\"\n  axis = \"{axis}\""
            );
        }
    }
    fs::write(bench.join("recording.toml"), manifest).expect("written");
    bench
}

pub(super) fn rlg(arguments: &[&str], paths: &[&Path]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rlg"));
    command.args(arguments).args(paths);
    command.output().expect("it runs")
}

pub(super) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("words are UTF-8")
}

#[test]
fn the_whole_answer_stands_on_standard_output_and_nothing_beside_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = recording(folder.path(), 2e-3);
    let output = rlg(&["diagnose"], &[&bench]);
    let (said, beside) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{beside}");
    assert_eq!(
        beside, "",
        "no progress where standard error is no terminal"
    );
    assert!(said.lines().count() <= MOST_LINES, "{said}");
    let assumed =
        "Assumed, as no --model is given: an ideal unit, with the motion of the reference";
    let count = said
        .lines()
        .filter(|line| line.starts_with(assumed))
        .count();
    assert_eq!(count, 1, "{said}");
    // 2e-3 is 2000 ppm, found within 5 σ and printed with its unit.
    let line = said.lines().find(|line| line.contains("gyro scale x"));
    let line = line.unwrap_or_else(|| panic!("no scale in {said}"));
    let (value, std) = pair(line);
    assert!(line.ends_with(" ppm"), "{line}");
    assert!((value - 2000.0).abs() < 5.0 * std && std < 20.0, "{line}");
    assert!(
        said.contains("Held-out power over noise: gyro x falls "),
        "{said}"
    );
    assert!(
        said.contains("Not distinguishable: gyro scale or reference scale."),
        "{said}"
    );
    for begin in ["Next: ", "To read: "] {
        assert!(said.lines().any(|line| line.starts_with(begin)), "{said}");
    }
    assert!(!said.contains('…'), "nothing is cut: {said}");
}

/// Returns the number before and the one behind "±".
fn pair(line: &str) -> (f64, f64) {
    let (before, after) = line.split_once(" ± ").expect("a pair");
    let number = |word: Option<&str>| -> f64 {
        let word = word.expect("a number").replace('−', "-");
        word.trim_end_matches(',').parse().expect("a number")
    };
    let value = number(before.split_whitespace().last());
    (value, number(after.split_whitespace().next()))
}

#[test]
fn json_alone_stands_on_standard_output_and_holds_what_the_file_holds() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = recording(folder.path(), 2e-3);
    let out = folder.path().join("out");
    let output = rlg(&["diagnose", "--json", "-q", "-o"], &[&out, &bench]);
    assert_eq!(text(&output.stderr), "");
    let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let file = fs::read(out.join("diagnosis.json")).expect("written");
    let written: Value = serde_json::from_slice(&file).expect("JSON");
    assert_eq!(printed, written);
    assert_eq!(printed["verdict"], "explained");
    // Without -q the words are printed, too, on the other stream.
    let output = rlg(&["diagnose", "--json"], &[&bench]);
    assert!(text(&output.stderr).contains("gyro scale x"));
    assert!(serde_json::from_slice::<Value>(&output.stdout).is_ok());
}

#[test]
fn other_thresholds_change_the_answer_and_stand_in_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = recording(folder.path(), 2e-5);
    let plan = folder.path().join("plan.toml");
    let printed = text(&rlg(&["plan"], &[]).stdout);
    let default = "\nnaming = 4.0\n";
    assert!(printed.contains(default), "{printed}");
    let effects = |naming: &str| {
        fs::write(&plan, printed.replacen(default, naming, 1)).expect("written");
        let output = rlg(&["diagnose", "--json", "-q", "--plan"], &[&plan, &bench]);
        let said: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        (said["effects"].as_array().map(Vec::len), said)
    };
    let (as_printed, said) = effects(default);
    assert_eq!((as_printed, said.get("plan")), (Some(1), None), "{said}");
    let (strict, said) = effects("\nnaming = 100\n");
    assert_eq!(strict, Some(0), "{said}");
    let changed =
        serde_json::json!([{ "number": "judgement.naming", "value": [100.0], "default": [4.0] }]);
    assert_eq!(said["plan"], changed);

    fs::write(&plan, "format = 1\n[judgement]\nnameing = 5\n").expect("written");
    let output = rlg(&["diagnose", "--plan"], &[&plan, &bench]);
    assert_eq!(output.status.code(), Some(2));
    let refused = text(&output.stderr);
    for part in ["plan.toml", "judgement.nameing", "judgement.naming"] {
        assert!(refused.contains(part), "{refused}");
    }
}

#[test]
fn a_verdict_ends_the_command_with_code_1_where_it_is_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let scaled = recording(&folder.path().join("a"), 2e-3);
    let ideal = recording(&folder.path().join("b"), 0.0);
    let code = |fail_on: &[&str], bench: &Path| {
        let output = rlg(&[&["diagnose", "-q"], fail_on].concat(), &[bench]);
        assert!(
            text(&output.stdout).contains("To read: "),
            "the answer is given all the same"
        );
        output.status.code()
    };
    // The table of options and verdicts is a unit test of the command.
    assert_eq!(code(&[], &scaled), Some(0));
    assert_eq!(code(&["--fail-on", "any"], &scaled), Some(1));
    assert_eq!(code(&["--fail-on", "any"], &ideal), Some(0));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_device_ends_the_command_with_code_2_and_a_sentence() {
    for arguments in [&["plan"][..], &["plan", "--json"], &["man", "plan"]] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full");
        let output = Command::new(env!("CARGO_BIN_EXE_rlg"))
            .args(arguments)
            .arg("-q")
            .stdout(full.expect("Linux has it"))
            .stderr(Stdio::piped())
            .output()
            .expect("it runs");
        let words = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {words}");
        assert!(
            words.contains("standard output: cannot be written"),
            "{words}"
        );
        assert_eq!(words.lines().count(), 1, "{words}");
    }
}

#[test]
fn a_reader_that_leaves_early_is_no_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = recording(folder.path(), 2e-3);
    for arguments in [
        &["diagnose"][..],
        &["diagnose", "--json"],
        &["man", "diagnose"],
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_rlg"))
            .args(arguments)
            .args((arguments[0] == "diagnose").then_some(&bench))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(0), "{arguments:?}");
        assert!(!text(&output.stderr).contains("panicked"));
    }
}

#[test]
fn a_folder_of_other_files_is_refused_in_one_sentence_and_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = recording(folder.path(), 2e-3);
    let out = folder.path().join("out");
    fs::create_dir(&out).expect("a folder");
    fs::write(out.join("model.toml"), "mine").expect("written");
    let output = rlg(&["diagnose", "-o"], &[&out, &bench]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(
        said.contains("holds model.toml, and no earlier result of this command"),
        "{said}"
    );
    assert_eq!(fs::read(out.join("model.toml")).expect("kept"), b"mine");
    assert_eq!(fs::read_dir(&out).expect("a folder").count(), 1);
    // Earlier results are replaced, an empty folder is filled.
    fs::remove_file(out.join("model.toml")).expect("removed");
    for _ in 0..2 {
        let output = rlg(&["diagnose", "-q", "-o"], &[&out, &bench]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    }
}

#[test]
fn pulses_need_a_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = recording(folder.path(), 0.0);
    let manifest = fs::read_to_string(bench.join("recording.toml")).expect("read");
    let counted = manifest.replace("gyro_rate", "gyro_count");
    fs::write(bench.join("recording.toml"), counted).expect("written");
    let output = rlg(&["diagnose"], &[&bench]);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(
        said.contains("counts pulses") && said.contains("--model"),
        "{said}"
    );
    assert!(output.stdout.is_empty());
}

#[test]
fn answers_on_recordings_of_others_are_short_and_whole() {
    let Some(folder) = std::env::var_os("RLG_RECORDINGS").map(PathBuf::from) else {
        eprintln!("skipped: RLG_RECORDINGS names no folder of recordings");
        return;
    };
    for (name, parts) in [
        ("delay-att-0.008", &["reference early   7.99", " ms"][..]),
        ("bias-0.076", &["gyro bias   x 0.116", " °/s"]),
        (
            "autopilot-attitude",
            &[
                "reference late   7.5",
                "52 rows of the recording in 45 places",
            ],
        ),
        (
            "held-7-rows",
            &["each sample held for 7 rows (mean age 15.0 ms)"],
        ),
        (
            "wrapped-rate",
            &["saturated rows   gyro x: 2062 rows in 19 places"],
        ),
        ("delay-rate-0.032", &["reference early   31.999"]),
        (
            "encoder-yaw",
            &["gyro late z ", "not explained", " stretches; the first: "],
        ),
        (
            "null-10s",
            &[
                "The model explains this recording",
                " % of the motion, like noise of N x ",
            ],
        ),
        ("two-attitudes-bias", &["Held out: no rows"]),
    ] {
        let bench = folder.join("outside").join(name);
        let output = rlg(&["diagnose", "-m"], &[&bench.join("model.toml"), &bench]);
        let said = text(&output.stdout);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{name}: {}",
            text(&output.stderr)
        );
        assert_eq!(text(&output.stderr), "", "{name}");
        assert!(said.lines().count() <= MOST_LINES, "{name}: {said}");
        for part in parts {
            assert!(said.contains(part), "{name}: no {part:?} in {said}");
        }
    }
}

#[test]
fn companions_name_every_command() {
    let bash = text(&rlg(&["completions", "bash"], &[]).stdout);
    let page = text(&rlg(&["man"], &[]).stdout);
    let own = text(&rlg(&["man", "diagnose"], &[]).stdout);
    for command in ["diagnose", "simulate", "on-target"] {
        assert!(bash.contains(command), "{command}");
        assert!(page.contains(&command.replace('-', "\\-")), "{command}");
    }
    assert!(
        own.contains("rlg\\-diagnose") && own.contains("fail\\-on"),
        "{own}"
    );
    assert_eq!(rlg(&["man", "nothing"], &[]).status.code(), Some(2));
    // All pages at once, each as it is printed.
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("man1");
    let written = rlg(&["man", "--out"], &[&out]);
    assert_eq!(written.status.code(), Some(0), "{}", text(&written.stderr));
    for (file, expected) in [("rlg.1", page), ("rlg-diagnose.1", own)] {
        let found = std::fs::read_to_string(out.join(file)).expect("a page");
        assert_eq!(found.trim_end(), expected.trim_end(), "{file}");
    }
    assert!(out.join("rlg-on-target.1").is_file() && !out.join("rlg-help.1").exists());
    let refused = rlg(&["man", "diagnose", "--out"], &[&out]);
    assert_eq!(refused.status.code(), Some(2));
}

#[test]
fn timings_are_printed_and_stand_on_the_page_where_they_are_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = recording(folder.path(), 2e-3);
    let out = folder.path().join("out");
    let output = rlg(&["diagnose", "--timings", "--out"], &[&out, &bench]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let answer = text(&output.stdout);
    let table: Vec<&str> = answer
        .lines()
        .skip_while(|line| !line.starts_with("Timings"))
        .collect();
    let counts = |stage: &str| -> Vec<f64> {
        let line = table.iter().find(|line| line.trim().starts_with(stage));
        let line = line.unwrap_or_else(|| panic!("no {stage} in {answer}"));
        let fields = line.split_whitespace().rev().take(5);
        fields.filter_map(|field| field.parse().ok()).collect()
    };
    let [fits, transforms, columns, .., seconds] = counts("together")[..] else {
        panic!("{answer}");
    };
    let [of_passes, ..] = counts("pass")[..] else {
        panic!("{answer}");
    };
    assert!(of_passes > 0.0 && fits >= of_passes, "{answer}");
    assert!(
        transforms > columns && columns > 0.0 && seconds > 0.0,
        "{answer}"
    );
    let page = fs::read_to_string(out.join("report.html")).expect("a page");
    assert!(page.contains("<h2>Timings</h2>"));
    // The result itself is the same on any machine.
    let json = fs::read_to_string(out.join("diagnosis.json")).expect("a result");
    assert!(!json.contains("imings"));
    let without = rlg(&["diagnose"], &[&bench]);
    assert!(!text(&without.stdout).contains("Timings"));
}

/// 60 s of a motion of many tones; from row `lost.0` on the gyros are `lost.1` rows ahead of the reference.
fn with_lost_rows(folder: &Path, lost: (u32, u32)) -> PathBuf {
    let bench = recording(folder, 0.0);
    let mut rows = String::from("gx,gy,gz,rx,ry,rz\n");
    let rate = |row: u32, axis: u32| -> f64 {
        let time_s = (f64::from(row) + 0.5) / RATE_HZ;
        let tone = |k: u32| {
            // Square roots: no two tones have a common period.
            let hz = 0.4 * f64::from(k + 25 * axis + 2).sqrt();
            0.1 * (6.3 * hz * time_s + f64::from(k * k)).sin()
        };
        (0..25).map(tone).sum()
    };
    for row in 0..6000 {
        let read = row + if row < lost.0 { 0 } else { lost.1 };
        // The gyros' last digit, alone, is noise.
        let gyros = (0..3).map(|axis| format!("{:.4}", rate(read, axis)));
        let reference = (0..3).map(|axis| format!("{:.9e}", rate(row, axis) / RATE_HZ));
        let fields: Vec<String> = gyros.chain(reference).collect();
        let _ = writeln!(rows, "{}", fields.join(","));
    }
    fs::write(bench.join("rows.csv"), rows).expect("written");
    bench
}

#[test]
fn rows_lost_without_stamps_are_found_and_restored_beside_rates() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = with_lost_rows(folder.path(), (1500, 50));
    let output = rlg(&["diagnose"], &[&bench]);
    let answer = text(&output.stdout);
    assert!(
        answer.contains("50 rows of the recording, 15.0–15.5 s"),
        "{answer}"
    );
    for wrong in ["early", "late", "scale", "not explained"] {
        assert!(!answer.contains(&format!("  gyro {wrong}")), "{answer}");
    }
    let output = rlg(&["diagnose", "--json", "-q"], &[&bench]);
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let summary = found["summary"].to_string();
    assert!(summary.contains("are missing before row 1500"), "{summary}");
    let share = found["residual"]["share_of_motion"]
        .as_f64()
        .expect("a share");
    assert!(share < 0.01, "{share}: {answer}");

    // Unmeasured rows have no residual: the pictures show noise throughout, where the gap alone is some 0.3 rad.
    let read = Recording::read(&bench).expect("a recording");
    let model = ideal(&bench).expect("a model");
    let outcome = diagnose(&read, &model, Path::new("ideal"), 0, &|_| {});
    let pictures = outcome.expect("a diagnosis").pictures.expect("pictures");
    let angles = pictures.angle_after_rad.iter().flatten();
    let largest = angles.fold(0.0_f64, |most, angle| most.max(angle.abs()));
    assert!(largest < 1e-3, "{largest} rad");
}
