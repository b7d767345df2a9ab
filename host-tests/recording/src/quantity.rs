//! Quantities of channels: names, units, axes and plausible magnitudes in the quantity's unit.
//!
//! The contract's table as code. A magnitude bound is not a filter: it is compared with the *median* of a whole
//! channel, so that single faults pass and only a wrong unit is rejected.

use super::{Axis, Quantity};

/// Axis labels of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisRule {
    /// One of x, y, z.
    Body,
    /// x, y, z or none: a thermometer may belong to a gyro or to the whole unit.
    BodyOrNone,
    /// No axis: a quantity of the whole unit.
    Absent,
    /// One of w, x, y, z.
    Quaternion,
    /// Any label: a quantity outside the contract.
    Free,
}

/// Plausible range of the median magnitude of a channel, in the quantity's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plausible {
    /// Lower bound.
    pub least: f64,
    /// Upper bound.
    pub greatest: f64,
    /// Probable cause of a value outside.
    pub reason: &'static str,
}

/// Upper bound of a rate \[rad/s\], ten revolutions a second: above any ring-laser gyro (the fastest are specified to
/// about 1000 °/s), below a moving channel in degrees or arcseconds labelled as rad.
const FASTEST_RAD_S: f64 = 62.8;

/// Upper bound of a dither angle \[rad\]: flexures limit the block to some 0.001 rad; 0.1 rad is a wrong unit.
const LARGEST_DITHER_RAD: f64 = 0.1;

/// Upper bound of a specific force \[m/s²\], 1000 g: beyond any motion survived by a navigation unit.
const LARGEST_FORCE_M_S2: f64 = 9.8e3;

/// Lower bound of a temperature \[K\]: no unit runs below −123 °C; the column is in °C.
const COLDEST_K: f64 = 150.0;

/// Upper bound of a temperature \[K\]: solder melts above 327 °C.
const HOTTEST_K: f64 = 600.0;

/// Upper bound of a field \[T\]: 1 T (the Earth's is 5e-5 T) is that of a magnet's gap; the column is in µT, nT or
/// gauss.
const STRONGEST_FIELD_T: f64 = 1.0;

/// Upper bound of a unit quaternion's component: 1, plus rounding of the storage.
const LARGEST_COMPONENT: f64 = 1.001;

/// Upper bound of an intensity or drive over nominal: the end of the bank's code, which is twice nominal.
const LARGEST_SHARE: f64 = 2.0;

/// Upper bound of a time since a pulse per second \[s\]: the end of the bank's stamp.
const LONGEST_SINCE_PULSE_S: f64 = 1.05;

impl Quantity {
    /// Quantities of gyros, the least processed first.
    pub const GYROS: [Self; 3] = [Self::GyroCount, Self::GyroIncrement, Self::GyroRate];

    /// Quantities of accelerometers.
    pub const FORCES: [Self; 2] = [Self::SpecificForce, Self::VelocityIncrement];

    /// True if a row holds a sum or a mean over its period.
    pub fn is_of_a_period(&self) -> bool {
        let is_of_unit = Self::GYROS.contains(self) || Self::FORCES.contains(self);
        is_of_unit || *self == Self::ReferenceIncrement
    }

    /// Returns the quantity of a name in the file; an unlisted name is kept as [`Quantity::Other`].
    pub fn from_name(name: &str) -> Self {
        match name {
            "gyro_count" => Self::GyroCount,
            "gyro_increment" => Self::GyroIncrement,
            "gyro_rate" => Self::GyroRate,
            "dither_angle" => Self::DitherAngle,
            "specific_force" => Self::SpecificForce,
            "velocity_increment" => Self::VelocityIncrement,
            "temperature" => Self::Temperature,
            "magnetic_field" => Self::MagneticField,
            "reference_increment" => Self::ReferenceIncrement,
            "reference_attitude" => Self::ReferenceAttitude,
            "laser_intensity" => Self::LaserIntensity,
            "path_length_drive" => Self::PathLengthDrive,
            "path_length_resets" => Self::PathLengthResets,
            "dither_drive" => Self::DitherDrive,
            "time_since_pulse" => Self::TimeSincePulse,
            other => Self::Other(other.to_owned()),
        }
    }

