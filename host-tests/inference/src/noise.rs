//! Stationary noise in the terms of IEEE 952, each diagonal in a DCT-II.
//!
//! With λ_k = 4 sin²(π k / 2n), the power per row is 1 for angle random walk (N), λ_k for white angle (Q), 1/k for flicker
//! (B), and 1/λ_k for rate random walk (K). The two drift terms are scaled to 1 at the second and the first frequency of the
//! whole record. A constant under drift (k = 0) has the variance of the drift accumulated until then: a random walk from 0
//! has a mean of variance σ² (a + m/3) over m rows after a rows.

use std::f64::consts::PI;
use std::ops::Range;

use crate::dct::sines;
use crate::gaps;
use crate::observations::Observations;

/// Number of noise terms.
pub const TERMS: usize = 4;

/// Power of each term per row, in the record's unit squared: N, Q, B, K in this order.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NoiseLevels {
    /// Angle random walk: white noise of the record.
    pub white: f64,
    /// White angle noise, differenced in the record: quantisation, pickoff, encoder.
    pub angle: f64,
    /// Flicker, at the second frequency of the record.
    pub flicker: f64,
    /// Rate random walk, at the first frequency of the record.
    pub walk: f64,
}

impl NoiseLevels {
    /// Levels in the order N, Q, B, K.
    pub fn as_array(self) -> [f64; TERMS] {
        [self.white, self.angle, self.flicker, self.walk]
    }

    /// Levels from the order N, Q, B, K.
    pub fn from_array([white, angle, flicker, walk]: [f64; TERMS]) -> Self {
        Self {
            white,
            angle,
            flicker,
            walk,
        }
    }

    /// Power of white rate and white angle noise at a frequency, as a share of the row rate.
    pub fn of_share(self, share: f64) -> f64 {
        self.white + self.angle * 4.0 * (PI * share).sin().powi(2)
    }

    /// Mean of several records' levels.
    pub fn mean(levels: &[Self]) -> Self {
        let count = levels.len() as f64;
        let mut sum = [0.0; TERMS];
        for levels in levels {
            for (sum, level) in sum.iter_mut().zip(levels.as_array()) {
                *sum += level / count;
            }
        }
        Self::from_array(sum)
    }

    /// Converts the levels to rows of another length, in a record of another: angle random walk and drift keep their power a
    /// hertz; so does white angle below half the slower rate, as if the faster rows were summed.
    ///
    /// # Inputs
    /// `own`, `other`: rows a second \[Hz\] and length \[s\] of the record.
    pub fn of_other_rows(self, own: (f64, f64), other: (f64, f64)) -> Self {
        let (rate, span) = (other.0 / own.0, other.1 / own.1);
        Self {
            white: self.white / rate,
            angle: self.angle * rate,
            flicker: self.flicker * span / rate,
            walk: self.walk * span * span / rate,
        }
    }

    /// Levels without drift.
    pub fn stationary(self) -> Self {
        Self {
            flicker: 0.0,
            walk: 0.0,
            ..self
        }
    }
}

/// Frequencies in bins, with each term's mean power in them.
#[derive(Debug, Clone)]
pub struct NoiseBasis {
    /// Coefficients of each bin, counted through all spans.
    pub bins: Vec<Range<usize>>,
    /// Effective number of observations in each bin; gaps contribute none.
    pub counts: Vec<f64>,
    /// Mean power of each term in each bin.
    pub power: [Vec<f64>; TERMS],
    /// Middle frequency of each bin \[cycles per row\].
    pub frequency: Vec<f64>,
    spans: Vec<SpanShape>,
    record_rows: usize,
}

#[derive(Debug, Clone)]
struct SpanShape {
    rows: usize,
    /// Rows of the record before the span.
    before: usize,
}

/// Last coefficient of single-coefficient bins.
const SINGLE_BINS: usize = 32;

/// Width of a wider bin, as a share of its frequency.
const BIN_WIDTH: f64 = 0.08;

/// Power of differenced noise at zero frequency, as a share of that at the next.
const CONSTANT_OF_ANGLE: f64 = 0.25;

impl NoiseBasis {
    /// A basis without bins.
    pub fn empty() -> Self {
        let none = Observations {
            spans: Vec::new(),
            record_rows: 0,
        };
        Self::new(&none)
    }

    /// Terms of independent observations, a bin each: values not on rows, such as means over intervals.
    ///
    /// # Inputs
    /// `power`: of each term in each observation; `counts`: number of observations represented by each.
    pub fn of_values(power: [Vec<f64>; TERMS], counts: Vec<f64>) -> Self {
        Self {
            bins: (0..counts.len()).map(|one| one..one + 1).collect(),
            frequency: vec![0.0; counts.len()],
            record_rows: counts.len(),
            spans: Vec::new(),
            power,
            counts,
        }
    }

