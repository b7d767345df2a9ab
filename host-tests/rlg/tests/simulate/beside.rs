//! Instruments other than the gyros: accelerometers, a fibre-optic triad, a reported attitude.

use super::support::*;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rlg::recording::Quantity;

const ACCELEROMETERS: &str = "[accelerometer]\nbias_m_s2 = [0.0, 0.0, 0.0]\n\
    scale_error = [0.0, 0.0, 0.0]\nnoise_m_s2_sqrt_hz = 0.0\nweight_m_s2 = 1e-11\n";

#[test]
fn accelerometers_err_as_the_catalogue_says() {
    let base = PERFECT.to_owned() + SITE + ACCELEROMETERS + TUMBLE;
    let without = run(&base, 1);
    let truth = triad(&without.recording, Quantity::SpecificForce);
    let tilt = Vector3::new(1e-4, -2e-4, 3e-4);
    type Adds = Box<dyn Fn(Vector3<f64>) -> Vector3<f64>>;
    let cases: [(&str, String, Adds); 4] = [
        (
            "accel_bias",
            "x = 1e-3, y = -2e-3, z = 3e-3".into(),
            Box::new(|_| Vector3::new(1e-3, -2e-3, 3e-3)),
        ),
        (
            "accel_scale",
            "x = 1e-4, y = -2e-4, z = 3e-4".into(),
            Box::new(move |f| tilt.component_mul(&f)),
        ),
        (
            "accel_quadratic",
            "x = 1e-5, y = -2e-5, z = 3e-5".into(),
            Box::new(|f| Vector3::new(1e-5, -2e-5, 3e-5).component_mul(&f.component_mul(&f))),
        ),
        (
            // a whole triad rotated by r reads f − r × f: δ_ij = r_j
            "accel_misalignment",
            "yx = 1e-4, zx = 1e-4, xy = -2e-4, zy = -2e-4, xz = 3e-4, yz = 3e-4".into(),
            Box::new(move |f| -tilt.cross(&f)),
        ),
    ];
    for (kind, parameters, expected) in cases {
        let with = run(&(base.clone() + &effect(kind, &parameters)), 1);
        let reads = triad(&with.recording, Quantity::SpecificForce);
        for row in 0..12_000 {
            let error = reads(row) - truth(row) - expected(truth(row));
            // codes of 1e-11
            assert!(error.amax() < 2.5e-11, "{kind}, row {row}: {error}");
        }
    }
    // a third of a row late, and seven rows
    for delay_s in [8e-5, 7.0 * T] {
        let with = run(
            &(base.clone() + &effect("accel_delay", &format!("y = {delay_s}"))),
            1,
        );
        let reads = triad(&with.recording, Quantity::SpecificForce);
        for row in 100..11_900 {
            let late = delay_s / T;
            let (whole, part) = (late.floor() as usize, late.fract());
            let (now, before) = (truth(row - whole)[1], truth(row - whole - 1)[1]);
            let expected = now + (before - now) * part;
            // linear interpolation between rows, f''T²/8: 9.8 m/s² rotated at 5 rad/s² and (1.4 rad/s)²
            assert!((reads(row)[1] - expected).abs() < 6e-7, "row {row}");
        }
    }
}

#[test]
fn accelerometer_on_an_arm_feels_the_arm_turn() {
    let base = PERFECT.to_owned() + SITE + ACCELEROMETERS;
    let spin = "[[motion]]\nkind = \"spin\"\naxis = \"z\"\nrate_rad_s = 3.0\nramp_s = 0.5\nduration_s = 3.0\n";
    let arms = effect(
        "size_effect",
        "xx = 0.1, xy = 0.02, yx = 0.05, yy = -0.03, zz = 0.2",
    );
    let with = run(&(base.clone() + spin + &arms), 1);
    let without = run(&(base + spin), 1);
    let felt = |row: usize| {
        triad(&with.recording, Quantity::SpecificForce)(row)
            - triad(&without.recording, Quantity::SpecificForce)(row)
    };
    // steady: inwards, ω² r; an arm along the axis has no effect. The Earth's rotation adds 2 · 3 · 7e-5 · r
    let inwards = felt(6000) - Vector3::new(-9.0 * 0.1, 9.0 * 0.03, 0.0);
    assert!(
        inwards.amax() < 2.0 * 3.0 * 7.3e-5 * 0.2 + 1e-10,
        "{inwards}"
    );
    // starting: α × r in its own direction, at the middle of the ramp, half of the step: 3·2.1875/0.5
    let alpha = 3.0 * 2.1875 / 0.5;
    let half: f64 = 1.5;
    let expected = Vector3::new(
        -half.powi(2) * 0.1 - alpha * 0.02,
        half.powi(2) * 0.03 + alpha * 0.05,
        0.0,
    );
    // the row's middle is half a row after the ramp's: α'' T²/8 of 13 rad/s² over 0.5 s, and ω changes by α T/2
    let got = felt(1000);
    assert!(
        (got - expected).amax() < 2e-3 + 2.0 * 3.0 * 7.3e-5 * 0.2,
        "{got} {expected}"
    );
}

