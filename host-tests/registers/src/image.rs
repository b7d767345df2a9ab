//! Builds the board's images as `cargo board` does, and reads segments and symbols from the ELF file.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;

use object::{Object, ObjectSegment, ObjectSymbol};
use trueaxis::flash_check::Seal;
use trueaxis::image::{ImageHeader, ImageSlot, PIECE_BYTES};
use trueaxis::image_layout::IMAGE_HEADER_BYTES;

/// Beginning of flash (RM0090 2.3).
pub const FLASH_BEGIN: u32 = 0x0800_0000;

/// Size of the part of flash that an image may fill, in front of the parameter slots (memory.x) \[bytes\].
pub const FLASH_BYTES: u32 = 768 * 1024;

/// The two number systems, each an image.
pub const CORES: [&str; 2] = ["firmware", "firmware-fixed"];

/// A return from a function.
const RETURN: [u8; 2] = 0x4770_u16.to_le_bytes();

/// An image of the board.
#[derive(Debug, Clone)]
pub struct Image {
    /// Name of the binary.
    pub name: String,
    /// Content of flash, from [`FLASH_BEGIN`] on.
    pub flash: Vec<u8>,
    /// True if a boot selector starts it: it may write records and images.
    pub is_behind_selector: bool,
    symbols: Vec<(String, u32, u32)>,
    /// The instruction that is not in its place.
    ram_test: [u8; 2],
}

impl Image {
    /// Builds and reads the image `name` with these cargo features besides `board`.
    ///
    /// # Panics
    /// It does not build: then there is nothing to test.
    pub fn build(name: &str, features: &[&str]) -> Self {
        Self::build_by("board", name, features)
    }

    /// Builds the image `name` for a slot, `slot-a` or `slot-b`, or the boot selector, each by its alias.
    ///
    /// # Panics
    /// It does not build.
    pub fn build_alias(alias: &str, name: &str) -> Self {
        Self::build_by(alias, name, &[])
    }

    fn build_by(alias: &str, name: &str, features: &[&str]) -> Self {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let workspace = package.ancestors().nth(2).expect("two folders above");
        // A folder of its own: other features have the same file name.
        let folder = ["registers-image", &features.join("-")].concat();
        let target = workspace.join("target");
        // The other aliases have a folder of their own.
        let is_board = alias == "board";
        let target = target.join(if is_board { &folder } else { alias });
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut command = Command::new(cargo);
        if is_board {
            command.args(["board", "--target-dir"]).arg(&target);
        } else {
            command.arg(alias);
        }
        let status = command
            .current_dir(workspace)
            .arg("--quiet")
            .args(features.iter().flat_map(|feature| ["--features", feature]))
            .status();
        assert!(
            status.as_ref().is_ok_and(|status| status.success()),
            "`cargo {alias}` with features {features:?} failed: {status:?}"
        );
        let mut path: PathBuf = target.join("thumbv7em-none-eabihf").join("release");
        path.push(name);
        Self::read(name, &path)
    }

    /// Reads the image `name` from its ELF file.
    ///
    /// # Panics
    /// It is none.
    pub fn read(name: &str, path: &Path) -> Self {
        let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let elf = object::File::parse(&*bytes).expect("cargo makes ELF files");
        let mut flash = vec![0xFF; FLASH_BYTES as usize];
        for segment in elf.segments() {
            let (data, begin) = (
                segment.data().expect("within the file"),
                load_address(&elf, &segment),
            );
            let Some(at) = begin.checked_sub(FLASH_BEGIN) else {
                continue;
            };
            let place = flash
                .get_mut(at as usize..)
                .and_then(|rest| rest.get_mut(..data.len()));
            if let Some(place) = place {
                place.copy_from_slice(data);
            }
        }
        let symbols = elf.symbols().filter_map(|symbol| {
            let name = symbol.name().ok()?.to_owned();
            Some((name, symbol.address() as u32, symbol.size() as u32))
        });
        let mut image = Self {
            name: name.to_owned(),
            flash,
            is_behind_selector: false,
            symbols: symbols.collect(),
            ram_test: RETURN,
        };
        image.exchange_ram_test();
        image
    }

    /// This image with its test of RAM, which returns at once in others: it is 70 ms of each power-on.
    pub fn with_ram_test(&self) -> Self {
        let mut whole = self.clone();
        whole.exchange_ram_test();
        whole
    }

    /// Exchanges the first instruction of the test of RAM.
    fn exchange_ram_test(&mut self) {
        let at = (self.symbol(&["__pre_init"]) - FLASH_BEGIN) as usize;
        self.flash[at..at + 2].swap_with_slice(&mut self.ram_test);
    }

