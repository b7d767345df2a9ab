//! Holds the faults: status bits per frame, counters since start, the first fault latched.
//!
//! A stage that holds a value at the end of its range raises its bit for that sample. The counters never
//! wrap, and the first fault keeps its sample number until the state is made anew, because after a failure
//! the first one is the cause and the rest are its consequences.
//!
//! Bits 0 to 13 are the chain's own; bits 14 to 31 concern its input and output and are raised by the processor around
//! the chain. Bits for information, not faults, are marked.

use core::fmt;

/// Status bits of one output period.
#[derive(Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "a status may hold a fault"]
pub struct Status(u32);

impl fmt::Debug for Status {
    /// The names of the bits that are set.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Status(")?;
        let mut separator = "";
        for bit in (0..32).filter(|bit| self.0 >> bit & 1 != 0) {
            match Self::name(bit) {
                Some(name) => write!(f, "{separator}{name}")?,
                None => write!(f, "{separator}bit {bit}")?,
            }
            separator = ", ";
        }
        f.write_str(")")
    }
}

impl Status {
    /// Pulse counts beyond [`SENSED_LIMIT_RAD`](crate::chain::design_parameters::SENSED_LIMIT_RAD).
    pub const COUNTS_SATURATED: Self = Self(1 << 0);
    /// Pickoff step beyond [`DITHER_LIMIT_RAD`](crate::chain::design_parameters::DITHER_LIMIT_RAD).
    pub const PICKOFF_SATURATED: Self = Self(1 << 1);
    /// Acceleration beyond [`ACCELERATION_LIMIT_RAD`](crate::chain::design_parameters::ACCELERATION_LIMIT_RAD).
    pub const ACCELERATION_SATURATED: Self = Self(1 << 2);
    /// The output is beyond ±(2³¹ − 1) codes, 0.0625 rad or 16 m/s: the frame leaves part of it to later ones.
    pub const OUTPUT_SATURATED: Self = Self(1 << 3);
    /// Information: the period holds the stream's first sample, which contributes no rotation: it has no
    /// previous pickoff reading to strip the dither with.
    pub const PRIMED: Self = Self(1 << 4);
    /// A pickoff stands still while its gyro counts the dither.
    pub const PICKOFF_FAILED: Self = Self(1 << 5);
    /// A block with a nominal dither amplitude does not move.
    pub const DITHER_STOPPED: Self = Self(1 << 6);
    /// A block dithers with less than half or more than one and a half of its nominal amplitude.
    pub const DITHER_OUT_OF_BAND: Self = Self(1 << 7);
    /// A block dithers and its gyro's counts do not change.
    pub const COUNTER_STUCK: Self = Self(1 << 8);
    /// Accelerometer codes beyond the chain's range.
    pub const VELOCITY_SATURATED: Self = Self(1 << 9);
    /// Information: the installation matrix is held at rest, without the flexure term.
    pub const DYNAMIC_TERM_OFF: Self = Self(1 << 10);
    /// Information: the dither strip is tracking gain and delay.
    pub const ADAPTING: Self = Self(1 << 11);
    /// The sample of at least one of the period's sampling periods did not come.
    pub const GAP: Self = Self(1 << 12);
    /// Information: the frame shows rotation or velocity of earlier periods, which their frames could not hold.
    pub const CARRIED_OVER: Self = Self(1 << 13);
    /// Of the processor: a dither drive is beyond its limits.
    pub const DITHER_DRIVE: Self = Self(1 << 14);
    /// Of the processor: the parameters in flash are those of another unit; the values are the nominal ones.
    pub const PARAMETERS_FOREIGN: Self = Self(1 << 15);
    /// Of the processor: the sampling interrupt did not come in time for at least one period.
    pub const INTERRUPT_MISSED: Self = Self(1 << 16);
    /// Of the processor: the sampling interrupt was entered late.
    pub const INTERRUPT_LATE: Self = Self(1 << 17);
    /// Of the processor: the previous period's sample came again.
    pub const SAMPLE_REPEATED: Self = Self(1 << 18);
    /// Of the processor: a sample was not ready.
    pub const SAMPLE_LOST: Self = Self(1 << 19);
    /// Of the processor: a frame of the counter bank failed its check.
    pub const FRAME_CHECKSUM: Self = Self(1 << 20);
    /// Of the processor: the bus to the counter bank reported an error.
    pub const BUS_FAULT: Self = Self(1 << 21);
    /// Of the processor: an output frame found no room.
    pub const OUTPUT_OVERRUN: Self = Self(1 << 22);
    /// Of the processor: the board runs on its internal oscillator.
    pub const CLOCK_FALLBACK: Self = Self(1 << 23);
    /// Of the processor: no parameter slot was usable; the values are the nominal ones.
    pub const PARAMETERS_DEFAULT: Self = Self(1 << 24);
    /// Of the processor: one parameter slot was bad and the other one is used.
    pub const PARAMETER_SLOT_BAD: Self = Self(1 << 25);
    /// Of the processor: the counter bank's sequence number does not fit the time that passed, so it has started anew;
    /// the rotation since its last frame is unknown and left out.
    pub const BANK_RESTARTED: Self = Self(1 << 26);
    /// Of the processor: a laser's intensity is below its limit.
    pub const INTENSITY_LOW: Self = Self(1 << 27);
    /// Of the processor: a laser jumped to another mode, or its path-length control was reset.
    pub const MODE_HOP: Self = Self(1 << 28);
    /// Of the processor: a block's temperature is beyond its limits.
    pub const TEMPERATURE_RANGE: Self = Self(1 << 29);
    /// Of the processor: a temperature that a limit or a term needs does not come.
    pub const TEMPERATURE_ABSENT: Self = Self(1 << 30);
    /// Of the processor: a pulse per second is late, or did not come a second after the one before.
    pub const PULSE_LOST: Self = Self(1 << 31);
    /// Every bit of the chain that is a fault.
    const FAULTS: u32 = 0b1_0011_1110_1111;
    /// Every bit that is a fault in service: the chain's and the processor's, those of the boot apart.
    pub const IN_SERVICE_FAULTS: Self = Self(Self::FAULTS | 1 << 14 | 0xFC7F << 16);

