//! `rlg summarize`: results of many recordings in one file.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use rlg::recording::ForeignColumn;
use serde_json::{Value, json};

fn rlg() -> Command {
    Command::cargo_bin("rlg").expect("the command is built")
}

/// Writes results of a recording whose gyro y has this scale error.
fn results(folder: &Path, scale: f64) {
    fs::create_dir_all(folder).expect("a folder");
    let effect = json!({
        "kind": "gyro_scale",
        "indistinguishable_from": ["reference_scale"],
        "parameters": [{"name": "y", "value": scale, "std": 2e-6, "unit": "1"}, {"name": "axis", "value": "<b>y"}],
        "p_value": 1e-9,
        "label": "class",
    });
    let told = json!({
        "recording": "bench", "verdict": "explained", "effects": [effect],
        "sensitivity": [{"kind": "gyro_scale", "typical": 1e-4, "snr": 50.0, "unit": "1"}],
    });
    fs::write(folder.join("diagnosis.json"), told.to_string()).expect("a file");
}

/// Writes six, one of which is an outlier, and one with a truncated file.
fn fleet(folder: &Path) {
    for (k, scale) in [1e-5, 2e-5, 3e-5, 4e-5, 5e-5, 9e-4].into_iter().enumerate() {
        results(&folder.join(format!("unit-{k}")), scale);
    }
    let broken = folder.join("unit-6");
    results(&broken, 1e-5);
    fs::write(broken.join("diagnosis.json"), r#"{"recording": "ben"#).expect("a file");
}

#[test]
fn a_result_in_another_form_is_refused_with_its_number() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = folder.path().join("unit-0");
    results(&run, 1e-5);
    let file = run.join("diagnosis.json");
    let mut told: Value =
        serde_json::from_str(&fs::read_to_string(&file).expect("text")).expect("JSON");
    told["format"] = json!(2);
    fs::write(&file, told.to_string()).expect("a file");
    let said = rlg()
        .args(["summarize", "--json", "--out"])
        .args([folder.path().join("out.csv"), run])
        .output()
        .expect("it runs");
    let said =
        String::from_utf8_lossy(&said.stdout).into_owned() + &String::from_utf8_lossy(&said.stderr);
    assert!(
        said.contains("format 2") && said.contains("format 1"),
        "{said}"
    );
}

#[test]
fn csv_and_parquet_hold_the_same_and_the_page_says_what_stands_out() {
    let folder = tempfile::tempdir().expect("a folder");
    let all = folder.path().join("results");
    fleet(&all);
    let write = |name: &str| {
        let out = folder.path().join(name);
        let said = rlg()
            .args(["summarize", "--json", "--out"])
            .args([&out, &all])
            .output();
        let said = said.expect("it runs");
        assert!(said.status.success(), "{said:?}");
        let said: Value = serde_json::from_slice(&said.stdout).expect("JSON");
        assert_eq!(said["outliers"], json!(["unit-5"]));
        assert_eq!(said["refused"][0]["run"], "unit-6");
        out
    };
    let csv = fs::read_to_string(write("fleet.csv")).expect("text");
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let lines: Vec<_> = lines.collect();
    assert_eq!(lines.len(), 7, "{csv}");
    let column = |name: &str| {
        header
            .iter()
            .position(|one| *one == name)
            .expect("the column")
    };
    assert_eq!(lines[5][column("outlier")], "outlier");
    // The median of six, and its deviation.
    let median: f64 = lines[0][column("fleet_median")].parse().expect("a number");
    assert!((median - 3.5e-5).abs() < 1e-18);

    let columns = rlg::recording::parquet_columns(&write("fleet.parquet")).expect("a table");
    assert_eq!(columns.len(), 12, "{columns:?}");
    for ForeignColumn { name, values, .. } in columns {
        let of_csv = lines
            .iter()
            .map(|line| line[column(&name)].parse().unwrap_or(f64::NAN));
        let same = of_csv
            .zip(&values)
            .all(|(a, b)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()));
        assert!(same, "{name}: {values:?}\n{csv}");
    }

    let page = fs::read_to_string(write("fleet.html")).expect("text");
    assert!(
        page.contains("1 instrument stands out") && page.contains("900.0 ± 2.0 ppm"),
        "{page}"
    );
    assert!(
        page.contains("is no result of this version") && !page.contains("<b>y"),
        "{page}"
    );
}

