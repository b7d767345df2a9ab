//! Alignment at rest: the errors that biases leave against their analytic sensitivities.

use nalgebra::{UnitQuaternion, Vector3};
use strapdown::{Alignment, AlignmentError, EulerAngles, Increment, align, earth, level};

const LATITUDE_RAD: f64 = 0.7;

/// 0.01 °/h.
const GYRO_BIAS_RAD_S: f64 = 4.848e-8;

/// 50 µg.
const FORCE_BIAS_M_S2: f64 = 4.9e-4;

const PERIOD_S: f64 = 0.01;

fn level_heading(heading_rad: f64) -> EulerAngles {
    EulerAngles {
        roll_rad: 0.0,
        pitch_rad: 0.0,
        heading_rad,
    }
}

/// Measurements of a unit at these angles in each of `periods`, biased, and rocking by `rock_rad(t)` about its own
/// axes, which is 0 at both ends.
fn measured(
    angles: EulerAngles,
    gyro_bias_rad_s: Vector3<f64>,
    force_bias_m_s2: Vector3<f64>,
    periods: usize,
    rock_rad: impl Fn(f64) -> Vector3<f64>,
) -> Vec<Increment> {
    let earth_rate = earth::earth_rate_rad_s(LATITUDE_RAD);
    let inertial_from_body = |time_s: f64| {
        UnitQuaternion::from_scaled_axis(earth_rate * time_s)
            * angles.attitude()
            * UnitQuaternion::from_scaled_axis(rock_rad(time_s))
    };
    let reaction = |time_s: f64| {
        UnitQuaternion::from_scaled_axis(earth_rate * time_s)
            * -earth::gravity_m_s2(LATITUDE_RAD, 0.0)
    };
    (0..periods)
        .map(|row| {
            let begin_s = row as f64 * PERIOD_S;
            let begin = inertial_from_body(begin_s);
            let turned = begin.inverse() * inertial_from_body(begin_s + PERIOD_S);
            Increment {
                rotation_rad: turned.scaled_axis() + gyro_bias_rad_s * PERIOD_S,
                velocity_m_s: (begin.inverse() * reaction(begin_s + 0.5 * PERIOD_S)
                    + force_bias_m_s2)
                    * PERIOD_S,
                period_s: PERIOD_S,
            }
        })
        .collect()
}

fn no_rocking(_: f64) -> Vector3<f64> {
    Vector3::zeros()
}

/// A minute of rest.
fn aligned(angles: EulerAngles, gyro: Vector3<f64>, force: Vector3<f64>) -> Alignment {
    align(&measured(angles, gyro, force, 6000, no_rocking)).expect("a minute at rest")
}

fn error_rad(alignment: &Alignment, angles: EulerAngles) -> Vector3<f64> {
    // of the computed frame, about north, east, down
    (alignment.ned_from_body * angles.attitude().inverse()).scaled_axis()
}

#[test]
fn without_errors_any_attitude_is_found() {
    for (roll_rad, pitch_rad, heading_rad) in [
        (0.0, 0.0, 0.0),
        (0.3, -0.2, 4.0),
        (-2.5, 1.2, 1.0),
        (3.1, -1.5, 6.0),
    ] {
        let angles = EulerAngles {
            roll_rad,
            pitch_rad,
            heading_rad,
        };
        let found = aligned(angles, Vector3::zeros(), Vector3::zeros());
        // rounding of 6000 turns, seen through 1/(Ω t cos L) = 300
        assert!(error_rad(&found, angles).norm() < 1e-9);
        assert!((found.rate_rad_s.norm() - earth::ROTATION_RAD_S).abs() < 1e-14);
        let rows = measured(angles, Vector3::zeros(), Vector3::zeros(), 100, no_rocking);
        let levelled = level(&rows, heading_rad).expect("a second at rest");
        assert!(error_rad(&levelled, angles).norm() < 1e-9);
    }
}

#[test]
fn an_east_gyro_bias_shows_in_heading_by_b_over_omega_cos_latitude() {
    for heading_rad in [0.0, 1.0, 2.5, 5.0] {
        let angles = level_heading(heading_rad);
        let east = angles.attitude().inverse() * Vector3::y();
        let found = aligned(angles, east * GYRO_BIAS_RAD_S, Vector3::zeros());
        let error = error_rad(&found, angles);
        let law = -GYRO_BIAS_RAD_S / (earth::ROTATION_RAD_S * LATITUDE_RAD.cos());
        println!(
            "heading {heading_rad}: {:.4} mrad, law {:.4} mrad",
            error.z * 1e3,
            law * 1e3
        );
        // the next order is the cube of 0.9 mrad
        assert!((error.z / law - 1.0).abs() < 1e-5);
        assert!(error.xy().norm() < 1e-8);
    }
}

