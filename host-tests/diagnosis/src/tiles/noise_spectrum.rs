//! The noise of a residual, in Allan terms: S(f) per row \[rad²\] = Σ θ_b B_b(f) with B = 1 (random walk of angle),
//! 4 sin²(πf/fs) (white angle: quantisation, pickoff, reference), 1/f (flicker) and 1/(4 sin²(πf/fs))
//! (rate random walk).

use super::portion::{Portion, differenced};

/// Number of noise terms.
pub const TERMS: usize = 4;

/// Lowest frequency of the drifting terms, as a share of the first bin's: the mean over T of a rate that walks at random has
/// variance σ²T/3, the terms' shape has σ²T/π² at half the first bin.
pub const LOWEST_SHARE: f64 = 0.275;

/// Names of the terms in reports.
pub const TERM_NAMES: [&str; TERMS] = [
    "angle random walk",
    "white angle noise",
    "flicker",
    "rate random walk",
];

/// S(f) of one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// θ of the terms, in the order of [`TERM_NAMES`] \[rad²; the last two times Hz and 1\].
    pub theta: [f64; TERMS],
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
}

impl Noise {
    /// Random walk of angle with θ = 1 rad²: weights all rows alike before any noise is known.
    pub fn unit(rate_hz: f64) -> Self {
        Self {
            theta: [1.0, 0.0, 0.0, 0.0],
            rate_hz,
        }
    }

    /// The terms at a frequency. Below `floor_hz` the drifting terms stay at their value there.
    pub fn terms(frequency_hz: f64, rate_hz: f64, floor_hz: f64) -> [f64; TERMS] {
        let floored = frequency_hz.max(floor_hz);
        [
            1.0,
            differenced(frequency_hz, rate_hz),
            1.0 / floored,
            1.0 / differenced(floored, rate_hz),
        ]
    }

    /// The same in a bin of a portion.
    pub fn terms_in(portion: &Portion, bin: usize, rate_hz: f64, floor_hz: f64) -> [f64; TERMS] {
        let frequency_hz = portion.frequency_hz(bin);
        if frequency_hz < floor_hz {
            return Self::terms(frequency_hz, rate_hz, floor_hz);
        }
        let differenced = portion.differenced(bin, rate_hz);
        [1.0, differenced, 1.0 / frequency_hz, 1.0 / differenced]
    }

    /// S at a frequency \[rad²\].
    pub fn at(&self, frequency_hz: f64, floor_hz: f64) -> f64 {
        Self::terms(frequency_hz, self.rate_hz, floor_hz)
            .iter()
            .zip(self.theta)
            .map(|(shape, theta)| shape * theta)
            .sum()
    }

    /// 1/S in every bin of a portion; 0 if the bin does not count.
    pub fn weights(&self, portion: &Portion) -> Vec<f64> {
        let floor_hz = portion.frequency_hz(1) * LOWEST_SHARE;
        let weight = |bin: usize| {
            let shape = Self::terms_in(portion, bin, self.rate_hz, floor_hz);
            1.0 / level_of(&shape, self)
        };
        (0..portion.bins())
            .map(|bin| {
                if portion.counts(bin) {
                    weight(bin)
                } else {
                    0.0
                }
            })
            .collect()
    }

    /// The same without the drifting terms.
    pub fn steady(&self) -> Self {
        Self {
            theta: [self.theta[0], self.theta[1], 0.0, 0.0],
            ..*self
        }
    }

    /// The noise of sums over blocks of rows, at frequencies far below the blocks' own.
    pub fn of_blocks(&self, block: usize) -> Self {
        let rows = block as f64;
        let [walk, white, flicker, drift] = self.theta;
        Self {
            // Power per Hz stays; white angle noise has its own shape, drift goes as 1/sin² of the new angle.
            theta: [rows * walk, white, rows * flicker, rows.powi(3) * drift],
            rate_hz: self.rate_hz / rows,
        }
    }

    /// Standard deviation \[rad/s\] of a mean rate over `seconds` of a record of `span_s`: random walk of angle,
    /// drifting terms since the record's beginning, and the white angle noise of the two ends.
    pub fn mean_rate_std_rad_s(&self, seconds: f64, span_s: f64) -> f64 {
        // Drift does not start anew in each stretch: its variance is that of the whole record.
        let drifting = self.wander_rad_s(span_s).powi(2);
        let floor_hz = LOWEST_SHARE / span_s;
        let slow = self.steady().at(0.0, floor_hz) * self.rate_hz / seconds + drifting;
        let ends = 2.0 * self.theta[1] / (seconds * seconds);
        (slow + ends).sqrt()
    }

    /// Standard deviation \[rad/s\] of the mean over a record of `span_s` that the drifting terms alone give.
    pub fn wander_rad_s(&self, span_s: f64) -> f64 {
        let floor_hz = LOWEST_SHARE / span_s;
        let drifting = self.at(0.0, floor_hz) - self.steady().at(0.0, floor_hz);
        (drifting * self.rate_hz / span_s).max(0.0).sqrt()
    }

    /// Angle random walk \[rad/√s\].
    pub fn angle_random_walk_rad_sqrt_s(&self) -> f64 {
        (self.theta[0] * self.rate_hz).sqrt()
    }

    /// White noise of angle \[rad\].
    pub fn angle_noise_rad(&self) -> f64 {
        self.theta[1].sqrt()
    }
}

/// Noise declared by the model: random walk of angle and white angle noise as θ, where known.
#[derive(Debug, Clone, Copy)]
pub struct Declared {
    /// θ of the random walk \[rad²\].
    pub random_walk: Option<f64>,
    /// θ of white angle noise \[rad²\].
    pub white_angle: Option<f64>,
}

/// S of the terms' shapes in one bin \[rad²\].
pub fn level_of(shape: &[f64; TERMS], noise: &Noise) -> f64 {
    shape
        .iter()
        .zip(noise.theta)
        .map(|(shape, theta)| shape * theta)
        .sum()
}
