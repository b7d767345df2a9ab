//! A short challenge: commitments come first, shards give the bytes of the whole, and findings are scored. Recordings of
//! others with a truth file are scored the same way.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

/// Four trials: an effect-free record, one effect, and both again.
const SHORT: [&str; 8] = [
    "--trials",
    "4",
    "--families",
    "null,single",
    "--seed",
    "5",
    "--most-rows",
    "20000",
];

/// Files written by a challenge.
const FILES: [&str; 5] = [
    "commitments.txt",
    "answers.jsonl",
    "outcomes.jsonl",
    "challenge.json",
    "report.html",
];

fn rlg(folder: &Path, arguments: &[&str]) -> Output {
    Command::cargo_bin("rlg")
        .expect("the binary")
        .current_dir(folder)
        .arg("challenge")
        .args(arguments)
        .output()
        .expect("it starts")
}

fn challenge(folder: &Path, more: &[&str]) {
    let arguments = [&SHORT[..], more].concat();
    let output = rlg(folder, &arguments);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn shards_and_threads_give_the_bytes_of_the_whole_and_a_changed_answer_is_noticed() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    challenge(at, &["--out", "whole", "--threads", "1"]);
    challenge(at, &["--out", "s0", "--shard", "0/2", "--threads", "2"]);
    challenge(at, &["--out", "s1", "--shard", "1/2"]);
    // In the other order: the trials' numbers sort them.
    let output = rlg(at, &["--out", "merged", "--merge", "s1", "s0"]);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    for file in FILES {
        let [whole, merged] = ["whole", "merged"].map(|name| fs::read(at.join(name).join(file)));
        assert!(
            whole.expect("written") == merged.expect("written"),
            "{file} differs"
        );
    }

    let scores: serde_json::Value =
        serde_json::from_slice(&fs::read(at.join("whole/challenge.json")).expect("written"))
            .expect("JSON");
    assert_eq!(scores["scored"], 4);
    assert_eq!(scores["by_family"]["null"]["trials"], 2);
    assert_eq!(scores["by_family"]["single"]["trials"], 2);
    let marks = scores["marks"].as_array().expect("marks");
    assert_eq!(
        marks[0]["trials"], 2,
        "both effect-free records stand behind the first mark"
    );
    let page = fs::read_to_string(at.join("whole/report.html")).expect("written");
    assert!(
        !page.contains("http") && !page.contains("<script"),
        "the page needs no network"
    );

    a_trial_repeated_alone_is_the_same_trial(at);

    assert!(rlg(at, &["--check", "whole"]).status.success());
    let file = at.join("whole/answers.jsonl");
    let answers = fs::read_to_string(&file).expect("written");
    fs::write(&file, answers.replacen("null", "nil", 1)).expect("writable");
    let output = rlg(at, &["--check", "whole"]);
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        said.contains("answers.jsonl") && said.contains("trial 0"),
        "{said}"
    );

    let output = rlg(at, &["--out", "twice", "--merge", "s0", "s0"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(!at.join("twice").exists(), "nothing half written");
}

/// The last trial of `whole` by itself, and its kept recording.
fn a_trial_repeated_alone_is_the_same_trial(at: &Path) {
    challenge(at, &["--out", "one", "--trial", "3"]);
    for file in ["answers.jsonl", "outcomes.jsonl", "commitments.txt"] {
        let [all, one] = ["whole", "one"]
            .map(|name| fs::read_to_string(at.join(name).join(file)).expect("written"));
        assert_eq!(all.lines().nth(3), one.lines().next(), "{file}");
    }
    // The kept recording is the diagnosed one.
    let recording = at.join("one/recording");
    let said = Command::cargo_bin("rlg")
        .expect("the binary")
        .arg("diagnose")
        .arg(&recording)
        .arg("--model")
        .arg(recording.join("model.toml"))
        .args(["--json", "--quiet", "--out"])
        .arg(at.join("looked_at"))
        .output()
        .expect("it starts");
    let said: serde_json::Value = serde_json::from_slice(&said.stdout).expect("JSON");
    let trial = fs::read_to_string(at.join("one/outcomes.jsonl")).expect("written");
    let trial: serde_json::Value = serde_json::from_str(&trial).expect("one line");
    assert_eq!(said["verdict"], trial["verdict"]);
    let count = |list: &serde_json::Value| list.as_array().map(Vec::len);
    assert_eq!(count(&said["effects"]), count(&trial["findings"]));
}

/// A triad on a table with a bias of 1 deg/h on gyro y that its model lacks.
const BIASED: &str = r#"
format = 1
name = "biased"
rate_hz = 200.0
[gyro]
pulse_weight_rad = [1e-9, 1e-9, 1e-9]
bias_rad_s = [0.0, 0.0, 0.0]
scale_error = [0.0, 0.0, 0.0]
angle_random_walk_rad_sqrt_s = [5e-7, 5e-7, 5e-7]
installation_rad = {}
output = "increment"
[reference]
angle_noise_rad = 2e-7
angle_random_walk_rad_sqrt_s = 1e-7
weight_rad = 1e-9
[[motion]]
kind = "vibration"
low_hz = 2.0
high_hz = 60.0
rate_rms_rad_s = [0.1, 0.1, 0.1]
duration_s = 20.0
ramp_s = 0.5
[[effect]]
kind = "gyro_bias"
y = 4.8e-6
"#;

#[test]
fn a_recording_of_others_is_committed_to_and_scored_against_its_truth() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    fs::write(at.join("biased.toml"), BIASED).expect("writable");
    let made = Command::cargo_bin("rlg")
        .expect("the binary")
        .current_dir(at)
        .args(["simulate", "biased.toml", "--out", "biased"])
        .output()
        .expect("it starts");
    assert!(
        made.status.success(),
        "{}",
        String::from_utf8_lossy(&made.stderr)
    );
    let given = [
        "--recording",
        "biased",
        "--truth",
        "biased.truth.json",
        "--out",
    ];
    let output = rlg(at, &[&given[..], &["scored"]].concat());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );

    let truth = fs::read(at.join("biased.truth.json")).expect("written");
    let committed = fs::read_to_string(at.join("scored/commitments.txt")).expect("written");
    let hash = rlg::challenge::commit::sha256(&truth);
    assert_eq!(committed, format!("biased.truth.json {hash}\n"));
    let read = |name: &str| -> serde_json::Value {
        let bytes = fs::read(at.join(name).join("challenge.json")).expect("written");
        serde_json::from_slice(&bytes).expect("JSON")
    };
    let scored = &read("scored")["given"][0];
    assert_eq!(scored["right"], true, "{scored:#}");
    let known = scored["known"].as_array().expect("a list");
    let y = known
        .iter()
        .find(|one| one["combination"] == "y")
        .expect("y is known");
    let number = |key: &str| y[key].as_f64().expect("a number");
    // Five deviations: less than once in a million runs by chance, and the seed is fixed.
    assert!(
        (number("value") - 4.8e-6).abs() < 5.0 * number("std"),
        "{y}"
    );

    // With another truth the same recording's score is wrong.
    fs::write(at.join("biased.truth.json"), r#"{"effects": []}"#).expect("writable");
    let output = rlg(at, &[&given[..], &["otherwise"]].concat());
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert_eq!(read("otherwise")["given"][0]["right"], false);
    assert_eq!(read("otherwise")["given"][0]["wrong"][0], "gyro_bias");
}

