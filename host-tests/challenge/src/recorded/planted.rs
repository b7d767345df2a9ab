//! Effects injected into others' recording: nothing, or an effect of half, once or twice its size.

use std::collections::BTreeMap;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::catalogue::{NINE, SIX};

use crate::marks::effects::{AXES, Effect};
use crate::marks::setting::{one_of, sign};

/// Kinds with their sizes in the contract's units: 1 %, 3 ms, 5 mrad, 0.56 °/s/g, and 1e-3 s²,
/// by which 5 rad/s² tilt an axis by 5 mrad.
const SIZES: [(&str, f64); 5] = [
    ("gyro_scale", 0.01),
    ("reference_delay", 3e-3),
    ("installation", 5e-3),
    ("gyro_g_bias", 1e-3),
    ("axis_flexure", 1e-3),
];

/// Shares of a size, with their names.
const SHARES: [(f64, &str); 3] = [(0.5, "_half"), (1.0, ""), (2.0, "_double")];

/// Injected effect of a trial.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planted(Option<(&'static str, f64, &'static str)>);

/// Number of different injections: the first is nothing.
pub const COUNT: u64 = 1 + (SIZES.len() * SHARES.len()) as u64;

impl Planted {
    /// Returns the injection of a trial's number, repeated in turn.
    pub fn of(number: u64) -> Self {
        let Some(place) = (number % COUNT).checked_sub(1) else {
            return Self(None);
        };
        let place = place as usize;
        let (kind, size) = SIZES[place / SHARES.len()];
        let (share, word) = SHARES[place % SHARES.len()];
        Self(Some((kind, share * size, word)))
    }

    /// Returns the name in tables.
    pub fn name(self) -> String {
        self.0
            .map_or("none".to_owned(), |(kind, _, word)| format!("{kind}{word}"))
    }

    /// Draws the effect: a scale error of one gyro, a delay, non-orthogonal axes of two gyros, a g-dependent bias along one
    /// axis, or flexure of one gyro about one axis. Flexure common to all gyros would act as a filter.
    pub fn effect(self, rng: &mut ChaCha8Rng) -> Option<Effect> {
        let (kind, size, _) = self.0?;
        let one = |name: &str, value: f64| BTreeMap::from([(name.to_owned(), value)]);
        let values = match kind {
            "gyro_scale" => one(one_of(rng, &AXES), size * sign(rng)),
            "reference_delay" => one("all", size * sign(rng)),
            "gyro_g_bias" => one(one_of(rng, NINE), size * sign(rng)),
            "axis_flexure" => one(one_of(rng, SIX), size * sign(rng)),
            // Each of two gyros senses the other's axis equally: as tilts about the third axis the signs differ.
            _ => {
                let about = rng.random_range(0..3);
                let tilt = size * sign(rng);
                let name = |gyro: usize| format!("{}{}", AXES[gyro % 3], AXES[about]);
                BTreeMap::from([(name(about + 1), tilt), (name(about + 2), -tilt)])
            }
        };
        Some(Effect {
            kind,
            axis: None,
            values,
        })
    }
}
