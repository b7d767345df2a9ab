//! Holds the unit's report at the end of an output period. The crate's feature `wire` encodes it as bytes.

use crate::chain::sample::OutputFrame;
use crate::unit::health::HealthItem;

/// Report of the unit at the end of an output period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TelemetryFrame {
    /// Increments and status of the output period.
    pub output: OutputFrame,
    /// The health item whose turn it was.
    pub health: HealthItem,
}
