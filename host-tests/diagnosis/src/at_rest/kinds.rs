//! Kinds of effects that a unit at rest shows slowly.

use rlg_catalogue::entries::STEP;

/// Kinds that this observation model decides on.
pub const KINDS: [&str; 5] = [
    BIAS,
    "gyro_bias_temperature",
    "gyro_bias_temperature_rate",
    "gyro_bias_magnetic",
    STEP,
];

pub(super) const BIAS: &str = "gyro_bias";
