//! The noise that a model declares.
//!
//! Enters: [`Model`]. Leaves: θ of noise.rs by gyro, for rows of one rate.

use super::motion::AngleNoise;
use super::noise::Declared;
pub(super) use rlg_findings::excess::excess_square;
use rlg_model::Model;

/// Noise of a motion that is read from the gyros themselves, of which the white part is known: they walk besides.
pub fn own_noise(model: &Model, white_rad: f64) -> AngleNoise {
    let walks_rad_sqrt_s = model.gyro.angle_random_walk_rad_sqrt_s.unwrap_or_default();
    AngleNoise {
        white_rad,
        walk_rad_sqrt_s: walks_rad_sqrt_s.into_iter().fold(0.0, f64::max),
    }
}

/// Noise of the reference's angle.
pub fn reference_noise(model: &Model) -> Option<AngleNoise> {
    model.reference.as_ref().map(|reference| AngleNoise {
        white_rad: reference.angle_noise_rad.unwrap_or_default(),
        walk_rad_sqrt_s: reference.angle_random_walk_rad_sqrt_s.unwrap_or_default(),
    })
}

/// Noise that the model declares, as θ: pulses, pickoff and reference make white angle noise, gyro and
/// reference walk at random. Excess found earlier stands in the model as effects.
pub fn declared_noise(model: &Model, rate_hz: f64) -> [Declared; 3] {
    [0, 1, 2].map(|axis| {
        let (reference_angle, reference_walk) =
            reference_noise(model).map_or((0.0, 0.0), |reference| {
                (
                    reference.white_rad.powi(2),
                    reference.walk_rad_sqrt_s.powi(2),
                )
            });
        let pickoff = model.pickoff_white_rad2(axis);
        let pulses = model.gyro.pulse_weight_rad[axis].powi(2) / 12.0;
        Declared {
            random_walk: model.gyro.angle_random_walk_rad_sqrt_s.map(|walk| {
                (walk[axis].powi(2)
                    + reference_walk
                    + excess_square(model, "angle_random_walk", axis))
                    / rate_hz
            }),
            // A model that names none leaves it unknown, not zero.
            white_angle: Some(
                pulses
                    + pickoff
                    + reference_angle
                    + excess_square(model, "pulse_quantisation", axis) / 12.0,
            )
            .filter(|square| *square > 0.0),
        }
    })
}
