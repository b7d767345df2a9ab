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
//! clear of the noise is damped bin by bin ([`Spectrum::clear_of_noise`]): the reference's noise stands in the
//! residual too, and a derivative of it there looks like physics.

use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

/// Rows of odd reflection at either end, so that a motion that does not end at rest does not ring.
const MARGIN_ROWS: usize = 4096;

/// The pass band ends this much beyond the last frequency with motion; then a raised cosine of the same
/// relative width follows.
const PASS_BEYOND: f64 = 1.15;
const STOP_BEYOND: f64 = 1.6;

/// A signal in the frequency domain, ready to be differentiated and delayed.
pub struct Spectrum {
    /// Up to the end of the stop band; above it there is nothing to keep.
    bins: Vec<Complex64>,
    rows: usize,
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
        let margin = MARGIN_ROWS.min(rows - 1);
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
        let mut planner = RealFftPlanner::new();
        let forward: Arc<dyn RealToComplex<f64>> = planner.plan_fft_forward(length);
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
            length,
            rate_hz,
            edge_hz,
            inverse: planner.plan_fft_inverse(length),
        }
    }

    /// Damps the bins in which the signal does not stand clear of its own noise, `level` times the shape per
    /// row: gain 1 − 3 N/P, P the power around the bin.
    pub fn clear_of_noise(mut self, level: f64, shape: NoiseShape) -> Self {
        /// Bins on either side: noise alone then scatters by a sixth, and never passes a third of its limit.
        const AROUND: usize = 16;
        /// Noise in P must not count as signal.
        const CLEAR: f64 = 3.0;
        let power: Vec<f64> = self
            .bins
            .iter()
            .map(|bin| bin.norm_sqr() / self.length as f64)
            .collect();
        let mut sums = vec![0.0; power.len() + 1];
        for (bin, power) in power.iter().enumerate() {
            sums[bin + 1] = sums[bin] + power;
        }
        let top = power.len() - 1;
        for (bin, value) in self.bins.iter_mut().enumerate() {
            let (first, last) = (
                bin.saturating_sub(AROUND),
                (bin + AROUND + 1).min(sums.len() - 1),
            );
            let mean = (sums[last] - sums[first]).max(0.0) / (last - first) as f64;
            let noise = level * shape.at(bin as f64 / top as f64);
            *value *= (1.0 - CLEAR * noise / mean.max(f64::MIN_POSITIVE)).max(0.0);
        }
        self
    }

    /// The signal at each row as `reading` asks.
    pub fn read(&self, reading: Reading) -> Vec<f64> {
        self.read_through(reading, &|_| Complex64::new(1.0, 0.0))
    }

    /// The same behind a linear system; `response` is its answer to e^(iωt) at a frequency \[Hz\].
    pub fn read_through(&self, reading: Reading, response: &dyn Fn(f64) -> Complex64) -> Vec<f64> {
        let margin = MARGIN_ROWS.min(self.rows - 1);
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
        padded[margin..margin + self.rows]
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

/// The spectra of a channel's pieces, between which nothing leaks; read, they stand end to end.
pub struct Spectra(Vec<Spectrum>);

impl Spectra {
    /// Takes the transform of each piece of `values`.
    pub fn new(values: &[f64], pieces: &[Range<usize>], rate_hz: f64, edge_hz: f64) -> Self {
        let of = |rows: &Range<usize>| Spectrum::new(&values[rows.clone()], rate_hz, edge_hz);
        Self(pieces.iter().map(of).collect())
    }

    /// See [`Spectrum::clear_of_noise`].
    pub fn clear_of_noise(self, level: f64, shape: NoiseShape) -> Self {
        let clear = |one: Spectrum| one.clear_of_noise(level, shape);
        Self(self.0.into_iter().map(clear).collect())
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

/// The next length that factors into 2, 3 and 5 and is even.
pub fn smooth_length(at_least: usize) -> usize {
    (at_least.max(2)..)
        .find(|&length| {
            let mut rest = length;
            for prime in [2, 3, 5] {
                while rest % prime == 0 {
                    rest /= prime;
                }
            }
            rest == 1 && length % 2 == 0
        })
        .expect("powers of two never end")
}

/// Mean periodogram of `values` over Hann-windowed, half-overlapping pieces of `piece` rows: the power per
/// row in each of `piece/2 + 1` bins (white noise of variance v gives v in every bin).
pub fn mean_periodogram(values: &[f64], piece: usize) -> Vec<f64> {
    let piece = piece.min(values.len() & !1).max(2);
    let window: Vec<f64> = (0..piece)
        .map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / piece as f64).cos())
        .collect();
    let norm: f64 = window.iter().map(|w| w * w).sum();
    let mut planner = RealFftPlanner::new();
    let forward: Arc<dyn RealToComplex<f64>> = planner.plan_fft_forward(piece);
    let (mut input, mut output) = (forward.make_input_vec(), forward.make_output_vec());
    let mut power = vec![0.0; piece / 2 + 1];
    let mut pieces = 0.0;
    let mut begin = 0;
    while begin + piece <= values.len() {
        for (slot, (value, weight)) in input
            .iter_mut()
            .zip(values[begin..begin + piece].iter().zip(&window))
        {
            *slot = value * weight;
        }
        forward
            .process(&mut input, &mut output)
            .expect("lengths come from the plan");
        for (sum, bin) in power.iter_mut().zip(&output) {
            *sum += bin.norm_sqr() / norm;
        }
        pieces += 1.0;
        begin += piece / 2;
    }
    power.iter().map(|sum| sum / pieces).collect()
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

/// Noise of a channel per row, in units of its shape: what is declared, or the spectrum's own top tenth where
/// that is more.
pub fn noise_level(values: &[f64], rate_hz: f64, shape: NoiseShape, declared: Option<f64>) -> f64 {
    let power = mean_periodogram(values, smooth_length((rate_hz / BIN_HZ) as usize));
    level_of(&power, shape, declared)
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
