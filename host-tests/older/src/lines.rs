//! Steady lines of a unit at rest: images of what was sampled too slowly, converters' tones, vibration.
//!
//! Enters: a [`Workbench`] on the fitted rows. Leaves: the lines as terms of the bench (a sine and a cosine each),
//! and what their frequencies have to do with one another.
//!
//! The strongest line of each gyro is refined between the bins and taken out, the noise is refitted, and so on
//! until none would come by chance in fewer than one in 1e4 recordings. A line must keep its phase through
//! the fitted time: what wanders by more cannot be predicted, and stays a location. Deliberately not here: which
//! multiple of the sampling rate an image lies at; one rate does not tell.

use std::f64::consts::TAU;

use super::declare::FAMILY_SIGNIFICANCE;
use super::empirical::{Form, Term};
use super::noise::{self, Declared};
use super::tone::Tone;
use super::workbench::{Parameters, Workbench};

/// Lines a gyro, at most: each is significant by itself; beyond this a spectrum is no set of lines.
const MOST_LINES: usize = 12;

/// Pieces of the fitted time whose phases are compared.
const PIECES: usize = 8;

/// Least share of a line's power that one phase explains: below a half, predicting it adds power.
const COHERENT: f64 = 0.5;

/// Bins on either side that say how much a line stands above what is there anyway.
const AROUND: usize = 24;

/// Bins around a line that belong to it.
const OWN_BINS: usize = 2;

/// Highest order of a relation between lines; each order more finds more by chance.
const HIGHEST_ORDER: i32 = 3;

/// A line that entered.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Gyro.
    pub axis: usize,
    /// As the expressions have it \[Hz\].
    pub frequency_hz: f64,
    /// 2 Δ ln L when it entered.
    pub ratio: f64,
    /// Chance, trials counted.
    pub p_value: f64,
}

/// Takes lines out one by one; each adds two terms to the bench, in the order of the answer.
pub fn search(
    bench: &mut Workbench,
    parameters: &Parameters,
    effects: &[usize],
    declared: &[Declared; 3],
) -> Result<Vec<Line>, String> {
    let mut lines: Vec<Line> = Vec::new();
    let mut passed_over: [Vec<usize>; 3] = Default::default();
    loop {
        let indices: Vec<usize> = parameters
            .of_all(effects)
            .into_iter()
            .chain(parameters.count()..parameters.count() + bench.terms().len())
            .collect();
        let information = bench.information();
        let solution = information.solve(&indices, &|index| {
            super::weigh::prior_width(parameters, &information, index)
        });
        let values: Vec<(usize, f64)> = indices
            .iter()
            .copied()
            .zip(solution.values.iter().copied())
            .collect();
        let left = bench.left_over(&values);
        let mut entered = false;
        for axis in 0..3 {
            let there = lines.iter().filter(|line| line.axis == axis).count();
            if there >= MOST_LINES {
                continue;
            }
            let weights = bench.noise[axis].weights(&bench.portion);
            let candidate = strongest(bench, axis, &left[axis], &weights, &mut passed_over[axis]);
            if let Some((frequency_hz, ratio, p_value)) = candidate {
                for shape in ["sine", "cosine"] {
                    let expression = format!("{shape}({frequency_hz:.7})");
                    let form = Form::Product { expression };
                    bench.add_term(Term { axis, form })?;
                }
                lines.push(Line {
                    axis,
                    frequency_hz,
                    ratio,
                    p_value,
                });
                entered = true;
            }
        }
        if !entered {
            return Ok(lines);
        }
        bench.refit_noise(effects, declared, true);
    }
}

