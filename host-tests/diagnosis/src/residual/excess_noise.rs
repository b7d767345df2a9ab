//! Excess noise beyond the declared levels of the model and the measured levels of the reference.

use rlg_plan::{Plan, RestPlan};
use std::collections::BTreeSet;

use nalgebra::Matrix3;
use rlg_inference::{Dct, Fit, NoiseBasis, NoiseLevels, Observations};
use rlg_signal::axes::Triad;
use rlg_signal::partition::Use;
use rlg_signal::quantiles::median;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::alignment::case_motion::{Level, Motion};
use crate::rows::data::Data;
use rlg_findings::excess::excess_square;
use rlg_findings::excess::{Excess, PULSES, WALK};

/// Number of compared levels: two on each of three gyros.
const TRIALS: f64 = 6.0;

/// Compares the fitted white noise of rate and of angle with their known levels, on gyros that are not in `unlike_noise`.
/// Random walk of gyros in `locks_in` is attributed to lock-in, whose stops leave a random angle.
///
/// # Inputs
/// `explained_rad`: part of the residual by the found effects.
pub fn excess(
    data: &Data,
    fit: &Fit,
    motion: &Motion,
    (unlike_noise, locks_in): (&BTreeSet<usize>, &BTreeSet<usize>),
    explained_rad: &Triad,
    plan: &Plan,
) -> Vec<Excess> {
    let Ok(observations) = data.observed(&data.rows_of(&[Use::Fit])) else {
        return Vec::new();
    };
    let levels = Compared::new(data, fit, motion, &observations, unlike_noise, plan);
    let sensed_by = reference_noise_sensed(explained_rad, &data.streams.case_rad);
    let rate_hz = data.streams.rate_hz;
    let of_walk = compare(
        &|axis| levels.fitted(axis, 0),
        &|axis| {
            let axis = Some(axis).filter(|axis| !locks_in.contains(axis))?;
            levels.known_walk(axis, &sensed_by)
        },
        &|level| (level * rate_hz).sqrt(),
        &WALK,
        plan,
    );
    let of_angle = compare(
        &|axis| levels.highest[axis].unwrap_or_else(|| levels.fitted(axis, 1)),
        &|axis| levels.known_angle(axis, &sensed_by),
        &|level| (12.0 * level).sqrt(),
        &PULSES,
        plan,
    );
    let mut found: Vec<Excess> = of_walk.into_iter().chain(of_angle).collect();
    data.lattice.take_over(&mut found, &|axis| {
        let std = levels.fitted(axis, 1).std;
        let std = std.hypot(motion.reference_angle[axis].std);
        levels.is_counted[axis].then(|| 0.5 * (of_pulses(data, axis) / std).powi(2))
    });
    found
}

/// Power of white angle noise by the gyro's unknown pulses \[rad²\].
fn of_pulses(data: &Data, axis: usize) -> f64 {
    data.lattice.unknown_rad2(axis) / 12.0
}

/// Fitted levels of white noise of rate and of angle, and those known of model and reference.
struct Compared<'a> {
    data: &'a Data<'a>,
    fit: &'a Fit,
    motion: &'a Motion,
    /// Gyros whose residual departs from noise.
    unlike_noise: &'a BTreeSet<usize>,
    basis: NoiseBasis,
    /// Gyros whose increments are counted by pulses of unknown size.
    is_counted: [bool; 3],
    /// Level of the highest octaves at rest, which they may determine for a gyro that departs from noise elsewhere.
    highest: [Option<Level>; 3],
}

impl<'a> Compared<'a> {
    fn new(
        data: &'a Data<'a>,
        fit: &'a Fit,
        motion: &'a Motion,
        observations: &Observations,
        unlike_noise: &'a BTreeSet<usize>,
        plan: &Plan,
    ) -> Self {
        let is_at_rest = data.streams.at_rest.is_some();
        // Rounding of rates without counting leaves an unbounded angle error.
        let is_counted = |axis: usize| match is_at_rest {
            true => is_bounded(&data.residual_rad[axis], observations, &plan.rest),
            false => {
                let least = plan.judgement.lattice.counted_share * of_pulses(data, axis);
                fit.levels[axis].angle > least
            }
        };
        let highest = |axis: usize| {
            let asked = is_at_rest && unlike_noise.contains(&axis);
            asked.then(|| angle_of_highest(&data.residual_rad[axis], observations, plan))?
        };
        Self {
            basis: NoiseBasis::new(observations),
            is_counted: [0, 1, 2]
                .map(|axis| data.lattice.pulse_rad[axis] > 0.0 && is_counted(axis)),
            highest: [0, 1, 2].map(highest),
            data,
            fit,
            motion,
            unlike_noise,
        }
    }

    fn fitted(&self, axis: usize, term: usize) -> Level {
        let levels = self.fit.levels[axis];
        Level {
            value: levels.as_array()[term],
            std: level_std(&self.basis, levels, term),
        }
    }

