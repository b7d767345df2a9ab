//! `rlg simulate` as a command.

use super::support::*;
use rlg::recording::Recording;

#[test]
fn command_puts_the_truth_beside_the_recording_and_leaves_nothing_when_it_refuses() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let rlg = |scenario: &str, out: &str| {
        let mut command = assert_cmd::Command::cargo_bin("rlg").unwrap();
        command.args([
            "simulate",
            &place(scenario),
            "--out",
            &place(out),
            "--seed",
            "5",
        ]);
        command.assert()
    };
    let still = "[[motion]]\nkind = \"still\"\nduration_s = 0.5\n";
    let text = PERFECT.replace("1e-13, 1e-13, 1e-13", "2e-6, 2e-6, 2e-6") + DITHER + still;
    std::fs::write(place("good.toml"), text.clone() + TABLE_3).unwrap();
    rlg("good.toml", "one").success();
    rlg("good.toml", "two").success();
    let bytes = |name: &str| std::fs::read(place(name)).unwrap();
    for file in ["samples.parquet", "recording.toml", "model.toml"] {
        assert_eq!(bytes(&format!("one/{file}")), bytes(&format!("two/{file}")));
    }
    // neither folder nor model tells what is concealed
    assert!(
        !String::from_utf8(bytes("one/model.toml"))
            .unwrap()
            .contains("axis_flexure")
    );
    assert_eq!(std::fs::read_dir(place("one")).unwrap().count(), 3);
    assert!(
        String::from_utf8(bytes("one.truth.json"))
            .unwrap()
            .contains("axis_flexure")
    );
    // what was written is what was simulated
    let read = Recording::read(place("one")).unwrap();
    let simulated = run(&(text.clone() + TABLE_3), 5).recording;
    assert_eq!(read.tables[0].channels, simulated.tables[0].channels);

    // where the truth has no place there is no recording either
    std::fs::create_dir(place("four.truth.json")).unwrap();
    let output = rlg("good.toml", "four").code(2).get_output().clone();
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(
        message.contains("four.truth.json: is a folder"),
        "{message}"
    );
    assert!(!folder.path().join("four").exists());

    std::fs::write(place("bad.toml"), text + "[[effect]]\nkind = \"lock_on\"\n").unwrap();
    let output = rlg("bad.toml", "three").code(2).get_output().clone();
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(
        message.contains("bad.toml") && message.contains("lock_on"),
        "{message}"
    );
    assert!(!folder.path().join("three").exists());
    assert!(!folder.path().join("three.truth.json").exists());
}
