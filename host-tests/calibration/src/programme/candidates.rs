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
use rlg_plan::ProgrammePlan;

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
pub fn candidates(
    limits: &Limits,
    noise: &[DeclaredNoise; 3],
    plan: &ProgrammePlan,
) -> Vec<Candidate> {
    let table = Table { limits, plan };
    let mut all = Vec::new();
    for (k, (gyro, across)) in PAIRS.iter().enumerate() {
        let axis = 3 - gyro - across;
        for share in plan.spins {
            all.extend(table.spin(&noise[*gyro], k, axis, *across, share));
        }
    }
    for (axis, noise) in noise.iter().enumerate() {
        for factor in plan.cones {
            all.extend(table.cone(noise, axis, factor));
        }
    }
    all
}

/// Turntable.
struct Table<'a> {
    limits: &'a Limits,
    plan: &'a ProgrammePlan,
}

impl Table<'_> {
    /// Largest rate amplitude of an oscillation of `omega_rad_s` that starts within `ramp_s`.
    fn amplitude(&self, omega_rad_s: f64, ramp_s: f64) -> f64 {
        let limits = self.limits;
        let steepest = omega_rad_s.hypot(STEEPEST / ramp_s) * self.plan.margin;
        (limits.greatest_acceleration_rad_s2 / steepest)
            .min(limits.greatest_rate_rad_s)
            .min(limits.greatest_angle_rad * omega_rad_s)
    }

    /// Spin with an oscillation of the same frequency across it; `share` of the largest rate.
    fn spin(
        &self,
        noise: &DeclaredNoise,
        k: usize,
        axis: usize,
        across: usize,
        share: f64,
    ) -> Option<Candidate> {
        let (limits, margin) = (self.limits, self.plan.margin);
        let rate_rad_s = share * limits.greatest_rate_rad_s / margin;
        let frequency_hz = rate_rad_s / TAU;
        if frequency_hz > limits.greatest_frequency_hz {
            return None;
        }
        let ramp_s = rounded_up(
            margin * STEEPEST * rate_rad_s / limits.greatest_acceleration_rad_s2,
            self.plan,
        );
        let rate_amplitude = self.amplitude(rate_rad_s, ramp_s);
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

    /// Cone at `factor` times the frequency with rate and acceleration both at their limit.
    fn cone(&self, noise: &DeclaredNoise, axis: usize, factor: f64) -> Option<Candidate> {
        let limits = self.limits;
        // Below this frequency the rate (or the angle) is the limit, and the column decreases with the frequency.
        let corner_hz = (limits.greatest_acceleration_rad_s2 / limits.greatest_rate_rad_s / TAU)
            .max((limits.greatest_acceleration_rad_s2 / limits.greatest_angle_rad).sqrt() / TAU)
            .min(limits.greatest_frequency_hz);
        let frequency_hz = factor * corner_hz;
        if frequency_hz > limits.greatest_frequency_hz {
            return None;
        }
        let omega = TAU * frequency_hz;
        let ramp_s = rounded_up(self.plan.cone_turns / frequency_hz, self.plan);
        let angle_rad = self.amplitude(omega, ramp_s) / omega;
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
}

/// Rounds a duration up to the grid of durations \[s\].
pub fn rounded_up(seconds: f64, plan: &ProgrammePlan) -> f64 {
    (seconds / plan.grid_s).ceil() * plan.grid_s
}
