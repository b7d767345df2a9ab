//! Tests if gyros and reference show a common motion, before it is used as an explanation.
//!
//! Enter: increments of both on the same rows \[rad\]. Leaves: [`Apart`], where the gyros move and do not follow the
//! reference.
//!
//! # Measure
//! Share of the gyros' power explained by the reference at one lag, by a real 3 × 3 map in each octave of frequency (a
//! multiple coherence): for any axes, signs, scales and filters, a common motion has a large share at one lag. Unrelated
//! motions have one by chance, the larger the fewer the frequencies; its size is the share of the same record at lags beyond
//! any delay, by circular shifts (surrogate test: Theiler et al., Physica D 58, 1992). Quarters of an octave have equal
//! weight, against the dominance of two or three frequencies of a steep spectrum; and a reference scaled to the gyros' power
//! over all quarters is not amplified much in one, against an explanation by its noise.
//!
//! # Assumptions
//! A quarter counts only where the gyros' power exceeds any gyro's noise, and below the band limit of the reference's rows:
//! without motion there is no information.

use std::f64::consts::PI;
use std::ops::Range;

use nalgebra::{Matrix3, RowVector3};
use realfft::num_complex::Complex64;

use crate::axes::{Triad, add};
use crate::transforms;

/// Settings of the test: `rlg challenge --marks --family unrelated` against `rates` and `attitude` shows its power.
#[derive(Debug, Clone, Copy)]
pub struct SameMotionPlan {
    /// Largest delay of two recorders of one experiment \[s\].
    pub most_delay_s: f64,
    /// Least lag of the surrogates, in largest delays \[1\].
    pub beyond_delay: f64,
    /// Largest angle random walk of any gyro \[rad/√s\]: 5 °/√h, ten times a telephone's.
    pub most_walk_rad_sqrt_s: f64,
    /// Least power of moving gyros, over that of such a walk \[1\].
    pub over_walk: f64,
    /// Power of the reference, over that of the gyros, below which it is not amplified to explain them \[1\].
    pub alike: f64,
    /// Upper limit of the compared frequencies, as a share of the reference's rows a second \[1\].
    pub of_reference_rate: f64,
    /// Sample rate of the reference \[Hz\]; `None`: one sample a row.
    pub reference_hz: Option<f64>,
    /// Least frequencies of an octave.
    pub least_bins: usize,
    /// Share, of all or of an octave, accepted as common motion regardless of the surrogates \[1\]: one tone has it at many
    /// lags.
    pub explained: f64,
    /// Least effective number of lines of such an octave \[1\]: a map explains fewer, common motion or not.
    pub least_lines: f64,
    /// Share below which common motion requires an excess over chance by `over_chance` \[1\].
    pub doubtful: f64,
    /// Factor of that excess \[1\].
    pub over_chance: f64,
    /// Largest number of rows, by averaging.
    pub most_rows: usize,
}

impl Default for SameMotionPlan {
    fn default() -> Self {
        Self {
            most_delay_s: 0.5,
            beyond_delay: 4.0,
            most_walk_rad_sqrt_s: 1.45e-3,
            over_walk: 10.0,
            alike: 0.1,
            of_reference_rate: 0.4,
            reference_hz: None,
            least_bins: 2,
            explained: 0.9,
            least_lines: 2.0,
            doubtful: 0.6,
            over_chance: 1.1,
            most_rows: 1 << 16,
        }
    }
}

/// Gyros and reference without a common motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Apart {
    /// Largest share of the gyros' power explained by the reference at any delay \[1\].
    pub share: f64,
    /// Largest share of the surrogate lags \[1\].
    pub by_chance: f64,
    /// Lag of `by_chance`: delay of the gyros behind the reference \[s\].
    pub at_lag_s: f64,
}

/// A quarter of an octave with motion of the gyros.
struct Quarter {
    bins: Range<usize>,
    /// Power of three gyros, and of three axes of the reference.
    gyros: f64,
    reference: f64,
}

/// Spectra of the three axes of both sides.
struct Spectra {
    gyros: [Vec<Complex64>; 3],
    reference: [Vec<Complex64>; 3],
}

