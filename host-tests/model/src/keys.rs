//! Keys of `model.toml`, with their description in `docs/files.md`.

use rlg_recording::keys::{Key, key};

/// All keys, in the order of the file; parameters of an `[[effect]]` other than its kind are the catalogue's.
#[rustfmt::skip]
pub const KEYS: &[Key] = &[
    key("", "format", "", "must be there", "1: the form that this page describes"),
    key("motion", "source", "", "reference", "source of the case's motion: `reference`, the recording's channels, or `static`, at rest at its site"),
    key("motion", "earth_rate", "", "false", "whether the reference already contains the Earth's rotation"),
    key("gyro", "pulse_weight_rad", "rad", "counts need it", "angle of one pulse, x, y, z"),
    key("gyro", "bias_rad_s", "rad/s", "0, 0, 0", "bias, x, y, z"),
    key("gyro", "scale_error", "1", "0, 0, 0", "scale error s of ω / (1 − s), x, y, z"),
    key("gyro", "angle_random_walk_rad_sqrt_s", "rad/√s", "measured", "N of IEEE 952, x, y, z"),
    key("gyro", "rate_random_walk_rad_s_sqrt_s", "rad/s/√s", "unknown: drift is possible", "K of IEEE 952, x, y, z"),
    key("gyro", "flicker_rad_s", "rad/s", "unknown: drift is possible", "B of IEEE 952, x, y, z"),
    key("gyro", "installation_rad", "rad", "0 for each", "ε_ij0 of Eq. (7), signs as there: `{ xy, xz, yx, yz, zx, zy }`, tilt of gyro i about axis j"),
    key("dither", "pickoff_gain", "1", "1, 1, 1", "reading of the pickoff over the rotation of the block, x, y, z"),
    key("dither", "pickoff_noise_rad", "rad", "0, 0, 0", "white noise of a pickoff's reading, x, y, z"),
    key("reference", "angle_noise_rad", "rad", "measured", "white noise of the reference's angle"),
    key("reference", "angle_random_walk_rad_sqrt_s", "rad/√s", "measured", "angle random walk of the reference"),
    key("accelerometer", "bias_m_s2", "m/s²", "0, 0, 0", "bias, x, y, z"),
    key("accelerometer", "scale_error", "1", "0, 0, 0", "scale error, x, y, z"),
    key("accelerometer", "noise_m_s2_sqrt_hz", "m/s²/√Hz", "measured", "white noise, one number or x, y, z"),
    key("[effect]", "kind", "", "must be there", "physics that is switched on: a kind of the catalogue below"),
];
