//! The sections that make an instrument, in a scenario or in a file of their own: `[gyro]`, `[dither]`,
//! `[reference]`, `[fibre_optic]`, `[encoder]`, `[accelerometer]`, `[thermal]`, `[magnetic]`, `[isolator]`.
//!
//! Enters: one section as an [`Entry`]. Leaves: its numbers, each finite and where physics allows it; the first
//! that is not is named with its line. The bounds refuse wrong units and slips of the pen; they do not judge an
//! instrument. SI units; x, y, z where three.

use super::Entry;
use crate::error::InputError;
use crate::model::Installation;
use crate::simulate::isolator::IsolatorEntry;
use crate::simulate::surroundings::{MagneticEntry, ThermalEntry};

const TINY: f64 = f64::MIN_POSITIVE;
/// A pulse is a fraction of an arcsecond to some arcseconds; 0.01 rad is a wrong unit.
const PULSE_RAD: [f64; 2] = [TINY, 1e-2];
/// 0.1 rad/s is 20 000 °/h; a ring-laser gyro's bias is below 1 °/h.
const BIAS_RAD_S: [f64; 2] = [-0.1, 0.1];
/// Scale errors are parts per million; a tenth is a wrong unit.
const SCALE: [f64; 2] = [-0.1, 0.1];
/// Small angles, to first order of which the model is right.
const SMALL_RAD: [f64; 2] = [-0.1, 0.1];
/// Noise of an angle, and its resolution.
const NOISE_RAD: [f64; 2] = [0.0, 0.1];
const WEIGHT_RAD: [f64; 2] = [TINY, 0.1];
/// Random walks beyond 1 are no gyro's.
const WALK: [f64; 2] = [0.0, 1.0];
/// The pickoff is calibrated to per cent.
const GAIN: [f64; 2] = [0.1, 10.0];

/// What the gyros' channels hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GyroOutput {
    /// Pulses counted.
    Count,
    /// Angles in multiples of the pulse weight: gyros without dither.
    Increment,
}

/// `[gyro]`, x y z: the truth that the model also states.
#[derive(Debug, Clone)]
pub struct GyroEntry {
    /// \[rad\].
    pub pulse_weight_rad: [f64; 3],
    /// \[rad/s\].
    pub bias_rad_s: [f64; 3],
    /// \[1\].
    pub scale_error: [f64; 3],
    /// \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: [f64; 3],
    /// Random walk of the bias, which the model does not state \[rad/s/√s\].
    pub rate_random_walk_rad_s_sqrt_s: [f64; 3],
    /// ε_ij0 \[rad\].
    pub installation_rad: Installation,
    /// What the channels hold.
    pub output: GyroOutput,
    /// Width of the counter of one row, sign included; `None`: wide enough for anything.
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
    for (angle, name) in angles.iter_mut().zip(crate::model::catalogue::SIX) {
        *angle = six.within_or(name, SMALL_RAD, "rad", 0.0)?;
    }
    six.finish()?;
    Ok(Installation::from_array(angles))
}

/// `[dither]`, x y z.
#[derive(Debug, Clone)]
pub struct DitherEntry {
    /// \[Hz\].
    pub frequency_hz: [f64; 3],
    /// Mean amplitude of the pickoff angle \[rad\].
    pub amplitude_rad: [f64; 3],
    /// Rms deviation of the amplitude over its mean \[1\].
    pub amplitude_spread: f64,
    /// Block angle over pickoff angle \[1\].
    pub pickoff_gain: [f64; 3],
    /// White noise of one reading \[rad\].
    pub pickoff_noise_rad: [f64; 3],
    /// Resolution of a reading \[rad\].
    pub pickoff_weight_rad: f64,
    /// J_block/(J_block + J_case): how far the case turns back \[1\].
    pub reaction_ratio: [f64; 3],
}