/// Frequency, likelihood ratio and chance of the strongest steady line left on a gyro.
fn strongest(
    bench: &Workbench,
    axis: usize,
    left: &super::portion::Bins,
    weights: &[f64],
    passed_over: &mut Vec<usize>,
) -> Option<(f64, f64, f64)> {
    let portion = &bench.portion;
    let streams = &bench.scene().streams;
    let span_s = streams.end_s() - streams.start_s;
    let drift_shares = noise::drift_shares(&bench.noise[axis], portion);
    // Slower than four turns is drift, and the last bins hold no pair of phases.
    let usable =
        (4..portion.bins().saturating_sub(2)).map(|bin| (bin, left[bin].norm_sqr() * weights[bin]));
    let mut strong: Vec<(usize, f64)> = usable.collect();
    strong.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (bin, _) in strong.into_iter().take(4 * MOST_LINES) {
        if passed_over
            .iter()
            .any(|&known| known.abs_diff(bin) <= OWN_BINS)
        {
            continue;
        }
        let whitened = bench.whitened_in_time(axis, left, bin);
        let turn = |frequency_hz: f64, row: usize| {
            (TAU * frequency_hz * (streams.middle_s(row) - streams.start_s)).sin_cos()
        };
        let since_start_s = |row: usize| streams.middle_s(row) - streams.start_s;
        let furthest = 1.1 / portion.seconds();
        let tone = Tone::new(
            &whitened,
            portion.frequency_hz(bin),
            furthest,
            since_start_s,
        );
        // A tenth of the resolution of the fitted time, then a hundredth of that: strong lines are known so well.
        let mut best = (portion.frequency_hz(bin), 0.0);
        let mut width = 1.0 / portion.seconds();
        for _ in 0..2 {
            let around = best.0;
            best = (-10..=10)
                .map(|k| around + width * f64::from(k) / 10.0)
                .map(|frequency_hz| (frequency_hz, tone.ratio(frequency_hz)))
                .max_by(|a, b| a.1.total_cmp(&b.1))?;
            width /= 10.0;
        }
        let beside = Beside::new(left, weights, bin);
        let is_drift = drift_shares.get(bin).is_some_and(|share| *share > 0.5);
        let (frequency_hz, ratio) = (best.0, best.1 / beside.level(is_drift));
        let chance = beside.chance(ratio, is_drift);
        let trials = 3.0 * 3.0 * 0.5 * streams.rate_hz * span_s;
        let p_value = -(trials * (-chance).ln_1p()).exp_m1();
        if p_value >= FAMILY_SIGNIFICANCE {
            continue;
        }
        let pieces: Vec<(f64, f64)> = whitened
            .chunks(whitened.len().div_ceil(PIECES).max(1))
            .map(|piece| {
                piece.iter().fold((0.0, 0.0), |(re, im), (row, value)| {
                    let (sin, cos) = turn(frequency_hz, *row);
                    (re + value * cos, im + value * sin)
                })
            })
            .collect();
        let sum = pieces
            .iter()
            .fold((0.0, 0.0), |s, p| (s.0 + p.0, s.1 + p.1));
        let power: f64 = pieces.iter().map(|p| p.0 * p.0 + p.1 * p.1).sum();
        let coherence = (sum.0 * sum.0 + sum.1 * sum.1) / (pieces.len() as f64 * power);
        // Each bin is looked at once: one that was taken out and is still the strongest is no line.
        passed_over.push(bin);
        if coherence >= COHERENT {
            return Some((frequency_hz, ratio, p_value));
        }
    }
    None
}

/// What stands around a bin, by the median, which lines do not move.
struct Beside {
    /// Power over that of the fitted noise \[1\].
    median: f64,
    bins: usize,
}

impl Beside {
    fn new(left: &super::portion::Bins, weights: &[f64], bin: usize) -> Self {
        // Power over S is exponential with mean 2, so its median is 2 ln 2.
        let chance = 2.0 * std::f64::consts::LN_2;
        let mut powers: Vec<f64> = (bin.saturating_sub(AROUND).max(1)
            ..(bin + AROUND).min(left.len() - 1))
            .filter(|near| near.abs_diff(bin) > OWN_BINS)
            .map(|near| left[near].norm_sqr() * weights[near])
            .collect();
        powers.sort_by(f64::total_cmp);
        let median = powers.get(powers.len() / 2).copied().unwrap_or(chance);
        Self {
            median: median / chance,
            bins: powers.len(),
        }
    }

    /// Power to hold a line against, over that of the fitted noise: more where a stronger line that wanders has shoulders,
    /// less only where drift was fitted, which a slow line passes for.
    fn level(&self, is_drift: bool) -> f64 {
        match is_drift {
            true => self.median,
            false => self.median.max(1.0),
        }
    }

    /// Chance of a ratio over [`Beside::level`], which is known no better than so many bins tell.
    fn chance(&self, ratio: f64, is_drift: bool) -> f64 {
        /// Of the median of exponential numbers: its variance is (ln 2)⁻² times that of the mean.
        const EFFICIENCY: f64 = std::f64::consts::LN_2 * std::f64::consts::LN_2;
        let freedom = EFFICIENCY * self.bins as f64;
        match is_drift && self.median < 1.0 {
            true => (1.0 + 0.5 * ratio / freedom).powf(-freedom),
            false => (-0.5 * ratio).exp(),
        }
    }
}

/// How one frequency follows from stronger ones, folded at the row rate; the plainest relation first.
pub fn relation(
    frequency_hz: f64,
    stronger_hz: &[f64],
    rate_hz: f64,
    tolerance_hz: f64,
) -> Option<String> {
    let folded = |hz: f64| {
        let rest = hz.rem_euclid(rate_hz);
        rest.min(rate_hz - rest)
    };
    let near = |hz: f64| (folded(hz) - frequency_hz).abs() < tolerance_hz;
    for order in 2..=HIGHEST_ORDER {
        for (place, first) in stronger_hz.iter().enumerate() {
            if near(f64::from(order) * first) {
                return Some(format!("{order} times {first:.3} Hz"));
            }
            for second in &stronger_hz[place + 1..] {
                for a in 1..order {
                    let b = order - a;
                    for (sign, word) in [(1.0, "+"), (-1.0, "-")] {
                        if near(f64::from(a) * first + sign * f64::from(b) * second) {
                            return Some(format!(
                                "{a} x {first:.3} Hz {word} {b} x {second:.3} Hz"
                            ));
                        }
                    }
                }
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::relation;

    #[test]
    fn products_of_two_lines_are_recognised_where_they_fold_to() {
        let stronger = [9.186, 29.912];
        let of = |hz: f64| relation(hz, &stronger, 64.0, 0.004);
        assert_eq!(of(20.726).as_deref(), Some("1 x 9.186 Hz - 1 x 29.912 Hz"));
        // 2 x 29.912 = 59.824 Hz, seen at 64 - 59.824.
        assert_eq!(of(4.176).as_deref(), Some("2 times 29.912 Hz"));
        assert_eq!(of(13.3), None);
    }
}
