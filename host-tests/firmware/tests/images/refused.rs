//! Images that are damaged, foreign or incomplete: refused at the upload, and at the start.

use firmware_tests::image_unit::{Unit, image, requests, sealed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use trueaxis::image::{ImageSlot, PIECE_BYTES};
use trueaxis::image_layout::IMAGE_HEADER_BYTES;
use trueaxis::image_state::BootReason;
use trueaxis::service::DONE;
use trueaxis::service::images::{IMAGE_ADDRESS, ON_TRIAL};

const TRIES: usize = 100;
const CODE: usize = 4_096;
const HEADER: usize = IMAGE_HEADER_BYTES as usize;

fn crc32(bytes: &[u8]) -> u32 {
    // Bit by bit, as IEEE 802.3 has it: a second implementation.
    !bytes.iter().fold(!0, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            crc >> 1 ^ if crc & 1 == 1 { 0xEDB8_8320 } else { 0 }
        })
    })
}

/// Seals a file anew: its check sum is that of the damaged bytes, so that the damage itself must be found.
fn sealed_anew(mut file: Vec<u8>) -> Vec<u8> {
    let covered = [&file[..28], &file[32..]].concat();
    file[28..32].copy_from_slice(&crc32(&covered).to_le_bytes());
    file
}

fn single_bit(file: &mut [u8], random: &mut ChaCha8Rng) {
    let at = random.random_range(0..file.len());
    file[at] ^= 1 << random.random_range(0..8);
}

/// Up to 32 bits in a row, of which the first and the last are flipped.
fn short_burst(file: &mut [u8], random: &mut ChaCha8Rng) {
    let bits = random.random_range(2..=32);
    let begin = random.random_range(0..8 * file.len() - bits);
    for bit in 0..bits {
        if bit == 0 || bit == bits - 1 || random.random() {
            file[(begin + bit) / 8] ^= 1 << ((begin + bit) % 8);
        }
    }
}

/// Up to 512 bytes of other content.
fn long_burst(file: &mut [u8], random: &mut ChaCha8Rng) {
    let bytes = random.random_range(1..=512);
    let begin = random.random_range(0..file.len() - bytes);
    let other = random.random_range(1..=255_u8);
    for byte in &mut file[begin..begin + bytes] {
        *byte ^= other;
    }
}

type Damage = fn(&mut [u8], &mut ChaCha8Rng);

const DAMAGES: [(&str, Damage); 3] = [
    ("single bit", single_bit),
    ("burst up to 32 bits", short_burst),
    ("burst up to 512 bytes", long_burst),
];

/// The unit before the update runs on: its bytes, its history and its start.
fn is_untouched(unit: &Unit, old: &[u8]) {
    let choice = unit.boot().expect("the old image");
    assert_eq!(unit.running(&choice, &[old]), 0);
    assert_eq!(choice.reason, BootReason::Confirmed);
    assert_eq!(unit.slots().history().expect("readable").candidate, None);
}

/// Damage on the way: the sender's file is not the one that was sealed. The filling is not sent and stays as it is.
#[test]
fn damaged_images_are_refused_by_the_upload() {
    let old = image(ImageSlot::A, CODE, 1);
    let served = Unit::in_service(&old, &[]);
    for (name, damage) in DAMAGES {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let mut refused = 0;
        for seed in 0..TRIES {
            let file = image(ImageSlot::B, CODE, seed as u64);
            let mut sent = [&file[..32], &file[HEADER..]].concat();
            damage(&mut sent, &mut random);
            let filled = [&sent[..32], &[0xFF; HEADER - 32], &sent[32..]].concat();
            let unit = served.copy();
            let outcomes = unit.send(ImageSlot::A, &requests(&filled));
            refused += usize::from(outcomes.last().expect("an answer").0 != DONE);
            is_untouched(&unit, &old);
        }
        println!("upload, {name}: {refused} of {TRIES} refused");
        assert_eq!(refused, TRIES);
    }
}

