//! Carries out requests that bring a firmware image to a stopped unit.
//!
//! Outcomes beyond those of [`service`](crate::service), which has their meanings:
//!
//! | outcome | is | detail |
//! |---|---|---|
//! | 0 | done | of `image_begin` and `image_store` the slot's number, of `image_data` the pieces received, of `image_state` the word of [`ImageState`](crate::store::image_state::ImageState) |
//! | 19 | an image without a boot selector runs: there are no slots | 0 |
//! | 20 | the bytes are no image | 0 |
//! | 21 | the layout of the image is not known | its version |
//! | 22 | the image is for another kind of unit | that kind |
//! | 23 | the image is not linked for the free slot | number of that slot, or the address that it is linked for |
//! | 24 | no image has this length | the length \[bytes\] |
//! | 25 | the image's vectors point outside RAM or code | the vector |
//! | 26 | the image's check sum does not match | the sum computed |
//! | 27 | the image is not whole | pieces received |
//! | 28 | the running image is on trial | 0 |

use embedded_storage::nor_flash::NorFlash;

use crate::store::image::{HEADER_BYTES, ImageError};
use crate::store::image_upload::{ImageUpload, ImageUploadError};
use crate::wire::service_frame::{Request, RequestKind};

/// The outcome where there are no slots of images.
pub const NO_IMAGE_SLOTS: u8 = 19;

/// The outcome of an image that is linked for another place.
pub const IMAGE_ADDRESS: u8 = 23;

/// The outcome of a request that an image on trial refuses.
pub const ON_TRIAL: u8 = 28;

/// True if a request is about firmware images.
pub fn is_about_images(request: &Request) -> bool {
    let kind = RequestKind::from_number(request.kind);
    kind.is_some_and(RequestKind::is_about_images)
}

/// Outcome and detail of an error.
fn outcome(error: ImageUploadError) -> (u8, u32) {
    match error {
        ImageUploadError::NotBegun => (2, 0),
        ImageUploadError::Image(error) => match error {
            ImageError::Magic => (20, 0),
            ImageError::Version(version) => (21, u32::from(version)),
            ImageError::Hardware(kind) => (22, kind),
            ImageError::Address(address) => (IMAGE_ADDRESS, address),
            ImageError::Length(bytes) => (24, bytes),
            ImageError::Vectors(vector) => (25, vector),
            ImageError::Checksum { computed, .. } => (26, computed),
            ImageError::Unreadable => (14, 0),
        },
        ImageUploadError::Slot(free) => (IMAGE_ADDRESS, free as u32),
        ImageUploadError::OnTrial => (ON_TRIAL, 0),
        ImageUploadError::Order(received) => (3, received),
        ImageUploadError::Unfinished(received) => (27, received),
        ImageUploadError::SupplyLow => (13, 0),
        ImageUploadError::Flash => (14, 0),
        ImageUploadError::Verify => (15, 0),
    }
}

/// Carries out a request about images; gives outcome and detail. `supply_suffices` is called before flash is erased or a
/// header is written.
pub fn carry_out<S: NorFlash, I: NorFlash>(
    upload: &mut ImageUpload<S, I>,
    request: &Request,
    supply_suffices: impl FnOnce() -> bool,
) -> (u8, u32) {
    let done = match RequestKind::from_number(request.kind) {
        Some(RequestKind::ImageBegin) => match request.bytes().first_chunk::<HEADER_BYTES>() {
            Some(header) => upload.begin(header, supply_suffices),
            None => Err(ImageUploadError::Image(ImageError::Magic)),
        },
        Some(RequestKind::ImageData) => {
            let piece = u32::from(request.word);
            upload.put(piece, request.bytes()).map(|()| piece + 1)
        }
        Some(RequestKind::ImageStore) => upload.store(supply_suffices),
        Some(RequestKind::ImageState) => Ok(upload.state().to_word()),
        _ => return (super::UNKNOWN, u32::from(request.kind)),
    };
    match done {
        Ok(detail) => (super::DONE, detail),
        Err(error) => outcome(error),
    }
}
