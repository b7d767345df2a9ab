//! Draws a fault campaign: each fault at random moments, and its expected counts.
//!
//! From a seed and the number of each kind of fault it draws a [`Campaign`]: the input of each interrupt of the faulty
//! unit ([`Interrupt`]), the samples of the same unit without faults, and the list of [`Injection`]s with the counters
//! that each must raise. The order is drawn, and within each injection's stretch of time the moment, the axis and the
//! size.
//!
//! | fault | effect on the unit |
//! |---|---|
//! | late | the interrupt comes late |
//! | missed | 1 to 3 interrupts do not come |
//! | repeated | the bank's frame of the previous period comes again |
//! | starved | the source has nothing ready (host only: a bus always has an answer) |
//! | bank restarted | the bus reports an error for 0 to 40 periods, then the bank goes on with number and counters from 0 |
//! | check sum | a bit of the frame is flipped |
//! | bus error | the bus reports an error |
//! | stuck line | every bit of the frame is the same |
//! | count beyond rate | the pulse counter jumps by 5 000 to 1 000 000 |
//! | counter stuck | a pulse counter stands still |
//! | dither stopped | a block comes to rest |
//! | dither out of band | a block has a quarter of its amplitude, or 1¾ times it |
//! | pickoff failed | a pickoff stands still |
//! | output overrun | no frame is taken for longer than the queue holds them |
//!
//! Faults at boot (parameter slots, clock) are no part of a stream; the tests boot for each.

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::Sample;
use trueaxis::counter_bank::{AccelerometerInput, BankFrame, FRAME_BYTES};
use trueaxis::health::item;
use trueaxis::processor::Timing;

use crate::unit::{SAMPLES_PER_OUTPUT, Unit};

/// Frames that wait for the serial port (the image's queue).
pub const QUEUED_FRAMES: usize = 15;

/// Periods at the end of an injection's interval in which no fault may be reported any more.
pub const WELL_PERIODS: u32 = 100;

/// A stretch for a fault of one moment, or of a queue that fills \[periods\]: 0.125 s.
const MOMENT_PERIODS: u32 = 500;

/// A stretch for a fault that lasts, until its traces are gone \[periods\]: 1.5 s, three adaptation times, in
/// which a strip that the fault's first window misled comes back.
pub const UNTIL_WELL_PERIODS: u32 = 6000;

/// The same, until the fault itself is over \[periods\]: onset, longest fault, two windows and an output period
/// are 1 200; enough where only bits are compared.
pub const UNTIL_OVER_PERIODS: u32 = 1400;

/// Duration of a lasting fault \[periods\]: at least three adaptation windows of 30 ms, so that one lies
/// wholly within it.
const LASTING: std::ops::Range<u32> = 400..800;

/// A block comes to rest and starts in this many periods, 10 ms: some cycles of a dither.
const RAMP_PERIODS: u32 = 40;

/// Time before the first injection \[periods\]: 2 s, in which the strip finds its gain.
const SETTLING_PERIODS: u32 = 8000;

/// Faults in service.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Fault {
    /// The interrupt comes late.
    Late,
    /// Interrupts do not come.
    Missed,
    /// A frame comes again.
    Repeated,
    /// The source is not ready.
    Starved,
    /// The bank starts anew.
    BankRestarted,
    /// A frame is damaged.
    Checksum,
    /// The bus fails.
    BusError,
    /// The data line is dead.
    StuckLine,
    /// A counter jumps.
    CountBeyondRate,
    /// A counter stands still.
    CounterStuck,
    /// A block stands still.
    DitherStopped,
    /// A block's amplitude is wrong.
    DitherOutOfBand,
    /// A pickoff stands still.
    PickoffFailed,
    /// Frames find no room.
    OutputOverrun,
}

impl Fault {
    /// All of them.
    pub const ALL: [Self; 14] = [
        Self::Late,
        Self::Missed,
        Self::Repeated,
        Self::Starved,
        Self::BankRestarted,
        Self::Checksum,
        Self::BusError,
        Self::StuckLine,
        Self::CountBeyondRate,
        Self::CounterStuck,
        Self::DitherStopped,
        Self::DitherOutOfBand,
        Self::PickoffFailed,
        Self::OutputOverrun,
    ];