#[test]
fn what_holds_no_results_and_what_tells_no_form_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("fleet.csv");
    let refused = |out: &Path| {
        let said = rlg()
            .arg("summarize")
            .arg(folder.path())
            .arg("--out")
            .arg(out)
            .output();
        let said = said.expect("it runs");
        assert_eq!(said.status.code(), Some(2));
        String::from_utf8_lossy(&said.stderr).into_owned()
    };
    let said = refused(&out);
    assert!(
        said.contains("holds no results; expected diagnosis.json"),
        "{said}"
    );
    let said = refused(&folder.path().join("fleet.xlsx"));
    assert!(said.contains(".parquet, .csv or .html"), "{said}");
    assert!(!out.exists());
}

#[test]
fn for_a_fleet_a_recording_that_cannot_be_used_is_a_result() {
    let folder = tempfile::tempdir().expect("a folder");
    let bench = super::answer::recording(folder.path(), 2e-3);
    let manifest = bench.join("recording.toml");
    let text = fs::read_to_string(&manifest).expect("text");
    let out = folder.path().join("found");
    let run = || {
        let done = rlg()
            .args(["-q", "diagnose", "--for-fleet", "-o"])
            .args([&out, &bench])
            .output();
        assert!(done.expect("it runs").status.success());
        let run = fs::read_to_string(out.join("run.json")).expect("run.json");
        serde_json::from_str::<Value>(&run).expect("JSON")
    };
    fs::write(
        &manifest,
        format!("instrument = \"SN 1\"\nstart = 2026-03-01\n{text}"),
    )
    .expect("a file");
    let refused = run();
    let sentence = refused["refused"].as_str().expect("a sentence");
    assert!(
        sentence.contains("start: has no date and time, found 2026-03-01"),
        "{sentence}"
    );
    assert!(!out.join("diagnosis.json").exists());

    fs::write(
        &manifest,
        format!("instrument = \"SN 1\"\nstart = 2026-03-01T13:00:00+01:00\n{text}"),
    )
    .expect("a file");
    let told = run();
    assert_eq!(
        (&told["refused"], &told["about"]["instrument"]),
        (&Value::Null, &json!("SN 1"))
    );
    assert_eq!(told["about"]["start_s"], 1_772_366_400.0);
    assert!(out.join("diagnosis.json").is_file());
}

/// Writes results of a recording of `instrument` at a temperature, with a scale error and the page.
fn of_instrument(folder: &Path, instrument: &str, (day, kelvin): (u32, f64), scale: f64) {
    results(folder, scale);
    fs::write(folder.join("report.html"), "").expect("a file");
    let about = json!({
        "recording": "bench", "instrument": instrument, "start": null, "start_s": f64::from(day) * 86_400.0,
        "temperature_k": kelvin,
    });
    let run = json!({"format": 1, "about": about, "refused": null});
    fs::write(folder.join("run.json"), run.to_string()).expect("a file");
}

/// Summarizes into a page.
fn page(results: &Path, out: &Path) -> (String, String) {
    let said = rlg()
        .arg("summarize")
        .args([results, Path::new("--out"), out])
        .output()
        .expect("it runs");
    assert!(said.status.success(), "{said:?}");
    let said = String::from_utf8(said.stdout).expect("text");
    (said, fs::read_to_string(out).expect("a page"))
}

