//! The case's motion, smoothed to the band in which the reference carries motion at all, with exact
//! derivatives and delays.
//!
//! Enters: increments over a row \[rad\], or readings at row ends. Leaves: rate, angular acceleration and
//! their derivatives at the middle of each row (body frame; rad/s, rad/s², ...). Derivatives are taken in
//! the frequency domain and the mean over the row is undone (division by sinc), because finite
//! differences of a sampled product under-read it by (Ω T)²/4.
//!
//! The band edge is where the reference's spectrum last stands clear of its own noise: beyond it there is
//! no motion to learn from, and noise in a regressor biases its coefficient towards zero. Below it, what is not
//! clear of the noise is damped bin by bin ([`clear_together`]): the reference's noise stands in the residual too,
//! and a derivative of it there looks like physics.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use realfft::ComplexToReal;
use realfft::num_complex::Complex64;
use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

use rlg_signal::transforms;
pub use rlg_signal::transforms::{even_smooth_length as smooth_length, mean_periodogram};

/// Rows of odd reflection at either end, so that a motion that does not end at rest does not ring, and the same in periods
/// of the band's edge: a slow channel that ends elsewhere than it began rings for longer.
const MARGIN_ROWS: usize = 4096;
const MARGIN_PERIODS: f64 = 8.0;

/// The pass band ends this much beyond the last frequency with motion; then a raised cosine of the same
/// relative width follows.
const PASS_BEYOND: f64 = 1.15;
const STOP_BEYOND: f64 = 1.6;

/// A signal in the frequency domain, ready to be differentiated and delayed.
pub struct Spectrum {
    /// Up to the end of the stop band; above it there is nothing to keep.
    bins: Vec<Complex64>,
    rows: usize,
    /// Rows of reflection before them.
    margin: usize,
    length: usize,
    rate_hz: f64,
    edge_hz: f64,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

/// What to read off a [`Spectrum`].
#[derive(Clone, Copy)]
pub struct Reading {
    /// Order of the time derivative.
    pub derivative: i32,
    /// The signal is read this much later than the row says \[s\].
    pub ahead_s: f64,
    /// Undo the mean over the row (for increments and means), or not (for readings at an instant).
    pub undo_row_mean: bool,
}

impl Spectrum {
    /// Takes the transform of `values`; frequencies above `edge_hz` are dropped smoothly.
    pub fn new(values: &[f64], rate_hz: f64, edge_hz: f64) -> Self {
        let rows = values.len();
        let periods = (MARGIN_PERIODS * rate_hz / edge_hz) as usize;
        let margin = MARGIN_ROWS.max(periods).min(rows - 1);
        let length = smooth_length(rows + 2 * margin);
        let mut padded = vec![0.0; length];
        let (first, last) = (values[0], values[rows - 1]);
        for (index, value) in padded[..margin].iter_mut().enumerate() {
            *value = 2.0 * first - values[margin - index];
        }
        padded[margin..margin + rows].copy_from_slice(values);
        for index in 0..margin {
            padded[margin + rows + index] = 2.0 * last - values[rows - 2 - index];
        }
        // What is left to fill joins the end to the beginning by half a cosine.
        let (from, to) = (padded[rows + 2 * margin - 1], padded[0]);
        let rest = length - rows - 2 * margin;
        for index in 0..rest {
            let share = 0.5 - 0.5 * (PI * (index + 1) as f64 / (rest + 1) as f64).cos();
            padded[rows + 2 * margin + index] = from + (to - from) * share;
        }
        let forward = transforms::forward(length);
        let mut bins = forward.make_output_vec();
        forward
            .process(&mut padded, &mut bins)
            .expect("lengths come from the plan");
        let stop = (edge_hz * STOP_BEYOND * length as f64 / rate_hz).ceil() as usize;
        bins.truncate(stop.saturating_add(1));
        bins.shrink_to_fit();
        Self {
            bins,
            rows,
            margin,
            length,
            rate_hz,
            edge_hz,
            inverse: transforms::inverse(length),
        }
    }