/// Damage in flash, after the upload or a year later: the selector starts the other image.
#[test]
fn damaged_images_are_refused_at_the_start() {
    let old = image(ImageSlot::A, CODE, 1);
    let served = Unit::in_service(&old, &[]);
    for (name, damage) in DAMAGES {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut refused = [0; 2];
        for seed in 0..TRIES {
            let file = image(ImageSlot::B, CODE, seed as u64);
            let unit = served.copy();
            let outcomes = unit.send(ImageSlot::A, &requests(&file));
            assert!(outcomes.iter().all(|(outcome, _)| *outcome == DONE));
            let confirmed = unit.copy();
            let mut damaged = file.clone();
            damage(&mut damaged, &mut random);
            unit.flash(ImageSlot::B, &damaged);
            let choice = unit.boot().expect("the old image");
            assert_eq!(unit.running(&choice, &[&old]), 0);
            refused[0] += usize::from(choice.reason == BootReason::Refused);
            // The same to an image that was confirmed long ago.
            assert_eq!(confirmed.boot().expect("the new").reason, BootReason::Trial);
            assert!(confirmed.confirm(ImageSlot::B));
            confirmed.flash(ImageSlot::B, &damaged);
            let choice = confirmed.boot().expect("the old image");
            assert_eq!(confirmed.running(&choice, &[&old]), 0);
            refused[1] += usize::from(choice.reason == BootReason::Fallback);
        }
        println!(
            "start, {name}: {refused:?} of {TRIES} refused before and after their confirmation"
        );
        assert_eq!(refused, [TRIES; 2]);
    }
}

/// Foreign images whose check sums are right.
#[test]
fn foreign_images_are_refused_by_name_at_upload_and_start() {
    let old = image(ImageSlot::A, CODE, 1);
    let served = Unit::in_service(&old, &[]);
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut other_word = move |right: u32| loop {
        let word: u32 = random.random();
        if word != right {
            break word;
        }
    };
    let mut with = |file: Vec<u8>, at: usize| {
        let mut file = file;
        let right = u32::from_le_bytes([file[at], file[at + 1], file[at + 2], file[at + 3]]);
        file[at..at + 4].copy_from_slice(&other_word(right).to_le_bytes());
        sealed_anew(file)
    };
    let good = |seed: usize| image(ImageSlot::B, CODE, seed as u64);
    for (name, outcome) in [
        ("magic", 20),
        ("kind of unit", 22),
        ("linked elsewhere", IMAGE_ADDRESS),
        ("linked for the slot in use", IMAGE_ADDRESS),
        ("length", 24),
        ("stack pointer", 25),
        ("first instruction", 25),
    ] {
        let mut refused = [0; 2];
        for seed in 0..TRIES {
            let file = match name {
                "magic" => with(good(seed), 0),
                "kind of unit" => with(good(seed), 8),
                "linked elsewhere" => with(good(seed), 12),
                "linked for the slot in use" => image(ImageSlot::A, CODE, seed as u64),
                "length" => {
                    // None, no whole pieces, larger than a slot.
                    let turn = seed as u32 / 3;
                    let length = [0, 32 * turn + 1 + turn % 31, 261_664 + 32 * turn][seed % 3];
                    let mut file = good(seed);
                    file[16..20].copy_from_slice(&length.to_le_bytes());
                    sealed_anew(file)
                }
                "stack pointer" => with(good(seed), HEADER),
                _ => with(good(seed), HEADER + 4),
            };
            let unit = served.copy();
            let outcomes = unit.send(ImageSlot::A, &requests(&file));
            let last = outcomes.last().expect("an answer").0;
            assert_eq!(last, outcome, "{name}");
            refused[0] += usize::from(last != DONE);
            is_untouched(&unit, &old);
            // The same by a probe, and records as after an upload.
            let unit = served.copy();
            unit.send(ImageSlot::A, &requests(&good(seed)));
            unit.flash(ImageSlot::B, &file);
            let choice = unit.boot().expect("the old image");
            assert_eq!(unit.running(&choice, &[&old]), 0);
            refused[1] += usize::from(choice.reason == BootReason::Refused);
        }
        println!("{name}: {refused:?} of {TRIES} refused at upload and start");
        assert_eq!(refused, [TRIES; 2], "{name}");
    }
}

