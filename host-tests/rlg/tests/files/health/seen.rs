//! Faults of a scenario as they are seen: by `rlg inspect` with limits, and by the firmware on the bank's frames of the same
//! recording.

use std::fs;

use serde_json::{Value, json};
use trueaxis::counter_bank::{AccelerometerInput, BankDecoder, FRAME_BYTES};
use trueaxis::{BootReport, F32, Parameters, Processor, Status, Timing};

use super::bench::Bench;
use super::scenario::{FAULTS, UNIT, simulated};

/// True if a time is `due`, to the rounding of sums of periods.
fn close(value: &Value, due: f64) -> bool {
    (value.as_f64().expect("a number") - due).abs() < 1e-9
}

/// Stretches beyond a limit of a channel, as `inspect` has them.
fn crossing<'a>(result: &'a Value, quantity: &str, axis: &Value) -> &'a Vec<Value> {
    let mut health = result["health"].as_array().expect("health").iter();
    let found = health.find(|one| one["quantity"] == quantity && one["axis"] == *axis);
    found.expect("the channel")["crossings"]
        .as_array()
        .expect("crossings")
}

#[test]
fn inspect_has_each_stretch_beyond_a_limit_with_its_times() {
    let bench = Bench::new();
    simulated(&bench, &(UNIT.to_owned() + FAULTS));
    bench.json(&[
        "params",
        "model.toml",
        "--limits",
        "limits.toml",
        "--out",
        "params.bin",
    ]);
    let (result, _) = bench.json(&["inspect", "run", "--limits", "limits.toml"]);
    let (by_block, _) = bench.json(&["inspect", "run", "--limits", "params.bin"]);
    assert_eq!(result, by_block);
    // Relation, limit, first and last row; e^-t/0.1 = 0.7 at 36 ms.
    for (quantity, axis, relation, limit, times_s) in [
        (
            "laser_intensity",
            "x",
            "below",
            "intensity_least",
            [0.536, 3.0],
        ),
        (
            "path_length_drive",
            "y",
            "stepped",
            "path_length_step",
            [0.804; 2],
        ),
        (
            "path_length_drive",
            "z",
            "stepped",
            "path_length_step",
            [1.004; 2],
        ),
        (
            "path_length_resets",
            "z",
            "reset",
            "path_length_step",
            [1.004; 2],
        ),
        ("dither_drive", "x", "above", "dither_drive", [1.204, 1.4]),
        ("temperature", "y", "absent", "temperature_k", [1.604, 1.8]),
    ] {
        let found = crossing(&result, quantity, &json!(axis));
        assert_eq!(found.len(), 1, "{quantity} {axis}: {found:?}");
        assert_eq!(found[0]["relation"], relation, "{quantity} {axis}");
        assert_eq!(found[0]["limit"], limit, "{quantity} {axis}");
        assert!(close(&found[0]["start_s"], times_s[0]), "{found:?}");
        assert!(close(&found[0]["end_s"], times_s[1]), "{found:?}");
    }
    for (quantity, axis) in [
        ("laser_intensity", "y"),
        ("path_length_drive", "x"),
        ("dither_drive", "z"),
        ("temperature", "x"),
    ] {
        assert!(
            crossing(&result, quantity, &json!(axis)).is_empty(),
            "{quantity} {axis}"
        );
    }
    // Before the first pulse there is no stamp; then 1.02 s after the pulse at 1.25 s, by a clock 30 ppm fast.
    let pulse = crossing(&result, "time_since_pulse", &Value::Null);
    let shown: Vec<_> = pulse
        .iter()
        .map(|one| one["relation"].as_str().expect("a word"))
        .collect();
    assert_eq!(shown, ["absent", "above", "absent"]);
    assert!(
        close(&pulse[1]["start_s"], 2.272) && close(&pulse[2]["start_s"], 2.3),
        "{pulse:?}"
    );
}

#[test]
fn inspect_prints_each_slow_channel_and_what_is_beyond_a_limit() {
    let bench = Bench::new();
    simulated(&bench, &(UNIT.to_owned() + FAULTS));
    let (_, words) = bench.json(&["inspect", "run", "--limits", "limits.toml"]);
    for part in [
        "0.536 s to 3.000 s",
        "reset at 1.004 s",
        "step of -0.30",
        "not measured from 1.604 s to 1.800 s",
        "250.000 Hz",
    ] {
        assert!(words.contains(part), "no {part} in {words}");
    }
    let (plain, words) = bench.json(&["inspect", "run"]);
    assert!(plain["health"][0].get("crossings").is_none());
    assert!(
        words.contains("laser_intensity x") && !words.contains("below"),
        "{words}"
    );
    let words = bench.refused(&["inspect", "run", "--limits", "model.toml"]);
    assert!(
        words.contains("model.toml, gyro") && words.contains("is no limit"),
        "{words}"
    );
}

