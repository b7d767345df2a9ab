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
    // neither folder nor model reveals the concealed effect
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
    // the written recording equals the simulated one
    let read = Recording::read(place("one")).unwrap();
    let simulated = run(&(text.clone() + TABLE_3), 5).recording;
    assert_eq!(read.tables[0].channels, simulated.tables[0].channels);

    // without a place for the truth there is no recording either
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

#[test]
fn every_kind_of_channel_comes_back_from_disk_as_it_was_simulated() {
    let text = PERFECT.replace("1e-13, 1e-13, 1e-13", "2e-6, 2e-6, 2e-6")
        + DITHER
        + SITE
        + REFERENCE
        + "attitude = true\n\
           [fibre_optic]\nangle_random_walk_rad_sqrt_s = 1e-7\nweight_rad = 1e-9\n\
           [encoder]\nangle_noise_rad = 1e-6\nweight_rad = 1e-7\n\
           [accelerometer]\nbias_m_s2 = [0.0, 0.0, 0.0]\nscale_error = [0.0, 0.0, 0.0]\n\
           noise_m_s2_sqrt_hz = 1e-4\nweight_m_s2 = 1e-4\n\
           [thermal]\nstart_k = 293.0\nself_heating_k = [9.0, 8.0, 7.0]\ntime_constant_s = [9.0, 9.0, 9.0]\n\
           sensor_noise_k = 0.01\nsensor_weight_k = 0.001\nrate_hz = 50.0\n\
           [magnetic]\nnavigation_field_t = [2e-5, 0.0, -4e-5]\nsensor_noise_t = 1e-8\nsensor_weight_t = 1e-9\nrate_hz = 100.0\n"
        + TUMBLE
        + &effect(
            "lost_samples",
            "channel = \"gyro_y\", start_s = 1.0, end_s = 1.5",
        )
        + &effect(
            "lost_samples",
            "channel = \"temperature_z\", start_s = 1.0, end_s = 1.5",
        );
    let folder = tempfile::tempdir().unwrap();
    let (scenario, out) = (folder.path().join("all.toml"), folder.path().join("all"));
    std::fs::write(&scenario, &text).unwrap();
    let mut command = assert_cmd::Command::cargo_bin("rlg").unwrap();
    let command = command
        .arg("simulate")
        .arg(&scenario)
        .arg("--out")
        .arg(&out);
    command.args(["--seed", "5", "--quiet"]).assert().success();
    let read = Recording::read(&out).unwrap();
    let simulated = run(&text, 5).recording;
    assert_eq!(read.segments, simulated.segments);
    assert_eq!(read.tables.len(), 5);
    for (one, other) in read.tables.iter().zip(&simulated.tables) {
        assert_eq!(
            (&one.file, &one.clock, one.rows),
            (&other.file, &other.clock, other.rows)
        );
        for (one, other) in one.channels.iter().zip(&other.channels) {
            assert_eq!(
                (&one.column, &one.quantity, &one.axis),
                (&other.column, &other.quantity, &other.axis)
            );
            // NaN for missing values
            let same = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
            assert!(
                one.values.iter().zip(&other.values).all(same),
                "{}",
                one.column
            );
        }
    }
    let lost = |table: usize, column: usize| {
        read.tables[table].channels[column]
            .values
            .iter()
            .filter(|v| v.is_nan())
            .count()
    };
    assert_eq!((lost(0, 1), lost(3, 2), lost(0, 0)), (2000, 25, 0));
}