    /// Forms bins and terms for `observations`.
    pub fn new(observations: &Observations) -> Self {
        let mut basis = Self {
            bins: Vec::new(),
            counts: Vec::new(),
            power: Default::default(),
            frequency: Vec::new(),
            spans: Vec::new(),
            record_rows: observations.record_rows,
        };
        let mut first = 0;
        for span in &observations.spans {
            let shape = SpanShape {
                rows: span.rows.len(),
                before: span.rows.start,
            };
            let share = |k: usize| {
                let missing = span
                    .gaps
                    .iter()
                    .map(|gap| gaps::missing(gap.len(), shape.rows, k));
                1.0 - missing.sum::<f64>()
            };
            let sines = sines(shape.rows);
            let mut begin = 0;
            while begin < shape.rows {
                let wide = (begin as f64 * (1.0 + BIN_WIDTH)) as usize;
                let end = if begin < SINGLE_BINS {
                    begin + 1
                } else {
                    wide.max(begin + 1)
                };
                let end = end.min(shape.rows);
                let mut sums = [0.0; TERMS];
                for (k, sine) in sines.iter().enumerate().take(end).skip(begin) {
                    let terms = basis.terms_at(&shape, k, *sine);
                    for (sum, term) in sums.iter_mut().zip(terms) {
                        *sum += term;
                    }
                }
                for (power, sum) in basis.power.iter_mut().zip(sums) {
                    power.push(sum / (end - begin) as f64);
                }
                basis
                    .counts
                    .push(share((begin + end) / 2) * (end - begin) as f64);
                basis.bins.push(first + begin..first + end);
                basis
                    .frequency
                    .push((begin + end - 1) as f64 / (4 * shape.rows) as f64);
                begin = end;
            }
            first += shape.rows;
            basis.spans.push(shape);
        }
        basis
    }

    /// Power of each term in coefficient `k` of a span of n rows, `sine` being that of π k/2n.
    fn terms_at(&self, shape: &SpanShape, k: usize, sine: f64) -> [f64; TERMS] {
        let n = shape.rows as f64;
        let record = self.record_rows as f64;
        let walk = (PI / record).powi(2);
        let flicker = 2.0 / record;
        if k == 0 {
            let before = shape.before as f64;
            let first = 4.0 * (PI / (2.0 * n)).sin().powi(2);
            let built_up = n * (before + n / 3.0);
            let grown = (1.0 + before / n).ln() + 1.0;
            return [
                1.0,
                CONSTANT_OF_ANGLE * first,
                flicker * n / CONSTANT_OF_FLICKER * grown,
                walk * built_up,
            ];
        }
        let lambda = 4.0 * sine * sine;
        [1.0, lambda, flicker * n / k as f64, walk / lambda]
    }

    /// Reduces the counts of a span's bins by the shares `taken` of each coefficient.
    pub(crate) fn take_out(&mut self, span: Range<usize>, taken: impl Fn(usize) -> f64) {
        /// Coefficients sampled in a wide bin.
        const SAMPLES: usize = 16;
        for (count, bin) in self.counts.iter_mut().zip(&self.bins) {
            if !span.contains(&bin.start) {
                continue;
            }
            let samples = bin.len().min(SAMPLES);
            let each = (0..samples).map(|sample| taken(bin.start + sample * bin.len() / samples));
            let left = 1.0 - each.sum::<f64>() / samples as f64;
            *count = (*count * left).max(LEAST_COUNT);
        }
    }

    /// Reduces each bin's count by a number of observations.
    pub(crate) fn take_out_of_bins(&mut self, taken: impl Iterator<Item = f64>) {
        for (count, taken) in self.counts.iter_mut().zip(taken) {
            *count = (*count - taken).max(LEAST_COUNT);
        }
    }

    /// Number of coefficients.
    pub fn coefficients(&self) -> usize {
        self.spans.iter().map(|span| span.rows).sum()
    }

    /// Noise power in every bin.
    pub fn binned(&self, levels: NoiseLevels) -> Vec<f64> {
        let levels = levels.as_array();
        (0..self.bins.len())
            .map(|bin| {
                let terms = self.power.iter().zip(levels);
                terms.map(|(power, level)| level * power[bin]).sum()
            })
            .collect()
    }

    /// Root of the noise power of every coefficient.
    pub fn roots(&self, levels: NoiseLevels) -> Vec<f64> {
        let powers = self.by_coefficient(levels).into_iter();
        powers.map(f64::sqrt).collect()
    }

    /// Noise power of every coefficient.
    pub fn by_coefficient(&self, levels: NoiseLevels) -> Vec<f64> {
        let levels = levels.as_array();
        let mut powers = Vec::with_capacity(self.coefficients());
        for shape in &self.spans {
            powers.extend(sines(shape.rows).into_iter().enumerate().map(|(k, sine)| {
                let terms = self.terms_at(shape, k, sine).into_iter().zip(levels);
                terms.map(|(power, level)| level * power).sum::<f64>()
            }));
        }
        powers
    }

    /// 1/S of every coefficient.
    pub fn weights(&self, levels: NoiseLevels) -> Vec<f64> {
        let powers = self.by_coefficient(levels).into_iter();
        powers.map(|power| 1.0 / power).collect()
    }
}

/// Flicker's constant has the power at frequency 0.55, as a random walk's mean has.
const CONSTANT_OF_FLICKER: f64 = 0.55;
/// Least count of a bin, where nuisance parameters take almost all.
const LEAST_COUNT: f64 = 1e-3;
#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::{NoiseBasis, NoiseLevels};
    use crate::Observations;

    /// Normal numbers of a seed.
    fn normals(seed: u64, count: usize) -> Vec<f64> {
        let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        StandardNormal.sample_iter(rng).take(count).collect()
    }

    #[test]
    fn the_mean_of_a_random_walk_has_the_power_that_is_set_for_it() {
        let basis = NoiseBasis::new(&Observations::bridged(&[true; 256]).expect("rows"));
        let trials = 4000;
        let mut sum = 0.0;
        for seed in 0..trials {
            let mut drift = 0.0;
            let mut total = 0.0;
            for step in normals(seed, 256) {
                drift += step;
                total += drift;
            }
            sum += total * total / 256.0 / trials as f64;
        }
        let level = 1.0 / (std::f64::consts::PI / 256.0).powi(2);
        let expected = basis.by_coefficient(NoiseLevels {
            walk: level,
            ..NoiseLevels::default()
        })[0];
        assert!((sum / expected - 1.0).abs() < 0.08, "{}", sum / expected);
    }
}
