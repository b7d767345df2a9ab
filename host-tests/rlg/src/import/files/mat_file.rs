//! Reads MATLAB's MAT-files of versions 5 to 7: numeric variables and the fields of scalar structures.
//!
//! Source: "MAT-File Format", The MathWorks (R2020a), chapter 1, "Level 5 MAT-File Format". Sizes from the file are bounded
//! by the bytes present. Cells, text, sparse and complex arrays are skipped.

use std::io::Read as _;
use std::path::Path;

use flate2::read::ZlibDecoder;

use super::columns::Block;
use super::matrix::{Matrix, to_blocks};
use crate::error::InputError;

/// Bytes before the first element.
const HEADER_BYTES: usize = 128;

/// Greatest depth of nested structures; deeper ones hold no logged columns.
const DEEPEST: usize = 6;

/// Element types of the format.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;

/// Array class of a structure.
const STRUCTURE: u8 = 2;

/// Classes of dense numeric arrays, from double to 64-bit integers.
const NUMERIC: std::ops::RangeInclusive<u8> = 6..=15;

/// Bit of the array flags for complex values.
const COMPLEX: u8 = 0x08;

/// Bytes in the order of the machine that wrote them.
#[derive(Clone, Copy)]
struct Bytes<'a> {
    bytes: &'a [u8],
    big_endian: bool,
}

/// One element: its type and its bytes.
struct Element<'a> {
    kind: u32,
    data: Bytes<'a>,
}

/// Reads the columns of the MAT-file `bytes`, which is `file`.
pub fn read(file: &Path, bytes: &[u8]) -> Result<Vec<Block>, InputError> {
    let damaged = || {
        InputError::new(file, "is truncated or damaged")
            .expected("a whole MAT-file of version 5, 7 or 7.3")
    };
    let big_endian = match bytes.get(126..HEADER_BYTES) {
        Some(b"IM") => false,
        Some(b"MI") => true,
        _ => {
            return Err(
                InputError::new(file, "is no MAT-file of version 5, 7 or 7.3")
                    .expected("a file that MATLAB's save wrote, not with -v4 or -ascii"),
            );
        }
    };
    let mut rest = Bytes {
        bytes: &bytes[HEADER_BYTES..],
        big_endian,
    };
    let mut matrices = Vec::new();
    while !rest.bytes.is_empty() {
        let element = rest.element().ok_or_else(damaged)?;
        match element.kind {
            COMPRESSED => {
                let inflated = inflate(element.data).ok_or_else(damaged)?;
                let mut inside = Bytes {
                    bytes: &inflated,
                    big_endian,
                };
                let element = inside.element().ok_or_else(damaged)?;
                if element.kind == MATRIX {
                    array(element.data, "", 0, &mut matrices).ok_or_else(damaged)?;
                }
            }
            MATRIX => array(element.data, "", 0, &mut matrices).ok_or_else(damaged)?,
            _ => {}
        }
    }
    Ok(to_blocks(file, matrices))
}

/// Inflates a compressed element: the tag inside holds the number of its bytes.
fn inflate(packed: Bytes<'_>) -> Option<Vec<u8>> {
    let mut decoder = ZlibDecoder::new(packed.bytes);
    let mut inflated = vec![0; 8];
    decoder.read_exact(&mut inflated).ok()?;
    let tag = Bytes {
        bytes: &inflated,
        ..packed
    };
    let size = u64::from(tag.word(4)?);
    decoder.take(size).read_to_end(&mut inflated).ok()?;
    (inflated.len() as u64 == size + 8).then_some(inflated)
}

