//! The raw stream from end to end: samples in, raw frames out of the emulated image's second serial port, a recording of
//! them, and the chain's outputs again, bit for bit.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use rlg::recording::{Quantity, Recording};
use rlg::target::records::records_of;
use rlg::target::{Image, Platform, SlotImages, TargetCore, on_target};
use serde_json::Value;
use trueaxis::bank_record::BankRecord;
use trueaxis::raw_frame::RAW_BYTES;

use super::on_target::{PULSE_M_S, noisy_samples_with_forces, parameters_with_accelerometers};

/// Periods queued in the image while its port is held (QUEUE in src/hardware/raw_tap.rs, less the empty slot).
const HELD: u32 = 63;

fn rlg(arguments: &[&str], more: &[&Path]) -> (Value, String) {
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    let output: Output = command
        .args(arguments)
        .args(more)
        .output()
        .expect("it runs");
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{words}");
    (serde_json::from_slice(&output.stdout).expect("JSON"), words)
}

fn raw_image(core: TargetCore) -> Image {
    Image::build_with_raw(Platform::Emulator, core).expect("the image builds")
}

/// A unit with accelerometers that rests for a second and is shaken for two.
fn short_scenario() -> String {
    let null = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/null.toml");
    let text = fs::read_to_string(null).expect("the scenario");
    let (unit, _) = text.split_once("[[motion]]").expect("motions");
    format!(
        "{unit}[[motion]]\nkind = \"still\"\nduration_s = 1.0\n\n[[motion]]\nkind = \"vibration\"\nlow_hz = 10.0\n\
         high_hz = 120.0\nrate_rms_rad_s = [0.15, 0.15, 0.15]\nduration_s = 2.0\nramp_s = 0.5\n"
    )
}

