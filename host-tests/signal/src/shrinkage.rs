//! Motion where it stands out of its noise: a short-time Wiener gain.
//!
//! Power is averaged over three frequencies and three frames; where it is below a gate times the noise, the gain is 0. A
//! conditioned input alone is not enough: where noise dominates it, products and derivatives of it are noise.
//!
//! The input's noise is known to some uncertainty δ only, so in every cell that is kept the estimate and the residual still share
//! a power of δ. Over the kept cells of an octave that is a mean score of Σ δ/S over √Σ P/S for a column that fits nothing:
//! the gate rises until it is small.

use realfft::num_complex::Complex64;

use crate::frames::Frames;

/// Which cells are kept.
#[derive(Debug, Clone, Copy)]
pub struct Gate {
    /// Least power over noise.
    pub ratio: f64,
    /// Largest mean score of a column under the null, for a noise off by its standard deviation \[σ\].
    pub bias: f64,
}

impl Default for Gate {
    fn default() -> Self {
        Self {
            ratio: 6.0,
            bias: 0.2,
        }
    }
}

/// Powers by DCT-II coefficient.
#[derive(Debug, Clone, Copy)]
pub struct Powers<'a> {
    /// Noise of the input.
    pub left: &'a [f64],
    /// Standard deviation of the noise that the input shares with the residual.
    pub uncertain: &'a [f64],
    /// Noise of the residual.
    pub residual: &'a [f64],
}

/// An estimate with how many cells of time and frequency it keeps.
#[derive(Debug, Clone)]
pub struct Shrunk {
    /// The estimate by row.
    pub values: Vec<f64>,
    /// Cells whose gain is not 0.
    pub kept: usize,
    /// Variance of the input's noise that is left in a row, on the mean of the frames that keep anything.
    pub noise: f64,
}

/// Shrinks `values`. Records that are too short stay as they are.
pub fn shrink(values: &[f64], powers: &Powers, rate_hz: f64, gate: &Gate) -> Shrunk {
    let Some(frames) = Frames::new(values.len(), rate_hz) else {
        return Shrunk {
            values: values.to_vec(),
            kept: usize::MAX,
            noise: powers.left.iter().sum::<f64>() / values.len().max(1) as f64,
        };
    };
    let (length, hop, rows) = (frames.length, frames.hop(), values.len());
    let padded = odd_reflection(values, length);
    let count = (padded.len() - length) / hop + 1;
    let spectra: Vec<Vec<Complex64>> = (0..count)
        .map(|frame| frames.transform(&padded, frame * hop))
        .collect();
    let scaled = |power: &[f64]| -> Vec<f64> {
        let resampled = frames.resample(power).into_iter();
        resampled
            .map(|power| (power * frames.window_power).max(f64::MIN_POSITIVE))
            .collect()
    };
    let [left, uncertain, residual] = [powers.left, powers.uncertain, powers.residual].map(scaled);
    let over_frequency: Vec<Vec<f64>> = spectra
        .iter()
        .map(|spectrum| {
            let power: Vec<f64> = spectrum.iter().map(|value| value.norm_sqr()).collect();
            smoothed(&power)
        })
        .collect();
    let power_of = |frame: usize, k: usize| {
        let around = frame.saturating_sub(1)..(frame + 2).min(count);
        let number = around.len() as f64;
        over_frequency[around]
            .iter()
            .map(|frame| frame[k])
            .sum::<f64>()
            / number
    };
    let octaves = frames.frequencies().ilog2() as usize + 1;
    let mut cells: Vec<Vec<Cell>> = (0..octaves).map(|_| Vec::new()).collect();
    for frame in 0..count {
        for k in 0..frames.frequencies() {
            let power = power_of(frame, k);
            let ratio = power / left[k];
            if ratio > gate.ratio {
                cells[octave(k)].push(Cell {
                    ratio,
                    power: power / residual[k],
                    shared: uncertain[k] / residual[k],
                });
            }
        }
    }
    let thresholds: Vec<f64> = cells.into_iter().map(|cells| raised(cells, gate)).collect();
    let mut result = vec![0.0; padded.len()];
    let (mut kept, mut frames_kept, mut noise) = (0, 0, 0.0);
    for (frame, mut spectrum) in spectra.into_iter().enumerate() {
        let kept_before = kept;
        for (k, value) in spectrum.iter_mut().enumerate() {
            let ratio = power_of(frame, k) / left[k];
            let gain = if ratio > thresholds[octave(k)] {
                1.0 - 1.0 / ratio
            } else {
                0.0
            };
            *value *= gain;
            kept += usize::from(gain > 0.0);
            noise += gain * gain * left[k];
        }
        frames_kept += usize::from(kept > kept_before);
        for (sum, value) in result[frame * hop..]
            .iter_mut()
            .zip(frames.rows_of(spectrum))
        {
            *sum += value;
        }
    }
    Shrunk {
        values: result[length..length + rows].to_vec(),
        kept,
        noise: noise / (frames.window_power * (frames.frequencies() * frames_kept.max(1)) as f64),
    }
}

/// Derivatives weigh high frequencies: the gate is set in each octave by itself.
fn octave(k: usize) -> usize {
    k.max(1).ilog2() as usize
}

/// A cell of the plane of time and frequency.
struct Cell {
    /// Power over noise.
    ratio: f64,
    /// Power over the residual's noise.
    power: f64,
    /// Power that is shared with the residual, over its noise.
    shared: f64,
}

/// The least ratio at which the kept cells have no more than the gate's bias.
fn raised(mut cells: Vec<Cell>, gate: &Gate) -> f64 {
    cells.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
    let (mut power, mut shared) = (0.0, 0.0);
    let mut threshold = f64::INFINITY;
    for cell in &cells {
        power += cell.power;
        shared += cell.shared;
        if shared <= gate.bias * power.sqrt() {
            threshold = cell.ratio;
        }
    }
    // The cell at the threshold is kept.
    (threshold * (1.0 - f64::EPSILON)).max(gate.ratio)
}

/// Means of three neighbours; ends as they are.
fn smoothed(power: &[f64]) -> Vec<f64> {
    let mut result = power.to_vec();
    for k in 1..power.len() - 1 {
        result[k] = (power[k - 1] + power[k] + power[k + 1]) / 3.0;
    }
    result
}

/// `values` with `length` rows on either side, reflected about the end values.
fn odd_reflection(values: &[f64], length: usize) -> Vec<f64> {
    let rows = values.len();
    let (first, last) = (values[0], values[rows - 1]);
    let before = (1..=length)
        .rev()
        .map(|row| 2.0 * first - values[row.min(rows - 1)]);
    let after = (1..=length).map(|row| 2.0 * last - values[(rows - 1).saturating_sub(row)]);
    before.chain(values.iter().copied()).chain(after).collect()
}
