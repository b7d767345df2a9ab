//! Relates sampling periods to a pulse per second.
//!
//! The bank stamps each latch with the time since the last pulse \[1/16 µs of its own clock\]. [`PulseClock`] counts
//! pulses, measures how long a second is by the bank's clock, and gives each frame the time of its first sample
//! ([`FrameTime`]). The stamps are the bank's, so neither the interrupt's latency nor this processor's clock enters.
//!
//! Time of a sample is the latch at the end of its sampling period. A crystal is some 50 ppm off, 50 µs at a second's
//! end: [`FrameTime::nanoseconds`] divides by the measured second, so that the clock's change from one second to the
//! next and the stamp's 1/16 µs remain.

use crate::chain::parameters::Parameters;
use crate::unit::slow_channels::BankService;

/// A second by a perfect clock \[1/16 µs\].
pub const NOMINAL_SECOND: u32 = 16_000_000;

/// Largest deviation of a measured second \[1/16 µs\]: 500 ppm, beyond any crystal. A pulse beyond it is not one.
pub const SECOND_TOLERANCE: u32 = 8_000;

/// Time of a frame's first sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameTime {
    /// Pulses seen before it; 0 for no time.
    pub pulses: u32,
    /// Time since the last of them \[1/16 µs of the bank's clock\].
    pub since_pulse: u32,
    /// The last measured second by that clock \[1/16 µs\].
    pub second: u32,
}

impl FrameTime {
    /// No time is known.
    pub const NONE: Self = Self {
        pulses: 0,
        since_pulse: 0,
        second: NOMINAL_SECOND,
    };

    /// Time since the last pulse \[ns\], by the measured second; `None` where no time is known. Above 10⁹ where a pulse
    /// is missing.
    pub fn nanoseconds(&self) -> Option<u32> {
        if self.pulses == 0 {
            return None;
        }
        let ns = u64::from(self.since_pulse) * 1_000_000_000;
        ns.checked_div(u64::from(self.second))
            .map(|ns| u32::try_from(ns).unwrap_or(u32::MAX))
    }
}

/// Counts pulses and keeps the present output period's first stamp.
#[derive(Debug, Clone)]
pub struct PulseClock {
    last: u32,
    /// Stamps from one period to the next \[1/16 µs\].
    step: u32,
    second: u32,
    pulses: u32,
    /// True while the last second measured was within its tolerance, or none is measured.
    regular: bool,
    first: FrameTime,
    awaits_first: bool,
    /// Time since a pulse above which the next one is late; `u32::MAX` if that is not watched.
    late_after: u32,
}

impl PulseClock {
    pub(crate) fn new(parameters: &Parameters) -> Self {
        let limits = parameters.limits.unwrap_or_default();
        Self {
            last: BankService::NO_PULSE,
            step: (f64::from(NOMINAL_SECOND) / parameters.sample_rate_hz) as u32,
            second: NOMINAL_SECOND,
            pulses: 0,
            regular: true,
            first: FrameTime::NONE,
            awaits_first: true,
            late_after: limits
                .pulse_silence_s
                .map_or(u32::MAX, |s| (s * f64::from(NOMINAL_SECOND)) as u32),
        }
    }

    /// Takes the stamp of a sample that covers `periods`, `before` sampling periods after the output period's first.
    #[inline(always)]
    pub(crate) fn take(&mut self, since_pulse: u32, periods: u32, before: u32) {
        let step = since_pulse.wrapping_sub(self.last);
        if periods == 1 && since_pulse > self.last && since_pulse < BankService::NO_PULSE {
            self.step = step;
        } else if since_pulse != self.last {
            core::hint::cold_path();
            self.follow(since_pulse, periods);
        }
        self.last = since_pulse;
        if self.awaits_first {
            self.awaits_first = false;
            self.first = self.time_of(since_pulse, before);
        }
    }

    /// The time `before` sampling periods ahead of a stamp.
    #[inline(always)]
    fn time_of(&self, since_pulse: u32, before: u32) -> FrameTime {
        if self.pulses == 0 {
            return FrameTime::NONE;
        }
        let ahead = before.saturating_mul(self.step);
        let (pulses, since_pulse) = match since_pulse.checked_sub(ahead) {
            Some(since) => (self.pulses, since),
            // In the second before.
            None => (
                self.pulses.wrapping_sub(1),
                since_pulse
                    .saturating_add(self.second)
                    .saturating_sub(ahead),
            ),
        };
        FrameTime {
            pulses,
            since_pulse,
            second: self.second,
        }
    }

    /// Follows a stamp that is not one period after the last: over a pulse, over lost periods, or of a lost pulse.
    #[inline(never)]
    fn follow(&mut self, since_pulse: u32, periods: u32) {
        if since_pulse >= BankService::NO_PULSE {
            return;
        }
        // The count begins anew: how many pulses came meanwhile is not known.
        if self.last >= BankService::NO_PULSE || periods == 0 {
            self.pulses = 1;
            self.regular = true;
            return;
        }
        let elapsed = self.last.saturating_add(self.step.saturating_mul(periods));
        let since_old = elapsed.saturating_add(self.second / 2);
        let pulses = since_old
            .saturating_sub(since_pulse)
            .checked_div(self.second);
        let pulses = pulses.unwrap_or(0);
        self.pulses = self.pulses.wrapping_add(pulses).max(1);
        if periods == 1 {
            let second = elapsed.saturating_sub(since_pulse);
            self.regular = second.abs_diff(NOMINAL_SECOND) <= SECOND_TOLERANCE;
            if self.regular {
                self.second = second;
            }
        }
    }

    /// Gives the frame's time, and awaits the next frame's first stamp.
    #[inline]
    pub(crate) fn conclude(&mut self) -> FrameTime {
        if core::mem::replace(&mut self.awaits_first, true) {
            FrameTime::NONE
        } else {
            self.first
        }
    }

    /// True if a pulse is late or did not come a second after the one before, where that is watched.
    #[inline]
    pub(crate) fn has_lost(&self) -> bool {
        self.late_after != u32::MAX && (self.last > self.late_after || !self.regular)
    }

    /// Pulses seen so far; begins anew at 1 after a time without them.
    pub fn pulses(&self) -> u32 {
        self.pulses
    }

    /// The last measured second by the bank's clock \[1/16 µs\].
    pub fn second(&self) -> u32 {
        self.second
    }
}
