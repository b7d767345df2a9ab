//! Estimate of the motion from noise by a gated short-time Wiener gain.
//!
//! Power is averaged over three frequencies and three frames; below a gate times the noise, the gain is 0. A conditioned
//! input alone is not enough: where noise dominates it, products and derivatives of it are noise.
//!
//! The input's noise has an uncertainty δ, so in every kept cell the estimate and the residual still share a power of δ.
//! Over the kept cells of an octave that is a mean score of Σ δ/S over √Σ P/S for a column without effect: the gate rises
//! until it is small.

use realfft::num_complex::Complex64;
use rlg_plan::{FramePlan, GatePlan};

use crate::frames::Frames;

/// Powers by DCT-II coefficient.
#[derive(Debug, Clone, Copy)]
pub struct Powers<'a> {
    /// Upper bound of the input's noise.
    pub left: &'a [f64],
    /// Expected input noise.
    pub expected: &'a [f64],
    /// Noise of the input in rows without a residual for its conditioning.
    pub before: &'a [f64],
    /// Standard deviation of the noise common to input and residual.
    pub uncertain: &'a [f64],
    /// Noise of the residual.
    pub residual: &'a [f64],
}

/// An estimate with its number of kept cells of time and frequency.
#[derive(Debug, Clone)]
pub struct Shrunk {
    /// The estimate by row.
    pub values: Vec<f64>,
    /// The ungated estimate by row: every cell by its Wiener gain times the posterior probability of motion.
    pub likeliest: Vec<f64>,
    /// Cells of nonzero gain.
    pub kept: usize,
    /// Residual variance of the input's noise in a row, averaged over the frames with kept cells.
    pub noise: f64,
}

/// Shrinks `values` by the gated Wiener gain. Records that are too short stay unchanged.
///
/// # Inputs
/// `seen`: rows whose residual conditioned the input.
pub fn shrink(
    values: &[f64],
    powers: &Powers,
    seen: &[bool],
    rate_hz: f64,
    gate: &GatePlan,
) -> Shrunk {
    let Some(plane) = Plane::new(values, rate_hz, &gate.frames) else {
        return Shrunk {
            values: values.to_vec(),
            likeliest: values.to_vec(),
            kept: usize::MAX,
            noise: powers.left.iter().sum::<f64>() / values.len().max(1) as f64,
        };
    };
    let resampled = |power: &[f64]| plane.resampled(power);
    let [left, expected, before] = [powers.left, powers.expected, powers.before].map(resampled);
    let [uncertain, residual] = [powers.uncertain, powers.residual].map(resampled);
    let unseen = plane.share_without(seen);
    let ratio =
        |frame: usize, k: usize| plane.power(frame, k) / (left[k] + unseen[frame] * before[k]);
    let frequencies = plane.frames.frequencies();
    let octaves = frequencies.ilog2() as usize + 1;
    let mut cells: Vec<Vec<Cell>> = (0..octaves).map(|_| Vec::new()).collect();
    for frame in 0..plane.count() {
        for k in 0..frequencies {
            let ratio = ratio(frame, k);
            if ratio > gate.ratio {
                cells[octave(k)].push(Cell {
                    ratio,
                    power: plane.power(frame, k) / residual[k],
                    shared: uncertain[k] / residual[k],
                });
            }
        }
    }
    let mut all = vec![0; octaves];
    (0..frequencies).for_each(|k| all[octave(k)] += plane.count());
    let moving = cells.iter().zip(&all);
    let odds: Vec<f64> = moving
        .map(|(moving, all)| (moving.len() as f64 + 0.5) / ((all - moving.len()) as f64 + 0.5))
        .collect();
    let thresholds: Vec<f64> = cells.into_iter().map(|cells| raised(cells, gate)).collect();
    let (mut kept, mut frames_kept, mut noise) = (0, 0, 0.0);
    for frame in 0..plane.count() {
        let kept_before = kept;
        for (k, left) in left.iter().enumerate() {
            let ratio = ratio(frame, k);
            if ratio > thresholds[octave(k)] {
                kept += 1;
                noise += gain(ratio).powi(2) * left;
            }
        }
        frames_kept += usize::from(kept > kept_before);
    }
    let over = (frequencies * frames_kept.max(1)) as f64;
    let noise = noise / (plane.frames.window_power * over);
    let likeliest = plane.weighted(|frame, k| {
        let ratio = plane.power(frame, k) / (expected[k] + unseen[frame] * before[k]);
        gain(ratio) * chance_of_motion(ratio, odds[octave(k)])
    });
    let gated = |frame: usize, k: usize| {
        let ratio = ratio(frame, k);
        if ratio > thresholds[octave(k)] {
            gain(ratio)
        } else {
            0.0
        }
    };
    Shrunk {
        values: plane.weighted(gated),
        likeliest,
        kept,
        noise,
    }
}

