//! Faults of the data: `lost_samples`, `stuck_channel`, `saturation`; and of a counter that stands still.
//!
//! From a sample of the instrument, and the start of its row in s, the recorded value: none (NaN), the last sample before
//! the fault, the sample clipped to a limit, or an increment of 0.
//!
//! The limit of a saturation is the scenario's `level`, in the channel's stored unit; without one, two thirds of the
//! largest sample before the fault.

/// Type of a fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Failure {
    /// The sample is missing (NaN).
    Lost,
    /// The last sample before the fault is repeated.
    Stuck,
    /// The sample is clipped to this limit; `None`: a share of the largest sample so far.
    Saturated(Option<f64>),
    /// The counter stands still: its increments are 0.
    Still,
}

/// Fault of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct FaultEntry {
    /// The channel's name in results: `gyro_x`, `dither_y`, `reference_z`, ....
    pub channel: String,
    /// Start \[s\].
    pub start_s: f64,
    /// End \[s\].
    pub end_s: f64,
    /// Type of the fault.
    pub failure: Failure,
}

/// Limit of a saturation without a level, as a share of the largest sample so far, so that the peaks of a vibration or a
/// dither are clipped.
const SHARE_OF_LARGEST: f64 = 2.0 / 3.0;

/// Fault of one channel, with the samples to remember.
#[derive(Debug, Clone)]
pub struct Fault {
    entry: FaultEntry,
    last: f64,
    largest: f64,
}

impl Fault {
    /// State of a fault before the first row.
    pub fn new(entry: &FaultEntry) -> Self {
        Self {
            entry: entry.clone(),
            last: 0.0,
            largest: 0.0,
        }
    }

    /// Returns the recorded value of a sample; `weight` is the channel's resolution.
    pub fn keep(&mut self, reading: f64, begin_s: f64, weight: f64) -> f64 {
        if !(self.entry.start_s..self.entry.end_s).contains(&begin_s) {
            self.last = reading;
            self.largest = self.largest.max(reading.abs());
            return reading;
        }
        match self.entry.failure {
            Failure::Lost => f64::NAN,
            Failure::Stuck => self.last,
            Failure::Still => 0.0,
            Failure::Saturated(level) => {
                let limit = level.unwrap_or(SHARE_OF_LARGEST * self.largest);
                let codes = (limit / weight).floor().max(0.0);
                let code = (reading / weight).round();
                code.clamp(-codes, codes) * weight
            }
        }
    }
}
