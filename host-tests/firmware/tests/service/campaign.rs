//! Injects ten faults, each a hundred times at drawn moments: its bit must show within 100 ms, and no other. Sound data show
//! none.

use firmware_tests::service::{self, SlowBank, SlowFault, latch_s};
use firmware_tests::unit::{RATE_HZ, Unit};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::counter_bank::{AccelerometerInput, BankDecoder, BankFrame, FRAME_BYTES};
use trueaxis::{BootReport, F32, Fixed, NumberSystem, Processor, Status, TelemetryFrame, Timing};

/// Injections of each fault.
const TIMES: usize = 100;

/// Latest at which a fault must show \[s\].
const SEEN_WITHIN_S: f64 = 0.1;

/// Stretch of an injection \[periods\], of which the fault lasts the first part.
const STRETCH: u32 = 2000;
const LASTING: u32 = 800;

/// Time before the first injection \[periods\].
const SETTLING: u32 = 8000;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fault {
    Slow(SlowFault),
    DitherAmplitude,
    CounterStuck,
    Checksum,
}

const FAULTS: [Fault; 10] = [
    Fault::Slow(SlowFault::DyingLaser),
    Fault::Slow(SlowFault::ModeHop),
    Fault::Slow(SlowFault::ControlReset),
    Fault::Slow(SlowFault::DitherDrive),
    Fault::Slow(SlowFault::ThermometerSilent),
    Fault::Slow(SlowFault::TemperatureRange),
    Fault::Slow(SlowFault::PulseLost),
    Fault::DitherAmplitude,
    Fault::CounterStuck,
    Fault::Checksum,
];

impl Fault {
    /// The bit that must show, and those that may show with it.
    fn bits(self) -> (Status, Status) {
        let none = Status::default();
        match self {
            Self::Slow(SlowFault::DyingLaser) => (Status::INTENSITY_LOW, none),
            Self::Slow(SlowFault::ModeHop | SlowFault::ControlReset) => (Status::MODE_HOP, none),
            Self::Slow(SlowFault::DitherDrive) => (Status::DITHER_DRIVE, none),
            Self::Slow(SlowFault::ThermometerSilent) => (Status::TEMPERATURE_ABSENT, none),
            Self::Slow(SlowFault::TemperatureRange) => (Status::TEMPERATURE_RANGE, none),
            Self::Slow(SlowFault::PulseLost) => (Status::PULSE_LOST, none),
            Self::DitherAmplitude => (Status::DITHER_OUT_OF_BAND, none),
            // A window partly within the fault shows part of the amplitude.
            Self::CounterStuck => (Status::COUNTER_STUCK, Status::DITHER_OUT_OF_BAND),
            Self::Checksum => (Status::FRAME_CHECKSUM, Status::GAP),
        }
    }
}

/// A unit, its bank, and the firmware.
struct Bench<N: NumberSystem> {
    unit: Unit,
    slow: SlowBank,
    frame: BankFrame,
    decoder: BankDecoder,
    processor: Processor<N>,
    period: u32,
}

impl<N: NumberSystem> Bench<N> {
    fn new(seed: u64) -> Self {
        let parameters = service::parameters();
        let processor = Processor::new(&parameters, BootReport::default()).expect("in range");
        Self {
            unit: Unit::new(seed),
            slow: SlowBank::new(seed),
            frame: BankFrame::default(),
            decoder: BankDecoder::new(AccelerometerInput::Counters),
            processor,
            period: 0,
        }
    }

    /// One period, with a fault of this axis that began so many periods ago.
    fn step(
        &mut self,
        fault: Option<(Fault, usize, u32)>,
        flipped_bit: usize,
    ) -> Option<TelemetryFrame> {
        let mut share = [1.0; 3];
        let mut slow = None;
        match fault {
            Some((Fault::DitherAmplitude, axis, since)) => {
                share[axis] = 1.0 - 0.75 * (f64::from(since) / 40.0).min(1.0);
            }
            Some((Fault::Slow(kind), axis, since)) => {
                slow = Some((kind, axis, f64::from(since) / RATE_HZ));
            }
            _ => {}
        }
        let mut sample = self.unit.step(share);
        if let Some((Fault::CounterStuck, axis, _)) = fault {
            sample.pulse_counts[axis] = 0;
        }
        self.frame = self
            .frame
            .followed_by(&sample, AccelerometerInput::Counters);
        self.frame.service = self.slow.step(slow);
        let mut bytes = self.frame.to_bytes();
        if let Some((Fault::Checksum, _, 0)) = fault {
            bytes[flipped_bit / 8] ^= 1 << (flipped_bit % 8);
        }
        self.period += 1;
        let reading = self.decoder.reading(Ok(&bytes), 1);
        self.processor.period(reading, Timing::default())
    }
}