/// Wiener gain for a ratio of power to noise.
fn gain(ratio: f64) -> f64 {
    (1.0 - 1.0 / ratio).max(0.0)
}

/// Posterior probability that a cell holds motion besides its noise.
///
/// # Inputs
/// `ratio`: power over noise of the cell; `odds`: prior odds in its octave. Most cells above a motion's band hold none, and
/// a gain by their own power alone would keep a quarter of their noise, which derivatives amplify.
fn chance_of_motion(ratio: f64, odds: f64) -> f64 {
    /// Effective number of independent values in the mean of three frequencies and three frames under a Hann window: power
    /// correlation 4/9 of neighbours, 1/36 of second neighbours and of frames half a length apart (Harris 1978).
    const INDEPENDENT: f64 = 5.4;
    if ratio <= 1.0 {
        return 0.0;
    }
    let against = (-INDEPENDENT * (ratio - 1.0 - ratio.ln())).exp();
    odds / (odds + against)
}

/// Spectrogram of a record.
struct Plane {
    frames: Frames,
    spectra: Vec<Vec<Complex64>>,
    over_frequency: Vec<Vec<f64>>,
    rows: usize,
    padded: usize,
}

impl Plane {
    /// `None` where there are too few rows.
    fn new(values: &[f64], rate_hz: f64, plan: &FramePlan) -> Option<Self> {
        let frames = Frames::new(values.len(), rate_hz, plan)?;
        let (length, hop) = (frames.length, frames.hop());
        let padded = odd_reflection(values, length);
        let count = (padded.len() - length) / hop + 1;
        let spectra: Vec<Vec<Complex64>> = (0..count)
            .map(|frame| frames.transform(&padded, frame * hop))
            .collect();
        let over_frequency = spectra
            .iter()
            .map(|spectrum| {
                let power: Vec<f64> = spectrum.iter().map(|value| value.norm_sqr()).collect();
                smoothed(&power)
            })
            .collect();
        Some(Self {
            rows: values.len(),
            padded: padded.len(),
            frames,
            spectra,
            over_frequency,
        })
    }

    fn count(&self) -> usize {
        self.spectra.len()
    }

    /// Powers by DCT-II coefficient, resampled to a frame's frequencies and scaled as its transform.
    fn resampled(&self, power: &[f64]) -> Vec<f64> {
        let resampled = self.frames.resample(power).into_iter();
        resampled
            .map(|power| (power * self.frames.window_power).max(f64::MIN_POSITIVE))
            .collect()
    }

    /// Share of rows in a frame and its neighbours that are not `seen`; reflected rows at the ends are not.
    fn share_without(&self, seen: &[bool]) -> Vec<f64> {
        let (length, hop) = (self.frames.length, self.frames.hop());
        let is_unseen = |at: usize| {
            let row = at.checked_sub(length);
            !row.is_some_and(|row| seen.get(row).is_some_and(|seen| *seen))
        };
        let own: Vec<f64> = (0..self.count())
            .map(|frame| {
                let rows = frame * hop..frame * hop + length;
                rows.filter(|&at| is_unseen(at)).count() as f64 / length as f64
            })
            .collect();
        (0..self.count())
            .map(|frame| {
                let around = &own[frame.saturating_sub(1)..(frame + 2).min(own.len())];
                around.iter().sum::<f64>() / around.len() as f64
            })
            .collect()
    }

