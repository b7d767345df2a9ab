//! Counts the unit's faults, latches the first one, and reports one health item with each frame.
//!
//! Events come from the processor and from the chain's own [`Faults`]. Counters count events since start and saturate;
//! the first fault has its sampling period. Each telemetry frame carries one [`HealthItem`]: the items take turns, so a
//! listener knows all of them after [`HEALTH_ITEMS`]`.len()` frames.
//!
//! | index | value, u32 |
//! |---|---|
//! | 0 to 3, 5 to 9, 12 | the chain's counter of the [`Status`] bit of this number \[output periods that had it\] |
//! | 14, 27 to 31 | the processor's counter of the status bit of this number \[output periods that had it\] |
//! | 16 to 22, 26 | the processor's counter of the status bit of this number: 16 periods whose interrupt never came, 17 late interrupts, 18 repeated frames, 19 samples that were not ready, 20 check sums, 21 bus errors and stuck lines, 22 frames without room, 26 restarts of the bank |
//! | 32 | first fault: its status bits; 0 without one |
//! | 33 | first fault: its sampling period since start |
//! | 34 | version: major, minor, patch, and 0 for f32 or 1 for fixed point, a byte each, major highest |
//! | 35 | sample rate \[Hz\], bits of an f32 |
//! | 36 | samples in an output period |
//! | 37 | generation of the parameter block; 0 with the nominal values |
//! | 38 | configuration: bit 0 accelerometers, bit 1 the dither strip adapts, bit n + 1 the build has a term for [`TermKind`](crate::terms::TermKind) n |
//! | 39 | sampling periods since start, wraps |
//! | 41 | of item 21, frames with every bit the same |
//! | 42 | cause of the last reset, bits of [`reset_cause`]; 0 if unknown, as in the emulator |
//! | 43 | failure of the previous run: 0 none, 1 panic, 2 hard fault, 3 clock lost |
//! | 44 | its place: the source line of a panic, the instruction's address of a hard fault, else 0 |
//! | 45 | pulses per second since they began to come |
//! | 46 | the last second by the bank's clock \[1/16 µs\] |
//! | 47 | the last four bytes of the number of the unit that the parameters are of, zeros at its end left out, highest first; 0 if they name none |
//! | 48 | date of the calibration, year × 10 000 + month × 100 + day; 0 if unknown |
//! | 49 | first four bytes of the model's SHA-256, highest first; 0 if unknown |
//! | 50 | first 28 bits of the firmware's git revision, and bit 0 for a tree with changes; 0 if unknown |
//! | 51 to 65 | the bank's slow channel 0 to 14, its code as an i32, table in [`slow_channels`](crate::unit::slow_channels); −32768 if not measured |
//! | 66 | the firmware image that runs and the reason for it at boot, bits in `store/image_state.rs`; 0 without a boot selector |
//! | 67 | results of the built-in test, bits in [`self_test`](crate::unit::self_test); 0 from the processor: who sends the frame puts them in |
//!
//! Counters of conditions (5 to 8, 12, 14, 27 to 31) grow with each output period that the condition lasts; counters of
//! events count events. Boot faults (status bits 15 and 23 to 25) stay in every frame's status instead of a
//! counter, and do not take the place of the first fault in service. Index 40 is not used again: earlier versions had
//! another counter there.
//!
//! The handling of each fault is tabulated in [`processor`](crate::unit::processor).

use crate::chain::faults::{Faults, FirstFault, Status};

/// One item of the table above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct HealthItem {
    /// Index of the item in the table above.
    pub index: u8,
    /// Its value.
    pub value: u32,
}

/// Indices that are not a status bit's.
pub mod item {
    use crate::chain::terms::records::TermKinds;

