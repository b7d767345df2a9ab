//! Finds the source lines that an address of the image came from, inlining included.
//!
//! From the image's debug information it gives for an address the [`Place`]s that it belongs to, the innermost inlined
//! function first, the function that has a symbol last.

use addr2line::gimli::{Dwarf, EndianSlice, LittleEndian, SectionId};
use object::{Object, ObjectSection};

/// A function in a source file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// Its name, without its path and the types that it is for.
    pub function: String,
    /// The source file of the instruction; empty where unknown.
    pub file: String,
}

/// The image's debug information is missing or damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NoLines;

impl std::fmt::Display for NoLines {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("has no debug information")
    }
}

impl std::error::Error for NoLines {}

/// The debug information of an image.
pub struct Lines<'a>(addr2line::Context<EndianSlice<'a, LittleEndian>>);

impl<'a> Lines<'a> {
    /// Reads the debug information of the image in `elf`.
    pub fn of(elf: &'a [u8]) -> Result<Self, NoLines> {
        let file = object::File::parse(elf).map_err(|_| NoLines)?;
        let load = |id: SectionId| -> Result<_, addr2line::gimli::Error> {
            let data = file
                .section_by_name(id.name())
                .and_then(|section| section.data().ok())
                .unwrap_or_default();
            Ok(EndianSlice::new(data, LittleEndian))
        };
        let dwarf = Dwarf::load(load).map_err(|_| NoLines)?;
        let context = addr2line::Context::from_dwarf(dwarf).map_err(|_| NoLines)?;
        Ok(Self(context))
    }

    /// Source places of the instruction at `address`.
    pub fn places(&self, address: u64) -> Vec<Place> {
        let mut places = Vec::new();
        let Ok(mut frames) = self.0.find_frames(address).skip_all_loads() else {
            return places;
        };
        while let Ok(Some(frame)) = frames.next() {
            let name = frame
                .function
                .as_ref()
                .and_then(|name| name.demangle().ok());
            let file = frame.location.and_then(|location| location.file);
            places.push(Place {
                function: name.map_or_else(String::new, |name| plain(&name).to_owned()),
                file: file.unwrap_or_default().to_owned(),
            });
        }
        places
    }
}

/// The plain name of a function: `close` of `close<trueaxis::numbers::float::F32>`.
fn plain(name: &str) -> &str {
    name.split_once('<').map_or(name, |(before, _)| before)
}

#[cfg(test)]
mod tests {
    use super::plain;

    #[test]
    fn a_name_is_plain_without_its_types() {
        assert_eq!(plain("close<trueaxis::numbers::float::F32>"), "close");
        assert_eq!(plain("exchange"), "exchange");
    }
}
