//! What a channel may measure: names, units, axes and the magnitudes that its unit makes possible.
//!
//! The table of the contract as code. A magnitude bound is not a filter: it is compared with the
//! *median* of a whole channel, so single faults pass and only a wrong unit is refused.

use super::{Axis, Quantity};

/// Which axis labels a quantity takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AxisRule {
    /// One of x, y, z.
    Body,
    /// x, y, z or none: a thermometer may belong to a gyro or to the whole unit.
    BodyOrNone,
    /// One of w, x, y, z.
    Quaternion,
    /// Anything: the quantity is not one of the contract's.
    Free,
}

/// Magnitudes that the median of a channel may have in the quantity's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plausible {
    /// The least.
    pub least: f64,
    /// The greatest.
    pub greatest: f64,
    /// What a value outside suggests.
    pub reason: &'static str,
}

/// Ten revolutions a second, in rad/s: above any ring-laser gyro (the fastest are specified to about
/// 1000 °/s), below what degrees or arcseconds labelled rad would show while anything moves.
const FASTEST_RAD_S: f64 = 62.8;

/// A dither block is held by flexures and turns by at most some 0.001 rad; 0.1 rad is a wrong unit.
const LARGEST_DITHER_RAD: f64 = 0.1;

/// 1000 g: beyond any motion a navigation unit survives.
const LARGEST_FORCE_M_S2: f64 = 9.8e3;

/// Below −123 °C no unit runs: the column is in °C.
const COLDEST_K: f64 = 150.0;

/// Above 327 °C solder melts.
const HOTTEST_K: f64 = 600.0;

/// A field of 1 T (the Earth's is 5e-5 T) is that of a magnet's gap: the column is in µT, nT or gauss.
const STRONGEST_FIELD_T: f64 = 1.0;

/// A unit quaternion's components do not exceed 1; the rest is rounding of the storage.
const LARGEST_COMPONENT: f64 = 1.001;

impl Quantity {
    /// The quantities that a gyro may record, the least processed first.
    pub const GYROS: [Self; 3] = [Self::GyroCount, Self::GyroIncrement, Self::GyroRate];

    /// Whether a row holds a sum or a mean over its period.
    pub fn is_of_a_period(&self) -> bool {
        let others = [
            Self::ReferenceIncrement,
            Self::SpecificForce,
            Self::VelocityIncrement,
        ];
        Self::GYROS.contains(self) || others.contains(self)
    }

    /// The quantity of this name in the file; an unlisted name is kept as [`Quantity::Other`].
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
            other => Self::Other(other.to_owned()),
        }
    }

    /// Its name in the file.
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
            Self::Other(name) => name,
        }
    }

    /// Those that the contract lists.
    pub const LISTED: [Self; 10] = [
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
    ];

    /// What a row of it holds, for `docs/files.md`.
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
            Self::Other(_) => "kept, and offered to the search for unlisted physics",
        }
    }

    /// The unit of its values after scale and offset; `None` for a quantity outside the contract.
    pub fn unit(&self) -> Option<&'static str> {
        Some(match self {
            Self::GyroCount | Self::ReferenceAttitude => "1",
            Self::GyroIncrement | Self::DitherAngle | Self::ReferenceIncrement => "rad",
            Self::GyroRate => "rad/s",
            Self::SpecificForce => "m/s^2",
            Self::VelocityIncrement => "m/s",
            Self::Temperature => "K",
            Self::MagneticField => "T",
            Self::Other(_) => return None,
        })
    }

    /// Which axis labels it takes.
    pub fn axis_rule(&self) -> AxisRule {
        match self {
            Self::Temperature => AxisRule::BodyOrNone,
            Self::ReferenceAttitude => AxisRule::Quaternion,
            Self::Other(_) => AxisRule::Free,
            _ => AxisRule::Body,
        }
    }

    /// Whether a channel without a single value leaves nothing to compare: gyros and references.
    pub fn is_essential(&self) -> bool {
        let references = [Self::ReferenceIncrement, Self::ReferenceAttitude];
        Self::GYROS.contains(self) || references.contains(self)
    }

    /// The magnitudes that are possible in its unit, for rows of `period_s`; `None` where there is no bound.
    pub fn plausible(&self, period_s: f64) -> Option<Plausible> {
        let bound = |least, greatest, reason| {
            Some(Plausible {
                least,
                greatest,
                reason,
            })
        };
        match self {
            Self::GyroCount | Self::Other(_) => None,
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
        }
    }
}

/// One unit in the spellings people use, reduced to the contract's: no spaces, `^` for powers, SI names.
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

    /// Its label in the files.
    pub fn label(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
        }
    }

    /// Its index in a vector: 0, 1, 2.
    pub fn index(self) -> usize {
        self as usize
    }
}
