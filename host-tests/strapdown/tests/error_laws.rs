//! Growth of errors: Schuler's pendulum, the Earth's day, the drift of a gyro.
//!
//! The navigator's error is compared with the linear error equations of a unit at rest, written here for the tests and
//! solved by a matrix exponential, and with the textbook figures.
//!
//! Source: Titterton & Weston, *Strapdown Inertial Navigation Technology*, 2nd ed., section 12.3, in the form
//! of the tilt φ of the computed frame: C̃ = (1 − φ×) C.

use std::f64::consts::{PI, TAU};

use nalgebra::{SMatrix, SVector, UnitQuaternion, Vector3};
use strapdown::{Increment, Navigator, Solution, VerticalChannel, earth};

const PERIOD_S: f64 = 0.1;

/// An hour's drift of 0.01 °/h.
const CENTIDEGREE_H: f64 = 0.01 * PI / 180.0 / 3600.0;

/// At rest at sea level, axes north, east, down.
fn at_rest(latitude_rad: f64) -> Solution {
    Solution {
        ned_from_body: UnitQuaternion::identity(),
        velocity_m_s: Vector3::zeros(),
        latitude_rad,
        longitude_rad: 0.0,
        height_m: 0.0,
    }
}

/// Measurements of perfect sensors there in a period.
fn still(latitude_rad: f64) -> Increment {
    let turn_rad = earth::earth_rate_rad_s(latitude_rad) * PERIOD_S;
    let force = -earth::gravity_m_s2(latitude_rad, 0.0);
    Increment {
        rotation_rad: turn_rad,
        // constant in a body that turns with the Earth, brought to the period's beginning
        velocity_m_s: (force + 0.5 * turn_rad.cross(&force)) * PERIOD_S,
        period_s: PERIOD_S,
    }
}

/// Errors of the linear equations: φ_N φ_E φ_D \[rad\], δv_N δv_E \[m/s\], δL, δλ cos L \[rad\].
type Errors = SVector<f64, 7>;

/// ẋ = A x + (−ε on φ).
fn linear(latitude_rad: f64) -> SMatrix<f64, 7, 7> {
    let (along_m, across_m) = (
        earth::meridian_radius_m(latitude_rad),
        earth::transverse_radius_m(latitude_rad),
    );
    let (sin, cos) = latitude_rad.sin_cos();
    let (up, north) = (earth::ROTATION_RAD_S * sin, earth::ROTATION_RAD_S * cos);
    let tan = latitude_rad.tan();
    let g = earth::gravity_m_s2(latitude_rad, 0.0).z;
    SMatrix::<f64, 7, 7>::from_row_slice(&[
        // φ̇ = −ω_in × φ + δω_in − ε, δω_in from the errors of latitude and velocity
        0.0,
        -up,
        0.0,
        0.0,
        1.0 / across_m,
        -up,
        0.0, //
        up,
        0.0,
        north,
        -1.0 / along_m,
        0.0,
        0.0,
        0.0, //
        0.0,
        -north,
        0.0,
        0.0,
        -tan / across_m,
        -north,
        0.0, //
        // δv̇ = f × φ − 2 ω_ie × δv, f = (0, 0, −g)
        0.0,
        g,
        0.0,
        0.0,
        -2.0 * up,
        0.0,
        0.0, //
        -g,
        0.0,
        0.0,
        2.0 * up,
        0.0,
        0.0,
        0.0, //
        0.0,
        0.0,
        0.0,
        1.0 / along_m,
        0.0,
        0.0,
        0.0, //
        0.0,
        0.0,
        0.0,
        0.0,
        1.0 / across_m,
        0.0,
        0.0, //
    ])
}

/// The linear errors at `time_s` from `start` under constant gyro drifts, north, east, down.
fn predicted(latitude_rad: f64, start: Errors, drift_rad_s: Vector3<f64>, time_s: f64) -> Errors {
    let mut whole = SMatrix::<f64, 8, 8>::zeros();
    whole
        .fixed_view_mut::<7, 7>(0, 0)
        .copy_from(&linear(latitude_rad));
    whole.fixed_view_mut::<3, 1>(0, 7).copy_from(&-drift_rad_s);
    let propagated = (whole * time_s).exp();
    propagated.fixed_view::<7, 7>(0, 0) * start + propagated.fixed_view::<7, 1>(0, 7)
}

