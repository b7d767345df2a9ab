//! What went beyond its range: bits per frame, counters since start, the first one latched.
//!
//! A stage that holds a value at the end of its range raises its bit for that sample. The counters never
//! wrap, and the first fault keeps its sample number until the state is made anew, because after a failure
//! the first one is the cause and the rest are its consequences.

/// Bits of one output period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status(u16);

impl Status {
    /// Pulse counts beyond [`SENSED_LIMIT_RAD`](crate::design_parameters::SENSED_LIMIT_RAD).
    pub const COUNTS_SATURATED: Self = Self(1 << 0);
    /// Pickoff step beyond [`DITHER_LIMIT_RAD`](crate::design_parameters::DITHER_LIMIT_RAD).
    pub const PICKOFF_SATURATED: Self = Self(1 << 1);
    /// Acceleration beyond [`ACCELERATION_LIMIT_RAD`](crate::design_parameters::ACCELERATION_LIMIT_RAD).
    pub const ACCELERATION_SATURATED: Self = Self(1 << 2);
    /// An output beyond ±(2³¹ − 1) codes, 0.0625 rad.
    pub const OUTPUT_SATURATED: Self = Self(1 << 3);
    /// The period holds the stream's first sample, which contributes no rotation: it has no previous
    /// pickoff reading to strip the dither with.
    pub const PRIMED: Self = Self(1 << 4);
    /// Every bit that is a fault.
    const FAULTS: u16 = 0b1111;

    /// As bits.
    #[inline(always)]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// From bits; unknown ones are kept.
    #[inline(always)]
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits)
    }

    /// Whether every bit of `other` is set.
    #[inline(always)]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Both.
    #[inline(always)]
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// This bit if `raised`.
    #[inline(always)]
    #[must_use]
    pub(crate) const fn when(self, raised: bool) -> Self {
        // Negating 0 or 1 gives a mask: no branch.
        Self(self.0 & (raised as u16).wrapping_neg())
    }
}

/// The first fault since start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FirstFault {
    /// The stages that raised a fault in the first output period that had one; empty before its end.
    pub stages: Status,
    /// Number of the first faulty sample since start, wrapping; of the present one while there was none.
    pub sample: u32,
}

/// Faults since start, per stage \[output periods that had at least one\].
///
/// Periods and not samples, because they are counted where a frame is made: a sample pays only for
/// its bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Faults {
    /// Periods with pulse counts beyond their range.
    pub counts: u32,
    /// Periods with a pickoff step beyond its range.
    pub pickoff: u32,
    /// Periods with an angular acceleration beyond its range.
    pub acceleration: u32,
    /// Periods whose rotation was beyond the frame's range.
    pub output: u32,
    /// The first of all.
    pub first: FirstFault,
}

impl Faults {
    /// Counts samples up to the first fault; `period` holds the bits of the present period so far.
    #[inline(always)]
    pub(crate) fn watch(&mut self, period: Status) {
        let clean = (self.first.stages.0 | period.0) & Status::FAULTS == 0;
        self.first.sample = self.first.sample.wrapping_add(u32::from(clean));
    }

    /// Adds one output period's bits.
    #[inline(always)]
    pub(crate) fn record(&mut self, period: Status) {
        let bit = |mask: Status| u32::from(period.0 & mask.0 != 0);
        self.counts = self.counts.saturating_add(bit(Status::COUNTS_SATURATED));
        self.pickoff = self.pickoff.saturating_add(bit(Status::PICKOFF_SATURATED));
        self.acceleration = self
            .acceleration
            .saturating_add(bit(Status::ACCELERATION_SATURATED));
        self.output = self.output.saturating_add(bit(Status::OUTPUT_SATURATED));
        if self.first.stages == Status::default() {
            self.first.stages.0 = period.0 & Status::FAULTS;
            // A frame's own fault shows only after its last sample was taken for clean.
            if period.0 & Status::FAULTS == Status::OUTPUT_SATURATED.0 {
                self.first.sample = self.first.sample.wrapping_sub(1);
            }
        }
    }
}
