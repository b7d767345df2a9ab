//! The fault campaign on the host: every fault at least 100 times, at random moments in one stream.
//!
//! Of each injection: its counter counts it exactly, no other counter moves but for the consequences that
//! `Fault::consequences` gives reasons for, the angle stays within a bound that follows from the fault, and at the end
//! of its stretch the unit is without fault. The table is printed: `cargo test --release -p firmware-tests --test
//! fault_campaign -- --nocapture`.

use std::collections::HashMap;

use embedded_storage::nor_flash::{ErrorType, NorFlashErrorKind, ReadNorFlash};
use firmware_tests::boots::BootFault;
use firmware_tests::campaign::{Campaign, Fault, Injection, UNTIL_WELL_PERIODS, WELL_PERIODS};
use firmware_tests::player::play;
use firmware_tests::unit::{self, DITHER_RAD, FASTEST_RAD_S, PULSE_RAD, RATE_HZ};
use firmware_tests::verdict;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use trueaxis::design_parameters::{ADAPTATION_STEP_LIMIT, DITHER_LIMIT_RAD, SENSED_LIMIT_RAD};
use trueaxis::parameter_block::LARGEST_BLOCK_BYTES;
use trueaxis::parameter_slots::ParameterSlots;
use trueaxis::{
    BootReport, F32, Fixed, NumberSystem, OUTPUT_RAD_PER_CODE, Parameters, Status, TelemetryFrame,
};

/// Injections of each fault.
const TIMES: usize = 100;

/// Largest angle of a block \[rad\]: its amplitude wanders by a tenth.
const BLOCK_RAD: f64 = 1.1 * DITHER_RAD;

/// Angle by the strip's own noise, against the unit without faults \[rad\]: pulses leave 0.05 % in the taps
/// (`stages::adaptation`), four times that of a block is half a pulse, at both ends.
const STRIP_RAD: f64 = 2.0 * PULSE_RAD;

/// Largest change of the strip's angle by windows partly within a fault, which they do not find \[rad\]: one at its
/// beginning, one at its end, each the largest step of gain and quadrature.
const MISLED_RAD: f64 = 2.0 * std::f64::consts::SQRT_2 * ADAPTATION_STEP_LIMIT as f64 * BLOCK_RAD;

/// Largest error of one frame's angle after recovery \[rad\]: a pulse.
const WELL_RAD: f64 = PULSE_RAD;

/// The frames by number, as angles \[rad\].
struct Angles(HashMap<u32, [f64; 3]>);

impl Angles {
    fn of(frames: &[TelemetryFrame]) -> Self {
        let rad = |code: i32| f64::from(code) * OUTPUT_RAD_PER_CODE;
        let angle =
            |frame: &TelemetryFrame| (frame.output.sequence, frame.output.dtheta_codes.map(rad));
        Self(frames.iter().map(angle).collect())
    }
}

/// Errors of the angles by one fault over all its injections.
#[derive(Debug, Default, Clone, Copy)]
struct Errors {
    largest_rad: f64,
    left_rad: f64,
    frame_when_well_rad: f64,
}

/// Largest error of the angle during a fault, against the unit without faults \[rad\].
fn bound_rad(injection: &Injection) -> f64 {
    let periods = f64::from(injection.end_of_fault - injection.onset + 1);
    let turned = FASTEST_RAD_S * periods / RATE_HZ;
    STRIP_RAD
        + match injection.fault {
            // The same samples: nothing but the strip's state.
            Fault::Late | Fault::OutputOverrun => 0.0,
            // The blocks' real motion, stripped.
            Fault::DitherStopped | Fault::DitherOutOfBand => MISLED_RAD,
            // The angle of the periods without a sample, shown late.
            Fault::Missed
            | Fault::Repeated
            | Fault::Starved
            | Fault::BankRestarted
            | Fault::Checksum
            | Fault::BusError
            | Fault::StuckLine => turned,
            // Held at the limit, instead of the block's motion in that period.
            Fault::CountBeyondRate => SENSED_LIMIT_RAD + BLOCK_RAD,
            // The case's rotation is not counted, the block's motion is still stripped.
            Fault::CounterStuck => turned + 2.0 * BLOCK_RAD,
            // The block's motion is not stripped, until the pickoff is back.
            Fault::PickoffFailed => 2.0 * BLOCK_RAD,
        }
}