    /// Name in the file.
    pub fn name(&self) -> &str {
        match self {
            Self::GyroCount => "gyro_count",
            Self::GyroIncrement => "gyro_increment",
            Self::GyroRate => "gyro_rate",
            Self::DitherAngle => "dither_angle",
            Self::SpecificForce => "specific_force",
            Self::VelocityIncrement => "velocity_increment",
            Self::Temperature => "temperature",
            Self::MagneticField => "magnetic_field",
            Self::ReferenceIncrement => "reference_increment",
            Self::ReferenceAttitude => "reference_attitude",
            Self::LaserIntensity => "laser_intensity",
            Self::PathLengthDrive => "path_length_drive",
            Self::PathLengthResets => "path_length_resets",
            Self::DitherDrive => "dither_drive",
            Self::TimeSincePulse => "time_since_pulse",
            Self::Other(name) => name,
        }
    }

    /// Quantities of the contract.
    pub const LISTED: [Self; 15] = [
        Self::GyroCount,
        Self::GyroIncrement,
        Self::GyroRate,
        Self::DitherAngle,
        Self::SpecificForce,
        Self::VelocityIncrement,
        Self::Temperature,
        Self::MagneticField,
        Self::ReferenceIncrement,
        Self::ReferenceAttitude,
        Self::LaserIntensity,
        Self::PathLengthDrive,
        Self::PathLengthResets,
        Self::DitherDrive,
        Self::TimeSincePulse,
    ];

    /// Quantities of the unit's health, which no diagnosis uses.
    pub const HEALTH: [Self; 5] = [
        Self::LaserIntensity,
        Self::PathLengthDrive,
        Self::PathLengthResets,
        Self::DitherDrive,
        Self::TimeSincePulse,
    ];