#[test]
fn fibre_optic_triad_stands_beside_and_serves_as_the_reference_where_there_is_no_other() {
    let fibre = "[fibre_optic]\nbias_rad_s = [1e-6, -2e-6, 3e-6]\nscale_error = [1e-5, 0.0, 0.0]\n\
        angle_random_walk_rad_sqrt_s = 0.0\nweight_rad = 1e-13\n";
    let flexure = effect("axis_flexure", "xy = 7e-8, xz = 7e-8");
    let cone = coning(15.0, 0.0064, 4.0);
    let text = PERFECT.to_owned() + fibre + DITHER + &cone + &flexure;
    let simulation = run(&text, 1);
    assert!(simulation.model.reference.is_some() && simulation.model.earth_rate_in_reference);
    let table = &simulation.recording.tables[1];
    assert_eq!(table.file, "fibre_optic.parquet");
    for row in 0..16_000 {
        let case = simulation.case_increments_rad[row];
        for (axis, bias) in [1e-6, -2e-6, 3e-6].into_iter().enumerate() {
            let scale = if axis == 0 { 1.0 + 1e-5 } else { 1.0 };
            let expected = case[axis] * scale + bias * T;
            // no dither, no flexure: the case, within a code
            assert!((table.channels[axis].values[row] - expected).abs() < 2e-13);
        }
    }
    // with another reference it is the second
    let both = run(&(PERFECT.to_owned() + REFERENCE + fibre + STILL), 1);
    assert_eq!(both.recording.tables.len(), 2);
    assert_eq!(both.recording.tables[0].channels[3].column, "rx");
}

#[test]
fn reported_attitude_is_the_case_carried_by_its_rates() {
    let text = PERFECT.to_owned() + REFERENCE + "attitude = true\n" + TUMBLE;
    let simulation = run(&text, 1);
    let q = &simulation.recording.tables[0].channels;
    let column = |axis: &str| {
        let found = q
            .iter()
            .find(|c| c.quantity == Quantity::ReferenceAttitude && c.axis.as_deref() == Some(axis));
        &found.unwrap().values
    };
    let mut attitude = UnitQuaternion::identity();
    let mut before = Vector3::zeros();
    for row in 0..12_000 {
        let turn = Vector3::from(simulation.case_increments_rad[row]);
        // two-sample coning term: the residual is of fourth order in a rotation of 3e-4 rad
        attitude *= UnitQuaternion::from_scaled_axis(turn + before.cross(&turn) / 12.0);
        before = turn;
        let reported = UnitQuaternion::from_quaternion(Quaternion::new(
            column("w")[row],
            column("x")[row],
            column("y")[row],
            column("z")[row],
        ));
        assert!(attitude.angle_to(&reported) < 1e-9, "row {row}");
    }
    assert!(attitude.angle() > 0.1);
    // over the ground: with the Earth's rotation, a case at rest keeps its attitude
    let rest = run(
        &(PERFECT.to_owned() + SITE + REFERENCE + "attitude = true\n" + STILL),
        1,
    );
    let w = rest.recording.tables[0]
        .channels
        .iter()
        .find(|c| c.column == "qw")
        .unwrap();
    assert!(w.values.iter().all(|w| (w - 1.0).abs() < 1e-12));
}
