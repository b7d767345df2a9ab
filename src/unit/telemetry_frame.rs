//! Holds the unit's report at the end of an output period. The crate's feature `wire` encodes it as bytes.

use crate::chain::sample::OutputFrame;
use crate::unit::health::HealthItem;
use crate::unit::pulse_clock::FrameTime;

/// Report of the unit at the end of an output period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[must_use = "a frame that is not sent is lost with its angle"]
pub struct TelemetryFrame {
    /// Increments and status of the output period.
    pub output: OutputFrame,
    /// The health item whose turn it was.
    pub health: HealthItem,
    /// Time of the output period's first sample, of a bank that stamps its frames.
    pub time: FrameTime,
}

impl TelemetryFrame {
    /// A frame without a time.
    pub const fn new(output: OutputFrame, health: HealthItem) -> Self {
        Self {
            output,
            health,
            time: FrameTime::NONE,
        }
    }
}
