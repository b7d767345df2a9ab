//! `rlg firmware`: makes the file that `rlg upload --firmware` sends from the images of both slots.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use trueaxis::image::ImageHeader;

use crate::error::InputError;
use crate::output::write_file;
use crate::terminal::Terminal;
use rlg_target::firmware_file::{firmware_file, sealed_elf};

/// Make a firmware file from the images of one slot or of both
///
/// Each image gets its header: slot, kind of unit, version, revision, length and CRC-32. A file with both can be sent to any
/// unit with a boot selector; a file with one may also be flashed by a probe, at the beginning of its slot.
///
/// With --seal: the ELF file of an image that no selector starts, with its check sum, which the built-in test compares.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  cargo slot-a && cargo slot-b\n  rlg firmware target/slot-[ab]/thumbv7em-none-eabihf/release/firmware --out firmware.rlgi\n  rlg firmware --seal target/thumbv7em-none-eabihf/release/firmware --out firmware"
)]
pub struct Firmware {
    /// ELF files of `cargo slot-a` and `cargo slot-b`
    #[arg(required_unless_present = "seal", conflicts_with = "seal", num_args = 1..=2)]
    images: Vec<PathBuf>,
    /// ELF file of `cargo board`
    #[arg(long, value_name = "ELF")]
    seal: Option<PathBuf>,
    /// File to write
    #[arg(short, long)]
    out: PathBuf,
}

impl Firmware {
    /// Seals the images and writes them behind each other.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        if let Some(path) = &self.seal {
            return self.seal(path, terminal);
        }
        let mut file = Vec::new();
        let mut headers: Vec<ImageHeader> = Vec::new();
        for path in &self.images {
            let (header, bytes) = firmware_file(path)?;
            if headers.iter().any(|other| other.slot == header.slot) {
                return Err(
                    InputError::new(path, "is linked for the slot of the other file")
                        .value(format!("{:?}", header.slot))
                        .expected("one image for each slot"),
                );
            }
            terminal.say(format!(
                "slot {:?}: {} bytes of code, version {}, revision {}",
                header.slot,
                header.length,
                version(header.version),
                revision(header.revision)
            ));
            headers.push(header);
            file.extend(bytes);
        }
        write_file(&self.out, &file)?;
        let images = headers.iter().map(|header| {
            json!({
                "slot": format!("{:?}", header.slot),
                "bytes": header.length,
                "version": version(header.version),
                "revision": revision(header.revision),
                "crc": format!("{:08x}", header.crc),
            })
        });
        terminal.result(&json!({ "images": images.collect::<Vec<_>>() }))
    }
}

impl Firmware {
    /// Writes the ELF file with its check sum.
    fn seal(&self, path: &Path, terminal: &Terminal) -> Result<(), InputError> {
        let (seal, elf) = sealed_elf(path)?;
        write_file(&self.out, &elf)?;
        terminal.say(format!(
            "{}: {} bytes of flash, CRC-32 {:08x}",
            self.out.display(),
            seal.bytes,
            seal.crc
        ));
        terminal.result(&json!({ "bytes": seal.bytes, "crc": format!("{:08x}", seal.crc) }))
    }
}

/// Version and number system of health item 34.
pub fn version(word: u32) -> String {
    let [major, minor, patch, core] = word.to_be_bytes();
    let core = if core == 0 { "f32" } else { "fixed" };
    format!("{major}.{minor}.{patch} {core}")
}

/// Revision of health item 50.
pub fn revision(word: u32) -> String {
    let changed = if word & 1 == 0 { "" } else { " with changes" };
    format!("{:07x}{changed}", word >> 4)
}
