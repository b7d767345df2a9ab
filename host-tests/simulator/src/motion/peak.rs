//! Upper bounds of the rate of a motion (rad/s), for the check against a counter.
//!
//! For random profiles the bound is five times the rms.

use super::Profile;
use super::rotation_vector::ConingTone;
use std::f64::consts::TAU;

impl ConingTone {
    /// The longer semi-axis \[rad\].
    pub fn semi_axis_rad(&self) -> f64 {
        self.angle_rad.abs().max(self.across_angle_rad.abs())
    }
}

/// Largest slope of the smooth step, times its length: 140/64.
const STEEPEST: f64 = 2.1875;

/// Peak of a random signal over its rms: exceeded once in two million.
const PEAK_OVER_RMS: f64 = 5.0;

impl Profile {
    /// Upper bound of the rate about any axis \[rad/s\]; for random motions, hardly ever exceeded.
    pub fn peak_rate_rad_s(&self, duration_s: f64) -> f64 {
        match self {
            Self::Still => 0.0,
            Self::Coning {
                frequency_hz,
                angle_rad,
                ramp_s,
                ..
            } => angle_rad.abs() * (TAU * frequency_hz.abs() + STEEPEST / ramp_s),
            Self::EllipticConing { tones, ramp_s, .. } => tones
                .iter()
                .map(|tone| {
                    tone.semi_axis_rad() * (TAU * tone.frequency_hz.abs() + STEEPEST / ramp_s)
                })
                .sum(),
            Self::Slew { angle_rad, .. } => STEEPEST * angle_rad.abs() / duration_s,
            Self::Spin {
                rate_rad_s,
                oscillation_frequency_hz,
                oscillation_angle_rad,
                ..
            } => rate_rad_s.abs() + TAU * (oscillation_frequency_hz * oscillation_angle_rad).abs(),
            Self::Tumble { rate_rad_s, .. } => rate_rad_s
                .iter()
                .fold(0.0, |most, rate| most.max(rate.abs())),
            Self::Vibration { rate_rms_rad_s, .. } => {
                PEAK_OVER_RMS
                    * rate_rms_rad_s
                        .iter()
                        .fold(0.0_f64, |most, rms| most.max(rms.abs()))
            }
            Self::RandomVibration { angular, .. } => {
                let rms = angular
                    .iter()
                    .map(|spectrum| spectrum.power(0.0, f64::INFINITY).sqrt());
                PEAK_OVER_RMS * rms.fold(0.0, f64::max)
            }
        }
    }
}