    /// First fault: status bits.
    pub const FIRST_FAULT_STATUS: u8 = 32;
    /// First fault: sampling period.
    pub const FIRST_FAULT_PERIOD: u8 = 33;
    /// Version and number system.
    pub const VERSION: u8 = 34;
    /// Sample rate \[Hz\], bits of an f32.
    pub const SAMPLE_RATE: u8 = 35;
    /// Samples in an output period.
    pub const SAMPLES_PER_OUTPUT: u8 = 36;
    /// Generation of the parameter block.
    pub const GENERATION: u8 = 37;
    /// Configuration bits.
    pub const CONFIGURATION: u8 = 38;
    /// Sampling periods since start.
    pub const PERIODS: u8 = 39;
    /// Frames with every bit the same.
    pub const STUCK_LINES: u8 = 41;
    /// Cause of the last reset.
    pub const RESET_CAUSE: u8 = 42;
    /// Failure of the previous run.
    pub const LAST_FAILURE_KIND: u8 = 43;
    /// Place of that failure.
    pub const LAST_FAILURE_PLACE: u8 = 44;
    /// Pulses per second.
    pub const PULSES: u8 = 45;
    /// The last second by the bank's clock.
    pub const SECOND: u8 = 46;
    /// Unit of the parameters.
    pub const UNIT: u8 = 47;
    /// Date of the calibration.
    pub const CALIBRATED: u8 = 48;
    /// Hash of the model.
    pub const MODEL: u8 = 49;
    /// Revision of the firmware.
    pub const REVISION: u8 = 50;
    /// First slow channel of the bank.
    pub const SLOW_CHANNEL: u8 = 51;

    /// Running firmware image.
    pub const IMAGE: u8 = 66;
    /// Results of the built-in test.
    pub const SELF_TEST: u8 = 67;

    /// Bit of [`CONFIGURATION`]: there are accelerometers.
    pub const WITH_ACCELEROMETERS: u32 = 1 << 0;
    /// Bit of [`CONFIGURATION`]: the dither strip adapts.
    pub const ADAPTIVE: u32 = 1 << 1;

    /// Bits of [`CONFIGURATION`]: the kinds of terms that the build has.
    pub const fn terms(kinds: TermKinds) -> u32 {
        kinds.bits() << 1
    }
}

/// Bits of [`item::RESET_CAUSE`], in the order of RCC_CSR (RM0090 7.3.21). The firmware clears them at each
/// boot, so they are of the last reset. Several may stand together: every reset from inside pulls the pin,
/// and power-on sets the brown-out's bit.
pub mod reset_cause {
    /// The supply was below the brown-out level.
    pub const BROWN_OUT: u32 = 1 << 0;
    /// The reset pin.
    pub const PIN: u32 = 1 << 1;
    /// Power came on, or was lost for a moment.
    pub const POWER_ON: u32 = 1 << 2;
    /// Software: the end of a run that failed (items 43 and 44), or a probe.
    pub const SOFTWARE: u32 = 1 << 3;
    /// The independent watchdog: samples stopped or the main loop hung.
    pub const INDEPENDENT_WATCHDOG: u32 = 1 << 4;
    /// The window watchdog, unused here.
    pub const WINDOW_WATCHDOG: u32 = 1 << 5;
    /// Low power: a forbidden stop or standby mode.
    pub const LOW_POWER: u32 = 1 << 6;
}

/// The items in the order of their turns: at 400 frames a second each comes round every 148 ms.
/// The first of a run say how the one before ended.
pub const HEALTH_ITEMS: [u8; 59] = [
    item::RESET_CAUSE,
    item::LAST_FAILURE_KIND,
    item::LAST_FAILURE_PLACE,
    item::SELF_TEST,
    item::SAMPLE_RATE,
    item::SAMPLES_PER_OUTPUT,
    item::CONFIGURATION,
    item::VERSION,
    item::GENERATION,
    item::FIRST_FAULT_STATUS,
    item::FIRST_FAULT_PERIOD,
    item::PERIODS,
    0,
    1,
    2,
    3,
    5,
    6,
    7,
    8,
    9,
    12,
    16,
    17,
    18,
    19,
    20,
    21,
    22,
    26,
    item::STUCK_LINES,
    14,
    27,
    28,
    29,
    30,
    31,
    item::PULSES,
    item::SECOND,
    item::UNIT,
    item::CALIBRATED,
    item::MODEL,
    item::REVISION,
    51,
    52,
    53,
    54,
    55,
    56,
    57,
    58,
    59,
    60,
    61,
    62,
    63,
    64,
    65,
    item::IMAGE,
];

