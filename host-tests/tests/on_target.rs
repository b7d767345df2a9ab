//! The real image in the emulator. Needs `qemu-system-arm` and the image's target, so these tests are
//! ignored by a plain `cargo test`; `cargo verify` installs both and runs them.

use std::fs;
use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rlg::target::{Image, OnTarget, TargetCore, emulator, events, on_target};
use trueaxis::run_report::RunOutcome;
use trueaxis::{CrossAxis, Parameters, Sample};

/// Every parameter away from the value that would hide it.
fn parameters() -> Parameters {
    Parameters {
        pulse_weight_rad: [2.1e-6, 1.9e-6, 2.05e-6],
        bias_rad_s: [2.7e-6, -6.0e-6, 1.2e-5],
        scale_error: [1.5e-5, -5.4e-6, 1.9e-5],
        installation_rad: cross_axis([-1.7e-4, 1.8e-4, 1.1e-4, -1.7e-5, -2.8e-4, 2.4e-4]),
        flexure_s2: cross_axis([6.9e-8, 7.1e-8, 7.5e-8, 7.3e-8, 6.7e-8, 7.6e-8]),
        pickoff_gain: [1.001, 0.999, 1.002],
        ..Parameters::default()
    }
}

fn cross_axis([xy, xz, yx, yz, zx, zy]: [f64; 6]) -> CrossAxis<f64> {
    CrossAxis {
        xy,
        xz,
        yx,
        yz,
        zx,
        zy,
    }
}

/// White noise: counts and pickoff readings within ± the given bounds. 220 pulses are 100 °/s at 2 µrad.
fn noisy_samples(count: usize, counts: i32, codes: i32) -> Vec<Sample> {
    let mut random = ChaCha8Rng::seed_from_u64(4000);
    (0..count)
        .map(|_| Sample {
            pulse_counts: std::array::from_fn(|_| random.random_range(-counts..=counts)),
            pickoff_codes: std::array::from_fn(|_| random.random_range(-codes..=codes)),
        })
        .collect()
}

fn run(core: TargetCore, samples: &[Sample]) -> OnTarget {
    let image = Image::build(core).expect("the image builds");
    on_target::compare(&image, core, &parameters(), samples, &mut |_| {}).expect("the image runs")
}

/// Samples within every range, at the acceleration stage's limit, and far beyond all.
fn holds_bit_for_bit(core: TargetCore) {
    for (counts, codes) in [(20, 50_000), (220, 2_000_000), (i32::MAX, i32::MAX)] {
        let samples = noisy_samples(20_003, counts, codes);
        let result = run(core, &samples);
        assert!(result.bit_equal, "{:?}", result.first_difference);
        assert_eq!(result.samples as usize, samples.len());
        assert_eq!(
            (result.starved, result.late, result.outputs_lost),
            (0, 0, 0),
            "the interrupt lost something"
        );
    }
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_f32_image_gives_the_hosts_bits_whatever_enters() {
    holds_bit_for_bit(TargetCore::F32);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_fixed_image_gives_the_hosts_bits_whatever_enters() {
    holds_bit_for_bit(TargetCore::Fixed);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn instruction_counts_repeat_exactly() {
    let samples = noisy_samples(4_000, 220, 2_000_000);
    let (first, second) = (
        run(TargetCore::F32, &samples),
        run(TargetCore::F32, &samples),
    );
    assert_eq!(first, second);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn a_wrong_output_of_the_image_is_seen() {
    // The f32 image held against the fixed-point host: the two round differently, so the comparison must
    // find a frame, or it finds nothing ever.
    let image = Image::build(TargetCore::F32).expect("the image builds");
    let samples = noisy_samples(4_000, 220, 2_000_000);
    let result = on_target::compare(
        &image,
        TargetCore::Fixed,
        &parameters(),
        &samples,
        &mut |_| {},
    )
    .expect("the image runs");
    assert!(!result.bit_equal);
    assert!(result.first_difference.is_some());
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn events_arrive_with_their_words() {
    let quiet = run(TargetCore::F32, &noisy_samples(2_000, 20, 50_000));
    assert!(
        quiet.events[0].contains("boot: core f32"),
        "{:?}",
        quiet.events
    );
    let last = quiet.events.last().expect("an event at the end");
    assert!(last.contains("end of stream: 2000 samples"), "{last}");
    assert!(
        !quiet
            .events
            .iter()
            .any(|event| event.contains("first fault")),
        "{:?}",
        quiet.events
    );

    let saturating = run(TargetCore::F32, &noisy_samples(2_000, i32::MAX, i32::MAX));
    assert!(
        saturating
            .events
            .iter()
            .any(|event| event.contains("first fault")),
        "{:?}",
        saturating.events
    );
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn a_damaged_parameter_block_is_refused_by_the_image() {
    let image = Image::build(TargetCore::Fixed).expect("the image builds");
    let mut block = parameters().to_block();
    block[20] ^= 1;
    let emulation = emulator::run(&image.path, &block, &noisy_samples(10, 1, 1), &mut |_| {})
        .expect("the image reports");
    assert_eq!(emulation.report.outcome, RunOutcome::ParameterFault);
    assert!(emulation.outputs.is_empty());
    let events = events::decode(&image.path, &image.elf, &emulation.events).expect("events");
    assert!(
        events
            .iter()
            .any(|event| event.contains("parameter block refused") && event.contains("Checksum")),
        "{events:?}"
    );
}

#[test]
fn a_file_that_is_no_image_is_refused_by_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("firmware");
    fs::write(&path, b"not an ELF file").expect("a file in it");
    let error = Image::read(&path).expect_err("text is no image");
    assert_eq!(error.file, path);
    assert!(
        error.to_string().contains("thumbv7em-none-eabihf"),
        "{error}"
    );

    let error = Image::read(Path::new("no/such/image")).expect_err("nothing is no image");
    assert!(error.to_string().contains("cannot be read"), "{error}");
}

#[test]
fn this_programs_own_binary_is_no_image() {
    let own = std::env::current_exe().expect("a running program has a file");
    assert!(Image::read(&own).is_err());
}
