//! Names what a foreign column may become: a quantity of the recording, or something that one is formed from.

use crate::recording::Quantity;
use crate::recording::units::Dimension;

/// What a column becomes.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// A channel of this quantity.
    Stored(Quantity),
    /// The case's rate: times the period it is a `reference_increment`.
    ReferenceRate,
    /// The case's angle, of an encoder: unwrapped and differenced it is a `reference_increment`.
    ReferenceAngle,
    /// A quaternion from the navigation frame to the body: its conjugate is a `reference_attitude`.
    AttitudeInverse,
    /// An angle about the axis in a sequence of three rotations.
    Euler,
    /// Nothing.
    Nothing,
}

impl Target {
    /// The target of this name on the command line; an unlisted name is a quantity of its own.
    pub fn from_name(name: &str) -> Self {
        match name {
            "reference_rate" => Self::ReferenceRate,
            "reference_angle" => Self::ReferenceAngle,
            "reference_attitude_inverse" => Self::AttitudeInverse,
            "reference_euler" => Self::Euler,
            "none" => Self::Nothing,
            other => Self::Stored(Quantity::from_name(other)),
        }
    }

    /// Its name on the command line.
    pub fn name(&self) -> &str {
        match self {
            Self::Stored(quantity) => quantity.name(),
            Self::ReferenceRate => "reference_rate",
            Self::ReferenceAngle => "reference_angle",
            Self::AttitudeInverse => "reference_attitude_inverse",
            Self::Euler => "reference_euler",
            Self::Nothing => "none",
        }
    }

    /// What its values measure; `None` where any unit will do.
    pub fn dimension(&self) -> Option<Dimension> {
        match self {
            Self::Stored(quantity) => Dimension::of(quantity),
            Self::ReferenceRate => Some(Dimension::AngularRate),
            Self::ReferenceAngle | Self::Euler => Some(Dimension::Angle),
            Self::AttitudeInverse => Some(Dimension::Number),
            Self::Nothing => None,
        }
    }

    /// Whether it becomes an attitude.
    pub fn is_attitude(&self) -> bool {
        let stored = Self::Stored(Quantity::ReferenceAttitude);
        *self == stored || matches!(self, Self::AttitudeInverse | Self::Euler)
    }

    /// Whether a row holds a sum or a mean over its period, so that all rows need one period.
    pub fn is_of_a_period(&self) -> bool {
        match self {
            Self::Stored(quantity) => quantity.is_of_a_period(),
            Self::ReferenceRate | Self::ReferenceAngle => true,
            _ => false,
        }
    }

    /// Whether it is a gyro's reading.
    pub fn is_gyro(&self) -> bool {
        matches!(self, Self::Stored(quantity) if Quantity::GYROS.contains(quantity))
    }

    /// Whether its unit must be known for a diagnosis: gyros, references and forces. The others are left out without.
    pub fn needs_a_unit(&self) -> bool {
        let optional = [
            Quantity::Temperature,
            Quantity::MagneticField,
            Quantity::DitherAngle,
        ];
        !matches!(self, Self::Stored(quantity) if optional.contains(quantity))
    }

    /// Axis labels that it takes.
    pub fn takes_axis(&self, axis: Option<&str>) -> bool {
        match self {
            Self::Stored(Quantity::Temperature) => matches!(axis, None | Some("x" | "y" | "z")),
            Self::Stored(Quantity::ReferenceAttitude) | Self::AttitudeInverse => {
                matches!(axis, Some("w" | "x" | "y" | "z"))
            }
            Self::Stored(Quantity::Other(_)) | Self::Nothing => true,
            _ => matches!(axis, Some("x" | "y" | "z")),
        }
    }
}
