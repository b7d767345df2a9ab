//! Images with optional terms in the emulator, and what they say of themselves.

use rlg::target::{Image, Platform, TargetCore, on_target};
use trueaxis::TermKind;
use trueaxis::terms::TermKinds;

use crate::on_target::{PULSE_M_S, noisy_samples_with_forces, parameters_with_accelerometers};

/// The image with every optional term, each with a record, and one without any that is asked for one.
#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_images_with_every_term_give_the_hosts_bits() {
    let records: [(TermKind, &[f64]); 7] = [
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
    ];
    let mut known = parameters_with_accelerometers(PULSE_M_S);
    for (kind, values) in records {
        known.terms.push(kind, values).expect("room");
    }
    for core in [TargetCore::F32, TargetCore::Fixed] {
        let image = Image::build_with_terms(Platform::Emulator, core).expect("the image builds");
        assert_eq!(image.term_kinds, TermKinds::of(TermKind::ALL));
        for (counts, codes, forces) in [(20, 50_000, 2_000), (i32::MAX, i32::MAX, i32::MAX)] {
            let samples = noisy_samples_with_forces(20_003, counts, codes, forces);
            let result =
                on_target::compare(&image, core, &known, samples.iter().copied(), &mut |_| {})
                    .expect("the image runs");
            assert!(result.bit_equal, "{:?}", result.first_difference);
            let cost = result.instructions_between_outputs.expect("samples");
            println!(
                "{core:?}, every term: {cost:?}, {:?}",
                result.instructions_per_sample
            );
            if counts == 20 {
                assert_eq!(cost.min, cost.max);
            }
        }
        let bare = Image::build(Platform::Emulator, core).expect("the image builds");
        assert_eq!(bare.term_kinds, TermKinds::NONE);
        let refused = on_target::compare(&bare, core, &known, [], &mut |_| {});
        let words = refused.expect_err("no such term").to_string();
        assert!(words.contains("gyro_delay"), "{words}");
    }
}
