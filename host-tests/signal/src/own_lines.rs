//! Lines of the gyros that no other channel has: a vibration that aliased, a converter's tone.
//!
//! Enter: increments of gyros and reference on the same rows \[rad\]. Leaves: [`OwnLine`]s, by frequency and complex amplitude.
//!
//! # Method
//! In every block of the spectrum the gyros are predicted from the reference by one complex 3 × 3 transfer function, which holds
//! delay, filter, scale and axes whatever they are; bins that it does not predict, far above the median power of the block, are
//! no part of its fit. A line is a peak of that residual. It is the gyros' own where they have a peak of their own there and the
//! reference has none. Frequency and amplitudes are those of largest likelihood under white noise of the block's power.
//!
//! # Assumptions
//! A line that nonlinearity makes of the motion stands at a sum or a difference of the motion's own lines: there none is sought.

use rlg_plan::OwnLinesPlan;
use std::borrow::Cow;
use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use realfft::num_complex::Complex64;

use crate::axes::{Triad, add};
use crate::line_fit::{Spectra, Window, median_power, powers};

pub use crate::line_fit::OwnLine;

/// Finds lines.
///
/// # Inputs
/// `others`: the reference's increments \[rad\], then other channels of the unit; `seen`: rows of all; `reference_hz`: the
/// reference's samples a second.
pub fn find(
    gyros_rad: &Triad,
    others: &[&Triad],
    seen: &[bool],
    (rate_hz, reference_hz): (f64, f64),
    plan: &OwnLinesPlan,
) -> Vec<OwnLine> {
    let window = Window::new(seen);
    let mut others = others
        .iter()
        .map(|other| other.each_ref().map(|axis| window.spectrum(axis)));
    let Some(reference) = others.next() else {
        return Vec::new();
    };
    let blocks = blocks(seen.len(), (rate_hz, reference_hz), plan);
    let lines_of = |spectra: &Spectra| lines_of(spectra, &blocks, plan);
    let mut excluded = products(lines_of(&reference), plan.strongest);
    excluded.extend(others.flat_map(|other| products(lines_of(&other), plan.strongest)));
    let mut search = Search {
        gyros_rad,
        reference,
        window,
        rate_hz,
        plan,
        lines: Vec::new(),
    };
    let about = |bin: usize| bin.saturating_sub(plan.about)..=bin + plan.about;
    while search.lines.len() < plan.most {
        let left = search.spectra_beside(None);
        let is_free = |bin: usize| excluded.iter().all(|known| !about(bin).contains(known));
        let best = blocks
            .iter()
            .flat_map(|block| search.own_peaks(&left, block))
            .filter(|peak| is_free(peak.bin))
            .max_by(|a, b| a.ratio.total_cmp(&b.ratio));
        let Some(peak) = best else {
            break;
        };
        excluded.push(peak.bin);
        if let Some(line) = search.fit(peak.bin, None) {
            search.lines.push(line);
            search.settle();
        }
    }
    search.lines
}

/// Frequencies of the lines of other channels \[Hz\]: what a gyro has there may be of the motion.
///
/// # Inputs
/// As of [`find`].
pub fn of_motion(
    others: &[&Triad],
    seen: &[bool],
    (rate_hz, reference_hz): (f64, f64),
    plan: &OwnLinesPlan,
) -> Vec<f64> {
    let rows = seen.len();
    let blocks = blocks(rows, (rate_hz, reference_hz), plan);
    let window = Window::new(seen);
    let spectra = others
        .iter()
        .map(|other| other.each_ref().map(|axis| window.spectrum(axis)));
    let peaks = spectra.flat_map(|spectra| lines_of(&spectra, &blocks, plan));
    let hz = |peak: Peak| peak.bin as f64 * rate_hz / rows as f64;
    peaks.map(hz).collect()
}

