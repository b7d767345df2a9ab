//! Moves feasible on the turntable, with their information on the six K per second.
//!
//! From [`Limits`] and the noise of a row, [`Candidate`]s at the limits: spin-synchronous oscillations of every pair of
//! axes at several rates, cones about every axis at several frequencies.
//!
//! Information of a line of amplitude A (rate per unit K, rad/s per s²) at frequency f: A²/(2 S(f)) a second, A²/S(0) for a
//! mean, with S the power spectral density of the rate noise. Spin Ω about k, α about j: A = α Ω on K_ij, at f. Cone about
//! i with Ω and φ: Ω³φ²/2 on each of K_ij and K_ik, in phase in the mean and opposed at 2f.

use std::f64::consts::TAU;

use nalgebra::DMatrix;

use super::limits::Limits;
use crate::noise::DeclaredNoise;
use crate::unknowns::{COEFFICIENTS, PAIRS};
use rlg_catalogue::moves::{Kind, Move, STEEPEST};

/// Shares of the largest rate that are tried for the spin.
const SPINS: [f64; 6] = [1.0, 0.8, 0.6, 0.45, 0.3, 0.2];

/// Cone frequencies that are tried, over the one with rate and acceleration both at their limit: higher ones rectify less,
/// but separate the line at twice their frequency from slow noise.
const CONES: [f64; 5] = [1.0, 1.5, 2.0, 3.0, 5.0];

/// Factor of the ramps' length over the limit, against rounding.
const MARGIN: f64 = 1.02;

/// One kind of move.
#[derive(Clone)]
pub struct Candidate {
    /// Variants that share the candidate's time equally: both senses.
    pub variants: Vec<Kind>,
    /// Ramp at either end of each variant \[s\].
    pub ramp_s: f64,
    /// Information on the six K per second \[1/s⁴\].
    pub information_per_s: DMatrix<f64>,
}

impl Candidate {
    /// Move of a variant, for `plateau_s` at full motion.
    pub fn moved(&self, variant: usize, plateau_s: f64) -> Move {
        Move {
            kind: self.variants[variant],
            duration_s: plateau_s + 2.0 * self.ramp_s,
            ramp_s: self.ramp_s,
        }
    }
}

/// All candidates for one gyro noise per axis.
pub fn candidates(limits: &Limits, noise: &[DeclaredNoise; 3]) -> Vec<Candidate> {
    let mut all = Vec::new();
    for (k, (gyro, across)) in PAIRS.iter().enumerate() {
        let axis = 3 - gyro - across;
        for share in SPINS {
            all.extend(spin(limits, &noise[*gyro], k, axis, *across, share));
        }
    }
    for (axis, noise) in noise.iter().enumerate() {
        for factor in CONES {
            all.extend(cone(limits, noise, axis, factor));
        }
    }
    all
}

/// Largest rate amplitude of an oscillation of `omega_rad_s` that starts within `ramp_s`.
fn amplitude(limits: &Limits, omega_rad_s: f64, ramp_s: f64) -> f64 {
    let steepest = omega_rad_s.hypot(STEEPEST / ramp_s) * MARGIN;
    (limits.greatest_acceleration_rad_s2 / steepest)
        .min(limits.greatest_rate_rad_s)
        .min(limits.greatest_angle_rad * omega_rad_s)
}

fn spin(
    limits: &Limits,
    noise: &DeclaredNoise,
    k: usize,
    axis: usize,
    across: usize,
    share: f64,
) -> Option<Candidate> {
    let rate_rad_s = share * limits.greatest_rate_rad_s / MARGIN;
    let frequency_hz = rate_rad_s / TAU;
    if frequency_hz > limits.greatest_frequency_hz {
        return None;
    }
    let ramp_s = rounded_up(MARGIN * STEEPEST * rate_rad_s / limits.greatest_acceleration_rad_s2);
    let rate_amplitude = amplitude(limits, rate_rad_s, ramp_s);
    let column = rate_amplitude * rate_rad_s * rate_rad_s;
    let mut information_per_s = DMatrix::zeros(COEFFICIENTS, COEFFICIENTS);
    information_per_s[(k, k)] =
        0.5 * column * column / noise.rate_power(frequency_hz, limits.rate_hz);
    let variant = |sense: f64, phase_rad: f64| Kind::Spin {
        axis,
        rate_rad_s: sense * rate_rad_s,
        across,
        frequency_hz,
        angle_rad: rate_amplitude / rate_rad_s,
        phase_rad,
    };
    Some(Candidate {
        // Against attitudes, the two phases show drift about two inertial axes.
        variants: vec![variant(1.0, 0.0), variant(-1.0, TAU / 4.0)],
        ramp_s,
        information_per_s,
    })
}

fn cone(limits: &Limits, noise: &DeclaredNoise, axis: usize, factor: f64) -> Option<Candidate> {
    // Below this frequency the rate (or the angle) is the limit, and the column decreases with the frequency.
    let corner_hz = (limits.greatest_acceleration_rad_s2 / limits.greatest_rate_rad_s / TAU)
        .max((limits.greatest_acceleration_rad_s2 / limits.greatest_angle_rad).sqrt() / TAU)
        .min(limits.greatest_frequency_hz);
    let frequency_hz = factor * corner_hz;
    if frequency_hz > limits.greatest_frequency_hz {
        return None;
    }
    let omega = TAU * frequency_hz;
    // The cone opens over three turns.
    let ramp_s = rounded_up(3.0 / frequency_hz);
    let angle_rad = amplitude(limits, omega, ramp_s) / omega;
    let column = 0.5 * omega.powi(3) * angle_rad * angle_rad;
    let mean = column * column / noise.rate_power(0.0, limits.rate_hz);
    let line = 0.5 * column * column / noise.rate_power(2.0 * frequency_hz, limits.rate_hz);
    let mut information_per_s = DMatrix::zeros(COEFFICIENTS, COEFFICIENTS);
    let (a, b) = (2 * axis, 2 * axis + 1);
    for (row, other, value) in [
        (a, a, mean + line),
        (b, b, mean + line),
        (a, b, mean - line),
        (b, a, mean - line),
    ] {
        information_per_s[(row, other)] = value;
    }
    Some(Candidate {
        variants: vec![Kind::Coning {
            axis,
            frequency_hz,
            angle_rad,
        }],
        ramp_s,
        information_per_s,
    })
}

/// Durations are quarters of a second: whole rows at any sample rate that is a multiple of 4 Hz.
pub fn rounded_up(seconds: f64) -> f64 {
    (4.0 * seconds).ceil() / 4.0
}
