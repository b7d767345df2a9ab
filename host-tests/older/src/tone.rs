//! The power of a steady line between the bins.
//!
//! Enters: whitened rows around a bin, of unit variance, with their places in the recording. Leaves: 2 Δ ln L of a
//! sine and cosine at any frequency near the bin's. The rows are turned back by the bin's own frequency once and
//! summed in short runs; another frequency near by then costs one turn a run instead of one a row. A run is so short
//! that the furthest frequency asked for turns by 1/100 rad in it, which takes parts in 1e5 of the power.

use realfft::num_complex::Complex64;
use std::f64::consts::TAU;

/// Turn of the furthest frequency over a run \[rad\].
const RUN_TURN_RAD: f64 = 0.01;

/// Rows turned back and summed.
pub struct Tone {
    around_hz: f64,
    rows: usize,
    /// Middle \[s\], and cosine and sine sum.
    runs: Vec<(f64, Complex64)>,
}

impl Tone {
    /// `whitened` as (row, value); `time_s` of a row's middle; frequencies up to `width_hz` on either side.
    pub fn new(
        whitened: &[(usize, f64)],
        around_hz: f64,
        width_hz: f64,
        time_s: impl Fn(usize) -> f64,
    ) -> Self {
        let period_s = time_s(1) - time_s(0);
        let run_rows = ((RUN_TURN_RAD / (TAU * width_hz * period_s)) as usize).max(1);
        let mut runs = Vec::with_capacity(whitened.len() / run_rows + 1);
        // A run ends at a gap, so that its middle is the middle of its rows.
        for stretch in whitened.chunk_by(|a, b| a.0 + 1 == b.0) {
            for run in stretch.chunks(run_rows) {
                let turned = |(row, value): &(usize, f64)| {
                    Complex64::cis(TAU * around_hz * time_s(*row)) * value
                };
                let sum = run.iter().map(turned).sum();
                let middle_s = 0.5 * (time_s(run[0].0) + time_s(run[run.len() - 1].0));
                runs.push((middle_s, sum));
            }
        }
        Self {
            around_hz,
            rows: whitened.len(),
            runs,
        }
    }

    /// 2 Δ ln L of a line at this frequency.
    pub fn ratio(&self, frequency_hz: f64) -> f64 {
        self.ratios(frequency_hz, 0.0, 1)[0]
    }

    /// The same at `count` frequencies, `spacing_hz` apart: each run is turned on by the same small angle.
    pub fn ratios(&self, from_hz: f64, spacing_hz: f64, count: usize) -> Vec<f64> {
        let mut sums = vec![Complex64::ZERO; count];
        for (time_s, run) in &self.runs {
            let angle_rad = |frequency_hz: f64| TAU * frequency_hz * time_s;
            let mut turned = run * Complex64::cis(angle_rad(from_hz - self.around_hz));
            let turn = Complex64::cis(angle_rad(spacing_hz));
            for sum in &mut sums {
                *sum += turned;
                turned *= turn;
            }
        }
        let scale = 2.0 / self.rows as f64;
        sums.iter().map(|sum| scale * sum.norm_sqr()).collect()
    }
}