/// Compares both sides on the rows that are `seen`; `None` for a common motion or no motion at all.
pub fn apart(
    gyros_rad: &Triad,
    reference_rad: &Triad,
    seen: &[bool],
    rate_hz: f64,
    plan: &SameMotionPlan,
) -> Option<Apart> {
    let block = seen.len().div_ceil(plan.most_rows).max(1);
    let rows = seen.len() / block;
    let period_s = block as f64 / rate_hz;
    let is_seen: Vec<bool> = seen
        .chunks_exact(block)
        .map(|rows| rows.iter().all(|seen| *seen))
        .collect();
    let of = |of: &Triad| [0, 1, 2].map(|axis: usize| spectrum(&of[axis], block, &is_seen));
    let spectra = Spectra {
        gyros: of(gyros_rad),
        reference: of(reference_rad),
    };
    // Increments of a random walk have the variance N² h, as has each line of their spectrum, times their number and the
    // mean square of the window; their differences have |1 − exp(iωh)|² of it.
    let count = 0.375 * is_seen.iter().filter(|seen| **seen).count() as f64;
    let walk = 3.0 * plan.most_walk_rad_sqrt_s.powi(2) * period_s * count;
    let walked = |bins: &Range<usize>| {
        let middle = 0.5 * (bins.start + bins.end) as f64;
        let turned = 2.0 * (PI * middle / rows as f64).sin();
        walk * bins.len() as f64 * turned * turned
    };
    let quarters = |top: usize| -> Vec<Quarter> {
        let width = (top / 8).max(1);
        let all = (top / 2 + 1..top + 1).step_by(width).take(4);
        all.map(|first| Quarter::new(&spectra, first..first + width))
            .filter(|one| one.gyros > plan.over_walk * walked(&one.bins))
            .collect()
    };
    let reference_hz = plan.reference_hz.unwrap_or(rate_hz);
    let shown = plan.of_reference_rate * reference_hz * rows as f64 * period_s;
    let tops = std::iter::successors(Some((rows / 2).min(shown as usize)), |top| Some(top / 2));
    let octaves: Vec<Vec<Quarter>> = tops
        .take_while(|top| top / 2 >= plan.least_bins)
        .map(quarters)
        .filter(|quarters| !quarters.is_empty())
        .collect();
    let power = |of: fn(&Quarter) -> f64| octaves.iter().flatten().map(of).sum::<f64>();
    let [of_gyros, of_reference] = [power(|one| one.gyros), power(|one| one.reference)];
    if of_reference <= 0.0 {
        return None;
    }
    let seen_as = of_gyros / of_reference;
    let last = octaves.iter().flatten().map(|one| one.bins.end).max()?;
    // The lines of an octave decorrelate over a lag of half its period: step of a quarter of that, at most.
    let lags = (8 * last).next_power_of_two();
    let step_s = rows as f64 * period_s / lags as f64;
    let lag_s = |lag: usize| {
        let back = if lag > lags / 2 { lags as f64 } else { 0.0 };
        (lag as f64 - back) * step_s
    };
    let mut explained = vec![0.0; lags];
    for quarters in &octaves {
        let own = spectra.explained(quarters, seen_as, plan.alike, lags);
        let is_near = |lag: &usize| lag_s(*lag).abs() <= plan.most_delay_s;
        let best = (0..lags).filter(is_near).map(|lag| own[lag]);
        // A vibration unfelt by the reference does not affect other octaves.
        let share = best.fold(0.0, f64::max) / quarters.len() as f64;
        if share >= plan.explained && spectra.lines(quarters) >= plan.least_lines {
            return None;
        }
        add(&mut explained, &own, 1.0);
    }
    let quarters = octaves.iter().map(Vec::len).sum::<usize>() as f64;
    let (mut share, mut by_chance, mut at_lag_s) = (0.0_f64, 0.0, 0.0);
    for (lag, explained) in explained.into_iter().enumerate() {
        let (lag_s, here) = (lag_s(lag), explained / quarters);
        if lag_s.abs() <= plan.most_delay_s {
            share = share.max(here);
        } else if lag_s.abs() >= plan.beyond_delay * plan.most_delay_s && here > by_chance {
            (by_chance, at_lag_s) = (here, lag_s);
        }
    }
    let is_chance = share < by_chance && share < plan.explained;
    let is_doubtful = share < plan.over_chance * by_chance && share < plan.doubtful;
    (is_chance || is_doubtful).then_some(Apart {
        share,
        by_chance,
        at_lag_s,
    })
}