    /// True of a gyro with coarse pulses: their quantisation tones overlap the band of a random walk, and their weight follows
    /// from the values. Increments that are not counted have an unknown resolution.
    fn is_coarse(&self, axis: usize) -> bool {
        self.is_counted[axis] || self.data.lattice.is_rare[axis]
    }

    /// Known white rate noise of a gyro \[rad²\]; `None` if it is not to be compared.
    fn known_walk(&self, axis: usize, sensed_by: &Matrix3<f64>) -> Option<Level> {
        if self.unlike_noise.contains(&axis) || self.is_coarse(axis) {
            return None;
        }
        let (model, rate_hz) = (self.data.model, self.data.streams.rate_hz);
        let own = model.gyro.angle_random_walk_rad_sqrt_s?[axis].powi(2) / rate_hz;
        let more = excess_square(model, "angle_random_walk", axis) / rate_hz;
        let of_reference = of_reference(&self.motion.reference_walk, axis, sensed_by);
        Some(known(own + more, of_reference))
    }

    /// Known white angle noise of a gyro \[rad²\]; `None` if it is not to be compared.
    fn known_angle(&self, axis: usize, sensed_by: &Matrix3<f64>) -> Option<Level> {
        if self.unlike_noise.contains(&axis) && self.highest[axis].is_none() {
            return None;
        }
        let Data { streams, model, .. } = self.data;
        // At rest only the gyro makes angle noise, so a declared resolution is known of increments, too.
        let pulse_rad = match streams.at_rest {
            Some(_) => model.gyro.pulse_weight_rad[axis],
            None => streams.pulse_rad[axis],
        };
        let pulses = pulse_rad.powi(2) / 12.0;
        let pickoff = if self.data.dither_rad.is_some() {
            model.pickoff_white_rad2(axis)
        } else {
            0.0
        };
        let more = excess_square(model, "pulse_quantisation", axis) / 12.0;
        (pulses > 0.0 && !self.is_coarse(axis)).then(|| {
            let of_reference = of_reference(&self.motion.reference_angle, axis, sensed_by);
            known(pulses + pickoff + more, of_reference)
        })
    }
}

/// Noise of the reference in the residual of a gyro.
fn of_reference(levels: &[Level; 3], gyro: usize, sensed_by: &Matrix3<f64>) -> Level {
    let of_axis = |axis: usize| {
        let gain = sensed_by[(gyro, axis)].powi(2);
        [gain * levels[axis].value, gain * levels[axis].std]
    };
    let each = [0, 1, 2].map(of_axis);
    Level {
        value: each.iter().map(|[value, _]| value).sum(),
        std: each.iter().fold(0.0, |sum, [_, std]| std.hypot(sum)),
    }
}

/// Gains of the reference's noise in the gyros' residuals: 1, and what the explained part of a residual follows of the
/// reference, as scale and misalignment multiply the motion with its noise. Row of a gyro, column of an axis.
fn reference_noise_sensed(explained_rad: &Triad, reference_rad: &Triad) -> Matrix3<f64> {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let own = Matrix3::from_fn(|a, b| product(&reference_rad[a], &reference_rad[b]));
    let both = Matrix3::from_fn(|gyro, axis| product(&explained_rad[gyro], &reference_rad[axis]));
    // An axis without any reading has no noise.
    let inverse = own.pseudo_inverse(1e-12 * own.trace());
    Matrix3::identity() + both * inverse.unwrap_or_else(|_| Matrix3::zeros())
}

/// True if increments are those of a bounded angle, as counting makes: some octave then holds less power than an even share.
/// With rare pulses, neither they nor their angle are white, and no noise level decides it.
fn is_bounded(increments_rad: &[f64], observations: &Observations, plan: &RestPlan) -> bool {
    let least = plan.bounded_first;
    observations.spans.iter().any(|span| {
        let mut power = span.bridge(increments_rad);
        Dct::new(power.len()).forward(&mut power);
        power.iter_mut().for_each(|one| *one *= *one);
        let mean = |powers: &[f64]| powers.iter().sum::<f64>() / powers.len() as f64;
        let even = mean(&power[least.min(power.len())..]);
        let octaves = (0..).map(|octave| least << octave..(2 * least) << octave);
        let mut whole = octaves.take_while(|octave| octave.end <= power.len());
        whole.any(|octave| {
            let std = (2.0 / octave.len() as f64).sqrt();
            mean(&power[octave]) < (1.0 - plan.bounded_deficit * std) * even
        })
    })
}

