//! Rotation and force together, against closed forms.

use std::f64::consts::TAU;

use nalgebra::Rotation3;
use trueaxis::{F32, Fixed, NumberSystem};

use crate::frames;
use crate::motion::{Cone, G, Motion, Vector, navigate, parameters};

/// Largest error of a force by the chain \[m/s²\]: 0.1 µg, a hundredth of a navigation accelerometer's repeatability.
const FORCE_M_S2: f64 = 1e-7 * G;

const NO_ARMS: [[f64; 3]; 3] = [[0.0; 3]; 3];

/// The first frame's nine, and 2 s: whole periods of all frequencies here, so that an oscillation ends at its initial phase.
const SAMPLES: i64 = 8009;

/// Mean force in space that frames show, from the first frame's end to the last one's \[m/s²\].
fn mean_force<N: NumberSystem>(motion: &Motion) -> Vector {
    let samples = motion.samples(NO_ARMS, SAMPLES);
    let (frames, _) = frames::<N>(&parameters(NO_ARMS), &samples);
    let path = navigate(&motion.attitude, &frames);
    let elapsed_s = (path.len() - 1) as f64 * 0.0025;
    (path.last().expect("frames") - path[0]) / elapsed_s
}

/// J₁, to 1e-12 for arguments below 0.02.
fn bessel_j1(x: f64) -> f64 {
    0.5 * x * (1.0 - x * x / 8.0)
}

fn rocking_with_vibration<N: NumberSystem>(frequency_hz: f64) {
    let (omega, angle, force) = (TAU * frequency_hz, 0.5f64.to_radians(), 20.0);
    let motion = Motion {
        attitude: Box::new(move |t| Rotation3::new(Vector::x() * angle * (omega * t).sin())),
        rate: Box::new(move |t| Vector::x() * angle * omega * (omega * t).cos()),
        acceleration: Box::new(move |t| -Vector::x() * angle * omega * omega * (omega * t).sin()),
        force: Box::new(move |t| Vector::y() * force * (omega * t).sin()),
    };
    let mean = mean_force::<N>(&motion);
    // y sin Ωt turned by φ sin Ωt about x: a sin(φ sin) sin along z, a cos(φ sin) sin along y.
    let exact = Vector::new(0.0, 0.0, force * bessel_j1(angle));
    let error = mean - exact;
    println!(
        "{} {frequency_hz} Hz: {:.6} m/s² rectified, error {:.2e}",
        N::NAME,
        mean.z,
        error.norm()
    );
    assert!(
        error.norm() < FORCE_M_S2,
        "{} at {frequency_hz} Hz: {mean:?}, not {exact:?}",
        N::NAME
    );
}

#[test]
fn rocking_in_step_with_a_vibration_across_it_rectifies_as_bessel_says() {
    for frequency_hz in [50.0, 100.0] {
        rocking_with_vibration::<F32>(frequency_hz);
        rocking_with_vibration::<Fixed>(frequency_hz);
    }
}

/// A force constant in space, sensed by a body that turns at ω.
fn turning(rate: Vector, force: Vector) -> Motion {
    Motion {
        attitude: Box::new(move |t| Rotation3::new(rate * t)),
        rate: Box::new(move |_| rate),
        acceleration: Box::new(|_| Vector::zeros()),
        force: Box::new(move |t| Rotation3::new(rate * t).inverse() * force),
    }
}

fn spin_under_gravity<N: NumberSystem>() {
    let rate = Vector::new(100.0, -200.0, 300.0).map(f64::to_radians);
    let gravity = Vector::new(0.3, -0.5, 0.9) * G;
    let error = mean_force::<N>(&turning(rate, gravity)) - gravity;
    println!("{} spin: error {:.2e} m/s²", N::NAME, error.norm());
    assert!(error.norm() < FORCE_M_S2, "{}: {error:?}", N::NAME);
}

#[test]
fn a_force_fixed_in_space_stays_so_under_374_deg_s() {
    spin_under_gravity::<F32>();
    spin_under_gravity::<Fixed>();
}

fn coning_under_gravity<N: NumberSystem>(frequency_hz: f64) {
    let cone = Cone {
        omega: TAU * frequency_hz,
        angle: 0.1f64.to_radians(),
    };
    let gravity = Vector::new(0.5, 0.5, 0.7) * G;
    let motion = Motion {
        attitude: Box::new(move |t| cone.attitude(t)),
        rate: Box::new(move |t| cone.rate(t)),
        acceleration: Box::new(move |t| cone.acceleration(t)),
        force: Box::new(move |t| cone.attitude(t).inverse() * gravity),
    };
    let mean = mean_force::<N>(&motion);
    let error = mean - gravity;
    println!(
        "{} coning at {frequency_hz} Hz: error {:.2e} m/s²",
        N::NAME,
        error.norm()
    );
    assert!(
        error.norm() < FORCE_M_S2,
        "{} at {frequency_hz} Hz: {error:?}",
        N::NAME
    );
}

#[test]
fn gravity_is_the_same_under_coning_of_a_tenth_of_a_degree() {
    for frequency_hz in [15.0, 50.0, 100.0] {
        coning_under_gravity::<F32>(frequency_hz);
        coning_under_gravity::<Fixed>(frequency_hz);
    }
}
