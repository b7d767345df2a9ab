//! Scenario keys of the slow channels and of a unit's faults: recorded values against closed forms, refusals, and a diagnosis
//! beside them.

use std::fs;

use rlg::recording::{Quantity, Recording};
use serde_json::{Value, json};

use super::bench::Bench;
use super::scenario::{FAULTS, UNIT, simulated, values};

#[test]
fn the_channels_follow_their_closed_forms() {
    let bench = Bench::new();
    let recording = simulated(&bench, &(UNIT.to_owned() + FAULTS));
    let slow = |quantity: &Quantity, axis: &str| values(&recording, quantity, axis).to_vec();
    let end_s = |row: usize| (row + 1) as f64 / 250.0;
    let near = |found: f64, due: f64, code: f64| (found - due).abs() <= 0.501 * code;
    for (axis, level) in [("x", 1.0), ("y", 0.9), ("z", 0.8)] {
        for (row, found) in slow(&Quantity::LaserIntensity, axis)
            .into_iter()
            .enumerate()
        {
            let since_s = end_s(row) - 0.5;
            let left = if axis == "x" && since_s >= 0.0 {
                (-since_s / 0.1).exp()
            } else {
                1.0
            };
            assert!(
                near(found, level * left, 1.0 / 16384.0),
                "{axis}, row {row}: {found}"
            );
        }
    }
    let drive = [("x", 0.0), ("y", 0.1), ("z", 0.2)];
    for (axis, level) in drive {
        for (row, found) in slow(&Quantity::PathLengthDrive, axis)
            .into_iter()
            .enumerate()
        {
            let time_s = end_s(row);
            let due = match axis {
                "x" => 0.01 * 8.0 * (1.0 - (-time_s / 4.0).exp()),
                "y" if time_s >= 0.802 => level - 0.3,
                "z" if time_s >= 1.002 => level - 0.3,
                _ => level,
            };
            // The warming of a row is known at one of its nodes: 0.02 K/s over a millisecond beside the code.
            assert!(
                (found - due).abs() < 1.0 / 32768.0 + 1e-5,
                "{axis}, row {row}: {found}, {due}"
            );
        }
    }
    for (axis, resets) in [("x", 0.0), ("y", 0.0), ("z", 1.0)] {
        let counts = slow(&Quantity::PathLengthResets, axis);
        assert_eq!((counts[0], counts[749]), (0.0, resets), "{axis}");
    }
    for (row, found) in slow(&Quantity::DitherDrive, "x").into_iter().enumerate() {
        let due = if (1.202..1.402).contains(&end_s(row)) {
            1.8
        } else {
            1.0
        };
        assert!(near(found, due, 1.0 / 16384.0), "row {row}: {found}");
    }
    for (row, found) in slow(&Quantity::Temperature, "y").into_iter().enumerate() {
        // A fault of a channel is one of the gyros' rows that begin in its stretch.
        let begin_s = end_s(row) - 1.0 / 4000.0;
        assert_eq!(
            found.is_nan(),
            (1.602..1.802).contains(&begin_s),
            "row {row}"
        );
    }
}

#[test]
fn stamps_follow_the_pulses_and_the_clock() {
    let bench = Bench::new();
    let recording = simulated(&bench, &(UNIT.to_owned() + FAULTS));
    let mut channels = recording.tables.iter().flat_map(|table| &table.channels);
    let stamps = channels.find(|channel| channel.quantity == Quantity::TimeSincePulse);
    for (row, found) in stamps.expect("the channel").values.iter().enumerate() {
        let time_s = (row + 1) as f64 / 250.0;
        // Pulses at 0.25 s and 1.25 s; the one due at 2.25 s is lost, and a stamp ends at 1.0486 s.
        let pulse_s = [0.25, 1.25]
            .into_iter()
            .rfind(|pulse_s| *pulse_s <= time_s + 1e-9);
        match pulse_s.map(|pulse_s| (time_s - pulse_s) * 1.00003) {
            Some(due) if due < 1.04857594 => {
                assert!(
                    due - found < 1.01 / 16e6 && found - due < 1e-12,
                    "row {row}: {found}, {due}"
                );
            }
            _ => assert!(found.is_nan(), "row {row}: {found}"),
        }
    }
}

