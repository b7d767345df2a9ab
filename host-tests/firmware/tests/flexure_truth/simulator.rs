//! The simulator itself against formulas.

use std::f64::consts::TAU;

use firmware_tests::sensing_block::attitude::magnus;
use firmware_tests::sensing_block::measure::AttitudeError;
use firmware_tests::sensing_block::{
    Drift, Flexure, Motion, Phases, Quaternion, Recording, SUBSTEPS, Unit, Vector,
};
use trueaxis::CrossAxis;

use crate::predicted::drift_deg_h;
use crate::{EQUAL_S2, FROM_S, MODE_DAMPING, MODE_HZ, MODE_S2, RATE_HZ, UNEQUAL_S2, near};

/// The paper's Table 3 \[s²\], xy, xz, yx, yz, zx, zy.
const TABLE_3_S2: [f64; 6] = [6.9e-8, 7.1e-8, 7.5e-8, 7.3e-8, 6.7e-8, 7.6e-8];

/// Angle of one sample's pulses \[rad\].
fn angle(unit: &Unit, pulses: [i32; 3]) -> Vector {
    [0, 1, 2].map(|i| unit.pulse_weight_rad[i] * f64::from(pulses[i]))
}

/// Drift of a flexing unit's counts beyond a stiff one's, without any chain.
fn counted(flexure: &Flexure, motion: &Motion, seconds: f64) -> Drift {
    let flexing = Unit::fine().with(|u| u.flexure = *flexure);
    let count = ((FROM_S + seconds) * RATE_HZ) as usize;
    let recording = Recording::new(motion, &[flexing, Unit::fine()], RATE_HZ, count);
    let mut sum = [0i64; 3];
    let mut error_rad = Vec::with_capacity(count);
    for (flexing, stiff) in recording.samples[0].iter().zip(&recording.samples[1]) {
        for (sum, (a, b)) in
            (sum.iter_mut()).zip(flexing.pulse_counts.iter().zip(stiff.pulse_counts))
        {
            *sum += i64::from(a - b);
        }
        error_rad.push(sum.map(|sum| sum as f64 * Unit::fine().pulse_weight_rad[0]));
    }
    AttitudeError {
        frame_period_s: 1.0 / RATE_HZ,
        error_rad,
    }
    .drift(FROM_S, motion.period_s())
}

/// Counted and predicted agree to `share` of the largest and to the pulses' resolution.
fn assert_counted(name: &str, flexure: &Flexure, motion: &Motion, share: f64) {
    let counted = counted(flexure, motion, 4.0);
    let predicted = drift_deg_h(flexure, motion);
    println!(
        "{name}: counted {:?}, predicted {predicted:?}, resolution {:.1e} deg/h",
        counted.mean_deg_h,
        counted.resolution_deg_h()
    );
    let largest = predicted.iter().fold(0.0f64, |l, v| l.max(v.abs()));
    for (counted_deg_h, predicted) in counted.mean_deg_h.iter().zip(predicted) {
        let bound = share * largest + counted.resolution_deg_h();
        assert!((counted_deg_h - predicted).abs() <= bound, "{name}");
    }
}

const _: () = assert!(SUBSTEPS >= 16);

#[test]
fn the_attitude_of_coning_is_its_closed_form() {
    for (frequency_hz, angle_deg) in [(15.0, 0.367), (1.0, 5.0), (400.0, 0.02)] {
        let angle_rad = f64::to_radians(angle_deg);
        let motion = Motion::exact_coning(frequency_hz, angle_rad);
        let recording = Recording::new(&motion, &[], RATE_HZ, 8000);
        let exact = |t: f64| {
            let (sin, cos) = (TAU * frequency_hz * t).sin_cos();
            Quaternion::from_rotation_vector([0.0, angle_rad * cos, angle_rad * sin])
        };
        let mut attitude = exact(0.0);
        let mut largest = 0.0f64;
        for (k, rotation) in recording.rotations.iter().enumerate() {
            attitude = attitude.times(*rotation).normalised();
            let exact = exact((k + 1) as f64 / RATE_HZ);
            for (a, b) in attitude.0.iter().zip(exact.0) {
                largest = largest.max((a - b).abs());
            }
        }
        println!("{frequency_hz} Hz, {angle_deg} deg: {largest:.1e} after 2 s");
        assert!(largest < 1e-12, "{frequency_hz} Hz: {largest}");
    }
}

