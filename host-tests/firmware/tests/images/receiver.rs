//! Any requests about images, and any bytes: no panic, and the running image stays whole and in force.

use firmware_tests::image_unit::{Unit, image, requests};
use proptest::collection::vec;
use proptest::prelude::*;
use trueaxis::image::{HEADER_BYTES, ImageSlot};
use trueaxis::image_state::{BootReason, ImageState};
use trueaxis::image_upload::ImageUpload;
use trueaxis::service::images::carry_out;
use trueaxis::service_frame::{DATA_BYTES, Request, RequestReceiver};

const CODE: usize = 512;

/// Requests near those of a real upload: its own, in any order, some with a field changed, and any others.
fn any_request(own: Vec<Request>) -> impl Strategy<Value = Request> {
    let any_fields = (0..12_u8, any::<u16>(), 0..=40_u8, any::<[u8; DATA_BYTES]>());
    let foreign = any_fields.prop_map(|(kind, word, count, data)| Request {
        kind,
        word,
        count,
        data,
        ..Request::default()
    });
    let of_own = proptest::sample::select(own);
    let changed = (of_own.clone(), 0..DATA_BYTES, any::<u8>(), 0..4_u16);
    let changed = changed.prop_map(|(mut request, at, flip, word)| {
        request.data[at] ^= flip;
        request.word = request.word.wrapping_add(word).wrapping_sub(1);
        request
    });
    prop_oneof![4 => of_own, 2 => changed, 1 => foreign]
}

fn files() -> [Vec<u8>; 2] {
    [image(ImageSlot::A, CODE, 1), image(ImageSlot::B, CODE, 2)]
}

fn served() -> Unit {
    thread_local! {
        static SERVED: Unit = Unit::in_service(&files()[0], &[]);
    }
    SERVED.with(Unit::copy)
}

/// The running image is started, or the one that was sent, whole.
fn holds(unit: &Unit) -> Result<(), TestCaseError> {
    let [old, new] = files();
    unit.chip.borrow_mut().reboot();
    for _ in 0..2 {
        let choice = unit.boot();
        prop_assert!(choice.is_some());
        let choice = choice.expect("an image");
        let running = unit.running(&choice, &[&old, &new]);
        prop_assert_eq!(running == 1, choice.reason == BootReason::Trial);
    }
    prop_assert!(unit.chip.borrow().content[1].starts_with(&old));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4_000))]

    #[test]
    fn any_requests_leave_an_image_to_start(
        sent in vec(any_request(requests(&files()[1])), 1..60),
    ) {
        let unit = served();
        let mut upload = ImageUpload::new(unit.slots(), ImageSlot::A, BootReason::Confirmed);
        for request in &sent {
            let (outcome, detail) = carry_out(&mut upload, request, || true);
            if request.kind == 9 {
                prop_assert_eq!(outcome, 0);
                prop_assert_eq!(ImageState::of_word(detail).running, Some(ImageSlot::A));
            }
        }
        holds(&unit)?;
    }

    /// A whole upload with one byte of the line changed, left out or put in; the sender does not repeat.
    #[test]
    fn a_damaged_line_leaves_an_image_to_start(
        at in any::<prop::sample::Index>(), byte in any::<u8>(), how in 0..3_u8,
    ) {
        let unit = served();
        let mut line: Vec<u8> = requests(&files()[1]).iter().flat_map(Request::to_bytes).collect();
        let at = at.index(line.len());
        match how {
            0 => line[at] = byte,
            1 => { line.remove(at); }
            _ => line.insert(at, byte),
        }
        let mut upload = ImageUpload::new(unit.slots(), ImageSlot::A, BootReason::Confirmed);
        let mut receiver = RequestReceiver::new();
        for request in line.into_iter().filter_map(|byte| receiver.push(byte)) {
            let _ = carry_out(&mut upload, &request, || true);
        }
        holds(&unit)?;
    }

    /// A header of any bytes behind the magic word is refused or has a slot, a length and an address that fit.
    #[test]
    fn any_header_is_refused_or_fits(fields in any::<[u8; HEADER_BYTES]>(), keep in 0..HEADER_BYTES) {
        use trueaxis::image::{ImageHeader, LARGEST_CODE_BYTES};
        let mut bytes = fields;
        bytes[..keep].copy_from_slice(&files()[1][..keep]);
        if let Ok(header) = ImageHeader::of_bytes(&bytes) {
            prop_assert!(header.length.is_multiple_of(32) && header.length > 0);
            prop_assert!(header.length <= LARGEST_CODE_BYTES);
            prop_assert_eq!(header.to_bytes(), bytes);
        }
    }
}
