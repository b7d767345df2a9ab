//! Effects injected into a unit with accelerometers, and their frequency.

use std::collections::BTreeMap;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::catalogue::{NINE, SIX};
use rlg_simulator::instrument::normal;
use serde::{Deserialize, Serialize};

use crate::marks::effects::{AXES, Effect};
use crate::marks::setting::{name_of, one_of, sign};

/// Injected effect of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Planted {
    /// Nothing.
    None,
    /// Biases of accelerometers.
    AccelBias,
    /// Scale errors of accelerometers.
    AccelScale,
    /// Misaligned accelerometers.
    AccelMisalignment,
    /// Nonlinear accelerometers.
    AccelQuadratic,
    /// Accelerometers with a delay.
    AccelDelay,
    /// Accelerometers at lever arms from the centre of rotation.
    SizeEffect,
    /// A bias of gyros.
    GyroBias,
    /// Scale errors of gyros.
    GyroScale,
    /// Gyros with a delay.
    GyroDelay,
    /// Misaligned gyros.
    Installation,
    /// A reference with a delay.
    ReferenceDelay,
    /// A misaligned reference.
    ReferenceMisalignment,
    /// Scale errors of the reference.
    ReferenceScale,
}

/// Injected effects by the trial's number, repeated in turn.
pub const CYCLE: [Planted; 18] = {
    use Planted::{
        AccelBias, AccelDelay, AccelMisalignment, AccelQuadratic, AccelScale, GyroBias, GyroDelay,
        GyroScale, Installation, None, ReferenceDelay, ReferenceMisalignment, ReferenceScale,
        SizeEffect,
    };
    [
        None,
        AccelBias,
        GyroScale,
        AccelScale,
        None,
        ReferenceMisalignment,
        AccelMisalignment,
        GyroBias,
        None,
        AccelQuadratic,
        ReferenceDelay,
        AccelDelay,
        None,
        Installation,
        SizeEffect,
        ReferenceScale,
        None,
        GyroDelay,
    ]
};

impl Planted {
    /// Returns the injected effect of a trial's number.
    pub fn of(number: u64) -> Self {
        CYCLE[(number % CYCLE.len() as u64) as usize]
    }

    /// Returns the name in tables.
    pub fn name(self) -> String {
        name_of(&self)
    }

    /// Returns the kind of gyros or reference; `None` for accelerometer kinds and for no injection.
    pub fn beside(self) -> Option<&'static str> {
        match self {
            Self::GyroBias => Some("gyro_bias"),
            Self::GyroScale => Some("gyro_scale"),
            Self::GyroDelay => Some("gyro_delay"),
            Self::Installation => Some("installation"),
            Self::ReferenceDelay => Some("reference_delay"),
            Self::ReferenceMisalignment => Some("reference_misalignment"),
            Self::ReferenceScale => Some("reference_scale"),
            _ => None,
        }
    }

    /// Returns the largest size in an accelerometer \[the kind's unit\].
    pub fn largest(self) -> f64 {
        match self {
            Self::AccelBias => 0.5,
            Self::AccelScale | Self::AccelMisalignment => 0.05,
            Self::AccelQuadratic => 1e-3,
            Self::AccelDelay => 0.05,
            Self::SizeEffect => 1.0,
            _ => f64::INFINITY,
        }
    }

    /// Draws the pattern of an accelerometer effect, of size 1 in its largest parameter: of one parameter or of all.
    pub fn pattern(self, rng: &mut ChaCha8Rng) -> Option<Effect> {
        let (kind, names): (&str, &[&str]) = match self {
            Self::AccelBias => ("accel_bias", &AXES),
            Self::AccelScale => ("accel_scale", &AXES),
            Self::AccelMisalignment => ("accel_misalignment", SIX),
            Self::AccelQuadratic => ("accel_quadratic", &AXES),
            Self::AccelDelay => ("accel_delay", &AXES),
            Self::SizeEffect => ("size_effect", NINE),
            _ => return None,
        };
        let is_on_all = rng.random_bool(0.5);
        // Three channels of one recorder have equal delays; the whole unit has one lever arm from its axes of rotation.
        let is_common = matches!(self, Self::AccelDelay | Self::SizeEffect)
            && is_on_all
            && rng.random_bool(0.7);
        let chosen = match is_on_all {
            true => names.to_vec(),
            false => vec![one_of(rng, names)],
        };
        let common = [(); 3].map(|()| normal(rng));
        let mut values = BTreeMap::new();
        for name in chosen {
            let size = match (is_common, is_on_all) {
                (true, _) if name.len() == 1 => 1.0,
                (true, _) => AXES
                    .iter()
                    .position(|axis| name.ends_with(axis))
                    .map_or(0.0, |along| common[along]),
                (false, true) => normal(rng),
                (false, false) => sign(rng),
            };
            values.insert(name.to_owned(), size);
        }
        let effect = Effect {
            kind,
            axis: None,
            values,
        };
        Some(effect.scaled(1.0 / effect.largest()))
    }
}