/// Part of that error that remains after the fault \[rad\].
fn bound_left_rad(injection: &Injection) -> f64 {
    match injection.fault {
        // Pulses not counted are lost.
        Fault::CountBeyondRate | Fault::CounterStuck | Fault::BankRestarted => bound_rad(injection),
        // The strip telescopes, but for the part of the pickoff's step back beyond its range.
        Fault::PickoffFailed => STRIP_RAD + 2.0 * BLOCK_RAD - DITHER_LIMIT_RAD,
        _ => STRIP_RAD,
    }
}

/// Asserts that the angles stay within their bounds, and that the frames at the end are those of a unit without faults.
fn bounded(injection: &Injection, faulty: &Angles, clean: &Angles, errors: &mut Errors) {
    let every = u32::from(unit::SAMPLES_PER_OUTPUT);
    let mut error_rad = [0.0_f64; 3];
    for frame in injection.begin / every..injection.end / every {
        // Frames that found no room: their angle is gone, which the sequence shows.
        let Some(seen) = faulty.0.get(&frame) else {
            assert_eq!(injection.fault, Fault::OutputOverrun, "frame {frame}");
            continue;
        };
        for axis in 0..3 {
            let error = seen[axis] - clean.0[&frame][axis];
            error_rad[axis] += error;
            let size = error_rad[axis].abs();
            assert!(size <= bound_rad(injection), "{size} rad: {injection:?}");
            errors.largest_rad = errors.largest_rad.max(size);
            if frame * every >= injection.end - WELL_PERIODS {
                assert!(error.abs() <= WELL_RAD, "{error} rad: {injection:?}");
                errors.frame_when_well_rad = errors.frame_when_well_rad.max(error.abs());
            }
        }
    }
    for error in error_rad.map(f64::abs) {
        assert!(
            error <= bound_left_rad(injection),
            "{error} rad: {injection:?}"
        );
        errors.left_rad = errors.left_rad.max(error);
    }
}

/// Every frame of the last [`WELL_PERIODS`] of each stretch must be free of fault bits.
fn recovered(injections: &[Injection], frames: &[TelemetryFrame]) {
    let every = u32::from(unit::SAMPLES_PER_OUTPUT);
    let degraded = Status::IN_SERVICE_FAULTS.union(Status::DYNAMIC_TERM_OFF);
    let mut injections = injections.iter().peekable();
    for frame in frames {
        let period = frame.output.sequence * every;
        while injections.next_if(|one| one.end <= period).is_some() {}
        let Some(injection) = injections.peek() else {
            continue;
        };
        if period + WELL_PERIODS >= injection.end {
            let bits = frame.output.status.bits() & degraded.bits();
            assert_eq!(bits, 0, "not well again: {injection:?}");
        }
    }
}

