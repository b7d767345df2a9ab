//! Where samples come from: one trait for every source of readings.
//!
//! Enters: nothing but time; the caller asks once a period. Leaves: a [`Reading`], block frame, raw counts
//! and codes. Deliberately not here: waiting. A source answers at once, because the caller is an interrupt
//! with a deadline.

use crate::Sample;

/// Something that yields one sample a period.
pub trait SampleSource {
    /// The sample of the period that just ended. Answers without waiting for the next period.
    fn take(&mut self) -> Reading;
}

/// What one request yielded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reading {
    /// The sample, if there is one that the chain may use.
    pub sample: Option<Sample>,
    /// Sampling periods that the sample's counts cover: 1 as a rule, more after periods without a sample,
    /// 0 for the first sample (its counts are zeros: there is nothing yet to difference with) and where
    /// there is none.
    pub periods: u32,
    /// What was wrong. Both can be present: after a skipped frame the sample holds the angle of several
    /// periods, which is right as an angle and wrong as a rate.
    pub fault: Option<SourceFault>,
}

impl Reading {
    /// No sample, for this reason.
    pub const fn without_sample(fault: SourceFault) -> Self {
        Self {
            sample: None,
            periods: 0,
            fault: Some(fault),
        }
    }
}

/// Why a reading is not an ordinary one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum SourceFault {
    /// The bus reported an error.
    Bus,
    /// Every bit of the frame is the same: the data line is shorted, open, or nobody drives it.
    StuckLine,
    /// The frame's check sum does not match its content.
    Checksum,
    /// The frame of the previous period came again.
    Repeated,
    /// This many frames, which nobody failed to read, never came.
    Skipped(u16),
    /// The stream had no sample ready.
    Starved,
}
