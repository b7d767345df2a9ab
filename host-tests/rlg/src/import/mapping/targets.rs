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
    /// Element `11` to `33`, row and column, of the matrix that takes the body's axes into the navigation frame's.
    Matrix,
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
            "reference_matrix" => Self::Matrix,
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
            Self::Matrix => "reference_matrix",
            Self::Nothing => "none",
        }
    }

    /// Returns the dimension of its values; `None` if any unit is valid.
    pub fn dimension(&self) -> Option<Dimension> {
        match self {
            Self::Stored(quantity) => Dimension::of(quantity),
            Self::ReferenceRate => Some(Dimension::AngularRate),
            Self::ReferenceAngle | Self::Euler => Some(Dimension::Angle),
            Self::AttitudeInverse | Self::Matrix => Some(Dimension::Number),
            Self::Nothing => None,
        }
    }

    /// True if it becomes an attitude.
    pub fn is_attitude(&self) -> bool {
        let stored = Self::Stored(Quantity::ReferenceAttitude);
        *self == stored || matches!(self, Self::AttitudeInverse | Self::Euler | Self::Matrix)
    }

    /// True if it shows a table or a case: an attitude, an angle, a rate or increments.
    pub fn is_reference(&self) -> bool {
        let stored = Self::Stored(Quantity::ReferenceIncrement);
        self.is_attitude() || self.is_about_one_axis() || *self == stored
    }

    /// True if it is an angle or rate of a reference, whose axis a table's only angle may lack.
    pub fn is_about_one_axis(&self) -> bool {
        matches!(self, Self::ReferenceAngle | Self::ReferenceRate)
    }

    /// Returns the axis labels that make it whole, for an attitude.
    pub fn parts(&self) -> &'static [&'static str] {
        match self {
            Self::Euler => &["x", "y", "z"],
            Self::Matrix => &["11", "12", "13", "21", "22", "23", "31", "32", "33"],
            _ => &["w", "x", "y", "z"],
        }
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
        !matches!(self, Self::Stored(quantity) if optional.contains(quantity) || Quantity::HEALTH.contains(quantity))
    }

    /// True if it takes this axis label.
    pub fn takes_axis(&self, axis: Option<&str>) -> bool {
        match self {
            Self::Stored(Quantity::Temperature) => matches!(axis, None | Some("x" | "y" | "z")),
            Self::Stored(Quantity::ReferenceAttitude) | Self::AttitudeInverse => {
                matches!(axis, Some("w" | "x" | "y" | "z"))
            }
            Self::Matrix => axis.is_some_and(|axis| self.parts().contains(&axis)),
            Self::Stored(Quantity::TimeSincePulse) => axis.is_none(),
            Self::Stored(Quantity::Other(_)) | Self::Nothing => true,
            _ => matches!(axis, Some("x" | "y" | "z")),
        }
    }
}