/// Blocks of the spectrum's bins that the reference shows.
fn blocks(
    rows: usize,
    (rate_hz, reference_hz): (f64, f64),
    plan: &OwnLinesPlan,
) -> Vec<Range<usize>> {
    let shown = plan.of_reference_rate * reference_hz.min(rate_hz) / rate_hz;
    let shown = (shown * rows as f64) as usize;
    (plan.first..shown)
        .step_by(plan.block)
        .map(|first| first..first + plan.block)
        .take_while(|block| block.end <= shown)
        .collect()
}

/// Lines of three channels.
fn lines_of(spectra: &Spectra, blocks: &[Range<usize>], plan: &OwnLinesPlan) -> Vec<Peak> {
    let each = blocks.iter();
    each.flat_map(|block| peaks(spectra, block, plan.shared))
        .collect()
}

struct Search<'a> {
    gyros_rad: &'a Triad,
    reference: Spectra,
    window: Window,
    rate_hz: f64,
    plan: &'a OwnLinesPlan,
    lines: Vec<OwnLine>,
}

impl Search<'_> {
    /// Spectra of the gyros without the lines, but for the one at a place.
    fn spectra_beside(&self, place: Option<usize>) -> Spectra {
        let mut gyros_rad = Cow::Borrowed(self.gyros_rad);
        let lines = self.lines.iter().enumerate();
        for (_, line) in lines.filter(|(own, _)| Some(*own) != place) {
            let rows_rad = line.rows_rad(gyros_rad[0].len(), self.rate_hz);
            for (gyro, own) in gyros_rad.to_mut().iter_mut().zip(&rows_rad) {
                add(gyro, own, -1.0);
            }
        }
        gyros_rad.each_ref().map(|axis| self.window.spectrum(axis))
    }

    /// Peaks of a block that the gyros have and the reference, which would show them, has not; and peaks of their difference that
    /// the motion hides on both, which no reference of a motion has by chance.
    fn own_peaks(&self, gyros: &Spectra, block: &Range<usize>) -> Vec<Peak> {
        let left = residual((gyros, gyros), &self.reference, block, self.plan.outlying);
        let own = peaks(gyros, block, self.plan.shared);
        let noise = self.plan.shared * median_power(&powers(&self.reference, block));
        let hides = self.plan.shared * median_power(&powers(gyros, block));
        let of_gyros = |peak: &Peak| {
            let mut own = own.iter();
            peak.power() < hides
                || own.any(|own| own.bin.abs_diff(peak.bin) <= 1 && own.power() > noise)
        };
        peaks(&left, &(0..block.len()), self.plan.peak)
            .into_iter()
            .map(|peak| Peak {
                bin: peak.bin + block.start,
                ..peak
            })
            .filter(of_gyros)
            .collect()
    }

    /// Fits a line about a bin; beside all but the one `again`, which it stands for. `None` of one that has not one frequency
    /// and amplitude.
    fn fit(&self, bin: usize, again: Option<usize>) -> Option<OwnLine> {
        let half = self.plan.block / 2;
        let end = (bin + half).min(self.reference[0].len());
        let block = bin.saturating_sub(half)..end;
        let clean = self.spectra_beside(None);
        let of_again = again.map(|_| self.spectra_beside(again));
        let with = of_again.as_ref().unwrap_or(&clean);
        let left = residual((&clean, with), &self.reference, &block, self.plan.outlying);
        let (mut line, coherence) =
            self.window
                .fit(&left, bin - block.start, block.start, self.rate_hz);
        for amplitude in &mut line.amplitude_rad {
            if amplitude.norm() < self.plan.least_deviations * line.std_rad {
                *amplitude = Complex64::ZERO;
            }
        }
        let of_gyros = powers(with, &block);
        let own = of_gyros[bin - block.start];
        line.is_hidden = own < self.plan.shared * median_power(&of_gyros);
        (coherence >= self.plan.coherent).then_some(line)
    }

    /// Fits every line anew, for a strong one spoils the transfer function about it, until none moves by a standard deviation.
    fn settle(&mut self) {
        /// Most rounds.
        const ROUNDS: usize = 6;
        let rows = self.gyros_rad[0].len() as f64;
        for _ in 0..ROUNDS {
            let mut is_settled = true;
            for place in 0..self.lines.len() {
                let before = self.lines[place];
                let bin = (before.hz[0] / self.rate_hz * rows).round() as usize;
                let Some(after) = self.fit(bin, Some(place)) else {
                    continue;
                };
                let pairs = before.amplitude_rad.iter().zip(&after.amplitude_rad);
                let moved = pairs.map(|(before, after)| (after - before).norm());
                is_settled &= moved.fold(0.0, f64::max) < after.std_rad;
                self.lines[place] = after;
            }
            if is_settled {
                break;
            }
        }
    }
}

