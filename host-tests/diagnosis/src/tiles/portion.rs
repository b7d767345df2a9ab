//! A part of the recording made of several stretches of time, as one series in the frequency domain.
//!
//! Enters: row ranges and values by row. Leaves: one-sided bins scaled so that the sum of conj(a)·b over
//! bins is the sum of a·b over rows; white noise of variance v has mean square v times the bin's degrees.
//!
//! The stretches stand end to end. Random walk of angle is unaffected by a joint; white noise of angle is affected, because
//! neighbouring increments share it. One free jump of angle per joint (and one for the seam of the circle) makes the noise
//! exactly circular again, at the price of about 20 ms of data each: see [`Portion::joints`].

use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealToComplex};
use std::ops::Range;
use std::sync::Arc;

use rlg_plan::HeldOutPlan;
use rlg_signal::transforms::{self, smooth_length};

/// Bins of one series.
pub type Bins = Vec<Complex64>;

/// Workspace of transforms.
#[derive(Default)]
pub struct Room {
    gathered: Vec<f64>,
    /// Result of the last transform.
    pub bins: Bins,
    scratch: Bins,
}

/// Stretches of the recording.
pub struct Portion {
    /// The stretches, in order, without overlap.
    pub ranges: Vec<Range<usize>>,
    length: usize,
    rate_hz: f64,
    /// Band that counts \[Hz\]; all frequencies, unless another series of the same recording has the rest.
    pub band_hz: [f64; 2],
    /// 4 sin² of half a row's phase in each bin: gain of differencing on white noise.
    differenced: Vec<f64>,
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

/// 4 sin²(π f/rate).
pub fn differenced(frequency_hz: f64, rate_hz: f64) -> f64 {
    4.0 * (std::f64::consts::PI * frequency_hz / rate_hz)
        .sin()
        .powi(2)
}

impl Portion {
    /// Joins `ranges`, the longest of too many; shortens the last by less than a hundredth for a fast transform. `None` if too
    /// few rows would be left.
    pub fn new(mut ranges: Vec<Range<usize>>, rate_hz: f64, plan: &HeldOutPlan) -> Option<Self> {
        ranges.retain(|range| !range.is_empty());
        if ranges.len() > plan.most_stretches {
            let mut lengths: Vec<usize> = ranges.iter().map(ExactSizeIterator::len).collect();
            lengths.sort_unstable_by(|a, b| b.cmp(a));
            let shortest = lengths[plan.most_stretches - 1];
            ranges.retain(|range| range.len() >= shortest);
            ranges.truncate(plan.most_stretches);
        }
        let total: usize = ranges.iter().map(ExactSizeIterator::len).sum();
        if total < plan.least_rows {
            return None;
        }
        let length = (0..total)
            .map(|less| total - less)
            .find(|&length| length % 2 == 0 && smooth_length(length) == length)?;
        let mut excess = total - length;
        while excess > 0 {
            let last = ranges.last_mut()?;
            let cut = excess.min(last.len());
            last.end -= cut;
            excess -= cut;
            if last.start == last.end {
                ranges.pop();
            }
        }
        let frequency_hz = |bin: usize| bin as f64 * rate_hz / length as f64;
        let bins = 0..length / 2 + 1;
        Some(Self {
            differenced: bins
                .map(|bin| differenced(frequency_hz(bin), rate_hz))
                .collect(),
            ranges,
            length,
            rate_hz,
            band_hz: [0.0, f64::INFINITY],
            forward: transforms::forward(length),
            inverse: transforms::inverse(length),
        })
    }

    /// The same with only the bins in `band_hz` counting.
    pub fn within(self, band_hz: [f64; 2]) -> Self {
        Self { band_hz, ..self }
    }

    /// True if a bin counts.
    pub fn counts(&self, bin: usize) -> bool {
        (self.band_hz[0]..self.band_hz[1]).contains(&self.frequency_hz(bin))
    }

    /// Rows in all stretches.
    pub fn rows(&self) -> usize {
        self.length
    }

    /// Seconds in all stretches.
    pub fn seconds(&self) -> f64 {
        self.length as f64 / self.rate_hz
    }

    /// Number of bins.
    pub fn bins(&self) -> usize {
        self.length / 2 + 1
    }

    /// The plan from bins to rows, unscaled.
    pub fn inverse(&self) -> &dyn ComplexToReal<f64> {
        &*self.inverse
    }

    /// Frequency of a bin \[Hz\].
    pub fn frequency_hz(&self, bin: usize) -> f64 {
        bin as f64 * self.rate_hz / self.length as f64
    }