fn campaign<N: NumberSystem>(seed: u64) {
    let campaign = Campaign::new(seed, &Fault::ALL, TIMES, UNTIL_WELL_PERIODS);
    let (parameters, boot) = (unit::parameters(), BootReport::default());
    let boundaries = verdict::boundaries(&campaign.injections);
    let faulty = play::<N>(&parameters, boot, &campaign.interrupts, boundaries);
    let clean = play::<N>(&parameters, boot, &campaign.clean, []);
    verdict::nothing_is_counted(&clean.health);
    verdict::nothing_is_counted(&faulty.health_at[0]);

    let rows = verdict::judge(&campaign.injections, &faulty.health_at);
    let mut errors = [Errors::default(); Fault::ALL.len()];
    let (angles, truth) = (Angles::of(&faulty.frames), Angles::of(&clean.frames));
    for injection in &campaign.injections {
        let errors = &mut errors[injection.fault as usize];
        bounded(injection, &angles, &truth, errors);
    }
    recovered(&campaign.injections, &faulty.frames);
    verdict::first_is_latched(&campaign.injections[0], &faulty.health);

    let periods = campaign.clean.len();
    let mut table = format!("\n{}: {periods} periods\n{}", N::NAME, verdict::HEADER);
    table += " | largest | left | when well [pulses]";
    for (row, errors) in rows.iter().zip(errors) {
        let [largest, left, when_well] = [
            errors.largest_rad,
            errors.left_rad,
            errors.frame_when_well_rad,
        ]
        .map(|rad| rad / PULSE_RAD);
        table += &format!("\n{row} | {largest:.2} | {left:.2} | {when_well:.3}");
    }
    // At once: the tests run side by side.
    println!("{table}");
}

#[test]
fn every_fault_raises_its_own_counter_and_ends_f32() {
    campaign::<F32>(1);
}

#[test]
fn every_fault_raises_its_own_counter_and_ends_fixed() {
    campaign::<Fixed>(2);
}

/// Two parameter slots.
struct Flash(Vec<u8>);

impl ErrorType for &Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for &Flash {
    const READ_SIZE: usize = 1;
    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let from = offset as usize;
        let there = self.0.get(from..from + bytes.len());
        bytes.copy_from_slice(there.ok_or(NorFlashErrorKind::OutOfBounds)?);
        Ok(())
    }
    fn capacity(&self) -> usize {
        self.0.len()
    }
}

/// Room for a slot: the loader reads to the end of the block's last unit of flash.
const SLOT: usize = 2 * LARGEST_BLOCK_BYTES;

fn boots<N: NumberSystem>(seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let good = unit::parameters();
    let stream = Campaign::new(seed, &[], 0, 0).clean;
    let stream = &stream[..200];
    let block = good.to_block(9);
    let mut table = format!("\n{}: boot with | boots | said so in every frame", N::NAME);
    for fault in BootFault::ALL {
        let due = fault.status();
        let mut said = 0;
        for _ in 0..TIMES {
            let mut flash = Flash(vec![0xFF; 2 * SLOT]);
            let slots = fault.slots(&block, &mut random);
            for (content, place) in slots.iter().zip(flash.0.chunks_mut(SLOT)) {
                place[..content.len()].copy_from_slice(content);
            }
            let loaded = ParameterSlots::new(&flash, [0, SLOT as u32]).load();
            let report = BootReport::default().with(|report| {
                report.clock_fallback = fault == BootFault::NoOscillator;
                report.parameters_default = loaded.parameters_default();
                report.slot_bad = loaded.slot_bad;
                report.generation = loaded.generation;
            });
            let played = play::<N>(&loaded.parameters, report, stream, []);
            assert!(!played.frames.is_empty());
            let shown = |frame: &TelemetryFrame| frame.output.status.bits() & BootFault::ANY.bits();
            let all = played.frames.iter().all(|frame| shown(frame) == due.bits());
            said += usize::from(all);
            let promised = if fault == BootFault::BothSlots {
                Parameters::default()
            } else {
                good
            };
            let expected = play::<N>(&promised, report, stream, []);
            assert_eq!(played.frames, expected.frames, "{fault:?}");
            // A fault of the boot is not counted in service.
            verdict::nothing_is_counted(&played.health);
        }
        assert_eq!(said, TIMES, "{fault:?}");
        table += &format!("\n{} | {TIMES} | {said}", fault.name());
    }
    println!("{table}");
}

/// Parameter faults and the clock's: each stands in every frame of its boot and no other does, and the
/// angles are those of the parameters that the flags promise.
#[test]
fn every_fault_of_the_boot_is_in_every_frame() {
    boots::<F32>(3);
    boots::<Fixed>(4);
}