/// A bin above its neighbours.
#[derive(Debug, Clone, Copy)]
struct Peak {
    bin: usize,
    /// Power over the block's median \[1\].
    ratio: f64,
    /// Median power of the block, of three channels.
    median: f64,
}

impl Peak {
    fn power(&self) -> f64 {
        self.ratio * self.median
    }
}

/// Bins that stand above the median of their block and above both neighbours.
fn peaks(spectra: &Spectra, block: &Range<usize>, least: f64) -> Vec<Peak> {
    let powers = powers(spectra, block);
    let median = median_power(&powers);
    let beside = |at: usize| {
        let before = at.checked_sub(1).map_or(0.0, |at| powers[at]);
        before.max(powers.get(at + 1).copied().unwrap_or(0.0))
    };
    (0..powers.len())
        .filter(|&at| powers[at] > least * median && powers[at] >= beside(at))
        .map(|at| Peak {
            bin: block.start + at,
            ratio: powers[at] / median,
            median,
        })
        .collect()
}

/// Bins of lines of the motion, and of sums and differences, to the third order, of the `most` strongest.
fn products(lines: Vec<Peak>, most: usize) -> Vec<usize> {
    let mut bins: Vec<usize> = lines.iter().map(|line| line.bin).collect();
    let mut strongest = lines;
    strongest.sort_by(|a, b| b.power().total_cmp(&a.power()));
    strongest.truncate(most);
    let signed: Vec<i64> = std::iter::once(0)
        .chain(strongest.iter().flat_map(|one| {
            let bin = one.bin as i64;
            [bin, -bin]
        }))
        .collect();
    for a in &signed {
        for b in &signed {
            bins.extend(signed.iter().map(|c| (a + b + c).unsigned_abs() as usize));
        }
    }
    bins.sort_unstable();
    bins.dedup();
    bins
}

