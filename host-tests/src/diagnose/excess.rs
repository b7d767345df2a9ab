//! Noise beyond what the model declares: physics that shows only in the spectrum.
//!
//! Enters: fitted and declared noise. Leaves: [`Excess`] of random walk (`angle_random_walk`, which lock-in
//! imitates) and of white angle noise (`pulse_quantisation`: a step q leaves q²/12), in units of their kinds.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::noise::{self, Declared, Noise};
use super::portion::{Bins, Portion};

/// Effects that change the noise and nothing else: no prediction, only a level.
pub const NOISE_KINDS: [&str; 2] = ["angle_random_walk", "pulse_quantisation"];

/// An excess of one kind on the three gyros.
#[derive(Debug, Clone)]
pub struct Excess {
    /// The contract's kind.
    pub kind: &'static str,
    /// Kinds that look the same in a spectrum.
    pub indistinguishable_from: &'static [&'static str],
    /// Its equation.
    pub equation: &'static str,
    /// Unit of its parameters.
    pub unit: &'static str,
    /// x, y, z; 0 where the declared level stands.
    pub values: [f64; 3],
    /// Their standard deviations.
    pub stds: [f64; 3],
    /// Chance of the strongest gyro's excess, all levels and gyros counted.
    pub p_value: f64,
    /// Δ ln L of all gyros.
    pub log_likelihood_gain: f64,
    /// For a navigation engineer.
    pub left_out: &'static str,
}

/// Levels that are compared: two on each of three gyros.
const TRIALS: f64 = 6.0;

/// Compares fitted with declared levels in what everything found leaves. The noise fit keeps a declared level
/// unless the data contradict it, so whatever differs here is significant already.
pub fn excess(
    noise: &[Noise; 3],
    declared: &[Declared; 3],
    portion: &Portion,
    left: &[Bins; 3],
) -> Vec<Excess> {
    /// Less than a tenth more noise is no finding.
    const LEAST: f64 = 1.1;
    let mut found = Vec::new();
    let mut compare = |term: usize,
                       of: &dyn Fn(&Declared) -> Option<f64>,
                       unit_of: &dyn Fn(f64, f64) -> f64,
                       mut entry: Excess| {
        let mut any = false;
        for axis in 0..3 {
            let Some(level) = of(&declared[axis]) else {
                continue;
            };
            let fitted = noise[axis].theta[term];
            if fitted > LEAST * level {
                entry.values[axis] = unit_of(fitted - level, noise[axis].rate_hz);
                // d√(θ − θ0) = dθ/(2 √(θ − θ0)).
                let error = noise::level_error(&noise[axis], portion, term);
                entry.stds[axis] = entry.values[axis] * 0.5 * fitted / (fitted - level) * error;
                let ratio =
                    noise::ratio_over_level(portion, &left[axis], &noise[axis], term, level);
                // More noise only, so half of the two-sided chance.
                let chance = 0.5 * ChiSquared::new(1.0).map_or(1.0, |law| law.sf(ratio));
                let p_value = -(TRIALS * (-chance).ln_1p()).exp_m1();
                entry.p_value = entry.p_value.min(p_value);
                entry.log_likelihood_gain += 0.5 * ratio;
                any = true;
            }
        }
        if any {
            found.push(entry);
        }
    };
    compare(
        0,
        &|declared| declared.random_walk,
        &|theta, rate_hz| (theta * rate_hz).sqrt(),
        Excess {
            kind: "angle_random_walk",
            indistinguishable_from: &["lock_in"],
            equation: "angle random walk beyond the model's, added in square",
            unit: "rad/sqrt(s)",
            values: [0.0; 3],
            stds: [0.0; 3],
            p_value: 1.0,
            log_likelihood_gain: 0.0,
            left_out: "The gyro has more angle random walk than the model declares, as lock-in leaves behind when the dither is too small or too regular.",
        },
    );
    compare(
        1,
        &|declared| declared.white_angle,
        &|theta, _| (12.0 * theta).sqrt(),
        Excess {
            kind: "pulse_quantisation",
            indistinguishable_from: &[],
            equation: "white angle noise of q^2/12 beyond the model's",
            unit: "rad",
            values: [0.0; 3],
            stds: [0.0; 3],
            p_value: 1.0,
            log_likelihood_gain: 0.0,
            left_out: "A channel is coarser than the model declares: white noise of angle, as a pulse converter with a larger pulse leaves behind.",
        },
    );
    found
}
