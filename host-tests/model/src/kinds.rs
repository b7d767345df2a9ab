//! Kinds of effects without a prediction for the gyros.

/// Kinds that change only the noise level.
pub const NOISE_KINDS: [&str; 2] = ["angle_random_walk", "pulse_quantisation"];

/// Faults: rows excluded from use, and corrections of channels before the analysis.
pub const FAULT_KINDS: [&str; 12] = [
    "lost_samples",
    "stuck_channel",
    "saturation",
    "held_values",
    "repeated_rows",
    "spikes",
    "reference_jump",
    "reference_spike",
    "reference_dropout",
    "channel_order",
    "channel_sign",
    "channel_factor",
];
