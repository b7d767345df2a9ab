//! Accelerometers away from the origin and from each other.

use std::f64::consts::TAU;

use nalgebra::Rotation3;
use trueaxis::{F32, Fixed, NumberSystem};

use crate::frames;
use crate::motion::{Cone, G, Motion, Vector, navigate, navigate_at, parameters};

/// Largest residual of the size effect as a steady force \[m/s²\]: 0.1 µg.
const FORCE_M_S2: f64 = 1e-7 * G;

/// Centimetres, all different.
const ARMS_M: [[f64; 3]; 3] = [
    [0.04, 0.03, -0.02],
    [-0.05, 0.02, 0.01],
    [0.02, -0.03, 0.06],
];

/// L ω is at most this times ω: the root of the arms' squares.
const ARM_M: f64 = 0.11;

const NO_ARMS: [[f64; 3]; 3] = [[0.0; 3]; 3];

/// 2 s and the first frame's nine samples.
const SAMPLES: i64 = 8009;

/// Mean force in space that a chain shows which takes the arms for `known_m` \[m/s²\], and the largest
/// velocity error at any frame's end \[m/s\], for a body whose origin feels `force` in space.
fn shown<N: NumberSystem>(motion: &Motion, force: Vector, known_m: [[f64; 3]; 3]) -> (Vector, f64) {
    let samples = motion.samples(ARMS_M, SAMPLES);
    let (frames, _) = frames::<N>(&parameters(known_m), &samples);
    let path = navigate(&motion.attitude, &frames);
    let time_s = |frame: usize| 0.0025 * frame as f64;
    let first = path[0];
    let largest = path
        .iter()
        .enumerate()
        .map(|(frame, velocity)| (velocity - first - force * time_s(frame)).norm())
        .fold(0.0, f64::max);
    let last = path.len() - 1;
    ((path[last] - first) / time_s(last), largest)
}

fn coning(frequency_hz: f64, angle_deg: f64, force: Vector) -> Motion {
    let cone = Cone {
        omega: TAU * frequency_hz,
        angle: angle_deg.to_radians(),
    };
    Motion {
        attitude: Box::new(move |t| cone.attitude(t)),
        rate: Box::new(move |t| cone.rate(t)),
        acceleration: Box::new(move |t| cone.acceleration(t)),
        force: Box::new(move |t| cone.attitude(t).inverse() * force),
    }
}

fn nothing_rectifies<N: NumberSystem>(frequency_hz: f64, angle_deg: f64) {
    let gravity = Vector::new(0.0, 0.0, G);
    let motion = coning(frequency_hz, angle_deg, gravity);
    let (known, bounded) = shown::<N>(&motion, gravity, ARMS_M);
    let (unknown, _) = shown::<N>(&motion, gravity, NO_ARMS);
    let (left, before) = ((known - gravity).norm(), (unknown - gravity).norm());
    println!(
        "{} {frequency_hz} Hz, {angle_deg}°: {before:.2e} -> {left:.2e} m/s², velocity within {bounded:.1e} m/s",
        N::NAME
    );
    // Else there would be nothing to correct.
    assert!(before > 100.0 * FORCE_M_S2, "only {before:e} without arms");
    // Two documented residuals: third order in the angle that a period turns by, and x⁴/90 of the squares; and a
    // hundredth of a µg for numbers.
    let x = TAU * frequency_hz / 4000.0;
    let turned = angle_deg.to_radians() * 10.0 * x;
    let bound = before * (turned.powi(2) / 6.0 + x.powi(4) / 90.0) + 0.1 * FORCE_M_S2;
    assert!(left < bound, "{}: {left:e} over {bound:e}", N::NAME);
    // In velocity, at start and end: the lag of the first rate, x/2 of r ω, and (x²)/3 of the others.
    let swing = ARM_M * angle_deg.to_radians() * TAU * frequency_hz;
    let bound = swing * (x / 2.0 + x * x / 3.0);
    assert!(bounded < bound, "{}: {bounded:e} over {bound:e}", N::NAME);
}

#[test]
fn the_size_effect_rectifies_nothing_under_coning() {
    for (frequency_hz, angle_deg) in [(15.0, 1.0), (50.0, 0.5), (100.0, 0.1)] {
        nothing_rectifies::<F32>(frequency_hz, angle_deg);
        nothing_rectifies::<Fixed>(frequency_hz, angle_deg);
    }
}

fn spin<N: NumberSystem>() {
    // ω² r of 7 cm: 1.7 m/s².
    let rate = Vector::new(150.0, -120.0, 200.0).map(f64::to_radians);
    let motion = Motion {
        attitude: Box::new(move |t| Rotation3::new(rate * t)),
        rate: Box::new(move |_| rate),
        acceleration: Box::new(|_| Vector::zeros()),
        force: Box::new(|_| Vector::zeros()),
    };
    let (left, bounded) = shown::<N>(&motion, Vector::zeros(), ARMS_M);
    println!("{} spin: {:.2e} m/s² left", N::NAME, left.norm());
    assert!(left.norm() < FORCE_M_S2, "{}: {left:?}", N::NAME);
    // A steady rate is known exactly, so nothing swings either: FORCE_M_S2 over the 2 s, and codes.
    assert!(
        bounded < 2.0 * FORCE_M_S2 + 1e-7,
        "{}: {bounded:e}",
        N::NAME
    );
}