    /// Meaning of a row's value, for `docs/files.md`.
    pub fn meaning(&self) -> &'static str {
        match self {
            Self::GyroCount => {
                "pulses counted over the row's period, the block's own dither included"
            }
            Self::GyroIncrement => "angle over the row's period, without a dither",
            Self::GyroRate => "mean rate over the row's period",
            Self::DitherAngle => "angle of the block relative to the case, at the row's end",
            Self::SpecificForce => "mean specific force over the row's period",
            Self::VelocityIncrement => "velocity increment over the row's period",
            Self::Temperature => "temperature at the row's end",
            Self::MagneticField => "magnetic flux density at the row's end",
            Self::ReferenceIncrement => {
                "angle of the case over the row's period, from a turntable or a reference gyro"
            }
            Self::ReferenceAttitude => {
                "unit quaternion, body to navigation frame, at the row's end: axes `w`, `x`, `y`, `z`"
            }
            Self::LaserIntensity => "intensity of the laser over nominal, at the row's end",
            Self::PathLengthDrive => {
                "drive of the path-length control over its range, -1 to 1, at the row's end"
            }
            Self::PathLengthResets => {
                "resets of the path-length control since the unit's start, at the row's end"
            }
            Self::DitherDrive => "drive of the dither over nominal, at the row's end",
            Self::TimeSincePulse => {
                "time from the last pulse per second to the row's end, by the unit's clock; no axis"
            }
            Self::Other(_) => "kept, and offered to the search for unlisted physics",
        }
    }

    /// Unit of the values after scale and offset; `None` for a quantity outside the contract.
    pub fn unit(&self) -> Option<&'static str> {
        Some(match self {
            Self::GyroCount
            | Self::ReferenceAttitude
            | Self::LaserIntensity
            | Self::PathLengthDrive
            | Self::PathLengthResets
            | Self::DitherDrive => "1",
            Self::TimeSincePulse => "s",
            Self::GyroIncrement | Self::DitherAngle | Self::ReferenceIncrement => "rad",
            Self::GyroRate => "rad/s",
            Self::SpecificForce => "m/s^2",
            Self::VelocityIncrement => "m/s",
            Self::Temperature => "K",
            Self::MagneticField => "T",
            Self::Other(_) => return None,
        })
    }

    /// Axis labels of the quantity.
    pub fn axis_rule(&self) -> AxisRule {
        match self {
            Self::Temperature => AxisRule::BodyOrNone,
            Self::ReferenceAttitude => AxisRule::Quaternion,
            Self::TimeSincePulse => AxisRule::Absent,
            Self::Other(_) => AxisRule::Free,
            _ => AxisRule::Body,
        }
    }

    /// True if a channel without a value prevents the analysis: gyros and references.
    pub fn is_essential(&self) -> bool {
        let references = [Self::ReferenceIncrement, Self::ReferenceAttitude];
        Self::GYROS.contains(self) || references.contains(self)
    }

    /// Plausible magnitudes in the quantity's unit, for rows of `period_s` \[s\]; `None` without a bound.
    pub fn plausible(&self, period_s: f64) -> Option<Plausible> {
        let bound = |least, greatest, reason| {
            Some(Plausible {
                least,
                greatest,
                reason,
            })
        };
        match self {
            Self::GyroCount | Self::PathLengthResets | Self::Other(_) => None,
            Self::GyroIncrement | Self::ReferenceIncrement => bound(
                0.0,
                FASTEST_RAD_S * period_s,
                "more than ten revolutions a second: is it in degrees, arcseconds or pulses?",
            ),
            Self::GyroRate => bound(
                0.0,
                FASTEST_RAD_S,
                "more than ten revolutions a second: is it in degrees or arcseconds a second?",
            ),
            Self::DitherAngle => bound(
                0.0,
                LARGEST_DITHER_RAD,
                "no dither flexure turns so far: is it in arcseconds or converter codes?",
            ),
            Self::SpecificForce => bound(
                0.0,
                LARGEST_FORCE_M_S2,
                "more than 1000 g: is it in micro-g or converter codes?",
            ),
            Self::VelocityIncrement => bound(
                0.0,
                LARGEST_FORCE_M_S2 * period_s,
                "more than 1000 g: is it in other units?",
            ),
            Self::Temperature => bound(
                COLDEST_K,
                HOTTEST_K,
                "no unit runs at this temperature: is it in degrees Celsius?",
            ),
            Self::MagneticField => bound(
                0.0,
                STRONGEST_FIELD_T,
                "stronger than a magnet: is it in microtesla or gauss?",
            ),
            Self::ReferenceAttitude => bound(
                0.0,
                LARGEST_COMPONENT,
                "no component of a unit quaternion exceeds 1",
            ),
            Self::LaserIntensity | Self::DitherDrive => bound(
                0.0,
                LARGEST_SHARE,
                "more than twice nominal: is it in volts, per cent or converter codes?",
            ),
            Self::PathLengthDrive => bound(
                0.0,
                LARGEST_COMPONENT,
                "beyond the control's range: is it in volts or converter codes?",
            ),
            Self::TimeSincePulse => bound(
                0.0,
                LONGEST_SINCE_PULSE_S,
                "longer than from pulse to pulse: is it in milliseconds or microseconds?",
            ),
        }
    }
}

/// Compares units after reduction of common spellings to the contract's: no spaces, `^` for powers, SI names.
pub fn same_unit(written: &str, expected: &str) -> bool {
    let canonical = |text: &str| {
        text.trim()
            .replace('²', "^2")
            .replace("s-1", "/s")
            .replace("s-2", "/s^2")
            .replace("**", "^")
            .replace([' ', '·', '*'], "")
            .replace("//", "/")
            .replace("s2", "s^2")
    };
    let written = canonical(written);
    match expected {
        "1" => matches!(
            written.as_str(),
            "1" | "" | "-" | "count" | "counts" | "pulse" | "pulses"
        ),
        "T" => written == "T" || written == "tesla",
        "K" => written == "K" || written == "kelvin",
        _ => written == expected,
    }
}

impl Axis {
    /// All three axes, in the order of vectors.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// Label in the files.
    pub fn label(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// Index in a vector: 0, 1, 2.
    pub fn index(self) -> usize {
        self as usize
    }
}
