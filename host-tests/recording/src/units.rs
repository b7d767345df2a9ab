//! Reads units in common spellings, and converts values to SI.

use super::Quantity;

/// Dimension of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// Angle per time.
    AngularRate,
    /// Angle.
    Angle,
    /// Acceleration.
    Force,
    /// Velocity.
    Velocity,
    /// Temperature.
    Temperature,
    /// Magnetic flux density.
    Field,
    /// Time.
    Time,
    /// Dimensionless number.
    Number,
}

/// Unit: stored · scale + offset = SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Dimension.
    pub dimension: Dimension,
    /// SI value of one unit.
    pub scale: f64,
    /// Added after the scale; for temperatures only.
    pub offset: f64,
}

/// Standard gravity \[m/s²\], which defines the unit g.
pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// m/s² to millionths of standard gravity.
pub const MICRO_G_PER_M_S2: f64 = 1e6 / STANDARD_GRAVITY_M_S2;

/// 0 °C \[K\].
const ICE_K: f64 = 273.15;

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Spellings, in the form of [`canonical`]. g is gravity and G is gauss, so case counts.
const UNITS: &[(&[&str], Dimension, f64, f64)] = &[
    (
        &["rad/s", "rad_s", "rads", "rps"],
        Dimension::AngularRate,
        1.0,
        0.0,
    ),
    (&["mrad/s", "mrad_s"], Dimension::AngularRate, 1e-3, 0.0),
    (&["urad/s", "urad_s"], Dimension::AngularRate, 1e-6, 0.0),
    (
        &["deg/s", "deg_s", "degs", "dps", "d/s"],
        Dimension::AngularRate,
        DEGREE,
        0.0,
    ),
    (
        &["mdeg/s", "mdps", "mdeg_s"],
        Dimension::AngularRate,
        DEGREE / 1e3,
        0.0,
    ),
    (
        &["deg/h", "deg_h", "deg/hr", "dph"],
        Dimension::AngularRate,
        DEGREE / 3600.0,
        0.0,
    ),
    (
        &["arcsec/s", "arcsec_s"],
        Dimension::AngularRate,
        DEGREE / 3600.0,
        0.0,
    ),
    (
        &["rpm"],
        Dimension::AngularRate,
        std::f64::consts::TAU / 60.0,
        0.0,
    ),
    (&["rad"], Dimension::Angle, 1.0, 0.0),
    (&["mrad"], Dimension::Angle, 1e-3, 0.0),
    (&["urad"], Dimension::Angle, 1e-6, 0.0),
    (&["deg", "degree"], Dimension::Angle, DEGREE, 0.0),
    (&["arcmin"], Dimension::Angle, DEGREE / 60.0, 0.0),
    (&["arcsec", "as"], Dimension::Angle, DEGREE / 3600.0, 0.0),
    (
        &["rev", "turn"],
        Dimension::Angle,
        std::f64::consts::TAU,
        0.0,
    ),
    (
        &["m/s^2", "m_s2", "ms2", "mps2", "ms^2"],
        Dimension::Force,
        1.0,
        0.0,
    ),
    (
        &["g", "gn", "g's", "gee", "gees"],
        Dimension::Force,
        STANDARD_GRAVITY_M_S2,
        0.0,
    ),
    (&["mg"], Dimension::Force, STANDARD_GRAVITY_M_S2 / 1e3, 0.0),
    (&["ug"], Dimension::Force, STANDARD_GRAVITY_M_S2 / 1e6, 0.0),
    (&["m/s", "m_s"], Dimension::Velocity, 1.0, 0.0),
    (&["mm/s"], Dimension::Velocity, 1e-3, 0.0),
    (&["K", "kelvin"], Dimension::Temperature, 1.0, 0.0),
    (
        &["C", "degC", "celsius"],
        Dimension::Temperature,
        1.0,
        ICE_K,
    ),
    (
        &["F", "degF", "fahrenheit"],
        Dimension::Temperature,
        5.0 / 9.0,
        459.67 * 5.0 / 9.0,
    ),
    (&["T", "tesla"], Dimension::Field, 1.0, 0.0),
    (&["mT"], Dimension::Field, 1e-3, 0.0),
    (&["uT"], Dimension::Field, 1e-6, 0.0),
    (&["nT"], Dimension::Field, 1e-9, 0.0),
    (&["G", "Gs", "gauss"], Dimension::Field, 1e-4, 0.0),
    (&["mG", "mGs", "mgauss"], Dimension::Field, 1e-7, 0.0),
    (
        &["s", "sec", "secs", "second", "seconds"],
        Dimension::Time,
        1.0,
        0.0,
    ),
    (
        &["ms", "msec", "millis", "milliseconds"],
        Dimension::Time,
        1e-3,
        0.0,
    ),
    (
        &["us", "usec", "micros", "microseconds"],
        Dimension::Time,
        1e-6,
        0.0,
    ),
    (
        &["ns", "nsec", "nanos", "nanosec", "nanoseconds"],
        Dimension::Time,
        1e-9,
        0.0,
    ),
    (&["min"], Dimension::Time, 60.0, 0.0),
    (&["1", "-"], Dimension::Number, 1.0, 0.0),
];

