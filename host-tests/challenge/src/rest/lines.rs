//! Steady lines on gyros at rest, drawn: one, several, or two and their product.

use std::f64::consts::{FRAC_PI_2, PI};

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use super::planted::Planted;
use crate::marks::effects::{AXES, Concealed};
use crate::marks::setting::log_uniform;

/// Matched-filter SNR of lines.
const STRENGTHS: [f64; 2] = [12.0, 300.0];

/// Least distance of two lines \[resolutions\].
const APART: f64 = 10.0;

/// A steady line: amplitudes of the rows' means \[rad/s\] and phases \[rad\], x y z.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Frequency \[Hz\].
    pub frequency_hz: f64,
    /// The inverse of the recording's length \[Hz\].
    pub resolution_hz: f64,
    /// Amplitudes \[rad/s\].
    pub amplitude_rad_s: [f64; 3],
    /// Phases \[rad\].
    pub phase_rad: [f64; 3],
    /// Matched-filter SNR.
    pub rho: f64,
}

/// Limits of the drawn lines.
#[derive(Debug, Clone, Copy)]
pub struct Room {
    /// Row rate \[Hz\].
    pub rate_hz: f64,
    /// Number of rows.
    pub rows: usize,
    /// Angle random walk of the gyros \[rad/√s\].
    pub walk_rad_sqrt_s: [f64; 3],
}

impl Room {
    fn length_s(&self) -> f64 {
        self.rows as f64 / self.rate_hz
    }

    /// Returns the observable frequency band \[Hz\].
    fn band_hz(&self) -> [f64; 2] {
        [APART / self.length_s(), 0.45 * self.rate_hz]
    }

    /// Draws the injected lines; `None` if they overlap or are outside the band.
    pub fn lines(&self, planted: Planted, rng: &mut ChaCha8Rng) -> Option<Vec<Line>> {
        let lines = match planted {
            Planted::Line => vec![self.line(true, rng)],
            Planted::Lines => {
                let count = rng.random_range(2..=3);
                let mut one = || {
                    let on_one = rng.random_bool(0.5);
                    self.line(on_one, rng)
                };
                (0..count).map(|_| one()).collect()
            }
            Planted::ProductOfLines => self.product(rng),
            _ => Vec::new(),
        };
        let [low_hz, high_hz] = self.band_hz();
        let mut frequencies_hz: Vec<f64> = lines.iter().map(|line| line.frequency_hz).collect();
        frequencies_hz.sort_by(f64::total_cmp);
        let is_shown = frequencies_hz
            .iter()
            .all(|hz| (low_hz..high_hz).contains(hz));
        let mut pairs = frequencies_hz.windows(2);
        let are_apart = pairs.all(|pair| pair[1] - pair[0] > APART / self.length_s());
        (is_shown && are_apart).then_some(lines)
    }

    /// Draws two lines of all gyros and, on one gyro, c sin a sin b = c/2 (sin(a − b + π/2) + sin(a + b − π/2)).
    fn product(&self, rng: &mut ChaCha8Rng) -> Vec<Line> {
        let [first, second] = [self.line(false, rng), self.line(false, rng)];
        let mut sum = self.line(true, rng);
        sum.frequency_hz = first.frequency_hz + second.frequency_hz;
        let mut difference = sum.clone();
        let beat_hz = first.frequency_hz - second.frequency_hz;
        difference.frequency_hz = beat_hz.abs();
        for axis in 0..3 {
            let (a, b) = (first.phase_rad[axis], second.phase_rad[axis]);
            sum.phase_rad[axis] = a + b - FRAC_PI_2;
            difference.phase_rad[axis] = beat_hz.signum() * (a - b) + FRAC_PI_2;
        }
        vec![first, second, sum, difference]
    }

    /// Draws a line of one gyro, or of all.
    fn line(&self, on_one: bool, rng: &mut ChaCha8Rng) -> Line {
        let [low_hz, high_hz] = self.band_hz();
        let frequency_hz = log_uniform(rng, low_hz, high_hz);
        let only = rng.random_range(0..3);
        let rho = log_uniform(rng, STRENGTHS[0], STRENGTHS[1]);
        // ρ² = A² t/2N² of each gyro
        let share = if on_one { 1.0 } else { 3_f64.sqrt().recip() };
        let amplitude_rad_s = std::array::from_fn(|axis| {
            let is_quiet = on_one && axis != only;
            let walk = if is_quiet {
                0.0
            } else {
                self.walk_rad_sqrt_s[axis]
            };
            share * rho * walk * (2.0 / self.length_s()).sqrt()
        });
        Line {
            frequency_hz,
            resolution_hz: 1.0 / self.length_s(),
            amplitude_rad_s,
            phase_rad: std::array::from_fn(|_| 2.0 * PI * rng.random::<f64>()),
            rho,
        }
    }
}

impl Line {
    /// Converts the line to its form in the commitment.
    pub fn concealed(&self) -> Concealed {
        let resolution = ("resolution_hz".to_owned(), Value::from(self.resolution_hz));
        let frequency = ("frequency_hz".to_owned(), Value::from(self.frequency_hz));
        let expression = format!("sine({:.7})", self.frequency_hz);
        let expression = ("expression".to_owned(), Value::from(expression));
        Concealed {
            kind: "unlisted".to_owned(),
            parameters: numbers(self.amplitude_rad_s)
                .chain([frequency, resolution, expression])
                .collect(),
            rho: self.rho,
        }
    }
}

/// Returns the parameters x, y, z by name.
pub fn numbers(values: [f64; 3]) -> impl Iterator<Item = (String, Value)> {
    (0..3).map(move |axis| (AXES[axis].to_owned(), Value::from(values[axis])))
}