/// The navigator's errors in the same terms, at every `every_s` up to `until_s`.
fn navigated(
    start: Solution,
    drift_rad_s: Vector3<f64>,
    every_s: f64,
    until_s: f64,
) -> Vec<(f64, Errors)> {
    let home = at_rest(start.latitude_rad);
    let perfect = still(start.latitude_rad);
    let increment = Increment {
        rotation_rad: perfect.rotation_rad + drift_rad_s * PERIOD_S,
        ..perfect
    };
    let mut navigator = Navigator::new(start);
    let every = (every_s / PERIOD_S).round() as usize;
    let mut found = Vec::new();
    for step in 1..=(until_s / PERIOD_S).round() as usize {
        let solution = navigator.advance(&increment, VerticalChannel::Aided(0.0));
        if step % every == 0 {
            // C̃ Cᵀ = 1 − φ×: the rotation vector of the computed against the true frame is −φ
            let tilt = -(solution.ned_from_body * home.ned_from_body.inverse()).scaled_axis();
            let cos = home.latitude_rad.cos();
            let errors = Errors::from_column_slice(&[
                tilt.x,
                tilt.y,
                tilt.z,
                solution.velocity_m_s.x,
                solution.velocity_m_s.y,
                solution.latitude_rad - home.latitude_rad,
                solution.longitude_rad * cos,
            ]);
            found.push((step as f64 * PERIOD_S, errors));
        }
    }
    found
}

/// Largest difference of each error from its law, over the law's largest.
fn worst_share(
    latitude_rad: f64,
    start: Errors,
    drift_rad_s: Vector3<f64>,
    found: &[(f64, Errors)],
) -> f64 {
    let mut difference = Errors::zeros();
    let mut size = Errors::zeros();
    for (time_s, errors) in found {
        let law = predicted(latitude_rad, start, drift_rad_s, *time_s);
        difference = difference.sup(&(errors - law).abs());
        size = size.sup(&law.abs());
    }
    difference.component_div(&size).max()
}

/// Times at which the sign changes \[s\].
fn crossings_s(values: &[(f64, f64)]) -> Vec<f64> {
    values
        .windows(2)
        .filter(|pair| pair[0].1.signum() != pair[1].1.signum())
        .map(|pair| {
            let share = pair[0].1 / (pair[0].1 - pair[1].1);
            pair[0].0 + share * (pair[1].0 - pair[0].0)
        })
        .collect()
}

/// Mean period between changes of sign \[s\].
fn swing_s(found: &[(f64, Errors)], row: usize) -> f64 {
    let values: Vec<_> = found
        .iter()
        .map(|(time_s, errors)| (*time_s, errors[row]))
        .collect();
    let crossings = crossings_s(&values);
    let halves = (crossings.len() - 1) as f64;
    2.0 * (crossings[crossings.len() - 1] - crossings[0]) / halves
}

#[test]
fn a_velocity_error_swings_with_84_4_minutes() {
    // on the equator, where the Earth's rotation does not turn the swing; six hours
    let g = earth::gravity_m_s2(0.0, 0.0).z;
    let mut mean_min = 0.0;
    for (axis, radius_m) in [
        (0, earth::meridian_radius_m(0.0)),
        (1, earth::transverse_radius_m(0.0)),
    ] {
        let mut start = at_rest(0.0);
        start.velocity_m_s[axis] = 0.1;
        let found = navigated(start, Vector3::zeros(), 10.0, 6.0 * 3600.0);
        let period_s = swing_s(&found, 3 + axis);
        let schuler_s = TAU * (radius_m / g).sqrt();
        println!(
            "Schuler, axis {axis}: {:.3} min; 2π√(R/g) = {:.3} min",
            period_s / 60.0,
            schuler_s / 60.0
        );
        // the height loop's part, 2e-5, is the largest that the law leaves out
        assert!((period_s / schuler_s - 1.0).abs() < 1e-4);
        mean_min += period_s / 120.0;
    }
    // the known figure is that of the mean Earth
    assert!((mean_min - 84.4).abs() < 0.05);
}

#[test]
fn the_swing_of_a_velocity_error_turns_as_foucaults_pendulum() {
    // its plane turns by Ω sin L against the Earth: after a quarter turn all of it is east
    let latitude_rad = 1.0_f64;
    let mut start = at_rest(latitude_rad);
    start.velocity_m_s.x = 0.1;
    let quarter_s = PI / 2.0 / (earth::ROTATION_RAD_S * latitude_rad.sin());
    let found = navigated(start, Vector3::zeros(), 30.0, quarter_s + 2600.0);
    let around = found
        .iter()
        .filter(|(time, _)| (*time - quarter_s).abs() < 2600.0);
    let (north, east) = around.fold((0.0_f64, 0.0_f64), |(north, east), (_, errors)| {
        (north.max(errors[3].abs()), east.max(errors[4].abs()))
    });
    println!("after a quarter turn: north {north:.4}, east {east:.4} m/s");
    // the plane turns by Ω sin L times the 2600 s looked at to both sides, 0.16 rad
    assert!(north < 0.17 * 0.1 && east > 0.095);
}