/// Sampling periods in which frames with each bit end, first and last \[s\].
fn bits(stream: &[u8], parameters: &Parameters) -> Vec<(Status, [f64; 2])> {
    let mut decoder = BankDecoder::new(AccelerometerInput::Counters);
    let mut processor = Processor::<F32>::new(parameters, BootReport::default()).expect("in range");
    let mut seen: Vec<(Status, [f64; 2])> = Vec::new();
    for (row, bytes) in stream.as_chunks::<FRAME_BYTES>().0.iter().enumerate() {
        let reading = decoder.reading(Ok(bytes), 1);
        let Some(frame) = processor.period(reading, Timing::default()) else {
            continue;
        };
        let end_s = (row + 1) as f64 / 4000.0;
        // The first slow row ends after 4 ms.
        if end_s < 0.01 {
            continue;
        }
        for bit in 0..32 {
            let status = Status::from_bits(frame.output.status.bits() & 1 << bit);
            if status.bits() == 0 {
                continue;
            }
            match seen.iter_mut().find(|(known, _)| *known == status) {
                Some((_, times_s)) => times_s[1] = end_s,
                None => seen.push((status, [end_s; 2])),
            }
        }
    }
    seen
}

#[test]
fn the_firmware_raises_the_bits_of_the_scenario_s_faults_on_the_bank_s_frames() {
    let bench = Bench::new();
    for (faults, due) in [
        ("", &[][..]),
        (
            FAULTS,
            &[
                (Status::INTENSITY_LOW, [0.536, 3.0]),
                (Status::MODE_HOP, [0.802, 1.002]),
                (Status::DITHER_DRIVE, [1.202, 1.402]),
                (Status::TEMPERATURE_ABSENT, [1.602, 1.802]),
                (Status::PULSE_LOST, [2.02, 3.0]),
                (Status::DITHER_OUT_OF_BAND, [2.4, 2.6]),
                (Status::COUNTER_STUCK, [2.7001, 2.9001]),
            ],
        ),
    ] {
        // A pulse from the start on: without one it counts as lost.
        let text =
            (UNIT.to_owned() + faults).replace("first_pulse_s = 0.25", "first_pulse_s = 0.0");
        simulated(&bench, &text.replace("start_s = 2.2\n", "start_s = 1.9\n"));
        bench.json(&[
            "params",
            "run/model.toml",
            "--pickoff-weight-rad",
            "1e-8",
            "--dither-from",
            "run",
            "--limits",
            "limits.toml",
            "--out",
            "params.bin",
        ]);
        let (_, words) = bench.json(&["export", "run", "--out", "run.bank"]);
        assert!(!words.contains("do not hold"), "{words}");
        let stream = fs::read(bench.at("run.bank")).expect("frames");
        let seen = bits(&stream, &bench.block("params.bin"));
        for (status, [from_s, to_s]) in due {
            let found = seen.iter().find(|(known, _)| known == status);
            let (_, [first_s, last_s]) = found.unwrap_or_else(|| panic!("{status:?} in {seen:?}"));
            // A round of channels, a window of the dither, a stretch of silence: 0.1 s, as docs/board.md has them.
            assert!(
                (*from_s..from_s + 0.1).contains(first_s),
                "{status:?}: {first_s}"
            );
            assert!((last_s - to_s).abs() < 0.1, "{status:?}: {last_s}");
        }
        let service = [
            Status::INTENSITY_LOW,
            Status::MODE_HOP,
            Status::DITHER_DRIVE,
            Status::TEMPERATURE_RANGE,
            Status::TEMPERATURE_ABSENT,
            Status::PULSE_LOST,
            Status::DITHER_OUT_OF_BAND,
            Status::COUNTER_STUCK,
        ];
        for (status, times_s) in seen.iter().filter(|(status, _)| service.contains(status)) {
            assert!(
                due.iter().any(|(known, _)| known == status),
                "{status:?} at {times_s:?}"
            );
        }
    }
}