impl DitherEntry {
    /// Reads the section.
    pub fn read(mut entry: Entry, rate_hz: f64) -> Result<Self, InputError> {
        let dither = Self {
            frequency_hz: entry.triple("frequency_hz")?,
            amplitude_rad: entry.triple_within("amplitude_rad", NOISE_RAD, "rad")?,
            // a spread of 0.3 already lets the amplitude come down to a tenth of its mean (3 spreads)
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

/// `[reference]`.
#[derive(Debug, Clone, Copy)]
pub struct ReferenceEntry {
    /// White noise of the angle \[rad\].
    pub angle_noise_rad: f64,
    /// \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: f64,
    /// Resolution of the angle \[rad\].
    pub weight_rad: f64,
    /// Whether it also reports attitude (`reference_attitude`, in the north-west-up frame).
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
    /// \[rad/s\].
    pub bias_rad_s: [f64; 3],
    /// \[1\].
    pub scale_error: [f64; 3],
    /// White noise of the angle \[rad\].
    pub angle_noise_rad: f64,
    /// \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: f64,
    /// \[rad/s/√s\].
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

/// `[encoder]`: angle encoders of the table's axes, on the base; they know nothing of the Earth's rotation.
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
    /// \[m/s²\].
    pub bias_m_s2: [f64; 3],
    /// \[1\].
    pub scale_error: [f64; 3],
    /// One-sided density \[m/s²/√Hz\].
    pub noise_m_s2_sqrt_hz: f64,
    /// Resolution of a reading \[m/s²\].
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

/// A rate of readings that divides the sample rate.
fn slow_rate(entry: &mut Entry, rate_hz: f64) -> Result<f64, InputError> {
    let slow_hz = entry.positive("rate_hz")?;
    let rows = rate_hz / slow_hz;
    if rows >= 1.0 && (rows - rows.round()).abs() < 1e-9 * rows {
        return Ok(slow_hz);
    }
    Err(entry
        .error("rate_hz", "does not divide the sample rate")
        .value(slow_hz)
        .expected(format!("{rate_hz} Hz over a whole number")))
}

/// Reads `[thermal]`.
pub fn thermal(mut entry: Entry, rate_hz: f64) -> Result<ThermalEntry, InputError> {
    let swing = entry.has("ambient_swing_k");
    let thermal = ThermalEntry {
        // electronics live between −73 and 127 °C
        start_k: entry.within("start_k", [200.0, 400.0], "K")?,
        self_heating_k: entry.triple_within("self_heating_k", [-100.0, 100.0], "K")?,
        time_constant_s: entry.triple_within("time_constant_s", [TINY, 1e6], "s")?,
        ambient_rate_k_s: entry.within_or("ambient_rate_k_s", [-10.0, 10.0], "K/s", 0.0)?,
        ambient_swing_k: entry.within_or("ambient_swing_k", [-100.0, 100.0], "K", 0.0)?,
        ambient_period_s: if swing {
            entry.within("ambient_period_s", [TINY, 1e6], "s")?
        } else {
            1.0
        },
        scale_error_k: entry.triple_within_or("scale_error_k", [-1e-2, 1e-2], "1/K", [0.0; 3])?,
        sensor_noise_k: entry.within("sensor_noise_k", [0.0, 10.0], "K")?,
        sensor_weight_k: entry.within("sensor_weight_k", [TINY, 10.0], "K")?,
        rate_hz: slow_rate(&mut entry, rate_hz)?,
    };
    entry.finish()?;
    Ok(thermal)
}

/// Reads `[magnetic]`.
pub fn magnetic(mut entry: Entry, rate_hz: f64) -> Result<MagneticEntry, InputError> {
    // 0.1 T is a strong magnet; the Earth has 5e-5 T
    let field = [-0.1, 0.1];
    let coil = entry.has("coil_field_t");
    let magnetic = MagneticEntry {
        navigation_field_t: entry.triple_within("navigation_field_t", field, "T")?,
        coil_field_t: entry.triple_within_or("coil_field_t", field, "T", [0.0; 3])?,
        coil_frequency_hz: if coil {
            entry.within("coil_frequency_hz", [TINY, 0.5 * rate_hz], "Hz")?
        } else {
            0.0
        },
        sensor_noise_t: entry.within("sensor_noise_t", [0.0, 1.0], "T")?,
        sensor_weight_t: entry.within("sensor_weight_t", [TINY, 1.0], "T")?,
        rate_hz: slow_rate(&mut entry, rate_hz)?,
    };
    entry.finish()?;
    Ok(magnetic)
}

/// Reads `[isolator]`: `angular_frequency_hz`, `angular_damping`, `linear_frequency_hz`, `linear_damping`, and for
/// rocking `offset_m`, `gyration_radius_m`.
pub fn isolator(mut entry: Entry) -> Result<IsolatorEntry, InputError> {
    let mut modes = |frequency: &str, damping: &str| -> Result<_, InputError> {
        if !entry.has(frequency) {
            return Ok([None; 3]);
        }
        let frequency_hz = entry.triple_within(frequency, [TINY, 1e5], "Hz")?;
        // beyond 10 a mount is a dashpot; 0 rings for ever, which is no mount
        let damping = entry.triple_within(damping, [TINY, 10.0], "")?;
        Ok([0, 1, 2].map(|axis| Some((frequency_hz[axis], damping[axis]))))
    };
    let angular = modes("angular_frequency_hz", "angular_damping")?;
    let linear = modes("linear_frequency_hz", "linear_damping")?;
    let offset_m = entry.triple_within_or("offset_m", [-1.0, 1.0], "m", [0.0; 3])?;
    let rocks = offset_m != [0.0; 3];
    if rocks && angular[0].is_none() {
        return Err(entry
            .error("angular_frequency_hz", "is missing")
            .expected("the modes in which an offset rocks the case"));
    }
    let isolator = IsolatorEntry {
        angular,
        linear,
        offset_m,
        gyration_radius_m: if rocks {
            entry.triple_within("gyration_radius_m", [1e-3, 10.0], "m")?
        } else {
            [1.0; 3]
        },
    };
    entry.finish()?;
    Ok(isolator)
}
