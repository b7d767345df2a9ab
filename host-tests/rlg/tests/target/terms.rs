//! Images with optional terms in the emulator, and their reported terms.

use rlg::target::budgets::Budgets;
use rlg::target::{Image, Platform, TargetCore, on_target};
use trueaxis::terms::TermKinds;
use trueaxis::{Parameters, TermKind};

use crate::on_target::{PULSE_M_S, noisy_samples_with_forces, parameters_with_accelerometers};

/// Every kind that acts without samples of temperature and field, at a realistic size.
const RECORDS: [(TermKind, &[f64]); 16] = [
    (TermKind::GyroDelay, &[20e-6, -10e-6, 15e-6]),
    (TermKind::GyroBandwidth, &[1e-9, 2e-9, 3e-9]),
    (TermKind::AccelDelay, &[-15e-6, 25e-6, 40e-6]),
    (TermKind::GyroScaleAsymmetry, &[1e-5, -2e-5, 3e-5]),
    (TermKind::GyroScaleQuadratic, &[1e-5, -2e-5, 1.5e-5]),
    (TermKind::GyroScaleCubic, &[2e-6, 1e-6, -3e-6]),
    (
        TermKind::GyroGBias,
        &[5e-8, -2e-8, 3e-8, 1e-8, 6e-8, -4e-8, -3e-8, 2e-8, 5e-8],
    ),
    (
        TermKind::AxisTiltByForce,
        &[2e-7, -1e-7, 3e-7, 1e-7, -2e-7, 2e-7],
    ),
    (TermKind::GyroG2Bias, &[1e-9, -2e-9, 1.5e-9]),
    (TermKind::AccelQuadratic, &[2e-6, -1e-6, 3e-6]),
    (
        TermKind::ElasticRateByForce,
        &[1e-7, -5e-8, 2e-8, 4e-8, 1e-7, 3e-8, -6e-8, 2e-8, -1e-7],
    ),
    (
        TermKind::ElasticRateByJerk,
        &[1e-9, -2e-9, 3e-9, 2e-9, 1e-9, -3e-9, 3e-9, 2e-9, -1e-9],
    ),
    (TermKind::DitherCubic, &[2000.0, -3000.0, 1500.0]),
    (
        TermKind::DitherCrosstalk,
        &[1e-3, -2e-3, 1e-3, 3e-3, -1e-3, 2e-3],
    ),
    (
        TermKind::AxisFlexureCubic,
        &[3e-13, -2e-13, 1e-13, 3e-13, -1e-13, 2e-13],
    ),
    (
        TermKind::AxisFlexureMode,
        &[6e-8, 7e-8, 7.5e-8, 6.5e-8, 8e-8, 7e-8, 150.0, 0.03],
    ),
];

fn parameters() -> Parameters {
    let mut known = parameters_with_accelerometers(PULSE_M_S);
    for (kind, values) in RECORDS {
        known.terms.push(kind, values).expect("room");
    }
    known
}

/// Plays noise of these sizes into the image with every term.
fn equals_the_host(image: &Image, core: TargetCore, samples: usize, sizes: [i32; 3]) {
    let known = parameters();
    let [counts, codes, forces] = sizes;
    let samples = noisy_samples_with_forces(samples, counts, codes, forces);
    let result = on_target::compare(image, core, &known, samples.iter().copied(), &mut |_| {})
        .expect("the image runs");
    let cost = result.instructions_between_outputs.expect("samples");
    println!(
        "{core:?}, every term, {} samples: between outputs {cost:?}, all {:?}; flash {}, RAM {}, stack {} bytes",
        result.samples,
        result.instructions_per_sample,
        result.flash_bytes,
        result.ram_bytes,
        result.stack_bytes
    );
    assert!(result.bit_equal, "{:?}", result.first_difference);
    if counts < i32::MAX {
        assert_eq!(cost.min, cost.max);
    }
}

/// The image with every optional term, and one without any that is given one.
#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_images_with_every_term_give_the_hosts_bits() {
    let budgets = Budgets::of_workspace().expect("the budgets");
    for core in [TargetCore::F32, TargetCore::Fixed] {
        let image = Image::build_with_terms(Platform::Emulator, core).expect("the image builds");
        assert_eq!(image.term_kinds, TermKinds::of(TermKind::ALL));
        // Flash, RAM and stack are those of every image.
        let exceeded = budgets.exceeded_by_image(&image).expect("an image");
        assert!(exceeded.is_empty(), "{exceeded:?}");
        equals_the_host(&image, core, 8_003, [20, 50_000, 2_000]);
        equals_the_host(&image, core, 8_003, [i32::MAX; 3]);
        let bare = Image::build(Platform::Emulator, core).expect("the image builds");
        assert_eq!(bare.term_kinds, TermKinds::NONE);
        let refused = on_target::compare(&bare, core, &parameters(), [], &mut |_| {});
        let words = refused.expect_err("no such term").to_string();
        assert!(words.contains("gyro_delay"), "{words}");
    }
}

/// 250 s of the unit's time.
#[test]
#[ignore = "a million samples in the emulator, each core; cargo verify nightly runs it"]
fn a_million_samples_with_every_term_in_full() {
    for core in [TargetCore::F32, TargetCore::Fixed] {
        let image = Image::build_with_terms(Platform::Emulator, core).expect("the image builds");
        equals_the_host(&image, core, 1_000_000, [20, 50_000, 2_000]);
    }
}