#[test]
fn of_three_instruments_the_one_off_and_the_one_that_drifts_stand_in_the_headline() {
    let folder = tempfile::tempdir().expect("a folder");
    let all = folder.path().join("results of March");
    // Scatter of 4 ppm about the mean of each; SN 3 is 880 ppm off, SN 2 goes by 20 ppm a kelvin.
    for (place, (instrument, middle, per_kelvin)) in [
        ("SN 1", 1e-5, 0.0),
        ("SN 2", 1e-5, 2e-5),
        ("SN 3", 8.8e-4, 0.0),
    ]
    .into_iter()
    .enumerate()
    {
        for day in 0..6_u32 {
            let kelvin = [0.0, 3.0, 1.0, -2.0, 2.0, -4.0][day as usize];
            let scatter = [1.0, -1.0, -1.0, 1.0, 1.0, -1.0][day as usize] * 4e-6;
            let name = format!("r{place}{day}");
            let at = (day, 293.0 + kelvin);
            let scale = middle + scatter + per_kelvin * kelvin;
            of_instrument(&all.join(name), instrument, at, scale);
        }
    }
    let pages = folder.path().join("pages");
    fs::create_dir(&pages).expect("a folder");
    let (said, page) = page(&all, &pages.join("fleet.html"));
    assert!(
        said.contains("18 recordings of 3 instruments; 6 with an outlier; 0 cannot be used"),
        "{said}"
    );
    for line in [
        "1 instrument stands out: SN 3 (gyro scale y (axis",
        "1 trend: gyro scale y (axis",
        "of SN 2, 19.9 ± 1.1",
        "ppm a kelvin",
    ] {
        assert!(
            said.contains(line) && page.contains(&line.replace('<', "&lt;")),
            "{line}: {said}"
        );
    }
    // Of the one number a picture against date and one against temperature: 18 points each, and three instruments in the legend.
    assert_eq!(page.matches("<circle").count(), 2 * 18 + 3, "{page}");
    assert!(
        page.contains("date (UTC)") && page.contains("temperature [°C]"),
        "{page}"
    );
    // Eighteen rows are folded by instrument, each linked to its page, beside the summary and with its spaces encoded.
    assert_eq!(page.matches("<details>").count(), 3, "{page}");
    assert!(
        page.contains("SN 2</b>: 6 recordings, 6 explained"),
        "{page}"
    );
    assert!(
        page.contains("<a href=\"./../results%20of%20March/r00/report.html\">r00</a>"),
        "{page}"
    );
}

#[test]
fn a_damaged_recording_counts_with_the_instrument_that_its_own_manifest_names() {
    let folder = tempfile::tempdir().expect("a folder");
    let all = folder.path().join("results");
    for (name, instrument) in [("a", "SN 1"), ("b", "SN 2")] {
        of_instrument(&all.join(name), instrument, (0, 293.0), 1e-5);
    }
    // One table is cut, one manifest is.
    for (name, cut) in [("cut", "rows.csv"), ("bare", "recording.toml")] {
        let bench = super::answer::recording(&folder.path().join(name), 0.0);
        let manifest = fs::read_to_string(bench.join("recording.toml")).expect("a manifest");
        let named = manifest.replace("[[table]]", "instrument = \"SN 2\"\n[[table]]");
        let named =
            named + "  [[table.channel]]\n  column = \"temp\"\n  quantity = \"temperature\"\n";
        fs::write(bench.join("recording.toml"), named).expect("written");
        fs::write(bench.join(cut), "for").expect("written");
        let said = rlg()
            .args(["diagnose", "--for-fleet", "--out"])
            .args([&all.join(name), &bench])
            .output()
            .expect("it runs");
        assert!(said.status.success(), "{said:?}");
    }
    let (said, page) = page(&all, &folder.path().join("fleet.html"));
    assert!(
        said.contains("4 recordings of 2 instruments; 0 with an outlier; 2 cannot be used"),
        "{said}"
    );
    let row = |name: &str| {
        let (before, _) = page
            .split_once(&format!("<td>{name}</td>"))
            .expect("its row");
        let cells = before.rsplit("<td>").next().expect("a cell");
        cells.trim_end_matches("</td>").to_owned()
    };
    assert_eq!([row("cut"), row("bare")], ["SN 2", "not known"]);
}
