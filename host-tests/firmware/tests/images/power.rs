//! Power that fails in front of and within every erasure and every programmed word of an update: upload, trial, confirmation.

use firmware_tests::image_unit::{LEFTOVERS, Leftover, Unit, image, requests};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::image::ImageSlot;
use trueaxis::image_journal::{Event, ImageId};
use trueaxis::image_state::BootReason;

/// Code of the images whose every word is a place to lose power \[bytes\].
const SMALL: usize = 1_024;

/// Code of images as large as the real ones: two sectors \[bytes\].
const LARGE: usize = 140 * 1024;

/// The whole update: the new image for slot B is sent, started and confirmed. True if power lasted.
fn update(unit: &Unit, new: &[u8]) -> bool {
    let requests = requests(new);
    let outcomes = unit.send(ImageSlot::A, &requests);
    if outcomes.len() < requests.len() || outcomes.iter().any(|(outcome, _)| *outcome != 0) {
        return false;
    }
    match unit.boot() {
        Some(choice) if choice.reason == BootReason::Trial => unit.confirm(ImageSlot::B),
        _ => false,
    }
}

/// Counts of a campaign.
#[derive(Debug, Default)]
struct Counts {
    cuts: usize,
    old: usize,
    new: usize,
}

/// Cuts the update of a unit at these operations, with every leftover; every boot afterwards must start the old image or the
/// new one, and come to rest on one of them.
fn cut_at(unit: &Unit, files: [&[u8]; 2], operations: impl Iterator<Item = usize>) -> Counts {
    let mut counts = Counts::default();
    for operation in operations {
        for leftover in LEFTOVERS {
            let unit = unit.copy();
            unit.chip.borrow_mut().cut = Some((operation, leftover));
            let lasted = update(&unit, files[1]);
            assert!(!lasted, "{operation}: no power was lost");
            unit.chip.borrow_mut().reboot();
            let mut started = Vec::new();
            for _ in 0..3 {
                let choice = unit.boot().expect("an image to start");
                started.push((unit.running(&choice, &files), choice.reason));
                unit.chip.borrow_mut().reboot();
            }
            // A trial that nobody confirms lasts for one start.
            let rested = started[1..]
                .iter()
                .all(|(image, reason)| *image == started[2].0 && *reason != BootReason::Trial);
            assert!(rested, "{operation} {leftover:?}: {started:?}");
            let is_trial = started[0].1 == BootReason::Trial;
            assert!(!is_trial || started[0].0 == 1, "a trial of the old image");
            counts.cuts += 1;
            *(if started[0].0 == 1 {
                &mut counts.new
            } else {
                &mut counts.old
            }) += 1;
            // Nothing is left behind that stops the next update.
            if leftover == Leftover::SomeBits && started[2].0 == 0 {
                assert!(update(&unit, files[1]), "{operation}: no update afterwards");
                let choice = unit.boot().expect("an image to start");
                assert_eq!(unit.running(&choice, &files), 1);
            }
        }
    }
    counts
}

/// Operations of an update whose power lasts.
fn operations(unit: &Unit, new: &[u8]) -> usize {
    let unit = unit.copy();
    assert!(update(&unit, new));
    let operations = unit.chip.borrow().operations;
    let choice = unit.boot().expect("an image to start");
    assert_eq!(
        (choice.header.slot, choice.reason),
        (ImageSlot::B, BootReason::Confirmed)
    );
    operations
}

#[test]
fn power_cut_at_every_operation_of_an_update() {
    let old = image(ImageSlot::A, SMALL, 1);
    let new = image(ImageSlot::B, SMALL, 2);
    let unit = Unit::in_service(&old, &image(ImageSlot::B, 2 * SMALL, 3));
    let operations = operations(&unit, &new);
    // A sector, the words of code and header, and three records.
    assert_eq!(operations, 1 + SMALL / 4 + 8 + 3 * 4);
    let counts = cut_at(&unit, [&old, &new], 0..operations);
    println!("every operation of {operations}: {counts:?}");
    assert_eq!(counts.old + counts.new, 3 * operations);
    assert!(counts.new >= 4 && counts.old > 3 * SMALL / 4);
}

/// The page of records is full, so the update writes a new one first.
#[test]
fn power_cut_at_every_operation_with_a_full_page() {
    let old = image(ImageSlot::A, SMALL, 1);
    let new = image(ImageSlot::B, SMALL, 2);
    let unit = Unit::in_service(&old, &[]);
    let own = unit.slots().own_id(ImageSlot::A).expect("a header");
    let mut slots = unit.slots();
    while slots.journal.append(Event::Confirmed, own).is_ok() {}
    let unit = unit.copy();
    let operations = operations(&unit, &new);
    // Besides: a sector of records, the confirmed image and the head.
    assert_eq!(operations, 1 + SMALL / 4 + 8 + 3 * 4 + 1 + 4 + 4);
    let counts = cut_at(&unit, [&old, &new], 0..operations);
    println!("every operation of {operations}, full page: {counts:?}");
    assert_eq!(counts.old + counts.new, 3 * operations);
}

/// Images of two sectors: every erasure, the first and the last words, and words between them.
#[test]
fn power_cut_within_an_update_of_full_size() {
    let old = image(ImageSlot::A, LARGE, 1);
    let new = image(ImageSlot::B, LARGE, 2);
    let unit = Unit::in_service(&old, &image(ImageSlot::B, LARGE, 3));
    let operations = operations(&unit, &new);
    assert_eq!(operations, 2 + LARGE / 4 + 8 + 3 * 4);
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let between = (0..60).map(|_| random.random_range(10..operations - 24));
    let places = (0..10).chain(between).chain(operations - 24..operations);
    let counts = cut_at(&unit, [&old, &new], places);
    println!("{operations} operations of an image of {LARGE} bytes: {counts:?}");
}

/// Of two pages the newer counts, and damaged records are passed over: by the records' own bytes.
#[test]
fn records_survive_a_hundred_full_pages() {
    let unit = Unit::in_service(&image(ImageSlot::A, SMALL, 1), &[]);
    let mut slots = unit.slots();
    let mut last = 0;
    for round in 0..100 {
        slots.journal.make_room(32).expect("power holds");
        let mut written = 0;
        while written < 700 && {
            last += 1;
            let image = ImageId {
                slot: ImageSlot::B,
                crc: last,
            };
            slots.journal.append(Event::Confirmed, image).is_ok()
        } {
            written += 1;
        }
        assert!(written > 31, "{round}");
        let page = slots.journal.page().expect("readable").expect("a page");
        let crc = page.history.confirmed.map(|image| image.crc);
        // The last one was refused only where the page was full.
        assert_eq!(crc, Some(last - u32::from(written < 700)));
    }
}
