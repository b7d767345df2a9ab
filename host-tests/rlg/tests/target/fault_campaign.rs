//! The fault campaign in the emulator: both images play it, every frame and every counter equal to the host's, whose
//! injections are checked one by one. The faults are defined in `firmware_tests::campaign` and `boots`. `cargo test
//! --release -p rlg --test target fault_campaign -- --ignored --nocapture` prints the tables; those of the tests
//! `..._in_full` are in `docs/board.md`.
//!
//! Not here: the source that has nothing ready (a bus always answers; an emulated bank without a record is a bus error), a
//! boot with an oscillator (the emulator has none, so every boot of it has that fault), and bounds of the angles, which the
//! host's own campaign tests.

use std::time::Instant;

use firmware_tests::boots::BootFault;
use firmware_tests::campaign::{Campaign, Fault, Interrupt, UNTIL_OVER_PERIODS, Wire};
use firmware_tests::{player, unit, verdict};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rlg::target::{Image, Platform, SlotImages, TargetCore, emulator, host_run, on_target};
use trueaxis::bank_record::{BankRecord, HOLD_PARTS};
use trueaxis::counter_bank::FRAME_BYTES;
use trueaxis::terms::TermKinds;
use trueaxis::{BootReport, Decoder, F32, Fixed, NumberSystem, Status, TelemetryFrame};

/// Injections of each fault, and boots with each.
const TIMES: usize = 10;

/// The same in full: minutes.
const TIMES_IN_FULL: usize = 100;

/// Time beyond a period's end for which the bus holds the interrupt, so that the next one is late \[1/32 of a period\]: a
/// quarter, four times the limit.
const LATE_PARTS: u32 = HOLD_PARTS / 4;

/// The same for a next one in time for its own period \[1/32 of a period\]: half the limit.
const IN_TIME_PARTS: u32 = 1;

/// Returns the records of the emulated bank for these interrupts: the bus holds the one before a late one, or before one
/// that finds others missed.
pub fn records(interrupts: &[Interrupt]) -> Vec<BankRecord> {
    let timings = interrupts.iter().skip(1).map(|next| next.timing);
    let timings = timings.chain([Default::default()]);
    interrupts
        .iter()
        .zip(timings)
        .map(|(interrupt, next)| {
            let (frame, bus_error) = match interrupt.wire {
                Wire::Frame(bytes) => (bytes, false),
                Wire::Error => ([0; FRAME_BYTES], true),
                Wire::Starved => unreachable!("not played in the emulator"),
            };
            let hold = match (next.missed, next.late) {
                (0, false) => 0,
                (missed, late) => {
                    let rest = if late { LATE_PARTS } else { IN_TIME_PARTS };
                    (missed + 1) * HOLD_PARTS + rest
                }
            };
            let record = BankRecord {
                hold: u8::try_from(hold).expect("a few periods"),
                link_held: interrupt.link_held,
                bus_error,
                frame,
            };
            assert_eq!(record.timing_of_the_next(), next);
            record
        })
        .collect()
}