/// Gyros less the motion by a transfer function of the block from the reference; bins from the block's first.
///
/// # Inputs
/// The gyros that the transfer function is fitted to, and those that the motion is taken from; `outlying`: power over the
/// median from which a bin is no part of the fit.
fn residual(
    (fitted, gyros): (&Spectra, &Spectra),
    reference: &Spectra,
    block: &Range<usize>,
    outlying: f64,
) -> Spectra {
    /// Rounds of the fit.
    const ROUNDS: usize = 3;
    let at = |of: &Spectra, bin: usize| Vector3::from_fn(|axis, _| of[axis][bin]);
    let mut bins: Vec<usize> = block.clone().collect();
    let mut transfer = Matrix3::zeros();
    let less = |of: &Spectra, transfer: &Matrix3<Complex64>| -> Spectra {
        let of_bin = |bin: usize| at(of, bin) - transfer * at(reference, bin);
        let left: Vec<Vector3<Complex64>> = block.clone().map(of_bin).collect();
        std::array::from_fn(|axis| left.iter().map(|bin| bin[axis]).collect())
    };
    for _ in 0..ROUNDS {
        let (mut crossed, mut own) = (Matrix3::zeros(), Matrix3::zeros());
        for &bin in &bins {
            let (gyros, reference) = (at(fitted, bin), at(reference, bin));
            crossed += gyros * reference.adjoint();
            own += reference * reference.adjoint();
        }
        transfer = match own.try_inverse() {
            Some(inverse) => crossed * inverse,
            None => Matrix3::zeros(),
        };
        let powers = powers(&less(fitted, &transfer), &(0..block.len()));
        let most = outlying * median_power(&powers);
        bins = block
            .clone()
            .filter(|bin| powers[bin - block.start] <= most)
            .collect();
    }
    less(gyros, &transfer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line_fit::phase_rad;
    use crate::test_noise::noise;
    use rlg_plan::OwnLinesPlan;

    const RATE_HZ: f64 = 100.0;
    const ROWS: usize = 6000;

    /// Noise behind a second-order filter, and behind a delay of a row and a scale error of 20 % with noise of 1e-3.
    fn moved(seed: u64) -> (Triad, Triad) {
        let mut noise = noise(seed);
        let (mut gyros, mut reference) = (Triad::default(), Triad::default());
        for axis in 0..3 {
            let (mut slow, mut value) = (0.0, 0.0);
            for _ in 0..ROWS {
                slow += 0.2 * (noise() - slow);
                let before = value;
                value += 0.2 * (slow - value);
                reference[axis].push(value);
                gyros[axis].push(1.2 * before + 1e-3 * noise());
            }
        }
        (gyros, reference)
    }

    fn add_line(gyros: &mut Triad, hz: f64, sizes: [f64; 3]) {
        for (axis, size) in gyros.iter_mut().zip(sizes) {
            for (row, value) in axis.iter_mut().enumerate() {
                *value += size * (phase_rad(hz / RATE_HZ, row) + 0.4).cos();
            }
        }
    }

    fn found(gyros: &Triad, reference: &Triad) -> Vec<OwnLine> {
        // A tenth that only tests, and a gap.
        let seen: Vec<bool> = (0..ROWS)
            .map(|row| row < 5400 && !(2000..2060).contains(&row))
            .collect();
        let clocks = (RATE_HZ, RATE_HZ);
        find(gyros, &[reference], &seen, clocks, &OwnLinesPlan::default())
    }

    #[test]
    fn a_line_of_the_gyros_is_found_through_delay_scale_and_gaps() {
        for seed in 0..10 {
            let (mut gyros, reference) = moved(seed);
            let hz = 3.0 + 3.31 * seed as f64;
            add_line(&mut gyros, hz, [0.3, 0.05, 0.0]);
            let lines = found(&gyros, &reference);
            let [line] = lines[..] else {
                panic!("{seed}: {lines:?}");
            };
            let off = (line.hz[0] - hz) / line.hz[1];
            assert!(off.abs() < 4.0, "{seed}: {line:?}");
            for (amplitude, size) in line.amplitude_rad.iter().zip([0.3, 0.05, 0.0]) {
                let truth = Complex64::from_polar(size, 0.4);
                let off = (amplitude - truth).norm() / line.std_rad;
                assert!(off < 6.0, "{seed}: {line:?}");
            }
        }
    }

    #[test]
    fn no_line_is_found_of_motion_or_where_the_reference_has_it() {
        for seed in 0..12 {
            let (mut gyros, mut reference) = moved(100 + seed);
            assert_eq!(found(&gyros, &reference), []);
            add_line(&mut gyros, 9.0, [0.3, 0.1, 0.0]);
            add_line(&mut reference, 9.0, [0.1, 0.1, 0.0]);
            assert_eq!(found(&gyros, &reference), []);
        }
    }

    #[test]
    fn a_harmonic_of_the_motion_is_left_to_the_search() {
        let (mut gyros, mut reference) = moved(3);
        add_line(&mut gyros, 4.0, [2.0, 0.0, 0.0]);
        add_line(&mut reference, 4.0, [2.0, 0.0, 0.0]);
        add_line(&mut gyros, 12.0, [0.3, 0.0, 0.0]);
        assert_eq!(found(&gyros, &reference), []);
    }
}
