//! Temperature of the blocks and magnetic field at the case.
//!
//! From the time since the start in s: the warming of each block since the start (K) and its rate (K/s), and the field of a
//! coil on the case (T, body frame). The Earth's field is rotated by the attitude (`attitude.rs`).
//!
//! Equations: T_i(t) = T_start + R_i (1 − e^{−t/τ_i}) + r t + A sin(2πt/P): self-heating with one time constant, and
//! ambient temperature with drift and oscillation. B(t) = B_coil sin(2πft).
//!
//! Assumes one temperature a block. Out of scope: gradients inside a block; a bias proportional to them is the catalogue's
//! `gyro_bias_temperature_rate`.

use nalgebra::Vector3;
use std::f64::consts::TAU;

/// `[thermal]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThermalEntry {
    /// Temperature at the start \[K\].
    pub start_k: f64,
    /// R_i \[K\].
    pub self_heating_k: [f64; 3],
    /// τ_i \[s\].
    pub time_constant_s: [f64; 3],
    /// r \[K/s\].
    pub ambient_rate_k_s: f64,
    /// A \[K\].
    pub ambient_swing_k: f64,
    /// P \[s\]; unused if A is 0.
    pub ambient_period_s: f64,
    /// Change of each gyro's scale with its block's temperature, dither included \[1/K\].
    pub scale_error_k: [f64; 3],
    /// White noise of a thermometer sample \[K\].
    pub sensor_noise_k: f64,
    /// Resolution of a sample \[K\].
    pub sensor_weight_k: f64,
    /// Sample rate \[Hz\].
    pub rate_hz: f64,
}

impl ThermalEntry {
    /// T_i − T_start \[K\] and dT_i/dt \[K/s\].
    pub fn warming(&self, since_start_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let (mut change_k, mut slope_k_s) = (Vector3::zeros(), Vector3::zeros());
        let swing = if self.ambient_swing_k == 0.0 {
            [0.0; 2]
        } else {
            let omega = TAU / self.ambient_period_s;
            let (sin, cos) = (omega * since_start_s).sin_cos();
            [
                self.ambient_swing_k * sin,
                self.ambient_swing_k * omega * cos,
            ]
        };
        for i in 0..3 {
            let left = (-since_start_s / self.time_constant_s[i]).exp();
            change_k[i] = self.self_heating_k[i] * (1.0 - left)
                + self.ambient_rate_k_s * since_start_s
                + swing[0];
            slope_k_s[i] = self.self_heating_k[i] / self.time_constant_s[i] * left
                + self.ambient_rate_k_s
                + swing[1];
        }
        (change_k, slope_k_s)
    }
}

/// `[magnetic]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MagneticEntry {
    /// The Earth's field, north west up \[T\].
    pub navigation_field_t: [f64; 3],
    /// B_coil: amplitude of a coil's field, body axes \[T\].
    pub coil_field_t: [f64; 3],
    /// f of the coil's current \[Hz\].
    pub coil_frequency_hz: f64,
    /// White noise of a sample \[T\].
    pub sensor_noise_t: f64,
    /// Resolution of a sample \[T\].
    pub sensor_weight_t: f64,
    /// Sample rate \[Hz\].
    pub rate_hz: f64,
}

impl MagneticEntry {
    /// Field of the coil \[T\], body frame.
    pub fn coil_t(&self, since_start_s: f64) -> Vector3<f64> {
        Vector3::from(self.coil_field_t) * (TAU * self.coil_frequency_hz * since_start_s).sin()
    }
}
