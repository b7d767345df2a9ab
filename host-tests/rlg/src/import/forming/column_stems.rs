//! Names of a recording's columns.

use crate::recording::Quantity;

/// Returns the first letters of a column's name in the recording.
pub(super) fn stem(quantity: &Quantity) -> &'static str {
    match quantity {
        Quantity::GyroCount | Quantity::GyroIncrement | Quantity::GyroRate => "g",
        Quantity::DitherAngle => "d",
        Quantity::SpecificForce => "a",
        Quantity::VelocityIncrement => "v",
        Quantity::Temperature => "temperature",
        Quantity::MagneticField => "m",
        Quantity::ReferenceIncrement => "r",
        Quantity::ReferenceAttitude => "q",
        Quantity::LaserIntensity => "laser_intensity_",
        Quantity::PathLengthDrive => "path_length_drive_",
        Quantity::PathLengthResets => "path_length_resets_",
        Quantity::DitherDrive => "dither_drive_",
        Quantity::TimeSincePulse => "time_since_pulse",
        Quantity::Other(_) => "",
    }
}
