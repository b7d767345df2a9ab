//! What a unit at rest shows, and which biases nothing tells from the Earth's rotation.

use super::declare::FIT_PRIOR;
use super::hypotheses::CATALOGUE;
use super::select::Chosen;
pub use rlg_signal::still::{AtRest, shown_rad};

/// Kinds that show without motion.
pub const KINDS: [&str; 8] = [
    "gyro_bias",
    "gyro_bias_temperature",
    "gyro_bias_temperature_rate",
    "gyro_bias_magnetic",
    "dither_gain",
    "dither_delay",
    "dither_cubic",
    "dither_crosstalk",
];

/// Widens the covariance of constant biases by what was taken for the Earth's rotation: nothing tells it from them.
pub fn widen(rest: &AtRest, chosen: &mut [Chosen]) {
    let constants = chosen
        .iter_mut()
        .filter(|one| CATALOGUE[one.effect].card().kind == "gyro_bias");
    for one in constants {
        let width = FIT_PRIOR * CATALOGUE[one.effect].card().typical;
        for direction in rest.taken_for_the_earths() {
            for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
                one.covariance[(a, b)] += width * width * direction[a] * direction[b];
            }
        }
    }
}
