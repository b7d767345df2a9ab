//! Choices of the selector, the judgement of a trial, and the words that report both.

use firmware_tests::image_unit::{Chip, Unit, image, requests};
use trueaxis::image::ImageSlot;
use trueaxis::image_journal::{Event, History, ImageId};
use trueaxis::image_slots::{CONFIRM_AFTER_S, Verdict, judge};
use trueaxis::image_state::{BootNote, BootReason, ImageState};
use trueaxis::service::DONE;

const CODE: usize = 2_048;

fn files() -> [Vec<u8>; 2] {
    [image(ImageSlot::A, CODE, 1), image(ImageSlot::B, CODE, 2)]
}

/// A unit with the first image confirmed and the second one stored.
fn updated() -> Unit {
    let [old, new] = files();
    let unit = Unit::in_service(&old, &[]);
    let outcomes = unit.send(ImageSlot::A, &requests(&new));
    assert!(outcomes.iter().all(|(outcome, _)| *outcome == DONE));
    unit.copy()
}

fn started(unit: &Unit) -> (ImageSlot, BootReason) {
    let choice = unit.boot().expect("an image");
    (choice.header.slot, choice.reason)
}

#[test]
fn an_image_that_never_confirms_is_rolled_back() {
    let unit = updated();
    assert_eq!(started(&unit), (ImageSlot::B, BootReason::Trial));
    for _ in 0..100 {
        assert_eq!(started(&unit), (ImageSlot::A, BootReason::RolledBack));
    }
    // A new upload of the same image has a trial of its own.
    let [_, new] = files();
    unit.send(ImageSlot::A, &requests(&new));
    assert_eq!(started(&unit), (ImageSlot::B, BootReason::Trial));
    assert!(unit.confirm(ImageSlot::B));
    for _ in 0..100 {
        assert_eq!(started(&unit), (ImageSlot::B, BootReason::Confirmed));
    }
}

#[test]
fn images_take_turns_over_five_hundred_updates() {
    let [old, _] = files();
    let unit = Unit::in_service(&old, &[]);
    let mut running = ImageSlot::A;
    for update in 0..500 {
        let next = running.other();
        let new = image(next, 512, 10 + update);
        let outcomes = unit.send(running, &requests(&new));
        assert!(
            outcomes.iter().all(|(outcome, _)| *outcome == DONE),
            "{update}"
        );
        assert_eq!(started(&unit), (next, BootReason::Trial));
        assert!(unit.confirm(next));
        let choice = unit.boot().expect("an image");
        assert_eq!(
            (choice.header.slot, choice.reason),
            (next, BootReason::Confirmed)
        );
        assert_eq!(unit.running(&choice, &[&new]), 0);
        running = next;
    }
}

#[test]
fn a_trial_that_cannot_be_recorded_waits() {
    let mut unit = updated();
    unit.supply_suffices = false;
    assert_eq!(started(&unit), (ImageSlot::A, BootReason::Postponed));
    unit.supply_suffices = true;
    unit.chip.borrow_mut().refuses = Some(0);
    assert_eq!(started(&unit), (ImageSlot::A, BootReason::Postponed));
    unit.chip.borrow_mut().reboot();
    assert_eq!(started(&unit), (ImageSlot::B, BootReason::Trial));
}

#[test]
fn a_damaged_confirmed_image_leaves_the_other_one() {
    let [old, new] = files();
    let unit = updated();
    assert_eq!(started(&unit), (ImageSlot::B, BootReason::Trial));
    assert!(unit.confirm(ImageSlot::B));
    unit.flash(ImageSlot::B, &[0; 700]);
    assert_eq!(started(&unit), (ImageSlot::A, BootReason::Fallback));
    // The state of the running image: it may overwrite the damaged one, and is confirmed by that.
    let state = unit.slots().state(ImageSlot::A, BootReason::Fallback);
    assert_eq!(
        (state.free, state.is_confirmed),
        (Some(ImageSlot::B), false)
    );
    let outcomes = unit.send(ImageSlot::A, &requests(&new));
    assert!(outcomes.iter().all(|(outcome, _)| *outcome == DONE));
    assert_eq!(started(&unit), (ImageSlot::B, BootReason::Trial));
    assert_eq!(started(&unit), (ImageSlot::A, BootReason::RolledBack));
    unit.flash(ImageSlot::A, &[0; 700]);
    // Neither confirmed nor untried, but the last that there is.
    assert_eq!(started(&unit), (ImageSlot::B, BootReason::Fallback));
    unit.flash(ImageSlot::B, &[0; 700]);
    assert_eq!(unit.boot(), None);
    assert_eq!(old.len(), CODE + 512);
}

