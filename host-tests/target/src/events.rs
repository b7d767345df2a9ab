//! Decodes the image's event log.
//!
//! The image sends only a number for each text; the texts are in its ELF file. Each event becomes one line: level,
//! sample number, words.

use std::path::Path;

use defmt_decoder::{DecodeError, Table};

use rlg_recording::error::InputError;

/// Decodes `events` with the texts in `elf`; `image` is named in errors.
pub fn decode(image: &Path, elf: &[u8], events: &[u8]) -> Result<Vec<String>, InputError> {
    let table = Table::parse(elf)
        .map_err(|error| {
            InputError::new(
                image,
                format!("has an event table of another version ({error})"),
            )
        })?
        .ok_or_else(|| InputError::new(image, "has no event table"))?;
    let mut decoder = table.new_stream_decoder();
    decoder.received(events);
    let mut lines = Vec::new();
    loop {
        match decoder.decode() {
            Ok(frame) => {
                let level = frame.level().map_or("", |level| level.as_str());
                let time = frame
                    .display_timestamp()
                    .map_or_else(String::new, |time| time.to_string());
                lines.push(format!("{level} [{time}] {}", frame.display_message()));
            }
            // The end, or an event that a crash cut off.
            Err(DecodeError::UnexpectedEof) => return Ok(lines),
            Err(DecodeError::Malformed) if table.encoding().can_recover() => {
                lines.push("(an event that cannot be decoded)".to_owned());
            }
            Err(DecodeError::Malformed) => {
                return Err(InputError::new(image, "sent events that cannot be decoded"));
            }
        }
    }
}
