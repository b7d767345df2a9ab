//! Applies faults of the data itself: `lost_samples`, `stuck_channel`, `saturation`.
//!
//! From a reading as the instrument made it, and the time its row begins in s, it gives what the recorder keeps:
//! nothing (NaN), the last reading before the fault, or the reading within a limit.
//!
//! A saturation's limit is the scenario's `level`, in the channel's stored unit; without one, two thirds of the
//! largest reading before the fault.

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Failure {
    /// The reading is not measured (NaN).
    Lost,
    /// The last reading before the fault is repeated.
    Stuck,
    /// The reading is held within this limit; `None`: a share of the largest reading so far.
    Saturated(Option<f64>),
}

/// One fault of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct FaultEntry {
    /// The channel's name in results: `gyro_x`, `dither_y`, `reference_z`, ....
    pub channel: String,
    /// Start \[s\].
    pub start_s: f64,
    /// End \[s\].
    pub end_s: f64,
    /// What goes wrong.
    pub failure: Failure,
}

/// Limit of a saturation without a level, as a share of the largest reading so far, so that the peaks of a vibration or
/// a dither are cut.
const SHARE_OF_LARGEST: f64 = 2.0 / 3.0;

/// A fault of one channel with the readings that it needs to remember.
#[derive(Debug, Clone)]
pub struct Fault {
    entry: FaultEntry,
    last: f64,
    largest: f64,
}

impl Fault {
    /// The fault before the first row.
    pub fn new(entry: &FaultEntry) -> Self {
        Self {
            entry: entry.clone(),
            last: 0.0,
            largest: 0.0,
        }
    }

    /// What the recorder keeps of `reading`; `weight` is the channel's resolution.
    pub fn keep(&mut self, reading: f64, begin_s: f64, weight: f64) -> f64 {
        if !(self.entry.start_s..self.entry.end_s).contains(&begin_s) {
            self.last = reading;
            self.largest = self.largest.max(reading.abs());
            return reading;
        }
        match self.entry.failure {
            Failure::Lost => f64::NAN,
            Failure::Stuck => self.last,
            Failure::Saturated(level) => {
                let limit = level.unwrap_or(SHARE_OF_LARGEST * self.largest);
                let codes = (limit / weight).floor().max(0.0);
                let code = (reading / weight).round();
                code.clamp(-codes, codes) * weight
            }
        }
    }
}
