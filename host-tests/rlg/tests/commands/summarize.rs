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
        .args(["summarize", "--json"])
        .arg(&run)
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
