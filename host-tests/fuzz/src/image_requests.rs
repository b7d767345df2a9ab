//! Brings any requests about firmware images to a stopped unit with small flash: any bytes as a line, and any requests in
//! whole frames.
//!
//! Checks: no panic; the running image's bytes stay as they are; the selector starts it, or an image whose CRC-32 it
//! has computed.
#![no_main]

use std::cell::RefCell;
use std::rc::Rc;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use libfuzzer_sys::fuzz_target;
use trueaxis::image::{ImageHeader, ImageSlot};
use trueaxis::image_journal::Event;
use trueaxis::image_layout::{IMAGE_HEADER_BYTES, IMAGE_SLOT_BYTES, NOTE_BEGIN};
use trueaxis::image_slots::ImageSlots;
use trueaxis::image_state::BootReason;
use trueaxis::image_upload::ImageUpload;
use trueaxis::service::images::carry_out;
use trueaxis::service_frame::{DATA_BYTES, Request, RequestReceiver};

/// Bytes of a sector of records: small, so that pages fill up.
const PAGE: usize = 1024;

/// Flash of one region, with sectors of `SECTOR` bytes.
#[derive(Clone)]
struct Memory<const SECTOR: usize>(Rc<RefCell<Vec<u8>>>);

impl<const SECTOR: usize> Memory<SECTOR> {
    fn erased(bytes: usize) -> Self {
        Self(Rc::new(RefCell::new(vec![0xFF; bytes])))
    }
}

impl<const SECTOR: usize> ErrorType for Memory<SECTOR> {
    type Error = NorFlashErrorKind;
}

impl<const SECTOR: usize> ReadNorFlash for Memory<SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        let content = self.0.borrow();
        bytes.copy_from_slice(&content[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.borrow().len()
    }
}

impl<const SECTOR: usize> NorFlash for Memory<SECTOR> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        self.0.borrow_mut()[from as usize..to as usize].fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        let mut content = self.0.borrow_mut();
        for (place, byte) in content[offset as usize..].iter_mut().zip(bytes) {
            *place &= byte;
        }
        Ok(())
    }
}

/// The header and code of an image of four pieces.
fn image(slot: ImageSlot) -> (ImageHeader, Vec<u8>) {
    let mut code = vec![0x5A; 4 * DATA_BYTES];
    code[..4].copy_from_slice(&NOTE_BEGIN.to_le_bytes());
    code[4..8].copy_from_slice(&(slot.vector_table() + 9).to_le_bytes());
    (ImageHeader::sealing(slot, 1, 2, &code), code)
}

fuzz_target!(|data: &[u8]| {
    let Some((mode, data)) = data.split_first() else {
        return;
    };
    let records = Memory::<PAGE>::erased(2 * PAGE);
    let images = Memory::<{ 128 * 1024 }>::erased(2 * IMAGE_SLOT_BYTES as usize);
    let (header, code) = image(ImageSlot::A);
    images.0.borrow_mut()[..32].copy_from_slice(&header.to_bytes());
    let at = IMAGE_HEADER_BYTES as usize;
    images.0.borrow_mut()[at..at + code.len()].copy_from_slice(&code);
    let slots = || ImageSlots::new(records.clone(), images.clone());
    let mut first = slots();
    let started = first.select(|| true).expect("a good image");
    assert_eq!(started.reason, BootReason::Unconfirmed);
    let own = first.own_id(ImageSlot::A).expect("a header");
    first
        .journal
        .append(Event::Confirmed, own)
        .expect("there is room");
    let before = images.0.borrow()[..IMAGE_SLOT_BYTES as usize].to_vec();

    let mut upload = ImageUpload::new(slots(), ImageSlot::A, BootReason::Confirmed);
    if mode % 2 == 0 {
        let mut receiver = RequestReceiver::new();
        for request in data.iter().filter_map(|byte| receiver.push(*byte)) {
            let _ = carry_out(&mut upload, &request, || true);
        }
    } else {
        for fields in data.chunks(36) {
            let number = |at: usize| fields.get(at).copied().unwrap_or(0);
            let mut request = Request {
                kind: 6 + number(0) % 4,
                word: u16::from(number(1) % 8),
                count: number(2),
                ..Request::default()
            };
            let (good, code) = image(ImageSlot::B);
            // Of a real upload, and then changed at one place.
            let bytes = match request.kind {
                6 => good.to_bytes().to_vec(),
                _ => code
                    .chunks(DATA_BYTES)
                    .nth(request.word.into())
                    .unwrap_or(&[])
                    .to_vec(),
            };
            for (place, byte) in request.data.iter_mut().zip(&bytes) {
                *place = *byte;
            }
            if number(2) % 4 != 0 {
                request.count = DATA_BYTES as u8;
            }
            request.data[usize::from(number(3)) % DATA_BYTES] ^= number(4);
            let _ = carry_out(&mut upload, &request, || true);
        }
    }
    assert!(before == images.0.borrow()[..IMAGE_SLOT_BYTES as usize]);
    let choice = slots().select(|| true).expect("an image to start");
    if choice.header.slot == ImageSlot::B {
        assert_eq!(choice.reason, BootReason::Trial);
        let again = slots().select(|| true).expect("an image to start");
        assert_eq!(
            (again.header.slot, again.reason),
            (ImageSlot::A, BootReason::RolledBack)
        );
    }
});
