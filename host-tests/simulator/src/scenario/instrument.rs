//! Sections of the gyros, in a scenario or in an instrument's file: `[gyro]` and `[dither]`.
//!
//! Each section is an [`Entry`]; its numbers must be finite and physically possible, and the first that is not is reported
//! with its line. The bounds refuse wrong units and typing errors; they do not rate an instrument. SI units; x, y, z for
//! triples.

use crate::entry::Entry;
use rlg_model::Installation;
use rlg_recording::error::InputError;

/// Lower bound of numbers that must be above 0.
pub const TINY: f64 = f64::MIN_POSITIVE;
/// A pulse is a fraction of an arcsecond to some arcseconds; 0.01 rad is a wrong unit.
pub const PULSE_RAD: [f64; 2] = [TINY, 1e-2];
/// 0.1 rad/s is 20 000 °/h; a ring-laser gyro's bias is below 1 °/h.
pub const BIAS_RAD_S: [f64; 2] = [-0.1, 0.1];
/// Scale errors are parts per million; a tenth is a wrong unit.
pub const SCALE: [f64; 2] = [-0.1, 0.1];
/// Small angles, for which the first-order model is accurate.
pub const SMALL_RAD: [f64; 2] = [-0.1, 0.1];
/// Noise of an angle.
pub const NOISE_RAD: [f64; 2] = [0.0, 0.1];
/// Resolution of an angle.
pub const WEIGHT_RAD: [f64; 2] = [TINY, 0.1];
/// No gyro has an angle random walk above 1 rad/√s.
pub const WALK: [f64; 2] = [0.0, 1.0];
/// The pickoff is calibrated to per cent.
pub const GAIN: [f64; 2] = [0.1, 10.0];

/// Quantity of the gyros' channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GyroOutput {
    /// Pulse counts.
    Count,
    /// Angles in multiples of the pulse weight: gyros without dither.
    Increment,
}

/// Section `[gyro]`, each value x y z: the true values, also stated in the model.
#[derive(Debug, Clone)]
pub struct GyroEntry {
    /// Pulse weight \[rad\].
    pub pulse_weight_rad: [f64; 3],
    /// Bias \[rad/s\].
    pub bias_rad_s: [f64; 3],
    /// Scale error \[1\].
    pub scale_error: [f64; 3],
    /// Angle random walk \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: [f64; 3],
    /// Rate random walk, which the model does not state \[rad/s/√s\].
    pub rate_random_walk_rad_s_sqrt_s: [f64; 3],
    /// ε_ij0 \[rad\].
    pub installation_rad: Installation,
    /// Quantity of the channels.
    pub output: GyroOutput,
    /// Width of the counter of one row, sign included \[bit\]; `None`: unlimited.
    pub counter_bits: Option<u32>,
}

impl GyroEntry {
    /// Reads the section.
    pub fn read(mut entry: Entry) -> Result<Self, InputError> {
        let gyro = Self {
            pulse_weight_rad: entry.triple_within("pulse_weight_rad", PULSE_RAD, "rad")?,
            bias_rad_s: entry.triple_within("bias_rad_s", BIAS_RAD_S, "rad/s")?,
            scale_error: entry.triple_within("scale_error", SCALE, "")?,
            angle_random_walk_rad_sqrt_s: entry.triple_within(
                "angle_random_walk_rad_sqrt_s",
                WALK,
                "rad/sqrt(s)",
            )?,
            rate_random_walk_rad_s_sqrt_s: entry.triple_within_or(
                "rate_random_walk_rad_s_sqrt_s",
                WALK,
                "rad/s/sqrt(s)",
                [0.0; 3],
            )?,
            installation_rad: installation(&mut entry)?,
            output: match entry
                .has("output")
                .then(|| entry.text("output"))
                .transpose()?
            {
                None => GyroOutput::Count,
                Some(text) if text == "count" => GyroOutput::Count,
                Some(text) if text == "increment" => GyroOutput::Increment,
                Some(text) => {
                    return Err(entry
                        .error("output", "is no output of a gyro")
                        .value(text)
                        .expected("\"count\" or \"increment\""));
                }
            },
            counter_bits: if entry.has("counter_bits") {
                let bits = entry.within("counter_bits", [2.0, 53.0], "bits")?;
                if bits.fract() != 0.0 {
                    return Err(entry
                        .error("counter_bits", "is not a whole number")
                        .value(bits));
                }
                Some(bits as u32)
            } else {
                None
            },
        };
        entry.finish()?;
        Ok(gyro)
    }

