//! Half-overlapping Hann frames, and their Fourier transforms.

use std::f64::consts::TAU;
use std::sync::Arc;

use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealToComplex};
use rlg_plan::FramePlan;

use crate::transforms;

/// Frames of one length.
pub struct Frames {
    /// Rows of a frame, even.
    pub length: usize,
    /// Hann window.
    pub window: Vec<f64>,
    /// Σ window².
    pub window_power: f64,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

impl Frames {
    /// Frames for `rows` rows at `rate_hz`; `None` where there are too few rows.
    pub fn new(rows: usize, rate_hz: f64, plan: &FramePlan) -> Option<Self> {
        let [shortest, longest] = plan.length_rows;
        let wished = (plan.length_s * rate_hz).clamp(shortest, longest);
        let length = 1_usize << (wished.log2().round() as u32);
        let longest = (rows / plan.least)
            .checked_ilog2()
            .map(|power| 1_usize << power)?;
        let length = length.min(longest);
        if length < plan.least_rows {
            return None;
        }
        let window: Vec<f64> = (0..length)
            .map(|row| 0.5 - 0.5 * (TAU * row as f64 / length as f64).cos())
            .collect();
        Some(Self {
            length,
            window_power: window.iter().map(|value| value * value).sum(),
            window,
            forward: transforms::forward(length),
            inverse: transforms::inverse(length),
        })
    }

    /// Rows between frames.
    pub fn hop(&self) -> usize {
        self.length / 2
    }

    /// Number of frequencies of a frame's transform.
    pub fn frequencies(&self) -> usize {
        self.length / 2 + 1
    }

    /// Transform of the windowed frame that begins at `first`.
    pub fn transform(&self, values: &[f64], first: usize) -> Vec<Complex64> {
        let mut frame: Vec<f64> = values[first..first + self.length]
            .iter()
            .zip(&self.window)
            .map(|(value, window)| value * window)
            .collect();
        let mut spectrum = self.forward.make_output_vec();
        self.forward
            .process(&mut frame, &mut spectrum)
            .expect("lengths as planned");
        spectrum
    }

    /// Inverse transform, by row.
    pub fn rows_of(&self, mut spectrum: Vec<Complex64>) -> Vec<f64> {
        let mut frame = self.inverse.make_output_vec();
        spectrum[0].im = 0.0;
        let last = spectrum.len() - 1;
        spectrum[last].im = 0.0;
        self.inverse
            .process(&mut spectrum, &mut frame)
            .expect("lengths as planned");
        let scale = 1.0 / self.length as f64;
        frame.iter_mut().for_each(|value| *value *= scale);
        frame
    }

    /// Noise power per row at a frame's frequencies, interpolated from that of `by_coefficient.len()` DCT-II coefficients.
    pub fn resample(&self, by_coefficient: &[f64]) -> Vec<f64> {
        let count = by_coefficient.len();
        (0..self.frequencies())
            .map(|k| {
                let place = k as f64 / self.length as f64 * 2.0 * count as f64;
                let low = (place as usize).min(count - 1);
                let high = (low + 1).min(count - 1);
                let share = (place - low as f64).clamp(0.0, 1.0);
                by_coefficient[low] + share * (by_coefficient[high] - by_coefficient[low])
            })
            .collect()
    }
}