    /// Mean power of a cell and its neighbours.
    fn power(&self, frame: usize, k: usize) -> f64 {
        let around = frame.saturating_sub(1)..(frame + 2).min(self.count());
        let number = around.len() as f64;
        let frames = self.over_frequency[around].iter();
        frames.map(|frame| frame[k]).sum::<f64>() / number
    }

    /// Applies a gain to every cell and transforms back.
    fn weighted(&self, gain: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let mut result = vec![0.0; self.padded];
        for (frame, spectrum) in self.spectra.iter().enumerate() {
            let weighted = spectrum
                .iter()
                .enumerate()
                .map(|(k, value)| value * gain(frame, k))
                .collect();
            let rows = self.frames.rows_of(weighted);
            for (sum, value) in result[frame * self.frames.hop()..].iter_mut().zip(rows) {
                *sum += value;
            }
        }
        result[self.frames.length..self.frames.length + self.rows].to_vec()
    }
}

/// Octave of a frequency: the gate is set by octave, as derivatives weigh high frequencies.
fn octave(k: usize) -> usize {
    k.max(1).ilog2() as usize
}

/// A cell of the plane of time and frequency.
struct Cell {
    /// Power over noise.
    ratio: f64,
    /// Power over the residual's noise.
    power: f64,
    /// Power common with the residual, over the residual's noise.
    shared: f64,
}

/// Returns the least ratio whose kept cells stay within the gate's bias.
fn raised(mut cells: Vec<Cell>, gate: &GatePlan) -> f64 {
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

/// Moving average of three neighbours; ends unchanged.
fn smoothed(power: &[f64]) -> Vec<f64> {
    let mut result = power.to_vec();
    for k in 1..power.len() - 1 {
        result[k] = (power[k - 1] + power[k] + power[k + 1]) / 3.0;
    }
    result
}

/// `values` extended by `length` rows on either side, by odd reflection about the end values.
fn odd_reflection(values: &[f64], length: usize) -> Vec<f64> {
    let rows = values.len();
    let (first, last) = (values[0], values[rows - 1]);
    let before = (1..=length)
        .rev()
        .map(|row| 2.0 * first - values[row.min(rows - 1)]);
    let after = (1..=length).map(|row| 2.0 * last - values[(rows - 1).saturating_sub(row)]);
    before.chain(values.iter().copied()).chain(after).collect()
}

#[cfg(test)]
mod tests {
    use super::{Powers, shrink};
    use rlg_plan::GatePlan;

    /// Pseudo-random noise of variance 1, with a period of 2³².
    fn noise(rows: usize) -> Vec<f64> {
        let mut state = 1_u32;
        let mut even = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(u32::MAX) - 0.5
        };
        (0..rows)
            .map(|_| (0..12).map(|_| even()).sum::<f64>())
            .collect()
    }

    fn second_differences(values: &[f64]) -> f64 {
        let squares = values
            .windows(3)
            .map(|of| (of[0] - 2.0 * of[1] + of[2]).powi(2));
        (squares.sum::<f64>() / values.len() as f64).sqrt()
    }

    #[test]
    fn derivatives_of_the_likeliest_motion_are_not_those_of_its_noise() {
        let rows = 8192;
        let motion = |row: usize| 1e3 * (0.02 * row as f64).sin();
        let noise = noise(rows);
        let values: Vec<f64> = noise
            .iter()
            .enumerate()
            .map(|(row, noise)| motion(row) + noise)
            .collect();
        let (white, nothing) = (vec![1.0; rows], vec![1e-9; rows]);
        let powers = Powers {
            left: &white,
            expected: &white,
            before: &white,
            uncertain: &nothing,
            residual: &white,
        };
        let shrunk = shrink(
            &values,
            &powers,
            &vec![true; rows],
            200.0,
            &GatePlan::default(),
        );
        let off: Vec<f64> = (0..rows)
            .map(|row| shrunk.likeliest[row] - motion(row))
            .collect();
        let inside = 512..rows - 512;
        let share = second_differences(&off[inside.clone()]) / second_differences(&noise[inside]);
        assert!(share < 0.1, "{share}");
    }
}