#[test]
fn a_number_of_the_plan_is_varied_on_the_same_trials() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let short = [
        "--marks",
        "--trials",
        "3",
        "--seed",
        "5",
        "--most-rows",
        "3000",
    ];
    let output = rlg(
        at,
        &[
            &short[..],
            &["--vary", "judgement.naming", "--out", "curve"],
        ]
        .concat(),
    );
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let curve: serde_json::Value =
        serde_json::from_slice(&fs::read(at.join("curve/curve.json")).expect("written"))
            .expect("JSON");
    let points = curve["points"].as_array().expect("points");
    let numbers = |name: &str| -> Vec<f64> {
        let of = points.iter().map(|point| &point[name]);
        of.map(|value| value.as_f64().expect("a number")).collect()
    };
    let factors = numbers("factor");
    assert_eq!(factors, [0.5, 0.7, 1.0, 1.4, 2.0]);
    let values = numbers("value");
    for (factor, value) in factors.iter().zip(&values) {
        assert_eq!(*value, factor * values[2]);
    }
    for point in points {
        let all = ["nulls", "positives"]
            .iter()
            .flat_map(|kind| point[kind].as_object().expect("counts").values());
        let sum: u64 = all.map(|count| count.as_u64().expect("a count")).sum();
        assert_eq!(sum, 3, "every trial is judged: {point}");
    }
    assert!(at.join("curve/commitments.txt").exists());
    let unknown = rlg(
        at,
        &[&short[..], &["--vary", "nothing", "--out", "none"]].concat(),
    );
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("naming"));
    assert!(!at.join("none").exists());
}

#[test]
fn exported_trials_hold_no_answer_and_answers_to_them_are_judged_as_ours_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let marks = |more: &[&str]| {
        let asked = [
            "--marks",
            "--trials",
            "2",
            "--seed",
            "3",
            "--most-rows",
            "4000",
        ];
        let families = ["--family", "null,basic"];
        let output = rlg(at, &[&asked[..], &families, more].concat());
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
    };
    marks(&["--out", "ours"]);
    marks(&["--out", "sealed", "--export", "trials"]);
    let trials: Vec<_> = fs::read_dir(at.join("trials"))
        .expect("trials")
        .map(|entry| entry.expect("a trial").file_name())
        .collect();
    assert_eq!(trials.len(), 2);
    for trial in &trials {
        let given = at.join("trials").join(trial);
        assert_eq!(fs::read_dir(&given).expect("a folder").count(), 1);
        let answer = at.join("answers").join(trial);
        fs::create_dir_all(answer.parent().expect("a folder")).expect("made");
        let output = Command::cargo_bin("rlg")
            .expect("the binary")
            .arg("diagnose")
            .arg(given.join("recording"))
            .arg("--model")
            .arg(given.join("recording/model.toml"))
            .arg("--out")
            .arg(&answer)
            .output()
            .expect("it starts");
        assert!(output.status.success());
    }
    marks(&["--out", "judged", "--judge", "answers"]);
    let outcomes = |of: &str| fs::read(at.join(of).join("outcomes.jsonl")).expect("outcomes");
    assert!(outcomes("ours") == outcomes("judged"));
    // A trial without an answer is not scored; the others count.
    fs::remove_dir_all(at.join("answers").join(&trials[0])).expect("removed");
    marks(&["--out", "half", "--judge", "answers"]);
    let half = String::from_utf8(outcomes("half")).expect("text");
    assert_eq!(half.matches("diagnosis.json").count(), 1);
}