#[test]
fn the_integration_has_sixth_order() {
    // Rates that turn about x; the rotation over 1 rad of their phase, in steps of 1/4 and 1/8.
    let rotation = |steps: usize| {
        let step_s = 1.0 / steps as f64;
        (0..steps).fold(Quaternion::IDENTITY, |attitude, step| {
            let rate = firmware_tests::sensing_block::NODES.map(|node| {
                let (sin, cos) = ((step as f64 + node) * step_s).sin_cos();
                [0.3, 2.0 * cos, 2.0 * sin]
            });
            attitude.times(Quaternion::from_rotation_vector(magnus(&rate, step_s)))
        })
    };
    let fine = rotation(64);
    let error = |steps| {
        let difference = rotation(steps).times(fine.inverse()).rotation_vector();
        difference.iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    let order = (error(4) / error(8)).log2();
    println!(
        "errors {:.2e}, {:.2e}: order {order:.2}",
        error(4),
        error(8)
    );
    assert!((5.7..6.5).contains(&order), "order {order}");
}

#[test]
fn table_3_drifts_by_half_a_degree_an_hour_at_15_hz_and_0_367_deg() {
    let motion = Motion::coning(0, 15.0, TAU * 15.0 * 0.367f64.to_radians());
    let flexure = Flexure::rigid(TABLE_3_S2);
    let [x, y, z] = drift_deg_h(&flexure, &motion);
    // The vector turns from y to z: its acceleration leads it, and gyro x reads −(K_xy + K_xz) Ω³φ²/2 more.
    assert!((x + 0.4959).abs() < 0.0001, "{x}");
    assert_eq!((y, z), (0.0, 0.0));
    assert_counted("Table 3", &flexure, &motion, 1e-7);
}

#[test]
fn coning_about_each_axis_drifts_by_the_sum_of_its_pair() {
    for axis in 0..3 {
        let motion = Motion::coning(axis, near(100.0), 0.6);
        assert_counted("coning", &Flexure::rigid(UNEQUAL_S2), &motion, 1e-7);
    }
}

#[test]
fn a_stiff_suspension_does_not_rectify_in_phase() {
    for frequency_hz in [20.0, 100.0, 400.0] {
        let motion = Motion::in_phase(near(frequency_hz), [0.6, 0.6, -0.6]);
        let flexure = Flexure::rigid(UNEQUAL_S2);
        let predicted = drift_deg_h(&flexure, &motion);
        assert!(predicted.iter().all(|v| v.abs() < 1e-12), "{predicted:?}");
        assert_counted("in phase", &flexure, &motion, 0.0);
    }
}

#[test]
fn a_ringing_block_drifts_by_its_resonance_more() {
    let modes = [593.0, 640.0, 555.0, 610.0, 577.0, 680.0];
    let flexure = Flexure::rigid([MODE_S2; 6]).ringing(modes, MODE_DAMPING);
    for frequency_hz in [20.0, 100.0, 200.0, 400.0] {
        let coning = Motion::coning(0, near(frequency_hz), 0.6);
        assert_counted("ringing, coning", &flexure, &coning, 1e-7);
        // Only damping rectifies here.
        let skew = Motion::in_phase(near(frequency_hz), [0.6; 3]);
        assert_counted("ringing, in phase", &flexure, &skew, 1e-6);
    }
    let share = |flexure: &Flexure| {
        drift_deg_h(flexure, &Motion::coning(0, 200.0, 0.6))[0]
            / drift_deg_h(
                &Flexure::rigid([MODE_S2; 6]),
                &Motion::coning(0, 200.0, 0.6),
            )[0]
    };
    let resonance = share(&Flexure::rigid([MODE_S2; 6]).ringing([MODE_HZ; 6], MODE_DAMPING));
    let ratio = 200.0 / MODE_HZ;
    assert!((resonance * (1.0 - ratio * ratio) - 1.0).abs() < 1e-4);
}

#[test]
fn random_vibration_has_its_power_and_its_drift() {
    for phases in [Phases::Common, Phases::Turning, Phases::Independent] {
        let motion = Motion::random((20.0, 200.0), 0.3, 36, phases, 7);
        for i in 0..3 {
            let power: f64 = (motion.tones.iter())
                .map(|tone| (tone.sine[i].powi(2) + tone.cosine[i].powi(2)) / 2.0)
                .sum();
            assert!((power.sqrt() - 0.3).abs() < 1e-9);
        }
        // Two frequencies beat at 2.5 Hz or faster: its residual after weighting over 4 s is 1e-4 of the drift.
        assert_counted(
            &format!("{phases:?}"),
            &Flexure::rigid(EQUAL_S2),
            &motion,
            2e-4,
        );
    }
}

#[test]
fn installation_bias_and_scale_are_those_of_eq_7() {
    let e = CrossAxis::from_array([4e-4, -2e-4, 1e-4, -5e-4, 3e-4, 8e-4]);
    let unit = Unit::fine().with(|u| {
        u.installation_rad = e;
        u.bias_rad_s = [2e-6, -3e-6, 4e-6];
        u.scale_error = [7e-6, -4e-6, 11e-6];
    });
    let mut motion = Motion::of(vec![]).with_slew([0.3, -0.2, 0.5]);
    motion.ramp_s = 0.0;
    let recording = Recording::new(&motion, &[unit], RATE_HZ, 4000);
    let mut sensed = [0.0; 3];
    for sample in &recording.samples[0] {
        for (sum, angle) in sensed.iter_mut().zip(angle(&unit, sample.pulse_counts)) {
            *sum += angle;
        }
    }
    let [x, y, z] = [0, 1, 2].map(|i| sensed[i] * (1.0 - unit.scale_error[i]) - unit.bias_rad_s[i]);
    let body = [
        x + e.xy * z + e.xz * y,
        y + e.yz * x + e.yx * z,
        z + e.zx * y + e.zy * x,
    ];
    for (body, steady) in body.iter().zip(motion.steady_rad_s) {
        assert!((body - steady).abs() < 1.5e-10, "{body}");
    }
}

#[test]
fn what_is_counted_less_the_block_is_the_case() {
    let unit = Unit::dithered(5).with(|u| u.pickoff_gain = [1.013, 0.991, 1.004]);
    let motion = Motion::in_phase(30.0, [0.5, -0.3, 0.2]);
    let recording = Recording::new(&motion, &[unit, Unit::fine()], RATE_HZ, 8000);
    let (mut dithered, mut still) = ([0.0; 3], [0.0; 3]);
    let mut swing = [(f64::INFINITY, 0.0f64); 3];
    let mut highest = [0.0f64; 3];
    for (a, b) in recording.samples[0].iter().zip(&recording.samples[1]) {
        for i in 0..3 {
            let block =
                f64::from(a.pickoff_codes[i]) * unit.pickoff_gain[i] * unit.pickoff_weight_rad;
            dithered[i] += angle(&unit, a.pulse_counts)[i];
            still[i] += angle(&Unit::fine(), b.pulse_counts)[i];
            let apart = dithered[i] - block - still[i];
            assert!(apart.abs() <= unit.pulse_weight_rad[i] * 1.0001, "{apart}");
            // The peak of each swing to the positive side.
            if block > 0.0 {
                highest[i] = highest[i].max(block);
            } else if highest[i] > 0.0 {
                swing[i] = (swing[i].0.min(highest[i]), swing[i].1.max(highest[i]));
                highest[i] = 0.0;
            }
        }
    }
    println!("peaks of the blocks' swings {swing:?} rad");
    for (least, most) in swing {
        assert!(least < 5.5e-4 && most > 9e-4 && most < 9.7e-4);
    }
}
