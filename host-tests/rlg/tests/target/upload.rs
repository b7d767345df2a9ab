//! A parameter upload from end to end: `rlg upload` to the emulated image, and the next boot with the stored block.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use rlg::target::records::records_of;
use rlg::target::{Image, Platform, SlotImages, TargetCore, emulator, on_target};
use trueaxis::health::item;
use trueaxis::{Parameters, TermKind};

use super::on_target::{PULSE_M_S, noisy_samples_with_forces, parameters_with_accelerometers};

/// More samples than the emulator plays during the requests.
const SAMPLES: usize = 400_000;

fn upload(block: &Path, port: &Path, more: &[&str]) -> Output {
    let mut command = Command::cargo_bin("rlg").expect("the command is built");
    command.arg("upload").args(more).arg(block);
    command.arg("--port").arg(port).output().expect("it runs")
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A running unit refuses; one that lacks a term is not asked to take it; a stopped one stores, and the next boot runs with
/// the new parameters, bit for bit as the host does.
fn takes_a_block(core: TargetCore) {
    let own = tempfile::tempdir().expect("a temporary folder");
    let block = |name: &str, parameters: &Parameters| {
        let path = own.path().join(name);
        fs::write(&path, &parameters.to_block(0)[..]).expect("a file");
        path
    };
    let old = parameters_with_accelerometers(PULSE_M_S);
    let new = old.with(|p| p.flexure_s2 = old.flexure_s2.map(|k| 0.5 * k));
    let with_term = new.with(|p| {
        let pushed = p.terms.push(TermKind::GyroDelay, &[1e-6; 3]);
        pushed.expect("there is room");
    });
    let (good, asking) = (block("good.bin", &new), block("asking.bin", &with_term));
    let image = Image::build(Platform::Emulator, core).expect("the image builds");
    let records = records_of(noisy_samples_with_forces(SAMPLES, 200, 50_000, 500));
    let slots = SlotImages::both(&old);
    let talk = |port: &Path| {
        let running = upload(&good, port, &[]);
        assert_eq!(running.status.code(), Some(2), "{}", words(&running));
        assert!(
            words(&running).contains("a unit that is running"),
            "{}",
            words(&running)
        );
        let lacking = upload(&asking, port, &["--stop"]);
        assert_eq!(lacking.status.code(), Some(2), "{}", words(&lacking));
        assert!(
            words(&lacking).contains("gyro_delay"),
            "{}",
            words(&lacking)
        );
        let stored = upload(&good, port, &["--stop", "--json"]);
        assert!(stored.status.success(), "{}", words(&stored));
        let result: serde_json::Value = serde_json::from_slice(&stored.stdout).expect("JSON");
        assert_eq!(result["generation"], 2);
    };
    let ((), stored) =
        emulator::run_with_port(&image.path, &slots, &records, talk).expect("the image runs");
    assert_eq!(stored.0[0], slots.0[0], "the slot in use was touched");

    let samples = &records[..5_000];
    let result = on_target::compare_records(&image, core, &stored, samples, &mut |_| {})
        .expect("the image runs");
    assert!(result.bit_equal, "{:?}", result.first_difference);
    assert_eq!(result.health[&item::GENERATION], 2);
    let loaded = stored.load(image.term_kinds);
    assert_eq!(loaded.parameters, new);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_f32_image_takes_a_block_while_it_is_stopped() {
    takes_a_block(TargetCore::F32);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_fixed_image_takes_a_block_while_it_is_stopped() {
    takes_a_block(TargetCore::Fixed);
}