    /// The fault's name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Late => "interrupt late",
            Self::Missed => "interrupt missed",
            Self::Repeated => "frame repeated",
            Self::Starved => "source starved",
            Self::BankRestarted => "bank restarted",
            Self::Checksum => "check sum",
            Self::BusError => "bus error",
            Self::StuckLine => "line stuck",
            Self::CountBeyondRate => "count beyond rate",
            Self::CounterStuck => "counter stuck",
            Self::DitherStopped => "dither stopped",
            Self::DitherOutOfBand => "dither out of band",
            Self::PickoffFailed => "pickoff failed",
            Self::OutputOverrun => "output overrun",
        }
    }

    /// The status bit, and health item, that must count it.
    pub fn counter(self) -> u8 {
        match self {
            Self::CountBeyondRate => 0,
            Self::PickoffFailed => 5,
            Self::DitherStopped => 6,
            Self::DitherOutOfBand => 7,
            Self::CounterStuck => 8,
            Self::Missed => 16,
            Self::Late => 17,
            Self::Repeated => 18,
            Self::Starved => 19,
            Self::Checksum => 20,
            Self::BusError | Self::StuckLine => 21,
            Self::OutputOverrun => 22,
            Self::BankRestarted => 26,
        }
    }

    /// True if the fault lasts, so that its counter grows with every output period.
    pub fn lasts(self) -> bool {
        matches!(
            self,
            Self::CounterStuck | Self::DitherStopped | Self::DitherOutOfBand | Self::PickoffFailed
        )
    }

    /// Counters that the fault itself raises too, with the reason of each.
    pub fn consequences(self) -> &'static [u8] {
        match self {
            // The period of the sample that did not come.
            Self::Missed | Self::Repeated | Self::Starved | Self::Checksum | Self::BusError => {
                &[12]
            }
            // As above; while it starts the bus fails, and a window that lacks samples shows part of the amplitude.
            Self::BankRestarted => &[12, 21, 7],
            // As above; dead lines too.
            Self::StuckLine => &[12, item::STUCK_LINES],
            // A count at its limit in one sample is an acceleration beyond any.
            Self::CountBeyondRate => &[2],
            // A window that is partly within the fault shows part of the amplitude.
            Self::CounterStuck | Self::DitherStopped => &[7],
            // As above; and a pickoff that comes back, at another place, is a step and an acceleration.
            Self::PickoffFailed => &[7, 1, 2],
            Self::Late | Self::DitherOutOfBand | Self::OutputOverrun => &[],
        }
    }
}

/// One fault and the stretch of time that it has for itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Injection {
    /// The fault.
    pub fault: Fault,
    /// First period of its stretch.
    pub begin: u32,
    /// First period of the fault.
    pub onset: u32,
    /// First period after the fault.
    pub end_of_fault: u32,
    /// First period after its stretch.
    pub end: u32,
    /// The gyro that it strikes.
    pub axis: usize,
    /// Periods, pulses, or the share of the amplitude, as the fault has it.
    pub size: f64,
    /// Expected count of its counter; of a fault that lasts, at least 1.
    pub counted: u32,
}

/// Result of reading the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wire {
    /// The bus brings these bytes.
    Frame([u8; FRAME_BYTES]),
    /// The bus reports an error.
    Error,
    /// The bus is not read: the source has no sample.
    Starved,
}

/// Input of one interrupt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupt {
    /// The sampling period at whose end it comes.
    pub period: u32,
    /// Timing of the interrupt.
    pub timing: Timing,
    /// Result of reading the bus.
    pub wire: Wire,
    /// True while the queue of frames is not emptied.
    pub link_held: bool,
}

/// A whole campaign.
#[derive(Debug, Clone)]
pub struct Campaign {
    /// The faults in order of time.
    pub injections: Vec<Injection>,
    /// The faulty unit, interrupt by interrupt.
    pub interrupts: Vec<Interrupt>,
    /// The samples of the same unit without faults, period by period.
    pub clean: Vec<Interrupt>,
}

impl Campaign {
    /// `times` of each of `faults`, in an order and at moments drawn from `seed`; a fault that lasts has a
    /// stretch of `lasting_periods`.
    pub fn new(seed: u64, faults: &[Fault], times: usize, lasting_periods: u32) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut order: Vec<Fault> = faults
            .iter()
            .flat_map(|fault| std::iter::repeat_n(*fault, times))
            .collect();
        order.shuffle(&mut random);
        let mut begin = SETTLING_PERIODS;
        let injections: Vec<Injection> = order
            .into_iter()
            .map(|fault| {
                let injection = draw(fault, begin, lasting_periods, &mut random);
                begin = injection.end;
                injection
            })
            .collect();
        let interrupts = play(seed, &injections, begin, &mut random);
        let clean = play(seed, &[], begin, &mut random);
        Self {
            injections,
            interrupts,
            clean,
        }
    }
}