impl Unit {
    /// Parses a unit; `0.061*deg/s` is a count with its weight.
    pub fn parse(text: &str) -> Option<Self> {
        let text = text.trim().replace("**", "^");
        let text = text.as_str();
        if let Some((weight, unit)) = text.split_once('*') {
            let weight: f64 = weight.trim().parse().ok()?;
            let unit = Self::named(unit)?;
            let usable = weight.is_finite() && weight != 0.0;
            return usable.then_some(Self {
                scale: weight * unit.scale,
                ..unit
            });
        }
        Self::named(text)
    }

    /// Parses the unit of a column whose dimension is known, which decides what is ambiguous: `G` is g for a force and gauss
    /// for a field, `°` alone is °C for a temperature.
    pub fn parse_for(text: &str, dimension: Dimension) -> Option<Self> {
        let of = |text: &str| Self::parse(text).filter(|unit| unit.dimension == dimension);
        of(text).or_else(|| match (dimension, text.trim()) {
            (Dimension::Force, "G" | "Gs") => of("g"),
            (Dimension::Temperature, "°" | "º" | "deg") => of("C"),
            _ => None,
        })
    }

    fn named(text: &str) -> Option<Self> {
        let text = canonical(text);
        let same =
            |name: &&str| **name == text || (name.len() > 3 && text.to_lowercase() == **name);
        UNITS.iter().find(|(names, ..)| names.iter().any(same)).map(
            |&(_, dimension, scale, offset)| Self {
                dimension,
                scale,
                offset,
            },
        )
    }

    /// Converts a stored value to SI.
    pub fn to_si(self, stored: f64) -> f64 {
        stored * self.scale + self.offset
    }
}

impl Dimension {
    /// Example units of this dimension, for a sentence.
    pub fn examples(self) -> &'static str {
        match self {
            Self::AngularRate => "deg/s, deg/h, rad/s, mrad/s, or a weight as 0.061*deg/s",
            Self::Angle => "deg, rad, arcsec, mrad, or a weight as 0.932*arcsec",
            Self::Force => "g, mg, m/s^2, or a weight as 0.000061*g",
            Self::Velocity => "m/s, mm/s, or a weight as 1e-5*m/s",
            Self::Temperature => "K, C, F",
            Self::Field => "T, uT, nT, gauss",
            Self::Time => "s, ms, us, ns",
            Self::Number => "1",
        }
    }

    /// Dimension of a quantity; `None` for a quantity outside the contract.
    pub fn of(quantity: &Quantity) -> Option<Self> {
        Some(match quantity {
            Quantity::GyroRate => Self::AngularRate,
            Quantity::GyroCount
            | Quantity::GyroIncrement
            | Quantity::DitherAngle
            | Quantity::ReferenceIncrement => Self::Angle,
            Quantity::SpecificForce => Self::Force,
            Quantity::VelocityIncrement => Self::Velocity,
            Quantity::Temperature => Self::Temperature,
            Quantity::MagneticField => Self::Field,
            Quantity::ReferenceAttitude
            | Quantity::LaserIntensity
            | Quantity::PathLengthDrive
            | Quantity::PathLengthResets
            | Quantity::DitherDrive => Self::Number,
            Quantity::TimeSincePulse => Self::Time,
            Quantity::Other(_) => return None,
        })
    }
}

/// Reduces the spellings of a unit to one: no blanks, ASCII, `^` for powers.
fn canonical(text: &str) -> String {
    let text = text.trim();
    // A line of units in capitals; case counts in short ones.
    let is_loud = text.len() > 3 && !text.contains(char::is_lowercase);
    let text = if is_loud {
        text.to_lowercase()
    } else {
        text.to_owned()
    };
    let text = text
        .replace("degrees", "deg")
        .replace("degree", "deg")
        .replace("radians", "rad")
        .replace("radian", "rad")
        .replace("meters", "m")
        .replace("metres", "m")
        .replace("/seconds", "/s")
        .replace("/second", "/s")
        .replace(".s", "s")
        .replace(['°', 'º', '˚'], "deg")
        .replace(['µ', 'μ'], "u")
        .replace('″', "arcsec")
        .replace('²', "^2")
        .replace("⁻¹", "-1")
        .replace("⁻²", "-2")
        .replace("**", "^")
        .replace("per", "/")
        .replace("sec^2", "s^2")
        .replace("/sec", "/s")
        .replace("/hour", "/h")
        .replace([' ', '·', '*'], "");
    let text = text.replace("s^-2", "/s^2").replace("s^-1", "/s");
    let text = text.replace("s-2", "/s^2").replace("s-1", "/s");
    let text = text.replace("/s/s", "/s^2").replace("//", "/");
    match text.as_str() {
        "m/s2" => "m/s^2".to_owned(),
        _ => text,
    }
}
