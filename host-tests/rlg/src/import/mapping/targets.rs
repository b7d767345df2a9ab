//! Lists the targets of foreign columns: quantities of the recording, and inputs from which one is formed.

use crate::recording::Quantity;
use crate::recording::units::Dimension;

/// Target of a column.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Target {
    /// A channel of this quantity.
    Stored(Quantity),
    /// Rate of the case: times the period it is a `reference_increment`.
    ReferenceRate,
    /// Angle of the case, of an encoder: unwrapped and differenced it is a `reference_increment`.
    ReferenceAngle,
    /// A quaternion from the navigation frame to the body: its conjugate is a `reference_attitude`.
    AttitudeInverse,
    /// An angle about the axis in a sequence of three rotations.
    Euler,
    /// Column left out.
    Nothing,
}

impl Target {
    /// Returns the target of this name on the command line; an unlisted name is a quantity of its own.
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

    /// Returns its name on the command line.
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

    /// Returns the dimension of its values; `None` if any unit is valid.
    pub fn dimension(&self) -> Option<Dimension> {
        match self {
            Self::Stored(quantity) => Dimension::of(quantity),
            Self::ReferenceRate => Some(Dimension::AngularRate),
            Self::ReferenceAngle | Self::Euler => Some(Dimension::Angle),
            Self::AttitudeInverse => Some(Dimension::Number),
            Self::Nothing => None,
        }
    }

    /// True if it becomes an attitude.
    pub fn is_attitude(&self) -> bool {
        let stored = Self::Stored(Quantity::ReferenceAttitude);
        *self == stored || matches!(self, Self::AttitudeInverse | Self::Euler)
    }

    /// True if a row holds a sum or a mean over its period, so that all rows need one period.
    pub fn is_of_a_period(&self) -> bool {
        match self {
            Self::Stored(quantity) => quantity.is_of_a_period(),
            Self::ReferenceRate | Self::ReferenceAngle => true,
            _ => false,
        }
    }

    /// True if it is a gyro's quantity.
    pub fn is_gyro(&self) -> bool {
        matches!(self, Self::Stored(quantity) if Quantity::GYROS.contains(quantity))
    }

    /// True if its unit must be known for a diagnosis: gyros, references and forces. Others are left out without a unit.
    pub fn needs_a_unit(&self) -> bool {
        let optional = [
            Quantity::Temperature,
            Quantity::MagneticField,
            Quantity::DitherAngle,
        ];
        !matches!(self, Self::Stored(quantity) if optional.contains(quantity))
    }

    /// True if it takes this axis label.
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