    /// Largest angle that one row of gyro `axis` can count \[rad\].
    pub fn counter_capacity_rad(&self, axis: usize) -> f64 {
        self.counter_bits.map_or(f64::INFINITY, |bits| {
            (2.0_f64.powi(bits as i32 - 1) - 1.0) * self.pulse_weight_rad[axis]
        })
    }
}

fn installation(entry: &mut Entry) -> Result<Installation, InputError> {
    let Some(mut six) = entry.inner("installation_rad")? else {
        return Err(entry
            .error("installation_rad", "is missing")
            .expected("{ xy = 0.0, xz = 0.0, ... }: the six of Eq. (7), absent ones 0"));
    };
    let mut angles = [0.0; 6];
    for (angle, name) in angles.iter_mut().zip(rlg_model::catalogue::SIX) {
        *angle = six.within_or(name, SMALL_RAD, "rad", 0.0)?;
    }
    six.finish()?;
    Ok(Installation::from_array(angles))
}

/// Section `[dither]`, each value x y z.
#[derive(Debug, Clone)]
pub struct DitherEntry {
    /// Frequency \[Hz\].
    pub frequency_hz: [f64; 3],
    /// Mean amplitude of the pickoff angle \[rad\].
    pub amplitude_rad: [f64; 3],
    /// Rms deviation of the amplitude over its mean \[1\].
    pub amplitude_spread: f64,
    /// Block angle over pickoff angle \[1\].
    pub pickoff_gain: [f64; 3],
    /// White noise of a pickoff sample \[rad\].
    pub pickoff_noise_rad: [f64; 3],
    /// Resolution of a pickoff sample \[rad\].
    pub pickoff_weight_rad: f64,
    /// Reaction ratio of the case, J_block/(J_block + J_case) \[1\].
    pub reaction_ratio: [f64; 3],
}

impl DitherEntry {
    /// Reads the section.
    pub fn read(mut entry: Entry, rate_hz: f64) -> Result<Self, InputError> {
        let dither = Self {
            frequency_hz: entry.triple("frequency_hz")?,
            amplitude_rad: entry.triple_within("amplitude_rad", NOISE_RAD, "rad")?,
            // with a spread of 0.3 the amplitude falls to a tenth of its mean (3 spreads)
            amplitude_spread: entry.within("amplitude_spread", [0.0, 0.3], "")?,
            pickoff_gain: entry.triple_within("pickoff_gain", GAIN, "")?,
            pickoff_noise_rad: entry.triple_within("pickoff_noise_rad", NOISE_RAD, "rad")?,
            pickoff_weight_rad: entry.within("pickoff_weight_rad", WEIGHT_RAD, "rad")?,
            // a case is heavier than its block
            reaction_ratio: entry.triple_within_or("reaction_ratio", [0.0, 0.5], "", [0.0; 3])?,
        };
        for frequency_hz in dither.frequency_hz {
            if !(TINY..0.5 * rate_hz).contains(&frequency_hz) {
                return Err(entry
                    .error("frequency_hz", "is not below half the sample rate")
                    .value(frequency_hz)
                    .expected(format!("above 0 and less than {} Hz", 0.5 * rate_hz)));
            }
        }
        entry.finish()?;
        Ok(dither)
    }
}
