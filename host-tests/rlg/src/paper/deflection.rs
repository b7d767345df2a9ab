//! Reproduces Tables 1 and 2: the bending of a block under a constant angular acceleration, and its proportionality.
//!
//! A [`Deflection`] is the tilt of the simulator's block \[µrad\] at the tables' accelerations \[rad/s²\], from its
//! inertia and stiffness alone, and the settled tilt over the acceleration \[s²\].
//!
//! Equation: δ'' + 2ζω₀δ' + ω₀²δ = −ω₀²Kα with K = J/k and ω₀² = k/J, the block as an oscillator on its suspension; for a
//! constant α the settled tilt is −Kα.
//!
//! Out of scope: finite elements. The paper's points A and B lie at two heights of one bent axis, which a rigid block on a
//! spring does not have: it has the one coefficient that the paper estimates from J and k.

use super::printed::{ACCELERATIONS_RAD_S2, INERTIA_OVER_STIFFNESS_S2};
use super::unit::{MODE_DAMPING, RATE_HZ};
use crate::simulate::attitude::Quadrature;
use crate::simulate::mode::Mode;
use std::f64::consts::TAU;

/// Settling time, long enough for transients to decay: e^(−ζω₀t) = 1e-30 \[s\].
const SETTLING_S: f64 = 1.0;

/// Tilts of the block under constant acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deflection {
    /// √(k/J)/2π \[Hz\].
    pub mode_hz: f64,
    /// Tilt at each acceleration of the tables \[µrad\].
    pub tilt_urad: [f64; 4],
    /// Tilt over acceleration \[s²\].
    pub coefficient_s2: f64,
    /// Largest relative departure from proportionality over the four \[1\].
    pub nonlinearity: f64,
}

/// Simulates the block of the paper's J and k under constant accelerations.
pub fn deflection() -> Deflection {
    let omega_rad_s = 1.0 / INERTIA_OVER_STIFFNESS_S2.sqrt();
    let mode_hz = omega_rad_s / TAU;
    let tilt_rad = ACCELERATIONS_RAD_S2.map(|acceleration_rad_s2| {
        let mut mode = Mode::new(mode_hz, MODE_DAMPING, &Quadrature::new(), 1.0 / RATE_HZ);
        // driven by inertia alone: J α over J
        let drive = [acceleration_rad_s2; 4];
        let periods = (SETTLING_S * RATE_HZ) as usize;
        (0..periods).fold(0.0, |_, _| mode.advance(drive)[3][0])
    });
    let ratio = |index: usize| tilt_rad[index] / ACCELERATIONS_RAD_S2[index];
    let coefficient_s2 = (0..4).map(ratio).sum::<f64>() / 4.0;
    Deflection {
        mode_hz,
        tilt_urad: tilt_rad.map(|tilt| 1e6 * tilt),
        coefficient_s2,
        nonlinearity: (0..4)
            .map(|index| (ratio(index) / coefficient_s2 - 1.0).abs())
            .fold(0.0, f64::max),
    }
}