/// Faults around the chain since start. Every counter stops at its end instead of wrapping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
#[must_use = "a counter may hold a fault"]
pub struct Health {
    /// Sampling periods whose interrupt never came.
    pub interrupts_missed: u32,
    /// Interrupts that came or ended late.
    pub interrupts_late: u32,
    /// Frames that came again.
    pub samples_repeated: u32,
    /// Periods in which the source had no sample ready.
    pub samples_starved: u32,
    /// Frames whose check sum was wrong.
    pub frame_checksums: u32,
    /// Bus errors, stuck lines included.
    pub bus_faults: u32,
    /// Frames with every bit the same.
    pub stuck_lines: u32,
    /// Output frames that found no room.
    pub output_overruns: u32,
    /// Times that the bank started anew.
    pub bank_restarts: u32,
    /// Output periods with a dither drive beyond its limits.
    pub dither_drive: u32,
    /// Output periods with a laser too dim.
    pub intensity_low: u32,
    /// Output periods with a jump of a laser's mode.
    pub mode_hops: u32,
    /// Output periods with a temperature beyond its limits.
    pub temperature_range: u32,
    /// Output periods without a temperature that is needed.
    pub temperature_absent: u32,
    /// Output periods with a pulse per second lost.
    pub pulse_lost: u32,
    /// The first fault in service, the chain's or the processor's.
    pub first: FirstFault,
}

impl Health {
    /// All counters at 0 and no fault.
    pub const NONE: Self = Self {
        interrupts_missed: 0,
        interrupts_late: 0,
        samples_repeated: 0,
        samples_starved: 0,
        frame_checksums: 0,
        bus_faults: 0,
        stuck_lines: 0,
        output_overruns: 0,
        bank_restarts: 0,
        dither_drive: 0,
        intensity_low: 0,
        mode_hops: 0,
        temperature_range: 0,
        temperature_absent: 0,
        pulse_lost: 0,
        first: FirstFault {
            stages: Status::from_bits(0),
            sample: 0,
        },
    };

    /// Counts one output period's findings of the service channels.
    pub(crate) fn count_service(&mut self, found: Status) {
        for (counter, bit) in [
            (&mut self.dither_drive, Status::DITHER_DRIVE),
            (&mut self.intensity_low, Status::INTENSITY_LOW),
            (&mut self.mode_hops, Status::MODE_HOP),
            (&mut self.temperature_range, Status::TEMPERATURE_RANGE),
            (&mut self.temperature_absent, Status::TEMPERATURE_ABSENT),
            (&mut self.pulse_lost, Status::PULSE_LOST),
        ] {
            *counter = counter.saturating_add(u32::from(found.contains(bit)));
        }
    }

    /// The counter of status bit `bit`, the chain's from `chain`; 0 for bits without one.
    pub fn counter(&self, chain: &Faults, bit: u8) -> u32 {
        match bit {
            0 => chain.counts,
            1 => chain.pickoff,
            2 => chain.acceleration,
            3 => chain.output,
            5 => chain.pickoff_failed,
            6 => chain.dither_stopped,
            7 => chain.dither_out_of_band,
            8 => chain.counter_stuck,
            9 => chain.velocity,
            12 => chain.gap,
            16 => self.interrupts_missed,
            17 => self.interrupts_late,
            18 => self.samples_repeated,
            19 => self.samples_starved,
            20 => self.frame_checksums,
            21 => self.bus_faults,
            22 => self.output_overruns,
            26 => self.bank_restarts,
            14 => self.dither_drive,
            27 => self.intensity_low,
            28 => self.mode_hops,
            29 => self.temperature_range,
            30 => self.temperature_absent,
            31 => self.pulse_lost,
            _ => 0,
        }
    }
}
