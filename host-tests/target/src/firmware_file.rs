//! Makes the file of a firmware image from its ELF file: header, filling, code ([`trueaxis::image`]).
//!
//! The slot is the one that the image is linked for; kind of unit, version and revision stand in the image, under the name
//! `FIRMWARE_IDENTITY` (`src/hardware/board/images.rs`).
//!
//! An image that no selector starts gets its check sum within its ELF file, under the name `IMAGE_SEAL` ([`trueaxis::flash_check`]).

use std::fs;
use std::path::Path;

use object::read::elf::ProgramHeader;
use object::{Object, ObjectSymbol};
use rlg_recording::error::InputError;
use trueaxis::flash_check::Seal;
use trueaxis::image::{HARDWARE, ImageHeader, ImageSlot, LARGEST_CODE_BYTES, PIECE_BYTES};
use trueaxis::image_layout::{FLASH_BEGIN, IMAGE_HEADER_BYTES, PARAMETER_SLOTS_BEGIN};

/// Name of the words of kind of unit, version and revision.
const IDENTITY: &str = "FIRMWARE_IDENTITY";

/// Name of the words of the check sum.
const SEAL: &str = "IMAGE_SEAL";

/// Content of flash that nothing was linked to.
const ERASED: u8 = 0xFF;

/// Makes the file of the image in the ELF file `path`.
///
/// # Errors
/// It is no ELF file, is linked for no slot, or is for another kind of unit.
pub fn firmware_file(path: &Path) -> Result<(ImageHeader, Vec<u8>), InputError> {
    let elf = fs::read(path).map_err(|error| InputError::unreadable(path, &error))?;
    let expected = "an ELF file of `cargo slot-a` or `cargo slot-b` (docs/board.md)";
    let refused = |reason: &str| InputError::new(path, reason.to_owned()).expected(expected);
    let segments = segments(&elf).ok_or_else(|| refused("is not a firmware image"))?;
    let first = segments.iter().map(|(address, _)| *address).min();
    let slot = first.and_then(ImageSlot::of_vector_table);
    let Some((slot, begin)) = slot.zip(first) else {
        return Err(refused("is not linked for a slot behind the boot selector"));
    };
    let code = code(&segments, begin, LARGEST_CODE_BYTES, PIECE_BYTES);
    let code = code.ok_or_else(|| refused("is larger than a slot"))?;
    let identity = identity(&elf, begin, &code);
    let [hardware, version, revision] =
        identity.ok_or_else(|| refused("does not name its kind of unit"))?;
    if hardware != HARDWARE {
        return Err(refused("is for another kind of unit").value(format!("{hardware:#010x}")));
    }
    let header = ImageHeader::sealing(slot, version, revision, &code);
    let mut file = header.to_bytes().to_vec();
    file.resize(IMAGE_HEADER_BYTES as usize, ERASED);
    file.extend(code);
    Ok((header, file))
}

/// Returns the ELF file `path`, of an image that no selector starts, with its check sum.
///
/// # Errors
/// It is no ELF file, is linked for a slot, or has no place for a check sum.
pub fn sealed_elf(path: &Path) -> Result<(Seal, Vec<u8>), InputError> {
    let mut elf = fs::read(path).map_err(|error| InputError::unreadable(path, &error))?;
    let refused = |reason: &str| {
        InputError::new(path, reason.to_owned())
            .expected("an ELF file of `cargo board` (docs/board.md)")
    };
    let segments = segments(&elf).ok_or_else(|| refused("is not a firmware image"))?;
    let first = segments.iter().map(|(address, _)| *address).min();
    if first != Some(FLASH_BEGIN) {
        return Err(refused("is not linked for the beginning of flash"));
    }
    let image = code(
        &segments,
        FLASH_BEGIN,
        PARAMETER_SLOTS_BEGIN - FLASH_BEGIN,
        4,
    );
    let image = image.ok_or_else(|| refused("reaches into the parameter slots"))?;
    let place = place(&elf, SEAL).ok_or_else(|| refused("has no place for a check sum"))?;
    let seal = Seal::sealing(&image, (place.physical - FLASH_BEGIN) as usize);
    let words = seal.to_words().map(u32::to_le_bytes);
    let bytes = place.in_file..place.in_file + Seal::BYTES as usize;
    let there = elf.get_mut(bytes).ok_or_else(|| refused("is cut off"))?;
    there.copy_from_slice(words.as_flattened());
    Ok((seal, elf))
}

/// Physical address and content of every segment that is loaded.
fn segments(elf: &[u8]) -> Option<Vec<(u32, &[u8])>> {
    let object::File::Elf32(file) = object::File::parse(elf).ok()? else {
        return None;
    };
    let endian = file.endian();
    let headers = file.elf_program_headers().iter();
    headers
        .filter(|header| header.p_type(endian) == object::elf::PT_LOAD)
        .map(|header| Some((header.p_paddr(endian), header.data(endian, elf).ok()?)))
        .filter(|segment| segment.is_none_or(|(_, content)| !content.is_empty()))
        .collect()
}

/// Code from an address on, in whole pieces of so many bytes; `None` if it is larger than `room`.
fn code(segments: &[(u32, &[u8])], begin: u32, room: u32, piece: usize) -> Option<Vec<u8>> {
    let mut code = Vec::new();
    for (address, content) in segments {
        let at = usize::try_from(address.checked_sub(begin)?).ok()?;
        let end = at.checked_add(content.len())?;
        if end > room as usize {
            return None;
        }
        if code.len() < end {
            code.resize(end, ERASED);
        }
        code[at..end].copy_from_slice(content);
    }
    code.resize(code.len().next_multiple_of(piece), ERASED);
    Some(code)
}

/// Place of a variable's initial value.
struct Place {
    /// Address in flash.
    physical: u32,
    /// Offset in the file.
    in_file: usize,
}

/// The place of the variable of this name.
fn place(elf: &[u8], name: &str) -> Option<Place> {
    let object::File::Elf32(file) = object::File::parse(elf).ok()? else {
        return None;
    };
    let address = file.symbol_by_name(name)?.address() as u32;
    let endian = file.endian();
    let headers = file.elf_program_headers().iter();
    let holds = |header: &&object::elf::ProgramHeader32<object::Endianness>| {
        let virtual_begin = header.p_vaddr(endian);
        (virtual_begin..virtual_begin + header.p_filesz(endian)).contains(&address)
    };
    let header = headers
        .filter(|header| header.p_type(endian) == object::elf::PT_LOAD)
        .find(holds)?;
    let within = address - header.p_vaddr(endian);
    Some(Place {
        physical: header.p_paddr(endian).checked_add(within)?,
        in_file: (header.p_offset(endian).checked_add(within)?) as usize,
    })
}

/// The words of the identity. They are variables: their initial values stand in flash.
fn identity(elf: &[u8], begin: u32, code: &[u8]) -> Option<[u32; 3]> {
    let physical = place(elf, IDENTITY)?.physical;
    let at = usize::try_from(physical.checked_sub(begin)?).ok()?;
    let bytes = code.get(at..)?.first_chunk::<12>()?;
    let mut words = [0; 3];
    for (word, bytes) in words.iter_mut().zip(bytes.as_chunks().0) {
        *word = u32::from_le_bytes(*bytes);
    }
    Some(words)
}
