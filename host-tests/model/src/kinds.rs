//! Kinds of effects that predict nothing of what a gyro senses.

/// Effects that change the noise and nothing else: no prediction, only a level.
pub const NOISE_KINDS: [&str; 2] = ["angle_random_walk", "pulse_quantisation"];

/// Kinds that predict nothing: they say that rows cannot be used, or how channels are put right before anything else.
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
