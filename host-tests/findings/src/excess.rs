//! Noise beyond the model's declared levels, as a finding: random walk (`angle_random_walk`, which lock-in imitates)
//! and white angle noise (`pulse_quantisation`: a quantisation step q has variance q²/12).

use rlg_model::{EffectValue, Model};
use rlg_recording::AXES;

/// Excess noise of one kind on the three gyros.
#[derive(Debug, Clone)]
pub struct Excess {
    /// The contract's kind.
    pub kind: &'static str,
    /// Kinds with the same spectrum.
    pub indistinguishable_from: &'static [&'static str],
    /// Its equation.
    pub equation: &'static str,
    /// Unit of its parameters.
    pub unit: &'static str,
    /// Excess on x, y, z; 0 if the declared level suffices.
    pub values: [f64; 3],
    /// Their standard deviations.
    pub stds: [f64; 3],
    /// p-value of the strongest gyro's excess, corrected for all levels and gyros.
    pub p_value: f64,
    /// Δ ln L of all gyros.
    pub log_likelihood_gain: f64,
    /// Explanation for a navigation engineer.
    pub left_out: &'static str,
}

impl Excess {
    /// Kind without an estimate.
    const fn of(
        kind: &'static str,
        indistinguishable_from: &'static [&'static str],
        equation: &'static str,
        unit: &'static str,
        left_out: &'static str,
    ) -> Self {
        Self {
            kind,
            indistinguishable_from,
            equation,
            unit,
            values: [0.0; 3],
            stds: [0.0; 3],
            p_value: 1.0,
            log_likelihood_gain: 0.0,
            left_out,
        }
    }
}

/// Angle random walk, which lock-in imitates.
pub const WALK: Excess = Excess::of(
    "angle_random_walk",
    &["lock_in"],
    "angle random walk beyond the model's, added in square",
    "rad/sqrt(s)",
    "The gyro has more angle random walk than the model declares, as lock-in leaves behind when the dither is too small or too regular.",
);

/// White angle noise, as of pulse quantisation.
pub const PULSES: Excess = Excess::of(
    "pulse_quantisation",
    &[],
    "white angle noise of q^2/12 beyond the model's",
    "rad",
    "A channel is coarser than the model declares: white noise of angle, as a pulse converter with a larger pulse leaves behind.",
);

/// Square of the noise of one kind on one gyro, summed over the model's effects.
pub fn excess_square(model: &Model, kind: &str, axis: usize) -> f64 {
    model
        .effects
        .iter()
        .filter(|effect| effect.kind == kind)
        .filter_map(|effect| match effect.parameters.get(AXES[axis]) {
            Some(EffectValue::Number(value)) => Some(value * value),
            _ => None,
        })
        .sum()
}