fn campaign<N: NumberSystem>(core: TargetCore, seed: u64, times: usize) {
    let faults: Vec<Fault> = Fault::ALL
        .into_iter()
        .filter(|fault| *fault != Fault::Starved)
        .collect();
    let campaign = Campaign::new(seed, &faults, times, UNTIL_OVER_PERIODS);
    let records = records(&campaign.interrupts);
    let slots = SlotImages::both(&unit::parameters());

    // On the host, injection by injection. The emulator has no crystal.
    let boot = BootReport::default().with(|report| {
        report.clock_fallback = true;
        report.generation = slots.load(TermKinds::NONE).generation;
    });
    let boundaries = verdict::boundaries(&campaign.injections);
    let host = player::play::<N>(&unit::parameters(), boot, &campaign.interrupts, boundaries);
    let rows = verdict::judge(&campaign.injections, &host.health_at);
    verdict::first_is_latched(&campaign.injections[0], &host.health);
    let with_bank =
        host_run::run(core, &slots, &records, TermKinds::NONE).expect("parameters in range");
    let telemetry: Vec<u8> = host
        .frames
        .iter()
        .flat_map(TelemetryFrame::to_bytes)
        .collect();
    assert!(with_bank.telemetry == telemetry && with_bank.health == host.health);

    // In the emulator, all of it.
    let image = Image::build(Platform::Emulator, core).expect("the image builds");
    let begin = Instant::now();
    let result = on_target::compare_records(&image, core, &slots, &records, &mut |_| {})
        .expect("the image runs");
    assert!(result.bit_equal, "{:?}", result.first_difference);

    let mut table = format!(
        "\n{} image: {} interrupts, {} frames, every bit and counter equal; {:.0} s\n{}",
        core.name(),
        campaign.interrupts.len(),
        result.frames,
        begin.elapsed().as_secs_f64(),
        verdict::HEADER
    );
    for row in rows.iter().filter(|row| row.injected > 0) {
        table += &format!("\n{row}");
    }
    // At once: the tests run side by side.
    println!("{table}");
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_f32_image_counts_every_fault_as_the_host_does() {
    campaign::<F32>(TargetCore::F32, 4, TIMES);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_fixed_image_counts_every_fault_as_the_host_does() {
    campaign::<Fixed>(TargetCore::Fixed, 5, TIMES);
}

/// Interrupts of one boot: ten frames, to check that the boot's faults stay in them.
const BOOT_INTERRUPTS: usize = 100;

fn boots(core: TargetCore, seed: u64, times: usize) {
    let image = Image::build(Platform::Emulator, core).expect("the image builds");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let clean = Campaign::new(seed, &[], 0, 0).clean;
    let records = records(&clean[..BOOT_INTERRUPTS]);
    let block = unit::parameters().to_block(9);
    let begin = Instant::now();
    let mut table = format!("\n{} image: boot with | boots | said so", core.name());
    for fault in [BootFault::OneSlot, BootFault::BothSlots, BootFault::None] {
        let due = fault.status().union(Status::CLOCK_FALLBACK);
        let mut said = 0;
        for _ in 0..times {
            let slots = SlotImages(fault.slots(&block, &mut random));
            let host = host_run::run(core, &slots, &records, TermKinds::NONE)
                .expect("parameters in range");
            let emulation =
                emulator::run(&image.path, &slots, &records, &mut |_| {}).expect("the image runs");
            assert!(emulation.telemetry == host.telemetry, "{fault:?}");
            assert_eq!(emulation.report.health, host.health, "{fault:?}");
            let mut decoder = Decoder::new();
            let bytes = emulation.telemetry.into_iter();
            let frames: Vec<_> = bytes.filter_map(|byte| decoder.push(byte)).collect();
            said += usize::from(
                !frames.is_empty()
                    && frames.iter().all(|frame| {
                        frame.output.status.bits() & BootFault::ANY.bits() == due.bits()
                    }),
            );
        }
        assert_eq!(said, times, "{fault:?}");
        table += &format!("\n{} | {times} | {said}", fault.name());
    }
    println!("{table}\n{:.0} s", begin.elapsed().as_secs_f64());
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_f32_image_says_what_its_boot_found() {
    boots(TargetCore::F32, 6, TIMES);
}

#[test]
#[ignore = "needs qemu-system-arm; cargo verify runs it"]
fn the_fixed_image_says_what_its_boot_found() {
    boots(TargetCore::Fixed, 7, TIMES);
}

#[test]
#[ignore = "needs qemu-system-arm, and minutes: --test target -- --ignored in_full"]
fn the_f32_image_counts_every_fault_in_full() {
    campaign::<F32>(TargetCore::F32, 4, TIMES_IN_FULL);
    boots(TargetCore::F32, 6, TIMES_IN_FULL);
}

#[test]
#[ignore = "needs qemu-system-arm, and minutes: --test target -- --ignored in_full"]
fn the_fixed_image_counts_every_fault_in_full() {
    campaign::<Fixed>(TargetCore::Fixed, 5, TIMES_IN_FULL);
    boots(TargetCore::Fixed, 7, TIMES_IN_FULL);
}