    /// The signal at each row as `reading` asks.
    pub fn read(&self, reading: Reading) -> Vec<f64> {
        self.read_through(reading, &|_| Complex64::new(1.0, 0.0))
    }

    /// The same behind a linear system; `response` is its answer to e^(iωt) at a frequency \[Hz\].
    pub fn read_through(&self, reading: Reading, response: &dyn Fn(f64) -> Complex64) -> Vec<f64> {
        let half = self.length / 2;
        let mut bins = self.inverse.make_input_vec();
        let unit = Complex64::new(0.0, 1.0).powi(reading.derivative);
        for (bin, (slot, value)) in bins.iter_mut().zip(&self.bins).enumerate() {
            let frequency_hz = bin as f64 * self.rate_hz / self.length as f64;
            let passed = self.pass(frequency_hz);
            if passed == 0.0 {
                continue;
            }
            let mut weight = passed * (TAU * frequency_hz).powi(reading.derivative);
            if reading.undo_row_mean {
                weight /= sinc(frequency_hz / self.rate_hz);
            }
            *slot = value * unit * weight * response(frequency_hz);
            if reading.ahead_s != 0.0 {
                *slot *= Complex64::cis(TAU * frequency_hz * reading.ahead_s);
            }
        }
        // Neither the mean nor the highest bin has a phase; the latter has no derivative either.
        bins[0].im = 0.0;
        bins[half] = Complex64::new(0.0, 0.0);
        let mut padded = self.inverse.make_output_vec();
        self.inverse
            .process(&mut bins, &mut padded)
            .expect("lengths come from the plan");
        padded[self.margin..self.margin + self.rows]
            .iter()
            .map(|value| value / self.length as f64)
            .collect()
    }

