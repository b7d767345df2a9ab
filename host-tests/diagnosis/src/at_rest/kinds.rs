//! Kinds of slow effects of a unit at rest.

use rlg_catalogue::entries::STEP;

/// Kinds in the catalogue of this observation model.
pub const KINDS: [&str; 5] = [
    BIAS,
    "gyro_bias_temperature",
    "gyro_bias_temperature_rate",
    "gyro_bias_magnetic",
    STEP,
];

pub(super) const BIAS: &str = "gyro_bias";
