//! `rlg close-loop`: one cheap kind, and an unknown kind.

use assert_cmd::Command;
use serde_json::Value;

fn close_loop(arguments: &[&str]) -> std::process::Output {
    Command::cargo_bin("rlg")
        .expect("the command is built")
        .args(["close-loop", "--quiet"])
        .args(arguments)
        .output()
        .expect("it starts")
}

#[test]
fn crosstalk_is_found_blind_and_corrected_in_both_number_systems() {
    let output = close_loop(&["--json", "dither_crosstalk"]);
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{words}");
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let row = &report["rows"][0];
    assert_eq!(row["found"], serde_json::json!(["dither_crosstalk"]));
    let number = |name: &str| row[name].as_f64().expect(name);
    // 5e-3 of 150″ and more from two neighbours.
    assert!(number("before") > 2e-6, "{row}");
    for after in ["after_f32", "after_fixed", "with_truth"] {
        assert!(number(after) < 0.02 * number("before"), "{row}");
    }
}

#[test]
fn a_kind_that_no_term_takes_out_is_refused() {
    let output = close_loop(&["lock_in"]);
    assert_eq!(output.status.code(), Some(2));
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(
        words.contains("lock_in") && words.contains("gyro_delay"),
        "{words}"
    );
}
