//! The file of limits: its keys, its ranges, and its refusals.

use rlg::limits_file::{KEYS, read};
use trueaxis::HealthLimits;

use super::bench::Bench;

#[test]
fn faults_of_the_file_are_named_and_nothing_is_written() {
    let bench = Bench::new();
    for (text, parts) in [
        ("", &["is empty"][..]),
        (
            "format = 2\nintensity_least = [1, 1, 1]\n",
            &["format", "found 2"],
        ),
        ("format = 1\n", &["holds no limit", "pulse_silence_s"]),
        (
            "format = 1\nintensity_lest = [1, 1, 1]\n",
            &["intensity_lest", "is no limit", "expected intensity_least"],
        ),
        (
            "format = 1\npulse_silence = 1.02\n",
            &["pulse_silence:", "expected pulse_silence_s"],
        ),
        (
            "format = 1\nvolts = 3\n",
            &["volts", "one of temperature_k"],
        ),
        (
            "format = 1\n[temperature_k]\nleast = 200\n",
            &["temperature_k", "another number of values"],
        ),
        (
            "format = 1\ntemperature_k = [-40.0, 85.0]\n",
            &["temperature_k", "out of range", "150 to 450 K"],
        ),
        (
            "format = 1\ntemperature_k = [300.0, 200.0]\n",
            &["temperature_k", "larger value first"],
        ),
        (
            "format = 1\ntemperature_k = [200.0, nan]\n",
            &["temperature_k", "out of range"],
        ),
        (
            "format = 1\nintensity_least = 0.7\n",
            &["intensity_least", "another number of values", "[x, y, z]"],
        ),
        (
            "format = 1\nintensity_least = [0.7, 0.7, \"0.7\"]\n",
            &["intensity_least", "another type"],
        ),
        (
            "format = 1\npath_length_step = [0.1]\n",
            &["path_length_step", "is a list"],
        ),
        (
            "format = 1\ndither_drive = [0.5, 2.5]\n",
            &["dither_drive", "0 to 2 of nominal"],
        ),
        (
            "format = 1\ndither_amplitude = [1.1, 1.5]\n",
            &["dither_amplitude", "nominal amplitude"],
        ),
        (
            "format = 1\npulse_silence_s = 1.0\n",
            &["pulse_silence_s", "1.001 to 1.04 s"],
        ),
    ] {
        bench.write("limits.toml", text);
        let arguments = [
            "params",
            "model.toml",
            "--limits",
            "limits.toml",
            "--out",
            "params.bin",
        ];
        let words = bench.refused(&arguments);
        for part in ["limits.toml"].iter().chain(parts) {
            assert!(words.contains(part), "{text:?} gave: {words}");
        }
    }
}

/// The file's ranges are those of the firmware: their ends are taken by both, a value beyond them by neither.
#[test]
fn ranges_are_those_of_the_firmware() {
    let bench = Bench::new();
    let taken = |text: &str| {
        bench.write("limits.toml", text);
        read(&bench.at("limits.toml")).map(|limits| limits.check().is_ok())
    };
    for key in KEYS {
        let [low, high] = key.range;
        // Values of a pair differ; those about 1 stay about it.
        let list = |edge: f64, is_low: bool| match key.values {
            1 => format!("{edge}"),
            2 if is_low => format!("[{edge}, {}]", high * 0.999),
            2 => format!("[{}, {edge}]", low.max(1e-3) * 1.001),
            _ => format!("[{edge}, {edge}, {edge}]"),
        };
        for (edge, outside, is_low) in [(low, low - 1e-6, true), (high, high + 1e-6, false)] {
            let line = |value| format!("format = 1\n{} = {}\n", key.name, list(value, is_low));
            assert_eq!(
                taken(&line(edge)).ok(),
                Some(true),
                "{} at {edge}",
                key.name
            );
            assert!(taken(&line(outside)).is_err(), "{} beyond {edge}", key.name);
        }
    }
    // The firmware's own check refuses just beyond the same ends.
    let refused =
        |change: fn(&mut HealthLimits)| HealthLimits::default().with(change).check().is_err();
    assert!(refused(|limits| limits.temperature_k = Some([149.9, 300.0])));
    assert!(refused(|limits| limits.temperature_k = Some([300.0, 450.1])));
    assert!(refused(
        |limits| limits.intensity_least = Some([0.0099, 0.5, 0.5])
    ));
    assert!(refused(
        |limits| limits.intensity_least = Some([0.5, 0.5, 1.001])
    ));
    assert!(refused(|limits| limits.path_length_step = Some(0.00099)));
    assert!(refused(|limits| limits.path_length_step = Some(1.001)));
    assert!(refused(|limits| limits.dither_drive = Some([-0.001, 1.0])));
    assert!(refused(|limits| limits.dither_drive = Some([0.5, 2.001])));
    assert!(refused(|limits| limits.dither_amplitude = [0.199, 1.5]));
    assert!(refused(|limits| limits.dither_amplitude = [0.5, 1.901]));
    assert!(refused(|limits| limits.pulse_silence_s = Some(1.0009)));
    assert!(refused(|limits| limits.pulse_silence_s = Some(1.0401)));
}
