//! Grades of gyros: their noise and the size of their errors.

use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use super::setting::{log_uniform, name_of, one_of};

/// Grade of the gyros.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Grade {
    /// Ring lasers: 0.001 to 0.01 °/√h.
    Rlg,
    /// Fibre-optic gyros: 0.01 to 0.1 °/√h.
    Fog,
    /// Micromechanical gyros: 0.2 to 2 °/√h.
    Mems,
}

impl Grade {
    /// Draws a grade.
    pub fn draw(rng: &mut ChaCha8Rng) -> Self {
        one_of(rng, &[Self::Rlg, Self::Fog, Self::Mems])
    }

    /// Draws the angle random walk of three gyros \[rad/√s\].
    pub fn draw_walk_rad_sqrt_s(self, rng: &mut ChaCha8Rng) -> [f64; 3] {
        let [least, most] = match self {
            Self::Rlg => [3e-7, 3e-6],
            Self::Fog => [3e-6, 3e-5],
            Self::Mems => [6e-5, 6e-4],
        };
        let walk = log_uniform(rng, least, most);
        std::array::from_fn(|_| walk * log_uniform(rng, 0.8, 1.25))
    }

    /// Returns the white noise of accelerometers of this grade \[m/s²/√Hz\].
    pub fn accelerometer_m_s2_sqrt_hz(self) -> f64 {
        match self {
            Self::Rlg => 5e-5,
            Self::Fog => 3e-4,
            Self::Mems => 1e-3,
        }
    }

    /// Returns the largest size of an effect in gyros of this grade \[the kind's unit\].
    pub fn largest(self, kind: &str) -> f64 {
        let [rlg, fog, mems] = match kind {
            "gyro_bias" => [3e-5, 3e-4, 5e-2],
            "gyro_scale" => [1e-2, 1e-2, 5e-2],
            "gyro_g_bias" => [1e-6, 1e-5, 2e-3],
            "gyro_bias_temperature" => [1e-6, 1e-5, 1e-3],
            "gyro_bias_step" => [1e-5, 1e-4, 1e-2],
            // 1/ω0² of a block that rings at 50 Hz
            "axis_flexure" => [1e-5; 3],
            "reference_delay" => [0.15; 3],
            "reference_misalignment" => [0.1; 3],
            _ => [f64::INFINITY; 3],
        };
        match self {
            Self::Rlg => rlg,
            Self::Fog => fog,
            Self::Mems => mems,
        }
    }

    /// Returns the name in files.
    pub fn name(self) -> String {
        name_of(&self)
    }
}