#[test]
fn a_block_swings_less_and_a_counter_stands_still_where_a_fault_has_it_so() {
    let bench = Bench::new();
    let faulty = simulated(&bench, &(UNIT.to_owned() + FAULTS));
    let sound = simulated(&bench, UNIT);
    let largest = |recording: &Recording, from_s: f64, to_s: f64| {
        let rows = (from_s * 4000.0) as usize..(to_s * 4000.0) as usize;
        let angles = &values(recording, &Quantity::DitherAngle, "z")[rows];
        angles
            .iter()
            .fold(0.0_f64, |largest, angle| largest.max(angle.abs()))
    };
    // Half-cycles of 1.2 ms at either end are left out.
    let ratio = largest(&faulty, 2.402, 2.598) / largest(&sound, 2.402, 2.598);
    assert!((ratio - 0.2).abs() < 0.01, "{ratio}");
    let outside = [(0.0, 2.4), (2.602, 3.0)]
        .map(|(from, to)| largest(&faulty, from, to) / largest(&sound, from, to));
    assert_eq!(outside, [1.0; 2]);
    let counts = values(&faulty, &Quantity::GyroCount, "y");
    let still = counts[10_801..=11_600].iter().all(|count| *count == 0.0);
    assert!(still && counts[10_700..10_801].iter().any(|count| *count != 0.0));
    assert!(counts[11_601..11_700].iter().any(|count| *count != 0.0));
    // The counter counts the swing that the pickoff shows, within the fault too.
    let swing = |from: usize| {
        let angle = |row: usize| values(&faulty, &Quantity::DitherAngle, "z")[row];
        let counted: f64 = values(&faulty, &Quantity::GyroCount, "z")[from..9_700]
            .iter()
            .sum();
        (3.9e-6 * counted - (angle(9_699) - angle(from - 1))).abs()
    };
    assert!(swing(9_650) < 3e-5, "{}", swing(9_650));
}

#[test]
fn a_control_at_its_end_resets_by_a_mode() {
    let bench = Bench::new();
    let text = UNIT.replace(
        "path_length_drive_k = [0.01, 0.0, 0.0]",
        "path_length_drive_k = [0.4, -0.35, 0.0]\npath_length_mode = 0.25\npath_length_end = 0.8",
    );
    let recording = simulated(&bench, &text);
    for axis in ["x", "y"] {
        let drive = values(&recording, &Quantity::PathLengthDrive, axis);
        assert!(drive.iter().all(|drive| drive.abs() <= 0.8001), "{axis}");
        let resets = values(&recording, &Quantity::PathLengthResets, axis);
        // 8 K (1 - e^-0.75) = 4.221 K. The drive of x would reach 1.688, of y 0.1 - 1.477: four and three modes beyond 0.8.
        let due = if axis == "x" { 4.0 } else { 3.0 };
        assert_eq!(*resets.last().expect("rows"), due, "{axis}");
        for row in 1..drive.len() {
            let step = drive[row] - drive[row - 1];
            let is_reset = resets[row] != resets[row - 1];
            assert_eq!(step.abs() > 0.2, is_reset, "{axis}, row {row}");
        }
    }
}

#[test]
fn the_truth_has_the_faults_and_a_scenario_without_them_no_such_key() {
    let bench = Bench::new();
    let truth = || -> Value {
        let text = fs::read_to_string(bench.at("run.truth.json")).expect("the truth");
        serde_json::from_str(&text).expect("JSON")
    };
    simulated(&bench, UNIT);
    assert!(truth().get("faults").is_none());
    simulated(&bench, &(UNIT.to_owned() + FAULTS));
    let faults = truth()["faults"].clone();
    assert_eq!(faults.as_array().expect("a list").len(), 8);
    assert_eq!(
        faults[0],
        json!({"kind": "dying_laser", "axis": "x", "time_s": 0.5, "time_constant_s": 0.1})
    );
    assert_eq!(
        faults[5],
        json!({"kind": "pulse_lost", "start_s": 2.2, "end_s": 2.3})
    );
    // Draws of other instruments are as they were without slow channels.
    let with = simulated(&bench, UNIT);
    let (begin, rest) = UNIT.split_once("[slow_channels]").expect("the section");
    let (_, motion) = rest.split_once("[[motion]]").expect("the motion");
    let without = simulated(&bench, &format!("{begin}[[motion]]{motion}"));
    assert_eq!(with.tables[..2], without.tables[..]);
    assert_eq!(with.tables.len(), 3);
}

#[test]
fn faults_of_a_scenario_are_named_with_their_line() {
    let bench = Bench::new();
    let refused = |text: String, parts: &[&str]| {
        bench.write("scenario.toml", &text);
        let words = bench.refused(&["simulate", "scenario.toml", "--out", "run"]);
        for part in ["scenario.toml", "line "].iter().chain(parts) {
            assert!(words.contains(part), "no {part} in {words}");
        }
    };
    let with = |from: &str, to: &str| {
        assert!(UNIT.contains(from) || FAULTS.contains(from), "{from}");
        (UNIT.to_owned() + FAULTS).replacen(from, to, 1)
    };
    refused(
        with("intensity = [1.0", "intensty = [1.0"),
        &["intensty", "unknown key"],
    );
    refused(
        with("intensity = [1.0", "intensity = [16384.0"),
        &["intensity", "0 to 1.9999 of nominal"],
    );
    refused(
        with("clock_error = 3e-5", "clock_error = 30"),
        &["clock_error", "out of range"],
    );
    refused(
        with("pulse_per_second = true", "pulse_per_second = false"),
        &["clock_error", "unknown key"],
    );
    refused(
        with("first_pulse_s = 0.25", "path_length_mode = 0.95"),
        &["path_length_mode", "path_length_end"],
    );
    refused(
        with("kind = \"dying_laser\"", "kind = \"dying_lasr\""),
        &["dying_lasr", "dying_laser"],
    );
    refused(
        with("kind = \"dying_laser\"", "kind = \"fire\""),
        &["fire", "mode_hop, path_length_reset"],
    );
    refused(
        with("time_constant_s = 0.1", "time_constant_s = 0.0"),
        &["time_constant_s", "out of range"],
    );
    refused(
        with("time_s = 0.5", "time_s = 3.5"),
        &["time_s", "within the recording"],
    );
    refused(
        with("end_s = 1.402", "end_s = 1.1"),
        &["end_s", "is not after start_s"],
    );
    refused(with("size = -0.3", "size = 0.0"), &["size", "is no step"]);
    refused(with("size = -0.3", "level = -0.3"), &["size", "is missing"]);
    refused(with("level = 1.8", "level = 2.5"), &["level", "0 to 2"]);
    let (begin, rest) = UNIT.split_once("[slow_channels]").expect("the section");
    let (_, motion) = rest.split_once("[[motion]]").expect("the motion");
    refused(
        format!("{begin}[[motion]]{motion}{FAULTS}"),
        &["dying_laser", "a section [slow_channels]"],
    );
    let without_pulse = with(
        "pulse_per_second = true\nfirst_pulse_s = 0.25\nclock_error = 3e-5\n",
        "",
    );
    refused(without_pulse, &["pulse_lost", "pulse_per_second = true"]);
}