#[test]
fn an_east_drift_of_0_01_deg_h_grows_by_0_6_nmile_each_hour() {
    let latitude_rad = PI / 4.0;
    let drift = Vector3::new(0.0, CENTIDEGREE_H, 0.0);
    let schuler_s = 84.4 * 60.0;
    let found = navigated(at_rest(latitude_rad), drift, 60.0, schuler_s);
    let radius_m = earth::meridian_radius_m(latitude_rad);
    let (time_s, errors) = found[found.len() - 1];
    let north_m = errors[5] * radius_m;
    // the computed level frame turns west about its east axis: the place moves south
    let law_m = -CENTIDEGREE_H * radius_m * time_s;
    println!(
        "east drift 0.01 °/h: {:.4} nmile in {:.2} h; −ε R t = {:.4}",
        north_m / 1852.0,
        time_s / 3600.0,
        law_m / 1852.0
    );
    // −ε R (t − sin ω_s t/ω_s) bends with the day: sin Ωt/Ωt is 0.978 at 84 min
    assert!((north_m / law_m - 1.0).abs() < 0.03);
}

#[test]
fn errors_of_each_gyro_and_start_grow_by_the_linear_law_for_ten_hours() {
    let latitude_rad = 0.6;
    for axis in 0..3 {
        let mut drift = Vector3::zeros();
        drift[axis] = CENTIDEGREE_H;
        let found = navigated(at_rest(latitude_rad), drift, 300.0, 36_000.0);
        let share = worst_share(latitude_rad, Errors::zeros(), drift, &found);
        println!("gyro {axis}: within {share:.1e} of the linear law");
        // second order: the error itself over the Earth's radius, 18 km in 10 h
        assert!(share < 3e-3, "gyro {axis}: {share}");
    }
    for axis in 0..3 {
        let mut tilt = Vector3::zeros();
        tilt[axis] = 1e-4;
        let mut start = at_rest(latitude_rad);
        start.ned_from_body = UnitQuaternion::from_scaled_axis(-tilt);
        let mut errors = Errors::zeros();
        errors.fixed_rows_mut::<3>(0).copy_from(&tilt);
        let found = navigated(start, Vector3::zeros(), 300.0, 36_000.0);
        let share = worst_share(latitude_rad, errors, Vector3::zeros(), &found);
        println!("tilt {axis}: within {share:.1e} of the linear law");
        // the height loop's 2e-5 of the phase after seven swings, 44 rad
        assert!(share < 1e-3, "tilt {axis}: {share}");
    }
    for axis in 0..2 {
        let mut start = at_rest(latitude_rad);
        start.velocity_m_s[axis] = 0.1;
        let mut errors = Errors::zeros();
        errors[3 + axis] = 0.1;
        let found = navigated(start, Vector3::zeros(), 300.0, 36_000.0);
        let share = worst_share(latitude_rad, errors, Vector3::zeros(), &found);
        println!("velocity {axis}: within {share:.1e} of the linear law");
        assert!(share < 1e-3, "velocity {axis}: {share}");
    }
}

#[test]
fn a_height_loop_takes_out_an_error_of_the_start_and_a_free_channel_diverges() {
    let mut start = at_rest(0.6);
    start.height_m = 10.0;
    let height_after = |channel: VerticalChannel, time_s: f64| {
        let mut navigator = Navigator::new(start);
        let increment = still(0.6);
        for _ in 0..(time_s / PERIOD_S) as usize {
            navigator.advance(&increment, channel);
        }
        navigator.solution().height_m
    };
    // triple pole at 30 s: after 20 time constants (t/τ)² e^(−t/τ) = 8e-7
    assert!(height_after(VerticalChannel::Aided(0.0), 600.0).abs() < 1e-3);
    // cosh(t √(2g/R)), with √(2g/R) = 1/570 s
    let radius_m = (earth::meridian_radius_m(0.6) + earth::transverse_radius_m(0.6)) / 2.0;
    let growth = (1800.0 * (2.0 * earth::gravity_m_s2(0.6, 0.0).z / radius_m).sqrt()).cosh();
    let free = height_after(VerticalChannel::Free, 1800.0) / 10.0;
    println!("free height after 30 min: {free:.3} of the start, cosh {growth:.3}");
    assert!((free / growth - 1.0).abs() < 0.01);
}