    fn pass(&self, frequency_hz: f64) -> f64 {
        let (pass, stop) = (self.edge_hz * PASS_BEYOND, self.edge_hz * STOP_BEYOND);
        if frequency_hz <= pass {
            1.0
        } else if frequency_hz >= stop {
            0.0
        } else {
            0.5 + 0.5 * (PI * (frequency_hz - pass) / (stop - pass)).cos()
        }
    }
}

/// Damps what does not stand clear of the noise in any direction of the three axes: gain 1 − 3/λ along the eigenvectors
/// of the whitened cross-spectra around a bin, and along the axes themselves. Axes that
/// move together, as on a shaker, have a combination in which their motion cancels and the reference's noise is left:
/// axis by axis it would pass, its derivatives stand in the residual too, and look like physics.
pub fn clear_together(axes: [Spectra; 3], noise: [RowNoise; 3]) -> [Spectra; 3] {
    let [x, y, z] = axes.map(|spectra| spectra.0);
    let mut cleared = [Vec::new(), Vec::new(), Vec::new()];
    for ((x, y), z) in x.into_iter().zip(y).zip(z) {
        let piece = clear_piece([x, y, z], noise);
        cleared
            .iter_mut()
            .zip(piece)
            .for_each(|(to, one)| to.push(one));
    }
    cleared.map(Spectra)
}

/// How much of a bin stays whose power is so many times the noise's: nothing below three times, all from six times on.
/// What is clear stays as it is, so that axes that move together still do.
fn passes(power: f64) -> f64 {
    const CLEAR: f64 = 3.0;
    ((power - CLEAR) / CLEAR).clamp(0.0, 1.0)
}

/// A motion's increments without what is mere noise of the channel in a moment: overlapping windows of a few seconds, in
/// each of which a bin stays where the power around it is clear of the noise. An axis that turns at one time and
/// rests at another has its noise of the resting time in every bin otherwise, and that noise, which the residual holds
/// too, looks like physics wherever something else moves then. Short windows take what the long ones keep beside a
/// motion that begins or ends within them.
pub fn clear_in_time(
    values: &[f64],
    pieces: &[Range<usize>],
    rate_hz: f64,
    noise: RowNoise,
) -> Vec<f64> {
    /// Seconds of a window.
    const WINDOWS_S: [f64; 2] = [4.0, 0.5];
    WINDOWS_S.iter().fold(values.to_vec(), |values, window_s| {
        clear_in_windows(&values, pieces, rate_hz, noise, *window_s)
    })
}

fn clear_in_windows(
    values: &[f64],
    pieces: &[Range<usize>],
    rate_hz: f64,
    noise: RowNoise,
    window_s: f64,
) -> Vec<f64> {
    /// Bins on either side, half of them independent behind the window: noise alone then stays below three times its
    /// mean in all but a few bins in a hundred thousand.
    const AROUND: usize = 8;
    let mut cleared = values.to_vec();
    let whole = smooth_length((window_s * rate_hz) as usize);
    for rows in pieces {
        let length = whole.min(rows.len() & !1);
        let half = length / 2;
        if half < 2 * AROUND {
            continue;
        }
        let (forward, inverse) = (transforms::forward(length), transforms::inverse(length));
        // Its square and the next window's add up to one.
        let window: Vec<f64> = (0..length)
            .map(|k| (PI * (k as f64 + 0.5) / length as f64).sin())
            .collect();
        let own = &values[rows.clone()];
        let kept: Vec<Vec<f64>> = (0..=own.len().div_ceil(half))
            .into_par_iter()
            .map(|place| {
                // Beyond the ends it goes back the way it came: an angle that stopped there would keep its noise.
                let at = |k: usize| {
                    let inside = (place * half + k).checked_sub(half);
                    if let Some(value) = inside.and_then(|row| own.get(row)) {
                        return *value;
                    }
                    let mirrored = match inside {
                        None => Some(half - 1 - (place * half + k)),
                        Some(row) => (2 * own.len() - 1).checked_sub(row),
                    };
                    mirrored
                        .and_then(|row| own.get(row))
                        .map_or(0.0, |value| -value)
                };
                let mut input: Vec<f64> = (0..length).map(|k| at(k) * window[k]).collect();
                let mut bins = forward.make_output_vec();
                forward
                    .process(&mut input, &mut bins)
                    .expect("lengths come from the plan");
                // The window's mean square is a half.
                let unit = |bin: usize| {
                    let share = 2.0 * bin.max(1) as f64 / length as f64;
                    0.5 * length as f64 * noise.at(share)
                };
                let mut sums = vec![0.0];
                for (bin, value) in bins.iter().enumerate() {
                    sums.push(sums[bin] + value.norm_sqr() / unit(bin).max(f64::MIN_POSITIVE));
                }
                for (bin, value) in bins.iter_mut().enumerate() {
                    let (from, to) = (
                        bin.saturating_sub(AROUND),
                        (bin + AROUND + 1).min(sums.len() - 1),
                    );
                    let power = (sums[to] - sums[from]) / (to - from) as f64;
                    *value *= passes(power);
                }
                inverse
                    .process(&mut bins, &mut input)
                    .expect("lengths come from the plan");
                let scale = 1.0 / length as f64;
                input
                    .iter()
                    .zip(&window)
                    .map(|(value, w)| value * w * scale)
                    .collect()
            })
            .collect();
        let own = &mut cleared[rows.clone()];
        own.fill(0.0);
        for (place, part) in kept.iter().enumerate() {
            for (k, value) in part.iter().enumerate() {
                let row = (place * half + k).checked_sub(half);
                if let Some(slot) = row.and_then(|row| own.get_mut(row)) {
                    *slot += value;
                }
            }
        }
    }
    cleared
}

fn clear_piece(mut axes: [Spectrum; 3], noise: [RowNoise; 3]) -> [Spectrum; 3] {
    /// Bins on either side: the largest eigenvalue of noise alone then stays below (1 + √(3/33))², 1.7.
    const AROUND: usize = 16;
    /// Noise in λ must not count as signal.
    const CLEAR: f64 = 3.0;
    /// A reference without any noise would be divided by nothing; (1e-20 rad)² is below all there are.
    const QUIETEST: f64 = 1e-50;
    let (bins, length) = (axes[0].bins.len(), axes[0].length as f64);
    // In units of each axis's noise.
    let unit = |axis: usize, bin: usize| {
        let share = 2.0 * bin.max(1) as f64 / length;
        (noise[axis].at(share).max(QUIETEST) * length).sqrt()
    };
    let whitened: Vec<Vector3<Complex64>> = (0..bins)
        .map(|bin| Vector3::from_fn(|axis, _| axes[axis].bins[bin] / unit(axis, bin)))
        .collect();
    let cleared: Vec<Vector3<Complex64>> = (0..bins)
        .into_par_iter()
        .map(|bin| {
            let around = bin.saturating_sub(AROUND)..(bin + AROUND + 1).min(bins);
            let count = around.len() as f64;
            let sum: Matrix3<Complex64> = whitened[around].iter().map(|v| v * v.adjoint()).sum();
            let mean = sum / Complex64::from(count);
            let gain = |power: f64| (1.0 - CLEAR / power.max(f64::MIN_POSITIVE)).max(0.0);
            // Where one axis moves so much more than the others that a few bins of it outweigh all around, their noise
            // in those bins would pass as its companion: an axis at rest stays at rest.
            let own = Vector3::from_fn(|axis, _| passes(mean[(axis, axis)].re));
            let root = mean.symmetric_eigen();
            let along = root.eigenvectors.adjoint() * whitened[bin];
            let gains = root.eigenvalues.map(gain);
            let kept = root.eigenvectors * along.zip_map(&gains, |value, gain| value * gain);
            Vector3::from_fn(|axis, _| kept[axis] * own[axis] * unit(axis, bin))
        })
        .collect();
    for (axis, spectrum) in axes.iter_mut().enumerate() {
        for (slot, value) in spectrum.bins.iter_mut().zip(&cleared) {
            *slot = value[axis];
        }
    }
    axes
}

/// The spectra of a channel's pieces, between which nothing leaks; read, they stand end to end.
pub struct Spectra(Vec<Spectrum>);

impl Spectra {
    /// Takes the transform of each piece of `values`.
    pub fn new(values: &[f64], pieces: &[Range<usize>], rate_hz: f64, edge_hz: f64) -> Self {
        let of = |rows: &Range<usize>| Spectrum::new(&values[rows.clone()], rate_hz, edge_hz);
        Self(pieces.iter().map(of).collect())
    }

