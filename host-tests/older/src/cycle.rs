//! Noise whose power goes round with the rows: the trace of a resampling.
//!
//! Enters: a residual \[rad per row\] and the rows to look at. Leaves: [`Cycle`]s: the power of row k goes as
//! 1 + a cos(2π k m/n + phase) with small n. Interpolated rows that fall on a sample of the source keep its noise,
//! rows between samples share that of their neighbours, so rows at rate r made from a source at rate s show the
//! beat |s − r m'| of the two: the source ran at r (k ± m/n) for some whole k. Which k, the rows alone do not tell.

use std::f64::consts::TAU;
use std::ops::Range;

use super::declare::FAMILY_SIGNIFICANCE;
use super::streams::Triad;

/// Longest cycle \[rows\]: rates in use stand to each other as small whole numbers.
const LONGEST_ROWS: usize = 8;

/// Frequencies on either side that say what chance does.
const NEIGHBOURS: i32 = 24;

/// A cycle of the noise's power.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
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
    /// ln of how much better the held-out rows' powers follow the fitted cycle than none, jolts held to a limit.
    pub held_out_gain: f64,
    /// Smallest chance among the gyros, trials counted.
    pub p_value: f64,
}

/// Looks for cycles on the fitted rows and measures them again on those held out.
pub fn cycles(
    residual_rad: &Triad,
    fitted: &[Range<usize>],
    held_out: &[Range<usize>],
) -> Vec<Cycle> {
    let squares = |axis: usize, ranges: &[Range<usize>]| squares(&residual_rad[axis], ranges);
    let fractions: Vec<(usize, usize)> = (2..=LONGEST_ROWS)
        .flat_map(|rows| (1..=rows / 2).map(move |turns| (turns, rows)))
        .filter(|&(turns, rows)| (2..=turns).all(|d| turns % d != 0 || rows % d != 0))
        .collect();
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
                let at = |shift: i32| {
                    let turn = turns as f64 / rows as f64 + f64::from(shift) / count as f64;
                    amplitude(&before[axis], turn)
                };
                let own = at(0);
                let power = |(re, im): (f64, f64)| re * re + im * im;
                // The nearest neighbours may hold what leaks from the line itself.
                let chance_power = (2..2 + NEIGHBOURS / 2)
                    .flat_map(|shift| [power(at(shift)), power(at(-shift))])
                    .sum::<f64>()
                    / f64::from(NEIGHBOURS);
                cycle.amplitude[axis] = power(own).sqrt();
                cycle.std[axis] = (0.5 * chance_power).sqrt();
                let p = (trials * (-power(own) / chance_power).exp()).min(1.0);
                cycle.p_value = cycle.p_value.min(p);
                let again = amplitude(&after[axis], turns as f64 / rows as f64);
                cycle.held_out_gain += gain(&after[axis], turns as f64 / rows as f64, own);
                cycle.held_out[axis] =
                    (own.0 * again.0 + own.1 * again.1) / power(own).sqrt().max(f64::MIN_POSITIVE);
            }
            // A cycle goes on: what the other rows speak against is none.
            let goes_on = cycle.held_out_gain > 0.0;
            (cycle.p_value < FAMILY_SIGNIFICANCE && goes_on).then_some(cycle)
        })
        .collect()
}

/// (row, squared value over their mean) of some rows; jolts held to a limit, so that none decides.
fn squares(values: &[f64], ranges: &[Range<usize>]) -> Vec<(usize, f64)> {
    /// Times the median power: normal noise is beyond once in 1500.
    const JOLT: f64 = 25.0;
    let rows: Vec<usize> = ranges.iter().flat_map(Clone::clone).collect();
    let mut sorted: Vec<f64> = rows.iter().map(|&row| values[row] * values[row]).collect();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let held = |row: usize| (values[row] * values[row]).min(JOLT * median);
    let mean = rows.iter().map(|&row| held(row)).sum::<f64>() / rows.len().max(1) as f64;
    rows.iter()
        .map(|&row| (row, held(row) / mean.max(f64::MIN_POSITIVE)))
        .collect()
}

/// ln likelihood of normal rows whose power goes with the cycle, over the same with a constant one.
fn gain(squares: &[(usize, f64)], turn: f64, (re, im): (f64, f64)) -> f64 {
    /// A share of the mean that no noise falls below.
    const LEAST: f64 = 0.05;
    squares
        .iter()
        .map(|(row, value)| {
            let (sin, cos) = (TAU * (turn * *row as f64).fract()).sin_cos();
            let power = (1.0 + re * cos + im * sin).max(LEAST);
            -0.5 * (power.ln() + value * (1.0 / power - 1.0))
        })
        .sum()
}

/// 2 <power · exp(i 2π k turn)> over rows k.
fn amplitude(squares: &[(usize, f64)], turn: f64) -> (f64, f64) {
    let (re, im) = squares.iter().fold((0.0, 0.0), |(re, im), (row, value)| {
        let (sin, cos) = (TAU * (turn * *row as f64).fract()).sin_cos();
        (re + (value - 1.0) * cos, im + (value - 1.0) * sin)
    });
    let scale = 2.0 / squares.len().max(1) as f64;
    (re * scale, im * scale)
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
            cycles(&triad, &halves[0], &halves[1])
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