    /// This image, linked for a slot, as the file that is sent to a unit: header, filling, code.
    ///
    /// # Panics
    /// The image is linked elsewhere.
    pub fn sealed(&self, slot: ImageSlot) -> Vec<u8> {
        let at = (slot.vector_table() - FLASH_BEGIN) as usize;
        let begin = self.flash.iter().position(|byte| *byte != 0xFF);
        assert_eq!(begin, Some(at), "{} is not linked for {slot:?}", self.name);
        let last = self.flash.iter().rposition(|byte| *byte != 0xFF);
        let end = last.map_or(at, |last| {
            at + (last + 1 - at).next_multiple_of(PIECE_BYTES)
        });
        seal(slot, &self.flash[at..end])
    }

    /// A board with this image as its selector, and files in the slots. Symbols are those of `named`.
    pub fn with_images(&self, named: &Self, files: &[(ImageSlot, &[u8])]) -> Self {
        let mut joined = self.clone();
        joined.is_behind_selector = true;
        joined.symbols = named.symbols.clone();
        for (slot, file) in files {
            let begin = slot.vector_table() - IMAGE_HEADER_BYTES - FLASH_BEGIN;
            joined.flash[begin as usize..begin as usize + file.len()].copy_from_slice(file);
        }
        joined
    }

    /// The address of the symbol whose name contains every one of `parts`.
    ///
    /// # Panics
    /// No symbol, or more than one.
    pub fn symbol(&self, parts: &[&str]) -> u32 {
        self.range(parts).start
    }

    /// The addresses of the symbol whose name contains every one of `parts`.
    ///
    /// # Panics
    /// No symbol, or more than one.
    pub fn range(&self, parts: &[&str]) -> Range<u32> {
        let mut found: Vec<_> = self
            .symbols
            .iter()
            .filter(|(name, ..)| parts.iter().all(|part| name.contains(part)))
            .map(|(_, address, size)| (address & !1, *size))
            .collect();
        found.sort_unstable();
        found.dedup();
        match found[..] {
            [(address, size)] => address..address + size,
            _ => panic!("{} symbols of {} contain {parts:?}", found.len(), self.name),
        }
    }

    /// This image, which no selector starts, with its check sum.
    ///
    /// # Panics
    /// It has no place for one.
    pub fn with_seal(&self) -> Self {
        let at = (self.symbol(&["IMAGE_SEAL"]) - FLASH_BEGIN) as usize;
        let end = self.end();
        let seal = Seal::sealing(&self.flash[..end], at);
        let words = seal.to_words().map(u32::to_le_bytes);
        let mut sealed = self.clone();
        sealed.flash[at..at + Seal::BYTES as usize].copy_from_slice(words.as_flattened());
        sealed
    }

    /// Bytes of an image from the beginning of flash.
    pub fn end(&self) -> usize {
        let last = self.flash.iter().rposition(|byte| *byte != 0xFF);
        last.map_or(0, |last| last + 1)
    }

    /// A word of the vector table: 0 is the initial stack pointer, then the exceptions by their number (PM0214 2.3.4).
    pub fn vector(&self, number: u32) -> u32 {
        let at = 4 * number as usize;
        let word = self.flash.get(at..at + 4).expect("within the table");
        u32::from_le_bytes([word[0], word[1], word[2], word[3]])
    }
}

/// The file of an image with this code.
pub fn seal(slot: ImageSlot, code: &[u8]) -> Vec<u8> {
    let header = ImageHeader::sealing(slot, 0x0001_0000, 0, code);
    let mut file = header.to_bytes().to_vec();
    file.resize(IMAGE_HEADER_BYTES as usize, 0xFF);
    file.extend(code);
    file
}

/// Physical address of a segment's content, which for initial values of variables is in flash.
fn load_address(elf: &object::File<'_>, segment: &object::Segment<'_, '_>) -> u32 {
    use object::read::elf::ProgramHeader;
    let object::File::Elf32(file) = elf else {
        panic!("an image of a 32-bit processor");
    };
    let endian = file.endian();
    let (offset, _) = segment.file_range();
    let of_segment = |header: &&object::elf::ProgramHeader32<object::Endianness>| {
        header.p_type(endian) == object::elf::PT_LOAD
            && u64::from(header.p_offset(endian)) == offset
            && u64::from(header.p_vaddr(endian)) == segment.address()
    };
    let header = file.elf_program_headers().iter().find(of_segment);
    header.expect("every segment has a header").p_paddr(endian)
}
