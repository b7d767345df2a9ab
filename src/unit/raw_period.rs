//! Holds one sampling period of the unit's raw stream: the chain's whole input. The crate's feature `wire`
//! encodes it as bytes ([`raw_frame`](crate::wire::raw_frame)).
//!
//! Counts are sent as running sums, so that a period which is lost on the way loses no angle and no velocity.

use crate::unit::processor::Timing;
use crate::unit::sample_source::{Reading, SourceFault};

/// Input of the chain in one sampling period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RawPeriod {
    /// Sampling periods since start, this one included, wrapping.
    pub number: u32,
    /// Pulses of the gyros x, y, z since start, wrapping.
    pub pulse_counters: [i32; 3],
    /// Pickoff codes x, y, z at the period's end; without a sample the last there were.
    pub pickoff_codes: [i32; 3],
    /// Sum of the accelerometers' codes x, y, z since start, wrapping.
    pub velocity_counters: [i32; 3],
    /// Sampling periods before this one that had no interrupt; 255 for that many or more.
    pub missed: u8,
    /// Sampling periods that this period's counts cover ([`Reading::periods`]); 255 for that many or more.
    pub covered: u8,
    /// Origin of the reading.
    pub source: RawSource,
}

/// Origin of a reading, as a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RawSource(u8);

impl RawSource {
    /// Bits of the fault, 0 for none.
    const FAULT: u8 = 0b0000_1111;
    const SAMPLE: u8 = 1 << 4;
    const LATE: u8 = 1 << 5;

    /// Of a reading and its interrupt.
    #[inline]
    pub fn new(reading: &Reading, timing: Timing) -> Self {
        let fault = match reading.fault {
            None => 0,
            Some(SourceFault::Bus) => 1,
            Some(SourceFault::StuckLine) => 2,
            Some(SourceFault::Checksum) => 3,
            Some(SourceFault::Repeated) => 4,
            Some(SourceFault::Restarted) => 5,
            Some(SourceFault::Starved) => 6,
        };
        let with = |bit: u8, set: bool| if set { bit } else { 0 };
        Self(fault | with(Self::SAMPLE, reading.sample.is_some()) | with(Self::LATE, timing.late))
    }

    /// Of a byte; every byte is one.
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// The byte.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// True if there was a sample that the chain may use.
    pub const fn has_sample(self) -> bool {
        self.0 & Self::SAMPLE != 0
    }

    /// True if the interrupt came later than allowed.
    pub const fn is_late(self) -> bool {
        self.0 & Self::LATE != 0
    }

    /// The fault, if any; a code of another version is given as [`SourceFault::Starved`].
    pub const fn fault(self) -> Option<SourceFault> {
        match self.0 & Self::FAULT {
            0 => None,
            1 => Some(SourceFault::Bus),
            2 => Some(SourceFault::StuckLine),
            3 => Some(SourceFault::Checksum),
            4 => Some(SourceFault::Repeated),
            5 => Some(SourceFault::Restarted),
            _ => Some(SourceFault::Starved),
        }
    }
}

/// Sums the periods' counts, and makes the record of each period.
#[derive(Debug, Clone, Default)]
pub struct RawCounters {
    pulses: [i32; 3],
    pickoff_codes: [i32; 3],
    velocities: [i32; 3],
}

impl RawCounters {
    /// Nothing counted yet.
    pub const NONE: Self = Self {
        pulses: [0; 3],
        pickoff_codes: [0; 3],
        velocities: [0; 3],
    };

    /// Counts one period in. Cannot panic, and branches only on the presence of a sample.
    ///
    /// # Inputs
    /// `number`: sampling periods since start, this one included
    /// ([`Processor::periods`](crate::unit::processor::Processor::periods) after it). `reading`, `timing`: the
    /// processor's input.
    #[inline]
    pub fn period(&mut self, number: u32, reading: &Reading, timing: Timing) -> RawPeriod {
        if let Some(sample) = &reading.sample {
            add(&mut self.pulses, &sample.pulse_counts);
            add(&mut self.velocities, &sample.accelerometer_codes);
            self.pickoff_codes = sample.pickoff_codes;
        }
        let held = |count: u32| count.min(255) as u8;
        RawPeriod {
            number,
            pulse_counters: self.pulses,
            pickoff_codes: self.pickoff_codes,
            velocity_counters: self.velocities,
            missed: held(timing.missed),
            covered: held(reading.periods),
            source: RawSource::new(reading, timing),
        }
    }
}

#[inline]
fn add(sums: &mut [i32; 3], counts: &[i32; 3]) {
    for (sum, count) in sums.iter_mut().zip(counts) {
        *sum = sum.wrapping_add(*count);
    }
}
