//! Attitude references, drawn: their stamps and errors.

use nalgebra::Vector3;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_simulator::instrument::normal;
use serde::{Deserialize, Serialize};

use crate::marks::noise::Levels;
use crate::marks::setting::{log_uniform, name_of, one_of};

/// Least time from the last stamp of a reference to the end \[s\].
const MARGIN_S: f64 = 0.2;

/// Type of attitude reference.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReferenceKind {
    /// Markers and fixed cameras, 100 Hz.
    Optical,
    /// Camera of 30 Hz with stamp jitter.
    Camera,
    /// Inertial navigator of 10 Hz with a correlated error.
    Navigator,
    /// A star tracker of 2 Hz.
    StarTracker,
}

/// Drawn reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// Type.
    pub kind: ReferenceKind,
    /// Stamp rate \[Hz\].
    pub rate_hz: f64,
    /// White noise of a stamp about each axis \[rad\].
    pub white_rad: f64,
    /// Standard deviation of the correlated error about each axis \[rad\].
    pub wander_rad: f64,
    /// Correlation time of that error \[s\].
    pub wander_s: f64,
    /// Largest jitter of the stamps, recorded in them \[s\].
    pub jitter_s: f64,
}

impl Reference {
    /// Draws a reference of gyros with `rows_hz` rows a second.
    pub fn draw(rows_hz: f64, rng: &mut ChaCha8Rng) -> Self {
        use ReferenceKind::{Camera, Navigator, Optical, StarTracker};
        let kind = one_of(rng, &[Optical, Camera, Navigator, StarTracker]);
        let [rate_hz, least_rad, most_rad] = match kind {
            Optical => [100.0, 1e-4, 1e-3],
            Camera => [30.0, 5e-4, 4e-3],
            Navigator => [10.0, 1e-4, 4e-4],
            StarTracker => [2.0, 2e-5, 2e-4],
        };
        let wanders = kind == Navigator;
        Self {
            kind,
            rate_hz: rows_hz.min(rate_hz),
            white_rad: log_uniform(rng, least_rad, most_rad),
            wander_rad: if wanders {
                log_uniform(rng, 3e-4, 2e-3)
            } else {
                0.0
            },
            wander_s: log_uniform(rng, 2.0, 10.0),
            jitter_s: if kind == Camera { 4e-3 } else { 0.0 },
        }
    }

    /// Draws the stamps of a recording \[s\].
    pub fn stamps_s(&self, length_s: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let count = ((length_s - MARGIN_S) * self.rate_hz).floor() as usize;
        (1..count)
            .map(|stamp| {
                let jitter_s = self.jitter_s * (2.0 * rng.random::<f64>() - 1.0);
                stamp as f64 / self.rate_hz + jitter_s
            })
            .collect()
    }

    /// Returns errors at stamps, in the navigation frame \[rad\].
    pub fn errors_rad(&self, stamps_s: &[f64], rng: &mut ChaCha8Rng) -> Vec<Vector3<f64>> {
        let mut draw = || Vector3::from_fn(|_, _| normal(rng));
        let mut wander = self.wander_rad * draw();
        let mut before_s = f64::NEG_INFINITY;
        stamps_s
            .iter()
            .map(|&time_s| {
                let keep = (-(time_s - before_s) / self.wander_s).exp();
                before_s = time_s;
                wander = wander * keep + self.wander_rad * (1.0 - keep * keep).sqrt() * draw();
                wander + self.white_rad * draw()
            })
            .collect()
    }

    /// Returns the noise of the attitude increments; the correlated error is approximated by its random walk at short
    /// times, which is an upper bound.
    pub fn levels(&self) -> Levels {
        let walk = self.wander_rad * (2.0 / self.wander_s).sqrt();
        Levels::white(walk, self.white_rad)
    }

    /// Returns the error of one stamp about an axis \[rad\].
    pub fn error_rad(&self) -> f64 {
        self.white_rad.hypot(self.wander_rad)
    }

    /// Returns the name in files.
    pub fn name(&self) -> String {
        name_of(&self.kind)
    }
}
