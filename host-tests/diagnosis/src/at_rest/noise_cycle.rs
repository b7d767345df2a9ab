//! Noise whose power is periodic in the rows: the trace of a resampling.
//!
//! The power of row k goes as 1 + a cos(2π k m/n + phase) with small n. Interpolated rows that fall on a sample of the
//! source keep its noise, rows between samples average that of their neighbours, so rows at rate r made from a source at
//! rate s show the beat |s − r m'| of the two: the source ran at r (k ± m/n) for some whole k. The rows alone do not
//! determine k.

use std::f64::consts::TAU;
use std::ops::Range;

use realfft::num_complex::Complex64;
use rlg_plan::CyclePlan;
use rlg_signal::quantiles::median;
use rlg_signal::streams::Triad;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Cycle of the noise's power.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Cycle {
    /// m, in turns of `rows` rows.
    pub turns: usize,
    /// n \[rows\].
    pub rows: usize,
    /// a of x, y, z on the fitted rows \[1\].
    pub amplitude: [f64; 3],
    /// Its standard deviation \[1\].
    pub std: [f64; 3],
    /// a of x, y, z on the held-out rows, along the phase of the fitted ones \[1\].
    pub held_out: [f64; 3],
    /// Gain in log likelihood of the held-out rows' powers by the fitted cycle over none, jolts clipped.
    pub held_out_gain: f64,
    /// Smallest p-value among the gyros, trials counted.
    pub p_value: f64,
}

/// Finds cycles on the fitted rows, and measures them again on those held out.
pub(super) fn cycles(
    residual_rad: &Triad,
    fitted: &[Range<usize>],
    held_out: &[Range<usize>],
    plan: &CyclePlan,
) -> Vec<Cycle> {
    let squares =
        |axis: usize, ranges: &[Range<usize>]| squares(&residual_rad[axis], ranges, plan.jolt);
    let fractions: Vec<(usize, usize)> = (2..=plan.longest_rows)
        .flat_map(|rows| (1..=rows / 2).map(move |turns| (turns, rows)))
        .filter(|&(turns, rows)| (2..=turns).all(|d| turns % d != 0 || rows % d != 0))
        .collect();
    let neighbours = plan.neighbours as i32;
    let trials = 3.0 * fractions.len() as f64;
    let before: Vec<_> = (0..3).map(|axis| squares(axis, fitted)).collect();
    let after: Vec<_> = (0..3).map(|axis| squares(axis, held_out)).collect();
    fractions
        .into_iter()
        .filter_map(|(turns, rows)| {
            let mut cycle = Cycle {
                turns,
                rows,
                amplitude: [0.0; 3],
                std: [0.0; 3],
                held_out: [0.0; 3],
                held_out_gain: 0.0,
                p_value: 1.0,
            };
            for axis in 0..3 {
                let count = before[axis].len();
                if count < 100 * rows || after[axis].len() < 100 * rows {
                    return None;
                }
                let turn = turns as f64 / rows as f64;
                let turned = Turned::new(&before[axis], turn, neighbours);
                let own = turned.amplitude(0);
                // The nearest neighbours may hold leakage of the line itself.
                let chance_power = (2..2 + neighbours / 2)
                    .flat_map(|shift| [shift, -shift])
                    .map(|shift| turned.amplitude(shift).norm_sqr())
                    .sum::<f64>()
                    / f64::from(neighbours);
                cycle.amplitude[axis] = own.norm();
                cycle.std[axis] = (0.5 * chance_power).sqrt();
                let p = (trials * chance(own.norm_sqr() / chance_power, turns, rows)).min(1.0);
                cycle.p_value = cycle.p_value.min(p);
                let again = Turned::new(&after[axis], turn, neighbours).amplitude(0);
                cycle.held_out_gain += gain(&after[axis], turn, own, plan.least_power);
                cycle.held_out[axis] =
                    (own.re * again.re + own.im * again.im) / own.norm().max(f64::MIN_POSITIVE);
            }
            // A cycle must also gain on the held-out rows.
            let goes_on = cycle.held_out_gain > 0.0;
            (cycle.p_value < plan.cycle_chance && goes_on).then_some(cycle)
        })
        .collect()
}

/// Probability that noise exceeds its mean power this many times: of sine and cosine, or at two rows a turn of the cosine
/// alone.
fn chance(power: f64, turns: usize, rows: usize) -> f64 {
    let parts = if 2 * turns == rows { 1.0 } else { 2.0 };
    ChiSquared::new(parts).map_or(1.0, |law| law.sf(parts * power))
}