/// Computes the spectrum of the differences of block sums under Hann's window, with differences at unseen rows set to zero:
/// a slow turn or a strong line would leak into all others at the cuts of the record.
fn spectrum(increments_rad: &[f64], block: usize, is_seen: &[bool]) -> Vec<Complex64> {
    let sums: Vec<f64> = increments_rad
        .chunks_exact(block)
        .map(|rows| rows.iter().sum())
        .collect();
    let fourier = transforms::forward(sums.len());
    let mut record = fourier.make_input_vec();
    for (row, difference) in record.iter_mut().enumerate().skip(1) {
        if is_seen[row - 1] && is_seen[row] {
            let window = (PI * row as f64 / sums.len() as f64).sin().powi(2);
            *difference = window * (sums[row] - sums[row - 1]);
        }
    }
    let mut spectrum = fourier.make_output_vec();
    if fourier.process(&mut record, &mut spectrum).is_err() {
        unreachable!("both buffers are as long as planned");
    }
    spectrum
}

impl Quarter {
    fn new(spectra: &Spectra, bins: Range<usize>) -> Self {
        let power = |of: &[Vec<Complex64>; 3]| -> f64 {
            let lines = of.iter().flat_map(|axis| &axis[bins.clone()]);
            lines.map(|line| line.norm_sqr()).sum()
        };
        Self {
            gyros: power(&spectra.gyros),
            reference: power(&spectra.reference),
            bins,
        }
    }
}

impl Spectra {
    /// Effective number of lines of the gyros' power: the square of its sum over the sum of its squares.
    fn lines(&self, quarters: &[Quarter]) -> f64 {
        let (mut sum, mut squares) = (0.0, 0.0);
        for quarter in quarters {
            for bin in quarter.bins.clone() {
                let power = self.gyros.iter().map(|axis| axis[bin].norm_sqr());
                let power = power.sum::<f64>() / quarter.gyros;
                sum += power;
                squares += power * power;
            }
        }
        sum * sum / squares
    }

    /// Computes the power explained by an octave's map of the reference at every lag, each quarter having the gyros' power 1
    /// (ridge regression).
    ///
    /// # Inputs
    /// `seen_as`: ratio of the powers of gyros and reference, over all quarters in motion; `alike`: as in the plan.
    fn explained(&self, quarters: &[Quarter], seen_as: f64, alike: f64, lags: usize) -> Vec<f64> {
        let (gyros, reference) = (&self.gyros, &self.reference);
        let lines = || {
            let of = |quarter: &Quarter| (quarter.bins.clone(), 1.0 / quarter.gyros);
            let each = quarters.iter().map(of);
            each.flat_map(|(bins, weight)| bins.map(move |bin| (bin, weight)))
        };
        let own = Matrix3::from_fn(|a, b| -> f64 {
            let product = |(bin, weight): (usize, f64)| {
                (reference[a][bin].conj() * reference[b][bin]).re * weight * seen_as
            };
            lines().map(product).sum()
        });
        let ridge = Matrix3::identity() * (alike * quarters.len() as f64 / 3.0);
        let Some(inverse) = (own + ridge).try_inverse() else {
            unreachable!("a ridge has an inverse");
        };
        let mut explained = vec![0.0; lags];
        let back = transforms::inverse(lags);
        let by_lag = |gyro: usize, axis: usize| {
            let mut spectrum = back.make_input_vec();
            for (bin, weight) in lines() {
                let product = gyros[gyro][bin] * reference[axis][bin].conj();
                spectrum[bin] = product * (0.5 * weight * seen_as.sqrt());
            }
            let mut by_lag = back.make_output_vec();
            if back.process(&mut spectrum, &mut by_lag).is_err() {
                unreachable!("both buffers are as long as planned");
            }
            by_lag
        };
        for gyro in 0..3 {
            let across = [0, 1, 2].map(|axis| by_lag(gyro, axis));
            for (lag, explained) in explained.iter_mut().enumerate() {
                let row = RowVector3::new(across[0][lag], across[1][lag], across[2][lag]);
                *explained += (row * inverse * row.transpose())[(0, 0)];
            }
        }
        explained
    }
}