#[test]
fn north_and_down_gyro_biases_leave_the_attitude_alone() {
    let angles = level_heading(0.8);
    for axis in [Vector3::x(), Vector3::z()] {
        let bias = angles.attitude().inverse() * axis * GYRO_BIAS_RAD_S;
        let found = aligned(angles, bias, Vector3::zeros());
        assert!(error_rad(&found, angles).norm() < 1e-8);
        // but the rate is no longer the Earth's
        assert!((found.rate_rad_s.norm() - earth::ROTATION_RAD_S).abs() > 0.5 * GYRO_BIAS_RAD_S);
    }
}

#[test]
fn accelerometer_biases_tilt_by_b_over_g_and_turn_by_tan_latitude_of_that() {
    let g = earth::gravity_m_s2(LATITUDE_RAD, 0.0).z;
    let tilt = FORCE_BIAS_M_S2 / g;
    let angles = level_heading(0.0);
    let north = aligned(angles, Vector3::zeros(), Vector3::x() * FORCE_BIAS_M_S2);
    let east = aligned(angles, Vector3::zeros(), Vector3::y() * FORCE_BIAS_M_S2);
    // a north bias pitches the computed body up; it leaves the heading
    assert!((error_rad(&north, angles) - Vector3::new(0.0, tilt, 0.0)).norm() < 1e-3 * tilt);
    assert!((north.ned_from_body.euler_angles().1 - tilt).abs() < 1e-3 * tilt);
    // an east bias rolls it, and the Earth's upward rate then shows as east
    let law = Vector3::new(-tilt, 0.0, tilt * LATITUDE_RAD.tan());
    let found = error_rad(&east, angles);
    println!("east 50 µg: {found:?}, law {law:?}");
    assert!((found - law).norm() < 1e-3 * law.norm());
}

#[test]
fn rocking_between_the_ends_is_taken_out() {
    // a degree of coning at 2 Hz, faded in and out: without tracking it would level to (1°)²/4, 8e-5 rad
    let duration_s = 60.0;
    let rock = |time_s: f64| {
        let fade = (std::f64::consts::PI * time_s / duration_s).sin().powi(2) * 0.0175;
        let phase = std::f64::consts::TAU * 2.0 * time_s;
        Vector3::new(phase.sin(), phase.cos(), 0.3 * phase.sin()) * fade
    };
    let angles = EulerAngles {
        roll_rad: 0.1,
        pitch_rad: 0.2,
        heading_rad: 1.0,
    };
    let rows = measured(angles, Vector3::zeros(), Vector3::zeros(), 6000, rock);
    let found = align(&rows).expect("a minute of rocking");
    let error = error_rad(&found, angles);
    println!("rocking: {error:?}");
    // the test's own velocity increments hold gravity at the period's middle, seen in the body at its beginning: exact,
    // so that only the second order of the Earth's turn in a period remains
    assert!(error.norm() < 1e-7);
}

#[test]
fn what_cannot_be_aligned_on_is_refused_with_the_reason() {
    assert_eq!(align(&[]), Err(AlignmentError::Empty));
    let angles = level_heading(0.0);
    let good = measured(angles, Vector3::zeros(), Vector3::zeros(), 100, no_rocking);
    let weightless: Vec<_> = good
        .iter()
        .map(|row| Increment {
            velocity_m_s: Vector3::zeros(),
            ..*row
        })
        .collect();
    assert!(matches!(
        align(&weightless),
        Err(AlignmentError::NoGravity(_))
    ));
    let resting: Vec<_> = good
        .iter()
        .map(|row| Increment {
            rotation_rad: Vector3::zeros(),
            ..*row
        })
        .collect();
    assert!(matches!(align(&resting), Err(AlignmentError::NoNorth(_))));
    let unmeasured: Vec<_> = good
        .iter()
        .map(|row| Increment {
            velocity_m_s: Vector3::repeat(f64::NAN),
            ..*row
        })
        .collect();
    assert!(matches!(
        align(&unmeasured),
        Err(AlignmentError::NoGravity(_))
    ));
}