/// Simulated vibration with accelerometers: the image's input is recovered from its raw stream, `rlg replay` of it has the
/// outputs of the first recording, and `rlg diagnose` takes it.
fn comes_back(core: TargetCore) {
    let own = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| own.path().join(name);
    let scenario = at("scenario.toml");
    fs::write(&scenario, short_scenario()).expect("a file");
    rlg(&["simulate", "--json", "--out"], &[&at("first"), &scenario]);
    let model = at("first").join("model.toml");
    let name = core.name();
    let (played, _) = rlg(
        &[
            "on-target",
            "--json",
            "--raw",
            "--accelerometers",
            "--core",
            name,
            "--out",
        ],
        &[&at("target"), Path::new("--model"), &model, &at("first")],
    );
    assert_eq!(played["bit_equal"], true, "{played}");
    let raw = at("target").join("raw.bin");
    let samples = played["samples"].as_u64().expect("samples");
    let length = fs::metadata(&raw).expect("the stream").len();
    assert_eq!(length, samples * RAW_BYTES as u64);

    let (imported, words) = rlg(&["import", "--json", "--out"], &[&at("again"), &raw]);
    assert_eq!(imported["rows"], samples, "{words}");
    assert_eq!(
        imported["gaps"].as_array().expect("gaps").len(),
        0,
        "{words}"
    );
    assert_eq!(imported["bytes_skipped"], 0);

    let first = Recording::read(at("first")).expect("the first recording");
    let again = Recording::read(at("again")).expect("the recording of the stream");
    for axis in ["x", "y", "z"] {
        let column = |recording: &Recording| {
            let found = recording.channel(&Quantity::GyroCount, axis);
            found.expect("counts").1.values.clone()
        };
        assert_eq!(column(&first)[1..], column(&again)[1..], "gyro {axis}");
    }
    let replayed = |recording: &str| {
        let out = at(&format!("replay-{recording}"));
        let folder = at(recording);
        let more = [&out, Path::new("--model"), &model, folder.as_path()];
        rlg(&["replay", "--json", "--core", name, "--out"], &more).0
    };
    let (before, after) = (replayed("first"), replayed("again"));
    assert_eq!(before["samples"], after["samples"]);
    assert_eq!(before["output_sha256"], after["output_sha256"]);
    let own_model = at("again").join("model.toml");
    let (diagnosed, words) = rlg(
        &["diagnose", "--json", "--out"],
        &[
            &at("report"),
            Path::new("--model"),
            &own_model,
            &at("again"),
        ],
    );
    assert!(diagnosed["verdict"].is_string(), "{words}");
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_raw_stream_of_the_f32_image_gives_its_input_back() {
    comes_back(TargetCore::F32);
}

#[test]
#[ignore = "a minute of qemu-system-arm: --test target -- --ignored in_full"]
fn the_raw_stream_of_the_fixed_image_gives_its_input_back_in_full() {
    comes_back(TargetCore::Fixed);
}

/// While the port is held the image queues frames up to its capacity, drops the rest whole, counts them, and goes on; the
/// telemetry is unaffected. A bus error in that time is a period without a sample.
#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn what_finds_no_room_is_dropped_whole_and_counted() {
    let parameters = parameters_with_accelerometers(PULSE_M_S);
    let samples = noisy_samples_with_forces(3000, 200, 50_000, 500);
    let mut records = records_of(samples);
    // As long as the queue of telemetry has room: 15 frames of 20 samples.
    for record in &mut records[1000..1200] {
        record.link_held = true;
    }
    records[2000] = BankRecord {
        bus_error: true,
        ..records[2000]
    };
    let image = raw_image(TargetCore::F32);
    let slots = SlotImages::both(&parameters);
    let result = on_target::compare_records(&image, TargetCore::F32, &slots, &records, &mut |_| {})
        .expect("the image runs");
    assert!(result.bit_equal, "{:?}", result.first_difference);
    assert_eq!(result.outputs_lost, 0);

    let own = tempfile::tempdir().expect("a temporary folder");
    let file = own.path().join("raw.bin");
    fs::write(&file, &result.raw).expect("a file");
    let (imported, words) = rlg(
        &["import", "--json", "--out"],
        &[&own.path().join("run"), &file],
    );
    assert_eq!(imported["rows"], 3000, "{words}");
    let gaps = imported["gaps"].as_array().expect("gaps");
    assert_eq!(gaps.len(), 2, "{words}");
    // The record that frees the port is one more without room: the main loop runs after its interrupt.
    let dropped = u64::from(201 - HELD);
    assert_eq!(gaps[0]["row"], 1000 + u64::from(HELD));
    assert_eq!(gaps[0]["frames_lost"], dropped);
    assert_eq!(imported["dropped_by_the_unit"], dropped);
    assert_eq!(
        (&gaps[1]["row"], &gaps[1]["rows"]),
        (&2000.into(), &2.into())
    );
    assert_eq!(gaps[1]["without_sample"], 1);
}

/// With the stream the chain's own cost is unchanged, and the interrupt's is the same for every sample between outputs.
#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_stream_costs_the_interrupt_a_constant() {
    for core in [TargetCore::F32, TargetCore::Fixed] {
        let parameters = parameters_with_accelerometers(PULSE_M_S);
        let played = |image: &Image| {
            let samples = noisy_samples_with_forces(4_003, 20, 50_000, 500);
            on_target::compare(image, core, &parameters, samples, &mut |_| {})
                .expect("the image runs")
        };
        let without = played(&Image::build(Platform::Emulator, core).expect("the image builds"));
        let with = played(&raw_image(core));
        let chain =
            |result: &on_target::OnTarget| result.instructions_between_outputs.expect("some");
        let whole = |result: &on_target::OnTarget| result.instructions_per_interrupt.expect("some");
        println!(
            "{}: whole interrupt {:.1} instructions without the stream, {:.1} with it; least {} and {}, most {} and {}",
            core.name(),
            whole(&without).mean,
            whole(&with).mean,
            whole(&without).min,
            whole(&with).min,
            whole(&without).max,
            whole(&with).max,
        );
        assert_eq!(chain(&with).min, chain(&with).max);
        assert_eq!(chain(&with).mean, chain(&without).mean);
        let mean = whole(&with).mean - whole(&without).mean;
        let extremes = [
            whole(&with).min - whole(&without).min,
            whole(&with).max - whole(&without).max,
        ];
        // The instant of the processor's wake-up varies by a few instructions.
        for extreme in extremes {
            assert!(
                (f64::from(extreme) - mean).abs() < 8.0,
                "{extreme} of {mean}"
            );
        }
    }
}