/// (row, squared value over their mean) of some rows; jolts clipped, so that none decides.
fn squares(values: &[f64], ranges: &[Range<usize>], jolt: f64) -> Vec<(usize, f64)> {
    let rows: Vec<usize> = ranges.iter().flat_map(Clone::clone).collect();
    let squares = rows.iter().map(|&row| values[row] * values[row]);
    let median = median(squares).unwrap_or(0.0);
    let held = |row: usize| (values[row] * values[row]).min(jolt * median);
    let mean = rows.iter().map(|&row| held(row)).sum::<f64>() / rows.len().max(1) as f64;
    rows.iter()
        .map(|&row| (row, held(row) / mean.max(f64::MIN_POSITIVE)))
        .collect()
}

/// Log-likelihood ratio of normal rows with the cycle's power to rows with a constant power.
fn gain(squares: &[(usize, f64)], turn: f64, own: Complex64, least: f64) -> f64 {
    squares
        .iter()
        .map(|(row, value)| {
            let (sin, cos) = (TAU * (turn * *row as f64).fract()).sin_cos();
            let power = (1.0 + own.re * cos + own.im * sin).max(least);
            -0.5 * (power.ln() + value * (1.0 / power - 1.0))
        })
        .sum()
}

/// Powers demodulated at one frequency and summed in short runs: nearby frequencies cost one rotation per run.
struct Turned {
    count: usize,
    /// Middle \[rows\] and sum of each run.
    runs: Vec<(f64, Complex64)>,
}

impl Turned {
    fn new(squares: &[(usize, f64)], turn: f64, neighbours: i32) -> Self {
        /// Rotation of the furthest neighbour over a run \[rad\], at the cost of parts in 1e4 of its power.
        const RUN_TURN_RAD: f64 = 0.05;
        let furthest = TAU * f64::from(2 + neighbours / 2) / squares.len() as f64;
        let run_rows = ((RUN_TURN_RAD / furthest) as usize).max(1);
        let turned = |(row, value): &(usize, f64)| {
            Complex64::cis(TAU * (turn * *row as f64).fract()) * (value - 1.0)
        };
        // A run ends at a gap, so that its middle is the middle of its rows.
        let stretches = squares.chunk_by(|a, b| a.0 + 1 == b.0);
        let runs = stretches.flat_map(|stretch| stretch.chunks(run_rows));
        let runs = runs.map(|run| {
            let middle = 0.5 * (run[0].0 + run[run.len() - 1].0) as f64;
            (middle, run.iter().map(turned).sum())
        });
        Self {
            count: squares.len(),
            runs: runs.collect(),
        }
    }

    /// 2 <power · exp(i 2π k f)> over rows k, f `shift` turns over all rows beside the own frequency.
    fn amplitude(&self, shift: i32) -> Complex64 {
        let turn = TAU * f64::from(shift) / self.count as f64;
        let each = self.runs.iter();
        let sum: Complex64 = each
            .map(|(middle, run)| run * Complex64::cis(turn * middle))
            .sum();
        sum * (2.0 / self.count.max(1) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;
    use rand_distr::{Distribution as _, StandardNormal};

    #[test]
    fn a_source_at_five_quarters_of_the_rate_shows_a_cycle_of_four_rows_and_a_shuffled_one_none() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let source: Vec<f64> = (0..60_000)
            .map(|_| StandardNormal.sample(&mut random))
            .collect();
        let resampled: Vec<f64> = (0..40_000)
            .map(|row| {
                let at = row as f64 * 1.25;
                let (first, share) = (at as usize, at.fract());
                source[first] + share * (source[first + 1] - source[first])
            })
            .collect();
        let halves = [0..20_000, 20_000..40_000].map(|half| vec![half]);
        let of = |values: Vec<f64>| {
            let triad = [values.clone(), values.clone(), values];
            cycles(&triad, &halves[0], &halves[1], &CyclePlan::default())
        };
        let found = of(resampled);
        assert!(
            found
                .iter()
                .any(|cycle| (cycle.turns, cycle.rows) == (1, 4))
        );
        // Straight lines leave noise powers 1, 5/8, 1/2, 5/8: first harmonic (1 - 1/2)/2 over their mean, 11/16.
        let quarter = found.iter().find(|c| (c.turns, c.rows) == (1, 4));
        let quarter = quarter.expect("a cycle of four rows");
        assert!((quarter.amplitude[0] - 0.364).abs() < 0.05, "{quarter:?}");
        assert!((quarter.held_out[0] - 0.364).abs() < 0.05, "{quarter:?}");
        // Three gyros, 20000 rows, -<ln(1 + a cos)>/2 = a²/8 a row where a is small; half of it allows for chance.
        assert!(quarter.held_out_gain > 0.5 * 3.0 * 20_000.0 * 0.364_f64.powi(2) / 8.0);
        assert!(of(source[..40_000].to_vec()).is_empty());
    }
}
