//! Effects injected into accelerometers in still positions, and their frequency.

use std::collections::BTreeMap;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_simulator::instrument::normal;
use serde::{Deserialize, Serialize};

use crate::force::planted::Planted as OfForce;
use crate::marks::effects::{AXES, Effect};
use crate::marks::setting::name_of;

/// Injected effect of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Planted {
    /// Nothing.
    None,
    /// Biases.
    AccelBias,
    /// Scale errors.
    AccelScale,
    /// Non-orthogonal axes.
    AccelMisalignment,
    /// Quadratic errors.
    AccelQuadratic,
    /// Biases, scale errors and tilts together, as in a new unit.
    NewUnit,
}

/// Injected effects by the trial's number, repeated in turn.
pub const CYCLE: [Planted; 10] = {
    use Planted::{AccelBias, AccelMisalignment, AccelQuadratic, AccelScale, NewUnit, None};
    [
        None,
        AccelBias,
        None,
        AccelScale,
        None,
        AccelMisalignment,
        None,
        AccelQuadratic,
        None,
        NewUnit,
    ]
};

/// Non-orthogonality of one pair of axes or of all, with equal tilts of each pair. An additional rotation of the whole
/// triad changes the lengths of gravity only by squares of its tilts, which act as scale errors: in the contract's equation
/// a tilted axis is longer.
fn skew(rng: &mut ChaCha8Rng) -> Effect {
    let is_on_all = rng.random_bool(0.5);
    let chosen = rng.random_range(0..3);
    let mut values = BTreeMap::new();
    for k in (0..3).filter(|k| is_on_all || *k == chosen) {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let size = normal(rng);
        values.insert([AXES[i], AXES[k]].concat(), size);
        values.insert([AXES[j], AXES[k]].concat(), -size);
    }
    let effect = Effect {
        kind: "accel_misalignment",
        axis: None,
        values,
    };
    effect.scaled(1.0 / effect.largest())
}

impl Planted {
    /// Returns the injected effect of a trial's number.
    pub fn of(number: u64) -> Self {
        CYCLE[(number % CYCLE.len() as u64) as usize]
    }

    /// Returns the name in tables.
    pub fn name(self) -> String {
        name_of(&self)
    }

    /// True if it is observable in positions with the axes along gravity alone.
    pub fn is_shown_by_faces(self) -> bool {
        matches!(self, Self::None | Self::AccelBias | Self::AccelScale)
    }

    /// Draws patterns of size 1 in their largest parameter, with the largest size in an accelerometer.
    pub fn patterns(self, rng: &mut ChaCha8Rng) -> Vec<(Effect, f64)> {
        let kinds: &[OfForce] = match self {
            Self::None => &[],
            Self::AccelBias => &[OfForce::AccelBias],
            Self::AccelScale => &[OfForce::AccelScale],
            Self::AccelMisalignment => &[OfForce::AccelMisalignment],
            Self::AccelQuadratic => &[OfForce::AccelQuadratic],
            Self::NewUnit => &[
                OfForce::AccelBias,
                OfForce::AccelScale,
                OfForce::AccelMisalignment,
            ],
        };
        let mut drawn = |kind: &OfForce| match kind {
            OfForce::AccelMisalignment => Some((skew(rng), kind.largest())),
            _ => Some((kind.pattern(rng)?, kind.largest())),
        };
        kinds.iter().filter_map(&mut drawn).collect()
    }
}