    /// See [`Spectrum::read`].
    pub fn read(&self, reading: Reading) -> Vec<f64> {
        match self.0.as_slice() {
            [only] => only.read(reading),
            several => several.iter().flat_map(|one| one.read(reading)).collect(),
        }
    }

    /// See [`Spectrum::read_through`].
    pub fn read_through(&self, reading: Reading, response: &dyn Fn(f64) -> Complex64) -> Vec<f64> {
        let pieces = self.0.iter();
        pieces
            .flat_map(|one| one.read_through(reading, response))
            .collect()
    }
}

/// sin(πx)/(πx).
pub fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-9 {
        1.0
    } else {
        (PI * x).sin() / (PI * x)
    }
}

/// How the noise of a channel lies over frequency.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum NoiseShape {
    /// The same in every bin.
    White,
    /// White in angle, so 4 sin²(πf/fs) in increments.
    Angle,
}

impl NoiseShape {
    /// The shape at a share of the highest frequency.
    fn at(self, share: f64) -> f64 {
        match self {
            NoiseShape::White => 1.0,
            NoiseShape::Angle => 4.0 * (0.5 * PI * share).sin().powi(2),
        }
    }
}

/// Noise of a channel of increments per row: white noise of angle, and a walk of the angle below it.
#[derive(Clone, Copy)]
pub struct RowNoise {
    angle: f64,
    walk: f64,
}

