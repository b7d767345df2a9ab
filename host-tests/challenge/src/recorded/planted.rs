//! What is planted into a recording: nothing, or an effect of half, once or twice its size.

use std::collections::BTreeMap;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::catalogue::{NINE, SIX};

use crate::marks::effects::{AXES, Effect};
use crate::marks::setting::{one_of, sign};

/// Kinds with their sizes in the contract's units: 1 %, 3 ms, 5 mrad, 0.11 °/s/g, 1e-4 s².
const SIZES: [(&str, f64); 5] = [
    ("gyro_scale", 0.01),
    ("reference_delay", 3e-3),
    ("installation", 5e-3),
    ("gyro_g_bias", 2e-4),
    ("axis_flexure", 1e-4),
];

/// Shares of a size, with their words.
const SHARES: [(f64, &str); 3] = [(0.5, "_half"), (1.0, ""), (2.0, "_double")];

/// What a trial plants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planted(Option<(&'static str, f64, &'static str)>);

/// Number of different plantings: the first plants nothing.
pub const COUNT: u64 = 1 + (SIZES.len() * SHARES.len()) as u64;

impl Planted {
    /// Returns what the trial of a number plants, again and again.
    pub fn of(number: u64) -> Self {
        let Some(place) = (number % COUNT).checked_sub(1) else {
            return Self(None);
        };
        let place = place as usize;
        let (kind, size) = SIZES[place / SHARES.len()];
        let (share, word) = SHARES[place % SHARES.len()];
        Self(Some((kind, share * size, word)))
    }

    /// Returns its name in tables.
    pub fn name(self) -> String {
        self.0
            .map_or("none".to_owned(), |(kind, _, word)| format!("{kind}{word}"))
    }

    /// Draws the effect: a scale error of one gyro, a delay, axes of two gyros that are not square to each other, a bias by force
    /// along one axis, or flexure of all six K of one sign, as a suspension's compliance has.
    pub fn effect(self, rng: &mut ChaCha8Rng) -> Option<Effect> {
        let (kind, size, _) = self.0?;
        let one = |name: &str, value: f64| BTreeMap::from([(name.to_owned(), value)]);
        let values = match kind {
            "gyro_scale" => one(one_of(rng, &AXES), size * sign(rng)),
            "reference_delay" => one("all", size * sign(rng)),
            "gyro_g_bias" => one(one_of(rng, NINE), size * sign(rng)),
            "installation" => {
                let about = rng.random_range(0..3);
                let (a, b) = ((about + 1) % 3, (about + 2) % 3);
                // Each senses the other's axis by as much: of a tilt about the third axis the signs differ.
                let tilt = size * sign(rng);
                let name = |gyro: usize| format!("{}{}", AXES[gyro], AXES[about]);
                BTreeMap::from([(name(a), tilt), (name(b), -tilt)])
            }
            _ => {
                let each = SIX.iter();
                each.map(|name| ((*name).to_owned(), size * (0.5 + 0.5 * rng.random::<f64>())))
                    .collect()
            }
        };
        Some(Effect {
            kind,
            axis: None,
            values,
        })
    }
}
