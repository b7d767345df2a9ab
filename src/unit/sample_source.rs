//! Defines the source of samples: one trait for every source of readings.
//!
//! The caller asks once a period and passes the elapsed time; a source answers at once with a [`Reading`] of raw
//! counts and codes in the block frame. It never waits, because the caller is an interrupt with a deadline.

use core::fmt;

use crate::chain::sample::Sample;
use crate::unit::slow_channels::BankService;

/// A source of one sample a period.
pub trait SampleSource {
    /// The sample of the period that just ended. Answers without waiting for the next period.
    ///
    /// `elapsed`: sampling periods since the previous call, by the caller's clock; 1 as a rule, more where it could not
    /// ask.
    fn take(&mut self, elapsed: u32) -> Reading;
}

/// A source's answer for one period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
#[must_use = "a sample that the chain does not get is lost"]
pub struct Reading {
    /// The sample, if there is one that the chain may use.
    pub sample: Option<Sample>,
    /// Sampling periods that the sample's counts cover: 1 as a rule, more after periods without a sample, 0 for the
    /// first sample of a source (its counts are zeros: there is nothing yet to difference with) and without a sample.
    pub periods: u32,
    /// The fault of this period, if any. Only [`SourceFault::Restarted`] comes with a sample.
    pub fault: Option<SourceFault>,
    /// A slow channel and the time of the latch, of a source that has them.
    pub service: BankService,
}

impl Reading {
    /// A reading of `sample`, if there is one, over `periods` sampling periods, without slow channel and time.
    pub const fn new(sample: Option<Sample>, periods: u32, fault: Option<SourceFault>) -> Self {
        Self {
            sample,
            periods,
            fault,
            service: BankService::NONE,
        }
    }

    /// This reading with a slow channel and the time of its latch.
    pub const fn with_service(self, service: BankService) -> Self {
        Self { service, ..self }
    }

    /// A reading without a sample, for the reason `fault`.
    pub const fn without_sample(fault: SourceFault) -> Self {
        Self {
            sample: None,
            periods: 0,
            fault: Some(fault),
            service: BankService::NONE,
        }
    }
}

/// Faults of a source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SourceFault {
    /// The bus reported an error.
    Bus,
    /// Every bit of the frame is the same: the data line is shorted, open, or not driven.
    StuckLine,
    /// The frame's check sum does not match its content.
    Checksum,
    /// The frame of the previous period came again.
    Repeated,
    /// The source has started anew, so that its counts since its last frame are unknown. The sample holds the
    /// readings from which it goes on.
    Restarted,
    /// The stream had no sample ready.
    Starved,
}

impl fmt::Display for SourceFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Bus => "the bus reported an error",
            Self::StuckLine => "every bit of the frame is the same: the data line is stuck",
            Self::Checksum => "the frame's check sum does not match",
            Self::Repeated => "the frame of the previous period came again",
            Self::Restarted => "the source has started anew",
            Self::Starved => "no sample was ready",
        })
    }
}

impl core::error::Error for SourceFault {}