impl RowNoise {
    /// Of a channel: white noise of angle as declared, or as the spectrum's own top tenth has it where that is more, and
    /// the declared walk.
    pub fn of(values: &[f64], rate_hz: f64, declared: Option<AngleNoise>) -> Self {
        let power = mean_periodogram(values, smooth_length((rate_hz / BIN_HZ) as usize));
        let angle = declared.map(|noise| noise.white_rad.powi(2));
        Self {
            angle: level_of(&power, NoiseShape::Angle, angle),
            walk: declared.map_or(0.0, |noise| noise.walk_rad_sqrt_s.powi(2) / rate_hz),
        }
    }

    /// Walk and white noise of angle \[rad² per row\].
    pub fn levels_rad2(self) -> [f64; 2] {
        [self.walk, self.angle]
    }

    fn at(self, share: f64) -> f64 {
        self.angle * NoiseShape::Angle.at(share) + self.walk
    }
}

/// Declared noise of the angle that a motion is read from.
#[derive(Debug, Clone, Copy)]
pub struct AngleNoise {
    /// White \[rad\].
    pub white_rad: f64,
    /// Random walk \[rad/√s\].
    pub walk_rad_sqrt_s: f64,
}

/// Where a channel's power is greatest \[Hz\], its mean aside.
pub fn strongest_hz(values: &[f64], rate_hz: f64) -> f64 {
    let piece = smooth_length((rate_hz / BIN_HZ) as usize).min(values.len() & !1);
    let power = mean_periodogram(values, piece);
    // The window shows the mean in the next bin, too.
    let best = (2..power.len()).max_by(|&a, &b| power[a].total_cmp(&power[b]));
    best.map_or(0.0, |bin| bin as f64 * rate_hz / piece as f64)
}

/// 1 Hz bins: fine enough for a 15 Hz motion, averaged over many pieces in a minute.
const BIN_HZ: f64 = 1.0;

fn level_of(power: &[f64], shape: NoiseShape, declared: Option<f64>) -> f64 {
    let bins = power.len() - 1;
    let top = bins - bins / 10;
    let own: f64 = (top..=bins)
        .map(|bin| power[bin] / shape.at(bin as f64 / bins as f64))
        .sum::<f64>()
        / (bins - top + 1) as f64;
    declared.map_or(own, |declared| declared.max(own))
}

/// The last frequency \[Hz\] at which a channel stands clear of its noise on any axis.
///
/// `declared` is the noise power per row; where it is not known, the spectrum's own top tenth is taken for
/// noise, which also serves where the declared noise is far below what is seen there.
pub fn last_clear_hz(
    triad: &[Vec<f64>; 3],
    pieces: &[Range<usize>],
    rate_hz: f64,
    shape: NoiseShape,
    declared: Option<f64>,
) -> f64 {
    /// Mean of about 2 × seconds periodograms: four times the noise cannot be chance in any bin.
    const CLEAR: f64 = 4.0;
    /// Lowest edge: slower motion is still followed this far.
    const LOWEST_HZ: f64 = 10.0;
    let piece = smooth_length((rate_hz / BIN_HZ) as usize);
    let mut edge_hz = LOWEST_HZ;
    let of_pieces = |values| pieces.iter().map(move |rows| (values, rows.clone()));
    for (values, rows) in triad.iter().flat_map(of_pieces) {
        let values: &Vec<f64> = values;
        let power = mean_periodogram(&values[rows], piece);
        let bins = power.len() - 1;
        let level = level_of(&power, shape, declared);
        if let Some(bin) = (1..=bins)
            .rev()
            .find(|&bin| power[bin] > CLEAR * level * shape.at(bin as f64 / bins as f64))
        {
            edge_hz = edge_hz.max(bin as f64 / bins as f64 * rate_hz / 2.0);
        }
    }
    edge_hz.min(0.45 * rate_hz)
}