#[test]
fn a_spinning_unit_feels_no_force_at_its_origin() {
    spin::<F32>();
    spin::<Fixed>();
}

fn slew<N: NumberSystem>() {
    // ω = ω₀ (1 − cos Ωt)/2, 200 °/s, there and back in a second, twice.
    let (top, omega) = (200f64.to_radians(), TAU);
    let axis = Vector::new(2.0, -1.0, 2.0) / 3.0;
    let motion = Motion {
        attitude: Box::new(move |t| {
            Rotation3::new(axis * top * 0.5 * (t - (omega * t).sin() / omega))
        }),
        rate: Box::new(move |t| axis * top * 0.5 * (1.0 - (omega * t).cos())),
        acceleration: Box::new(move |t| axis * top * 0.5 * omega * (omega * t).sin()),
        force: Box::new(|_| Vector::zeros()),
    };
    let (_, bounded) = shown::<N>(&motion, Vector::zeros(), ARMS_M);
    println!("{} slew: within {bounded:.2e} m/s", N::NAME);
    // r ω_max (ΩT)²/3 is 5e-8 m/s; 2 s of a steady 0.1 µg are 2e-6.
    assert!(bounded < 2.0 * FORCE_M_S2, "{}: {bounded:e}", N::NAME);
}

#[test]
fn a_slew_there_and_back_leaves_no_velocity() {
    slew::<F32>();
    slew::<Fixed>();
}

#[test]
fn arms_common_to_all_accelerometers_leave_only_what_swings() {
    // Q has differences of arms only: a unit far from the body's origin keeps the same force to the bit of
    // its telescoping terms.
    let far = [[0.4, -0.3, 0.2]; 3];
    let gravity = Vector::new(0.0, 0.0, G);
    let motion = coning(50.0, 0.2, gravity);
    let samples = motion.samples(far, SAMPLES);
    let (frames, _) = frames::<Fixed>(&parameters(far), &samples);
    let path = navigate(&motion.attitude, &frames);
    let last = path.len() - 1;
    let mean = (path[last] - path[0]) / (0.0025 * last as f64);
    let left = (mean - gravity).norm();
    println!("common arms of 0.54 m: {left:.2e} m/s² left");
    assert!(left < FORCE_M_S2, "{left:e}");
}

/// At every sample rate a sample turns by the same, in units of 1 to 8 rad: squares of rates and the swing each scale in
/// their own way.
fn nothing_rectifies_at<N: NumberSystem>(rate_hz: f64, samples_per_output: u16) {
    let gravity = Vector::new(0.0, 0.0, G);
    let slower = rate_hz / 4000.0;
    let motion = coning(15.0 * slower, 1.0, gravity);
    let samples = motion.samples_at(rate_hz, ARMS_M, SAMPLES);
    let force = |known_m: [[f64; 3]; 3]| {
        let parameters = parameters(known_m).with(|p| {
            p.sample_rate_hz = rate_hz;
            p.samples_per_output = samples_per_output;
        });
        let (frames, _) = frames::<N>(&parameters, &samples);
        let path = navigate_at(rate_hz, samples_per_output, &motion.attitude, &frames);
        let last = path.len() - 1;
        let period_s = f64::from(samples_per_output) / rate_hz;
        let mean = (path[last] - path[0]) / (period_s * last as f64) - gravity;
        let swings = path.iter().enumerate();
        let swing = swings.map(|(k, v)| (v - path[0] - gravity * (period_s * k as f64)).norm());
        (mean.norm(), swing.fold(0.0, f64::max))
    };
    let ((left, bounded), (before, _)) = (force(ARMS_M), force(NO_ARMS));
    println!(
        "{} {rate_hz} Hz: {before:.2e} -> {left:.2e} m/s², {bounded:.1e} m/s",
        N::NAME
    );
    let x = TAU * 15.0 / 4000.0;
    let turned = 1f64.to_radians() * f64::from(samples_per_output) * x;
    let bound = before * (turned.powi(2) / 6.0 + x.powi(4) / 90.0) + 0.1 * FORCE_M_S2;
    assert!(
        left < bound,
        "{} {rate_hz} Hz: {left:e} over {bound:e}",
        N::NAME
    );
    let swing = ARM_M * 1f64.to_radians() * TAU * 15.0 * slower * (x / 2.0 + x * x / 3.0);
    assert!(
        bounded < swing,
        "{} {rate_hz} Hz: {bounded:e} over {swing:e}",
        N::NAME
    );
}

#[test]
fn the_size_effect_rectifies_nothing_at_every_sample_rate() {
    for (rate_hz, samples_per_output) in [(8000.0, 10), (2000.0, 10), (1000.0, 5), (500.0, 5)] {
        nothing_rectifies_at::<F32>(rate_hz, samples_per_output);
        nothing_rectifies_at::<Fixed>(rate_hz, samples_per_output);
    }
}
