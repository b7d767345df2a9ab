//! Sections of the other instruments: `[reference]`, `[fibre_optic]`, `[encoder]`, `[accelerometer]`.
//!
//! Each section is an [`Entry`]; its numbers must be finite and in range, and the first that is not is reported with its
//! line. SI units; x, y, z for triples.

use super::instrument::{BIAS_RAD_S, NOISE_RAD, SCALE, TINY, WALK, WEIGHT_RAD};
use crate::entry::Entry;
use rlg_recording::error::InputError;

/// `[reference]`.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceEntry {
    /// White noise of the angle \[rad\].
    pub angle_noise_rad: f64,
    /// Angle random walk \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: f64,
    /// Resolution of the angle \[rad\].
    pub weight_rad: f64,
    /// Attitude is recorded too (`reference_attitude`, in the north-west-up frame).
    pub attitude: bool,
}

impl ReferenceEntry {
    /// Reads the section.
    pub fn read(mut entry: Entry) -> Result<Self, InputError> {
        let reference = Self {
            angle_noise_rad: entry.within("angle_noise_rad", NOISE_RAD, "rad")?,
            angle_random_walk_rad_sqrt_s: entry.within(
                "angle_random_walk_rad_sqrt_s",
                WALK,
                "rad/sqrt(s)",
            )?,
            weight_rad: entry.within("weight_rad", WEIGHT_RAD, "rad")?,
            attitude: entry.flag("attitude", false)?,
        };
        entry.finish()?;
        Ok(reference)
    }
}

/// `[fibre_optic]`, x y z: a fibre-optic triad on the case. No dither, no flexure.
#[derive(Debug, Clone, Copy)]
pub struct FibreOpticEntry {
    /// Bias \[rad/s\].
    pub bias_rad_s: [f64; 3],
    /// Scale error \[1\].
    pub scale_error: [f64; 3],
    /// White noise of the angle \[rad\].
    pub angle_noise_rad: f64,
    /// Angle random walk \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: f64,
    /// Rate random walk \[rad/s/√s\].
    pub rate_random_walk_rad_s_sqrt_s: f64,
    /// Resolution of the angle \[rad\].
    pub weight_rad: f64,
}

impl FibreOpticEntry {
    /// Reads the section.
    pub fn read(mut entry: Entry) -> Result<Self, InputError> {
        let gyro = Self {
            bias_rad_s: entry.triple_within_or("bias_rad_s", BIAS_RAD_S, "rad/s", [0.0; 3])?,
            scale_error: entry.triple_within_or("scale_error", SCALE, "", [0.0; 3])?,
            angle_noise_rad: entry.within_or("angle_noise_rad", NOISE_RAD, "rad", 0.0)?,
            angle_random_walk_rad_sqrt_s: entry.within(
                "angle_random_walk_rad_sqrt_s",
                WALK,
                "rad/sqrt(s)",
            )?,
            rate_random_walk_rad_s_sqrt_s: entry.within_or(
                "rate_random_walk_rad_s_sqrt_s",
                WALK,
                "rad/s/sqrt(s)",
                0.0,
            )?,
            weight_rad: entry.within("weight_rad", WEIGHT_RAD, "rad")?,
        };
        entry.finish()?;
        Ok(gyro)
    }
}

/// `[encoder]`: angle encoders of the table's axes, on the base; they do not measure the Earth's rotation.
#[derive(Debug, Clone, Copy)]
pub struct EncoderEntry {
    /// White noise of the angle \[rad\].
    pub angle_noise_rad: f64,
    /// Resolution of the angle \[rad\].
    pub weight_rad: f64,
}

impl EncoderEntry {
    /// Reads the section.
    pub fn read(mut entry: Entry) -> Result<Self, InputError> {
        let encoder = Self {
            angle_noise_rad: entry.within("angle_noise_rad", NOISE_RAD, "rad")?,
            weight_rad: entry.within("weight_rad", WEIGHT_RAD, "rad")?,
        };
        entry.finish()?;
        Ok(encoder)
    }
}

/// `[accelerometer]`, x y z.
#[derive(Debug, Clone, Copy)]
pub struct AccelerometerEntry {
    /// Bias \[m/s²\].
    pub bias_m_s2: [f64; 3],
    /// Scale error \[1\].
    pub scale_error: [f64; 3],
    /// One-sided noise density \[m/s²/√Hz\].
    pub noise_m_s2_sqrt_hz: f64,
    /// Resolution of a sample \[m/s²\].
    pub weight_m_s2: f64,
}

impl AccelerometerEntry {
    /// Reads the section.
    pub fn read(mut entry: Entry) -> Result<Self, InputError> {
        let accelerometer = Self {
            bias_m_s2: entry.triple_within("bias_m_s2", [-1.0, 1.0], "m/s^2")?,
            scale_error: entry.triple_within("scale_error", SCALE, "")?,
            noise_m_s2_sqrt_hz: entry.within("noise_m_s2_sqrt_hz", [0.0, 1.0], "m/s^2/sqrt(Hz)")?,
            weight_m_s2: entry.within("weight_m_s2", [TINY, 1.0], "m/s^2")?,
        };
        entry.finish()?;
        Ok(accelerometer)
    }
}
