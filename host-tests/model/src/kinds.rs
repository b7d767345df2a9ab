//! Kinds of effects that predict nothing of what a gyro senses.

/// Effects that change the noise and nothing else: no prediction, only a level.
pub const NOISE_KINDS: [&str; 2] = ["angle_random_walk", "pulse_quantisation"];

/// Kinds that say that rows cannot be used, and predict nothing.
pub const FAULT_KINDS: [&str; 3] = ["lost_samples", "stuck_channel", "saturation"];