#[test]
fn a_diagnosis_passes_over_the_slow_channels() {
    let bench = Bench::new();
    let (begin, rest) = UNIT.split_once("[slow_channels]").expect("the section");
    let (_, motion) = rest.split_once("[[motion]]").expect("the motion");
    let mut verdicts = Vec::new();
    for text in [UNIT.to_owned(), format!("{begin}[[motion]]{motion}")] {
        simulated(&bench, &text);
        let (result, _) = bench.json(&[
            "diagnose",
            "run",
            "--model",
            "run/model.toml",
            "--out",
            "report",
        ]);
        fs::remove_dir_all(bench.at("report")).expect("the report");
        verdicts.push((result["verdict"].clone(), result["effects"].clone()));
    }
    assert_eq!(verdicts[0], verdicts[1]);
    assert!(verdicts[0].0.is_string());
}

#[test]
fn a_table_of_slow_channels_comes_back_from_text_by_its_own_names() {
    let bench = Bench::new();
    let first = simulated(&bench, &(UNIT.to_owned() + FAULTS));
    bench.json(&["export", "run", "--out", "h.csv"]);
    let unit = "gyro_count:3.9e-6*rad";
    bench.json(&[
        "import",
        "h.csv",
        "h-slow.csv",
        "--unit",
        unit,
        "--out",
        "again",
    ]);
    let again = Recording::read(bench.at("again")).expect("a recording");
    let of = |recording: &Recording| -> Vec<(Quantity, Option<String>, Vec<u64>)> {
        let channels = recording.tables.iter().flat_map(|table| &table.channels);
        let health = channels.filter(|channel| Quantity::HEALTH.contains(&channel.quantity));
        let bits = |values: &[f64]| {
            // One sort of NaN.
            let bits = values
                .iter()
                .map(|value| if value.is_nan() { f64::NAN } else { *value });
            bits.map(f64::to_bits).collect()
        };
        health
            .map(|one| (one.quantity.clone(), one.axis.clone(), bits(&one.values)))
            .collect()
    };
    assert_eq!(of(&first).len(), 13);
    assert_eq!(of(&again), of(&first));
}

#[test]
fn channels_in_another_unit_or_on_no_axis_of_theirs_are_refused() {
    let bench = Bench::new();
    simulated(&bench, UNIT);
    let manifest = fs::read_to_string(bench.at("run/recording.toml")).expect("the manifest");
    let refused = |column: &str, from: &str, to: &str, parts: &[&str]| {
        let place = manifest
            .find(&format!("column = \"{column}\""))
            .expect("the column");
        let (head, tail) = manifest.split_at(place);
        assert!(tail.contains(from), "{from}");
        bench.write(
            "run/recording.toml",
            head.to_owned() + &tail.replacen(from, to, 1),
        );
        let words = bench.refused(&["inspect", "run"]);
        for part in [column].iter().chain(parts) {
            assert!(words.contains(part), "no {part} in {words}");
        }
    };
    let stamp = "quantity = \"time_since_pulse\"";
    let with_axis = format!("{stamp}\naxis = \"x\"");
    refused(
        "time_since_pulse",
        stamp,
        &with_axis,
        &["cannot have this axis", "expected no axis"],
    );
    let in_volts = format!("{stamp}\nunit = \"V\"");
    refused(
        "time_since_pulse",
        stamp,
        &in_volts,
        &["another unit", "s, ms, us, ns"],
    );
    let intensity = "quantity = \"laser_intensity\"";
    refused(
        "laser_intensity_y",
        intensity,
        "quantity = \"laser_intensty\"",
        &["laser_intensty", "laser_intensity"],
    );
    refused(
        "laser_intensity_y",
        "axis = \"y\"",
        "axis = \"w\"",
        &["cannot have this axis"],
    );
    refused(
        "laser_intensity_y",
        "scale = 6.103515625e-5",
        "scale = 1.0",
        &["cannot be in 1", "twice nominal"],
    );
}
