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
    /// Not measured.
    Lost,
    /// Held.
    Stuck,
    /// Limited to this, if known.
    Saturated(Option<f64>),
}

/// One fault of one channel.
#[derive(Debug, Clone, PartialEq)]
pub struct FaultEntry {
    /// As the results name it: `gyro_x`, `dither_y`, `reference_z`, ....
    pub channel: String,
    /// \[s\].
    pub start_s: f64,
    /// \[s\].
    pub end_s: f64,
    /// What goes wrong.
    pub failure: Failure,
}

/// Without a level: of the largest reading so far, so that a vibration's or a dither's peaks are cut.
const SHARE_OF_LARGEST: f64 = 2.0 / 3.0;

/// A fault and what it remembers of its channel.
#[derive(Debug, Clone)]
pub struct Fault {
    entry: FaultEntry,
    last: f64,
    largest: f64,
}

impl Fault {
    /// Before the first row.
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