#[test]
fn a_new_unit_starts_what_a_probe_has_flashed() {
    let [old, new] = files();
    let unit = Unit::new(Chip::erased());
    assert_eq!(unit.boot(), None);
    unit.flash(ImageSlot::B, &new);
    assert_eq!(started(&unit), (ImageSlot::B, BootReason::Unconfirmed));
    unit.flash(ImageSlot::A, &old);
    assert_eq!(started(&unit), (ImageSlot::A, BootReason::Unconfirmed));
    assert!(unit.confirm(ImageSlot::A));
    assert_eq!(started(&unit), (ImageSlot::A, BootReason::Confirmed));
}

/// Sectors of the records that hold other content, as after an image without a selector: no trial, no page, and an image
/// that starts; the first upload begins the records.
#[test]
fn records_on_sectors_that_were_not_erased() {
    let [old, new] = files();
    let mut chip = Chip::erased();
    for (at, byte) in chip.content[0].iter_mut().enumerate() {
        *byte = (at * 7) as u8;
    }
    let unit = Unit::new(chip);
    unit.flash(ImageSlot::A, &old);
    assert_eq!(started(&unit), (ImageSlot::A, BootReason::Unconfirmed));
    assert!(!unit.confirm(ImageSlot::A));
    let outcomes = unit.send(ImageSlot::A, &requests(&new));
    assert!(outcomes.iter().all(|(outcome, _)| *outcome == DONE));
    assert_eq!(started(&unit), (ImageSlot::B, BootReason::Trial));
    assert_eq!(started(&unit), (ImageSlot::A, BootReason::RolledBack));
}

#[test]
fn judgement_of_a_trial() {
    for seconds in 0..CONFIRM_AFTER_S {
        for case in 0..4 {
            assert_eq!(judge(seconds, case & 1 == 1, case & 2 == 2), Verdict::Wait);
        }
    }
    for (healthy, on_trial, verdict) in [
        (true, true, Verdict::Confirm),
        (true, false, Verdict::Confirm),
        (false, true, Verdict::GiveUp),
        (false, false, Verdict::Wait),
    ] {
        assert_eq!(judge(CONFIRM_AFTER_S, healthy, on_trial), verdict);
        assert_eq!(judge(u32::MAX, healthy, on_trial), verdict);
    }
}

#[test]
fn history_of_records_in_their_order() {
    let [a, b] = [ImageSlot::A, ImageSlot::B].map(|slot| ImageId { slot, crc: 7 });
    let of = |records: &[(Event, ImageId)]| {
        let all = records.iter();
        all.fold(History::default(), |history, (event, image)| {
            history.after(*event, *image)
        })
    };
    let confirmed = of(&[(Event::Confirmed, a)]);
    assert_eq!(confirmed.confirmed, Some(a));
    let stored = of(&[(Event::Confirmed, a), (Event::Stored, b)]);
    assert_eq!(
        (stored.confirmed, stored.candidate, stored.tried),
        (Some(a), Some(b), false)
    );
    assert!(stored.after(Event::Tried, b).tried);
    assert!(
        !stored.after(Event::Tried, a).tried,
        "another image's trial"
    );
    let other = ImageId {
        slot: ImageSlot::B,
        crc: 8,
    };
    assert!(
        !stored.after(Event::Tried, other).tried,
        "an older image of this slot"
    );
    assert_eq!(
        stored.after(Event::Tried, b).after(Event::Confirmed, b),
        of(&[(Event::Confirmed, b)])
    );
    assert_eq!(
        stored.after(Event::Stored, a).confirmed,
        None,
        "it was overwritten"
    );
    assert!(!stored.after(Event::Tried, b).after(Event::Stored, b).tried);
}

/// Bits by the table of `image_state`, written here a second time.
#[test]
fn words_of_state_and_note() {
    let state = ImageState {
        running: Some(ImageSlot::B),
        free: Some(ImageSlot::A),
        reason: BootReason::RolledBack,
        is_confirmed: true,
    };
    assert_eq!(state.to_word(), 2 | 1 << 2 | 3 << 4 | 1 << 8);
    for number in 0..=u8::MAX {
        let Some(reason) = BootReason::of_number(number) else {
            assert!(number > 7);
            continue;
        };
        assert_eq!(reason as u8, number);
        assert!(reason.meaning().contains("image"));
        for slot in [None, Some(ImageSlot::A), Some(ImageSlot::B)] {
            let state = ImageState {
                running: slot,
                free: slot,
                reason,
                is_confirmed: false,
            };
            assert_eq!(ImageState::of_word(state.to_word()), state);
        }
        for slot in ImageSlot::BOTH {
            let note = BootNote { slot, reason };
            let [word, marked] = note.to_words();
            assert_eq!(BootNote::of_words([word, marked]), Some(note));
            for bit in 0..32 {
                assert_eq!(BootNote::of_words([word ^ 1 << bit, marked]), None);
                assert_eq!(BootNote::of_words([word, marked ^ 1 << bit]), None);
            }
        }
    }
    assert_eq!(BootNote::of_words([0, 0]), None);
    assert_eq!(
        BootNote::of_words([1 << 16 | 1, (1 << 16 | 1) ^ u32::from_le_bytes(*b"NOTE")]),
        None
    );
}
