//! Names the form in which output periods leave the unit.

/// Form of the output on the telemetry port.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
#[non_exhaustive]
pub enum OutputFormat {
    /// The telemetry frame (`wire/telemetry.rs`).
    #[default]
    Frames = 0,
    /// Messages in the style of common inertial units (`wire/inertial_message.rs`).
    Inertial = 1,
}

impl OutputFormat {
    /// The form of this number, if it is one.
    pub const fn from_number(number: u16) -> Option<Self> {
        match number {
            0 => Some(Self::Frames),
            1 => Some(Self::Inertial),
            _ => None,
        }
    }
}