fn campaign<N: NumberSystem>(seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut order: Vec<Fault> = FAULTS
        .into_iter()
        .flat_map(|fault| std::iter::repeat_n(fault, TIMES))
        .collect();
    order.shuffle(&mut random);
    let mut bench = Bench::<N>::new(seed);
    for _ in 0..SETTLING {
        let _ = bench.step(None, 0);
    }
    let mut latest = FAULTS.map(|_| 0.0_f64);
    for fault in order {
        let axis = random.random_range(0..3);
        let bit = random.random_range(0..8 * FRAME_BYTES);
        let (due, may) = fault.bits();
        // A pulse can be lost only when it is due; any other fault begins at any time.
        let wait = match fault {
            Fault::Slow(SlowFault::PulseLost) => {
                let now_s = latch_s(bench.period);
                ((now_s.ceil() - now_s) * RATE_HZ) as u32
            }
            _ => random.random_range(0..50),
        };
        for _ in 0..wait {
            let _ = bench.step(None, 0);
        }
        let lasting = LASTING;
        let mut seen_s = None;
        for since in 0..STRETCH {
            let struck = (since < lasting).then_some((fault, axis, since));
            if since == lasting {
                bench.slow.settle();
            }
            let Some(frame) = bench.step(struck, bit) else {
                continue;
            };
            let status = frame.output.status;
            let others = status.bits() & Status::IN_SERVICE_FAULTS.bits() & !due.union(may).bits();
            assert_eq!(others, 0, "{fault:?}, {since} periods: {status:?}");
            if status.contains(due) && seen_s.is_none() {
                seen_s = Some(f64::from(since + 1) / RATE_HZ);
            }
        }
        let seen_s = seen_s.unwrap_or_else(|| panic!("{fault:?} of axis {axis} was not seen"));
        assert!(
            seen_s <= SEEN_WITHIN_S,
            "{fault:?} was seen after {seen_s} s"
        );
        let place = FAULTS
            .iter()
            .position(|known| *known == fault)
            .expect("one");
        latest[place] = latest[place].max(seen_s);
        // Until a second has its pulse again, and a strip that was misled is back.
        let until_well = match fault {
            Fault::Slow(SlowFault::PulseLost) => 8000,
            Fault::CounterStuck => 2000,
            _ => 0,
        };
        for _ in 0..until_well {
            let _ = bench.step(None, 0);
        }
    }
    let mut table = format!("\n{}: fault | seen of {TIMES} | latest [ms]", N::NAME);
    for (fault, latest_s) in FAULTS.iter().zip(latest) {
        table += &format!("\n{fault:?} | {TIMES} | {:.1}", 1e3 * latest_s);
    }
    println!("{table}");
}

#[test]
fn ten_faults_each_show_within_100_ms_f32() {
    campaign::<F32>(21);
}

#[test]
fn ten_faults_each_show_within_100_ms_fixed() {
    campaign::<Fixed>(22);
}

/// Runs a sound unit, and asserts that no frame in service has a fault.
fn sound<N: NumberSystem>(seed: u64, seconds: u32) {
    let mut bench = Bench::<N>::new(seed);
    let periods = seconds * RATE_HZ as u32;
    for period in 0..periods {
        let Some(frame) = bench.step(None, 0) else {
            continue;
        };
        let found = frame.output.status.bits() & Status::IN_SERVICE_FAULTS.bits();
        assert_eq!(found, 0, "{:?} after {period} periods", frame.output.status);
    }
    assert!(!bench.processor.has_latched_fault());
    println!("{}: no fault in {seconds} s of sound data", N::NAME);
}

#[test]
fn a_sound_unit_has_no_fault() {
    sound::<F32>(31, 60);
    sound::<Fixed>(32, 60);
}

#[test]
#[ignore = "minutes: a day of samples in each number system"]
fn a_sound_unit_has_no_fault_for_a_day_in_full() {
    sound::<F32>(33, 86_400);
    sound::<Fixed>(34, 86_400);
}