/// Draws one injection's moment and size.
fn draw(fault: Fault, begin: u32, lasting_periods: u32, random: &mut ChaCha8Rng) -> Injection {
    let length = if fault.lasts() {
        lasting_periods
    } else {
        MOMENT_PERIODS
    };
    let onset = begin + random.random_range(50..150);
    let mut periods = 1;
    let mut size = 0.0;
    let mut counted = 1;
    match fault {
        Fault::Missed => {
            periods = random.random_range(1..=3);
            counted = periods;
        }
        Fault::BankRestarted => periods = random.random_range(1..=41),
        Fault::CountBeyondRate => {
            let jump = f64::from(random.random_range(5_000..1_000_000));
            size = if random.random() { jump } else { -jump };
        }
        Fault::DitherOutOfBand => {
            // Up to where the fastest pickoff step, with the wandering, is still in the chain's range.
            size = if random.random() { 0.25 } else { 1.75 };
            periods = random.random_range(LASTING);
        }
        Fault::CounterStuck | Fault::DitherStopped | Fault::PickoffFailed => {
            periods = random.random_range(LASTING);
        }
        Fault::OutputOverrun => {
            periods = random.random_range(160..200);
            let every = u32::from(SAMPLES_PER_OUTPUT);
            // A frame of the first interrupt after the fault still finds the queue full.
            let frames = (onset + periods + 1) / every - onset / every;
            counted = frames - QUEUED_FRAMES as u32;
        }
        _ => {}
    }
    Injection {
        fault,
        begin,
        onset,
        end_of_fault: onset + periods,
        end: begin + length,
        axis: random.random_range(0..3),
        size,
        counted,
    }
}

/// Plays the unit through `periods` periods with these faults.
fn play(
    seed: u64,
    injections: &[Injection],
    periods: u32,
    random: &mut ChaCha8Rng,
) -> Vec<Interrupt> {
    let mut unit = Unit::new(seed);
    let mut bank = BankFrame::default();
    let mut on_the_wire = bank.to_bytes();
    let mut held_pickoff = 0;
    let mut missed = 0;
    let mut coming = injections.iter();
    let mut next = coming.next();
    let mut interrupts = Vec::with_capacity(periods as usize);
    for period in 0..periods {
        if next.is_some_and(|injection| period >= injection.end) {
            next = coming.next();
        }
        let mut share = [1.0; 3];
        if let Some(injection) = next {
            share[injection.axis] = amplitude_share(injection, period);
        }
        let mut sample = unit.step(share);
        let active = next.filter(|one| (one.onset..one.end_of_fault).contains(&period));
        if let Some(injection) = active {
            spoil(&mut sample, injection, period, &mut held_pickoff);
        }
        bank = bank.followed_by(&sample, AccelerometerInput::Counters);

        let fault = active.map(|injection| injection.fault);
        match fault {
            Some(Fault::Missed) => {
                missed += 1;
                continue;
            }
            Some(Fault::BankRestarted) => {
                // Off until the last of these periods, whose first sample it counts.
                bank = BankFrame::default().followed_by(&sample, AccelerometerInput::Counters);
            }
            _ => {}
        }
        if fault != Some(Fault::Repeated) {
            on_the_wire = bank.to_bytes();
        }
        let wire = match fault {
            Some(Fault::Starved) => Wire::Starved,
            Some(Fault::BusError) => Wire::Error,
            Some(Fault::BankRestarted)
                if active.is_some_and(|injection| period + 1 < injection.end_of_fault) =>
            {
                Wire::Error
            }
            Some(Fault::StuckLine) => Wire::Frame([random.random::<bool>() as u8 * 0xFF; _]),
            Some(Fault::Checksum) => {
                let mut damaged = on_the_wire;
                let bit = random.random_range(0..8 * FRAME_BYTES);
                damaged[bit / 8] ^= 1 << (bit % 8);
                Wire::Frame(damaged)
            }
            _ => Wire::Frame(on_the_wire),
        };
        interrupts.push(Interrupt {
            period,
            timing: Timing {
                missed: std::mem::take(&mut missed),
                late: fault == Some(Fault::Late),
            },
            wire,
            link_held: fault == Some(Fault::OutputOverrun),
        });
    }
    interrupts
}

/// The share of its amplitude that the struck block has: it changes in [`RAMP_PERIODS`].
fn amplitude_share(injection: &Injection, period: u32) -> f64 {
    let during = match injection.fault {
        Fault::DitherStopped => 0.0,
        Fault::DitherOutOfBand => injection.size,
        _ => return 1.0,
    };
    let ramp = |since: u32| (f64::from(since) / f64::from(RAMP_PERIODS)).min(1.0);
    let gone = if period < injection.onset {
        0.0
    } else if period < injection.end_of_fault {
        ramp(period - injection.onset)
    } else {
        1.0 - ramp(period - injection.end_of_fault)
    };
    1.0 + gone * (during - 1.0)
}

/// Applies the fault to the sample.
fn spoil(sample: &mut Sample, injection: &Injection, period: u32, held_pickoff: &mut i32) {
    let axis = injection.axis;
    match injection.fault {
        Fault::CountBeyondRate => {
            let jump = injection.size as i32;
            sample.pulse_counts[axis] = sample.pulse_counts[axis].wrapping_add(jump);
        }
        Fault::CounterStuck => sample.pulse_counts[axis] = 0,
        Fault::PickoffFailed => {
            if period == injection.onset {
                *held_pickoff = sample.pickoff_codes[axis];
            }
            sample.pickoff_codes[axis] = *held_pickoff;
        }
        _ => {}
    }
}