    /// Gain of differencing on white noise in a bin, for rows at `rate_hz`.
    pub fn differenced(&self, bin: usize, rate_hz: f64) -> f64 {
        if rate_hz == self.rate_hz {
            self.differenced[bin]
        } else {
            differenced(self.frequency_hz(bin), rate_hz)
        }
    }

    /// The transform of `values` (by row of the recording).
    pub fn transform(&self, values: &[f64]) -> Bins {
        let mut room = Room::default();
        self.transform_in(&mut room, values);
        room.bins
    }

    /// The same with the result in the bins of `room`; for many transforms one after another.
    pub fn transform_in(&self, room: &mut Room, values: &[f64]) {
        room.gathered.clear();
        for range in &self.ranges {
            room.gathered.extend_from_slice(&values[range.clone()]);
        }
        self.transform_gathered(room);
    }

    fn transform_gathered(&self, room: &mut Room) {
        let Room {
            gathered,
            bins,
            scratch,
        } = room;
        bins.resize(self.bins(), Complex64::default());
        scratch.resize(self.forward.get_scratch_len(), Complex64::default());
        self.forward
            .process_with_scratch(gathered, bins, scratch)
            .expect("lengths come from the plan");
        let scale = 1.0 / (self.length as f64).sqrt();
        let last = bins.len() - 1;
        for (bin, value) in bins.iter_mut().enumerate() {
            // Bins of a conjugate pair count twice.
            *value *= if bin == 0 || bin == last {
                scale
            } else {
                scale * std::f64::consts::SQRT_2
            };
        }
    }

    /// Bins back in time: the values of the rows of this portion, end to end.
    pub fn rows_of(&self, bins: &Bins) -> Vec<f64> {
        let last = bins.len() - 1;
        let mut halved: Bins = bins
            .iter()
            .map(|bin| bin / std::f64::consts::SQRT_2)
            .collect();
        // The inverse transform takes real ends.
        (halved[0], halved[last]) = (bins[0].re.into(), bins[last].re.into());
        let mut values = self.inverse.make_output_vec();
        self.inverse
            .process(&mut halved, &mut values)
            .expect("lengths come from the plan");
        let scale = 1.0 / (self.length as f64).sqrt();
        values.iter_mut().for_each(|value| *value *= scale);
        values
    }

    /// One unit jump of angle at the first row of each stretch.
    pub fn joints(&self) -> Vec<Bins> {
        let mut first = 0;
        self.ranges
            .iter()
            .map(|range| {
                let mut room = Room {
                    gathered: vec![0.0; self.length],
                    ..Room::default()
                };
                room.gathered[first] = 1.0;
                first += range.len();
                self.transform_gathered(&mut room);
                room.bins
            })
            .collect()
    }

    /// Whittle log-likelihood of a residual under weights 1/S: −½ Σ (degrees · ln S + power/S).
    pub fn log_likelihood(&self, left: &Bins, weights: &[f64]) -> f64 {
        let of = |(bin, (value, weight)): (usize, (&Complex64, &f64))| {
            -0.5 * (value.norm_sqr() * weight - self.degrees(bin) * weight.ln())
        };
        left.iter()
            .zip(weights)
            .enumerate()
            .filter(|(bin, _)| self.counts(*bin))
            .map(of)
            .sum()
    }

    /// Range of the bins that count.
    pub fn counted(&self) -> Range<usize> {
        let mut counted = (0..self.bins()).filter(|&bin| self.counts(bin));
        let first = counted.next().unwrap_or(0);
        first..counted.next_back().map_or(first, |last| last + 1)
    }

    /// Real degrees of freedom in a bin; 0 if it does not count.
    pub fn degrees(&self, bin: usize) -> f64 {
        if !self.counts(bin) {
            0.0
        } else if bin == 0 || bin + 1 == self.bins() {
            1.0
        } else {
            2.0
        }
    }
}

/// Σ Re(conj(a)·b) · weight over bins.
pub fn inner(a: &[Complex64], b: &[Complex64], weight: &[f64]) -> f64 {
    let length = a.len().min(b.len()).min(weight.len());
    lanes(length, |bin| {
        (a[bin].re * b[bin].re + a[bin].im * b[bin].im) * weight[bin]
    })
}

/// Σ term(k) in eight interleaved sums, independent of one another.
pub fn lanes(length: usize, term: impl Fn(usize) -> f64) -> f64 {
    const LANES: usize = 8;
    let mut sums = [0.0; LANES];
    let whole = length - length % LANES;
    for first in (0..whole).step_by(LANES) {
        for (lane, sum) in sums.iter_mut().enumerate() {
            *sum += term(first + lane);
        }
    }
    sums.iter().sum::<f64>() + (whole..length).map(term).sum::<f64>()
}