/// Estimates white angle noise in the two highest octaves, by medians, robust to narrow bands and bursts; `None` where their
/// power does not grow as that of angle noise.
fn angle_of_highest(
    increments_rad: &[f64],
    observations: &Observations,
    plan: &Plan,
) -> Option<Level> {
    /// Median of a squared standard normal variable.
    const MEDIAN: f64 = 0.454_936;
    /// Standard deviation of the median of such variables over that of their mean.
    const SPREAD: f64 = 1.363;
    let [span] = observations.spans.as_slice() else {
        return None;
    };
    let mut spectrum = span.bridge(increments_rad);
    let rows = spectrum.len();
    Dct::new(rows).forward(&mut spectrum);
    let level = |from: usize, to: usize| {
        let of = |k: usize| {
            let sine = (0.5 * std::f64::consts::PI * k as f64 / rows as f64).sin();
            spectrum[k].powi(2) / (4.0 * sine * sine)
        };
        let median = median((from..to).map(of)).unwrap_or(0.0);
        let count = (to - from) as f64;
        let value = median / MEDIAN;
        Level {
            value,
            std: value * SPREAD * (2.0 / count).sqrt(),
        }
    };
    if rows < 64 {
        return None;
    }
    let [lower, upper] = [level(rows / 4, rows / 2), level(rows / 2, rows)];
    let ratio = (lower.value / upper.value).max(upper.value / lower.value);
    (ratio < plan.judgement.same_angle_ratio).then(|| level(rows / 4, rows))
}

fn known(own: f64, reference: Level) -> Level {
    Level {
        value: own + reference.value,
        std: reference.std,
    }
}

fn compare(
    fitted: &dyn Fn(usize) -> Level,
    known: &dyn Fn(usize) -> Option<Level>,
    in_unit: &dyn Fn(f64) -> f64,
    kind: &Excess,
    plan: &Plan,
) -> Option<Excess> {
    let mut found = kind.clone();
    let mut any = false;
    for axis in 0..3 {
        let Some(known) = known(axis) else { continue };
        let fitted = fitted(axis);
        let std = fitted.std.hypot(known.std);
        let more = fitted.value - known.value;
        let size = more / std;
        if size < plan.judgement.excess_noise
            || fitted.value < plan.judgement.excess_ratio * known.value
        {
            continue;
        }
        found.values[axis] = in_unit(more);
        // d√x = dx/(2√x).
        found.stds[axis] = found.values[axis] * 0.5 * std / more;
        let chance = Normal::standard().sf(size);
        found.p_value = found.p_value.min((TRIALS * chance).min(1.0));
        found.log_likelihood_gain += 0.5 * size * size;
        any = true;
    }
    any.then_some(found)
}

/// Standard deviation of a fitted level, from the Fisher information of white noise of rate and of angle.
fn level_std(basis: &NoiseBasis, levels: NoiseLevels, term: usize) -> f64 {
    let power = basis.binned(levels);
    let information = |a: usize, b: usize| -> f64 {
        let bins = power.iter().zip(&basis.counts).enumerate();
        bins.map(|(bin, (s, count))| {
            0.5 * count * basis.power[a][bin] * basis.power[b][bin] / (s * s)
        })
        .sum()
    };
    let (own, other, both) = (
        information(term, term),
        information(1 - term, 1 - term),
        information(0, 1),
    );
    (other / (own * other - both * both)).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rlg_inference::Observations;

    use rlg_plan::RestPlan;

    use super::{is_bounded, reference_noise_sensed};

    #[test]
    fn pulses_that_come_rarely_are_bounded_and_rounded_rates_are_not() {
        const ROWS: usize = 6000;
        let observations = Observations::bridged(&[true; ROWS]).expect("rows");
        for seed in 0..12 {
            let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            // A thirtieth of a pulse a row.
            let noise = StandardNormal.sample_iter(rng).map(|one: f64| one / 30.0);
            let noise: Vec<f64> = noise.take(ROWS).collect();
            let mut angle = 0.5;
            let counts = noise.iter().map(|noise| {
                let before = f64::floor(angle);
                angle += 0.02 + noise;
                angle.floor() - before
            });
            let counts: Vec<f64> = counts.collect();
            assert!(
                is_bounded(&counts, &observations, &RestPlan::default()),
                "{seed}"
            );
            let rounded: Vec<f64> = noise.iter().map(|one| (one + 0.45).round()).collect();
            assert!(
                !is_bounded(&rounded, &observations, &RestPlan::default()),
                "{seed}"
            );
        }
    }

    #[test]
    fn a_scale_and_a_turn_multiply_the_noise_of_the_reference() {
        let normal = |seed: u64| -> Vec<f64> {
            let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            StandardNormal.sample_iter(rng).take(500).collect()
        };
        // The third axis reads nothing.
        let reference = [normal(1), normal(2), vec![0.0; 500]];
        let of = |x: f64, y: f64| -> Vec<f64> {
            let both = reference[0].iter().zip(&reference[1]);
            both.map(|(on_x, on_y)| x * on_x + y * on_y).collect()
        };
        let explained = [of(0.2, 0.0), of(0.01, -0.3), vec![0.0; 500]];
        let gain = reference_noise_sensed(&explained, &reference);
        for (at, right) in [((0, 0), 1.2), ((1, 0), 0.01), ((1, 1), 0.7), ((2, 2), 1.0)] {
            assert!((gain[at] - right).abs() < 1e-9, "{at:?}: {gain}");
        }
    }
}