/// Adds the matrices of an array named `prefix` and its own name; `None` if its bytes are inconsistent.
fn array(mut rest: Bytes<'_>, prefix: &str, depth: usize, into: &mut Vec<Matrix>) -> Option<()> {
    if rest.bytes.is_empty() {
        return Some(());
    }
    let flags = rest.element()?.data;
    // Class in the lowest byte of the first word, flags in the next.
    let word = flags.word(0)?;
    let (class, bits) = (word as u8, (word >> 8) as u8);
    let sides = rest.element()?.data.words()?;
    let own = rest.element()?.data.text();
    let name = match (prefix, own.as_str()) {
        ("", own) => own.to_owned(),
        (prefix, "") => prefix.to_owned(),
        (prefix, own) => format!("{prefix}.{own}"),
    };
    let sides: Vec<usize> = sides.into_iter().map(|side| side as usize).collect();
    let count = sides
        .iter()
        .try_fold(1_usize, |all, side| all.checked_mul(*side))?;
    if class == STRUCTURE && count == 1 && depth < DEEPEST {
        return structure(rest, &name, depth, into);
    }
    if NUMERIC.contains(&class) && bits & COMPLEX == 0 {
        let real = rest.element()?;
        let values = real.data.numbers(real.kind)?;
        if values.len() != count {
            return None;
        }
        into.push(Matrix {
            name,
            sides,
            values,
        });
    }
    Some(())
}

/// Adds the matrices of every field of a structure.
fn structure(mut rest: Bytes<'_>, name: &str, depth: usize, into: &mut Vec<Matrix>) -> Option<()> {
    let length = rest.element()?.data.word(0)? as usize;
    let names = rest.element()?.data;
    if length == 0 {
        return None;
    }
    for field in names.bytes.chunks(length) {
        let field = Bytes {
            bytes: field,
            ..names
        };
        let element = rest.element()?;
        if element.kind == MATRIX {
            let name = format!("{name}.{}", field.text());
            array(element.data, &name, depth + 1, into)?;
        }
    }
    Some(())
}

impl<'a> Bytes<'a> {
    /// Returns the four bytes from `place` on as a number.
    fn word(self, place: usize) -> Option<u32> {
        let bytes: [u8; 4] = self.bytes.get(place..place + 4)?.try_into().ok()?;
        Some(match self.big_endian {
            true => u32::from_be_bytes(bytes),
            false => u32::from_le_bytes(bytes),
        })
    }

    fn words(self) -> Option<Vec<u32>> {
        (0..self.bytes.len() / 4)
            .map(|k| self.word(4 * k))
            .collect()
    }

    /// Returns the text up to the first zero.
    fn text(self) -> String {
        let end = self.bytes.iter().position(|byte| *byte == 0);
        String::from_utf8_lossy(&self.bytes[..end.unwrap_or(self.bytes.len())]).into_owned()
    }

    /// Takes the next element off the front.
    fn element(&mut self) -> Option<Element<'a>> {
        let first = self.word(0)?;
        // Up to four bytes are stored in the tag itself, with their number in its upper half.
        let (kind, start, size, whole): (u32, usize, usize, usize) = match first >> 16 {
            0 => {
                let size = self.word(4)? as usize;
                let padding = match first {
                    COMPRESSED => 0,
                    _ => size.next_multiple_of(8) - size,
                };
                (first, 8, size, size.checked_add(8 + padding)?)
            }
            size => (first & 0xFFFF, 4, size as usize, 8),
        };
        let data = self.bytes.get(start..start.checked_add(size)?)?;
        self.bytes = &self.bytes[whole.min(self.bytes.len())..];
        Some(Element {
            kind,
            data: Bytes {
                bytes: data,
                ..*self
            },
        })
    }

    /// Returns the numbers of the element type `kind`; `None` if it is not numeric.
    fn numbers(self, kind: u32) -> Option<Vec<f64>> {
        macro_rules! numbers {
            ($type:ty) => {{
                let chunks = self.bytes.chunks_exact(size_of::<$type>());
                let number = |chunk: &[u8]| {
                    let bytes = chunk.try_into().unwrap_or_default();
                    match self.big_endian {
                        true => <$type>::from_be_bytes(bytes) as f64,
                        false => <$type>::from_le_bytes(bytes) as f64,
                    }
                };
                chunks.map(number).collect()
            }};
        }
        Some(match kind {
            1 => numbers!(i8),
            2 => numbers!(u8),
            3 => numbers!(i16),
            4 => numbers!(u16),
            5 => numbers!(i32),
            6 => numbers!(u32),
            7 => numbers!(f32),
            9 => numbers!(f64),
            12 => numbers!(i64),
            13 => numbers!(u64),
            _ => return None,
        })
    }
}