    /// Name of bit `bit` in reports; `None` for a bit without a meaning.
    pub const fn name(bit: u8) -> Option<&'static str> {
        Some(match bit {
            0 => "counts saturated",
            1 => "pickoff saturated",
            2 => "acceleration saturated",
            3 => "output saturated",
            4 => "primed",
            5 => "pickoff failed",
            6 => "dither stopped",
            7 => "dither out of band",
            8 => "counter stuck",
            9 => "velocity saturated",
            10 => "dynamic term off",
            11 => "adapting",
            12 => "gap",
            13 => "carried over",
            14 => "dither drive out of range",
            15 => "parameters of another unit",
            16 => "interrupt missed",
            17 => "interrupt late",
            18 => "sample repeated",
            19 => "sample lost",
            20 => "frame check sum",
            21 => "bus fault",
            22 => "output overrun",
            23 => "clock fallback",
            24 => "nominal parameters",
            25 => "parameter slot bad",
            26 => "bank restarted",
            27 => "intensity low",
            28 => "mode hop",
            29 => "temperature out of range",
            30 => "temperature absent",
            31 => "pulse per second lost",
            _ => return None,
        })
    }

    /// The status as a word of bits.
    #[inline(always)]
    pub const fn bits(self) -> u32 {
        self.0
    }

    /// The status of a word of bits; unknown bits are kept.
    #[inline(always)]
    pub const fn from_bits(bits: u32) -> Self {
        Self(bits)
    }

    /// True if every bit of `other` is set.
    #[inline(always)]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The bits that are set in either.
    #[inline(always)]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// This status if `raised`, else no bit.
    #[inline(always)]
    pub const fn when(self, raised: bool) -> Self {
        // Negating 0 or 1 gives a mask: no branch.
        Self(self.0 & (raised as u32).wrapping_neg())
    }
}

/// The first fault since start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "the first fault is the cause of the others"]
pub struct FirstFault {
    /// The stages that raised a fault in the first output period that had one; empty before its end.
    pub stages: Status,
    /// Number of the first faulty sample since start, wrapping; 0 while there was none. A fault found by a frame or an
    /// adaptation window has the number of its last sample.
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
    /// Periods whose rotation or velocity was beyond the frame's range.
    pub output: u32,
    /// Periods with a failed pickoff.
    pub pickoff_failed: u32,
    /// Periods with a block that stands still.
    pub dither_stopped: u32,
    /// Periods with a block out of its band.
    pub dither_out_of_band: u32,
    /// Periods with a stuck counter.
    pub counter_stuck: u32,
    /// Periods with accelerometer codes beyond their range.
    pub velocity: u32,
    /// Periods that lack at least one sample.
    pub gap: u32,
    /// The first fault since start.
    pub first: FirstFault,
}

impl Faults {
    /// No fault yet.
    pub const NONE: Self = Self {
        counts: 0,
        pickoff: 0,
        acceleration: 0,
        output: 0,
        pickoff_failed: 0,
        dither_stopped: 0,
        dither_out_of_band: 0,
        counter_stuck: 0,
        velocity: 0,
        gap: 0,
        first: FirstFault {
            stages: Status(0),
            sample: 0,
        },
    };

    /// Latches the sample of the first fault: `before` holds the bits of the output period so far.
    pub(crate) fn watch(&mut self, before: Status, raised: Status, sample: u32) {
        let clean = (self.first.stages.0 | before.0) & Status::FAULTS == 0;
        if clean && raised.0 & Status::FAULTS != 0 {
            self.first.sample = sample;
        }
    }

    /// Adds one output period's bits.
    #[inline(always)]
    pub(crate) fn record(&mut self, period: Status) {
        if period.0 & Status::FAULTS == 0 {
            return;
        }
        core::hint::cold_path();
        for (counter, mask) in [
            (&mut self.counts, Status::COUNTS_SATURATED),
            (&mut self.pickoff, Status::PICKOFF_SATURATED),
            (&mut self.acceleration, Status::ACCELERATION_SATURATED),
            (&mut self.output, Status::OUTPUT_SATURATED),
            (&mut self.pickoff_failed, Status::PICKOFF_FAILED),
            (&mut self.dither_stopped, Status::DITHER_STOPPED),
            (&mut self.dither_out_of_band, Status::DITHER_OUT_OF_BAND),
            (&mut self.counter_stuck, Status::COUNTER_STUCK),
            (&mut self.velocity, Status::VELOCITY_SATURATED),
            (&mut self.gap, Status::GAP),
        ] {
            *counter = counter.saturating_add(u32::from(period.0 & mask.0 != 0));
        }
        if self.first.stages == Status::default() {
            self.first.stages.0 = period.0 & Status::FAULTS;
        }
    }
}
