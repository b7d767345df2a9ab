//! Where samples come from: one trait for the board's counter bank and for the emulator's stream.
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
    /// What was wrong. Both can be present: after a skipped frame the sample holds the angle of several
    /// periods, which is right as an angle and wrong as a rate.
    pub fault: Option<SourceFault>,
}

/// Why a reading is not an ordinary one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceFault {
    /// The bus reported an error.
    Bus,
    /// The frame's check sum does not match its content.
    Checksum,
    /// The frame of the previous period came again.
    Repeated,
    /// This many frames between the previous one and this one never came.
    Skipped(u16),
    /// The stream had no sample ready.
    Starved,
}