/// A file that ends early, a piece left out, a piece sent twice with other bytes.
#[test]
fn incomplete_images_are_refused() {
    let old = image(ImageSlot::A, CODE, 1);
    let served = Unit::in_service(&old, &[]);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let pieces = CODE / PIECE_BYTES;
    let mut refused = [0; 3];
    for seed in 0..TRIES {
        let whole = requests(&image(ImageSlot::B, CODE, seed as u64));
        let end = random.random_range(1..=pieces);
        let mut truncated = whole[..end].to_vec();
        truncated.push(whole[whole.len() - 1]);
        let mut left_out = whole.clone();
        left_out.remove(1 + random.random_range(0..pieces - 1));
        let mut other = whole.clone();
        let at = 1 + random.random_range(0..pieces);
        let mut again = other[at];
        again.data[random.random_range(0..PIECE_BYTES)] ^= 1;
        other.insert(at + 1, again);
        for (count, (requests, outcome)) in
            refused
                .iter_mut()
                .zip([(truncated, 27), (left_out, 3), (other, 3)])
        {
            let unit = served.copy();
            let outcomes = unit.send(ImageSlot::A, &requests);
            *count += usize::from(outcomes.last().expect("an answer").0 == outcome);
            is_untouched(&unit, &old);
        }
    }
    println!(
        "truncated, a piece left out, a piece with other bytes: {refused:?} of {TRIES} refused"
    );
    assert_eq!(refused, [TRIES; 3]);
}

/// A lost answer is a request that comes again.
#[test]
fn requests_that_come_again_change_nothing() {
    let old = image(ImageSlot::A, CODE, 1);
    let new = image(ImageSlot::B, CODE, 2);
    let unit = Unit::in_service(&old, &[]);
    let once = unit.copy();
    once.send(ImageSlot::A, &requests(&new));
    let twice: Vec<_> = requests(&new)
        .into_iter()
        .flat_map(|request| [request, request])
        .collect();
    let outcomes = unit.send(ImageSlot::A, &twice);
    assert!(outcomes.len() == twice.len() && outcomes.iter().all(|(outcome, _)| *outcome == DONE));
    assert!(once.chip.borrow().content == unit.chip.borrow().content);
}

#[test]
fn no_flash_is_touched_with_a_low_supply_or_where_the_only_confirmed_image_is() {
    let old = image(ImageSlot::A, CODE, 1);
    let new = image(ImageSlot::B, CODE, 2);
    let mut unit = Unit::in_service(&old, &[]).copy();
    unit.supply_suffices = false;
    let outcomes = unit.send(ImageSlot::A, &requests(&new));
    assert_eq!(
        (outcomes, unit.chip.borrow().operations),
        (vec![(13, 0)], 0)
    );
    // An image on trial that is stopped all the same may not overwrite the one to go back to.
    unit.supply_suffices = true;
    unit.send(ImageSlot::A, &requests(&new));
    assert_eq!(unit.boot().expect("the new").reason, BootReason::Trial);
    let before = unit.chip.borrow().content.clone();
    let outcomes = unit.send(ImageSlot::B, &requests(&image(ImageSlot::A, CODE, 9)));
    assert_eq!(outcomes, [(ON_TRIAL, 0)]);
    assert!(before == unit.chip.borrow().content);
}

/// Bytes by the table of `image`, written here a second time.
#[test]
fn the_header_is_the_documented_one() {
    let file = sealed(ImageSlot::B, &[0; 64]);
    assert_eq!(&file[..8], b"RLGI\x01\x00\x02\x00");
    assert_eq!(
        &file[8..20],
        [
            *b"F405",
            0x0806_0200_u32.to_le_bytes(),
            64_u32.to_le_bytes()
        ]
        .as_flattened()
    );
    assert_eq!(
        file[28..32],
        crc32(&[&file[..28], &file[32..]].concat()).to_le_bytes()
    );
}
