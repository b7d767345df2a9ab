//! Writes MATLAB's MAT-files of version 5, a structure a table: MATLAB, Octave and SciPy open them without a toolbox;
//! version 7.3 opens in MATLAB only.
//!
//! Source: "MAT-File Format", The MathWorks (R2020a), chapter 1, "Level 5 MAT-File Format". Nothing is compressed. Written
//! here because the crate for it, matrw 0.1, would be a second reader in addition to `import/files/mat_file.rs`.

use std::path::Path;

use super::sheet::Sheet;
use crate::error::InputError;

/// Element types of the format.
const INT8: u32 = 1;
const INT32: u32 = 5;
const UINT32: u32 = 6;
const DOUBLE: u32 = 9;
const MATRIX: u32 = 14;

/// Array classes.
const STRUCTURE: u8 = 2;
const DOUBLES: u8 = 6;

/// Bytes of a field's name, including the closing zero.
const NAME_BYTES: usize = 64;

/// Text of the file's header, displayed by MATLAB; without a date, so that the same recording gives the same bytes.
const TEXT: &str = concat!(
    "MATLAB 5.0 MAT-file, written by rlg ",
    env!("CARGO_PKG_VERSION")
);

/// Encodes `sheets` as the file at `path`.
///
/// # Errors
/// A table is beyond the 2 GiB that a variable of this version can have.
pub fn bytes(path: &Path, sheets: &[Sheet]) -> Result<Vec<u8>, InputError> {
    let mut file = format!("{TEXT:124}").into_bytes();
    file.extend([0, 1, b'I', b'M']);
    for sheet in sheets {
        let too_long = || {
            InputError::new(path, "cannot hold a table of this length")
                .channel(&sheet.name)
                .value(format!(
                    "{} rows of {} columns",
                    sheet.rows(),
                    sheet.columns.len()
                ))
                .expected("2 GiB at most in a MAT-file of version 5; --format parquet has no bound")
        };
        let count = sheet.columns.len();
        if (sheet.rows() * 8 + NAME_BYTES * 4).saturating_mul(count) > i32::MAX as usize {
            return Err(too_long());
        }
        file.extend(element(MATRIX, &structure(sheet)));
    }
    Ok(file)
}

fn structure(sheet: &Sheet) -> Vec<u8> {
    let mut names = Vec::with_capacity(sheet.columns.len() * NAME_BYTES);
    for (name, _) in &sheet.columns {
        names.extend(name.as_bytes().iter().take(NAME_BYTES - 1));
        names.resize(names.len().next_multiple_of(NAME_BYTES), 0);
    }
    let mut bytes = head(STRUCTURE, [1, 1], &sheet.name);
    // The length of names is in the small form: number and type share a word.
    bytes.extend((4 << 16 | INT32).to_le_bytes());
    bytes.extend((NAME_BYTES as u32).to_le_bytes());
    bytes.extend(element(INT8, &names));
    for (_, values) in &sheet.columns {
        let data: Vec<u8> = values
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        let field = [
            head(DOUBLES, [values.len() as u32, 1], ""),
            element(DOUBLE, &data),
        ];
        bytes.extend(element(MATRIX, &field.concat()));
    }
    bytes
}

/// Encodes class, sides and name of an array.
fn head(class: u8, sides: [u32; 2], name: &str) -> Vec<u8> {
    let flags = element(UINT32, &[class, 0, 0, 0, 0, 0, 0, 0]);
    let sides = sides.map(u32::to_le_bytes).concat();
    [
        flags,
        element(INT32, &sides),
        element(INT8, name.as_bytes()),
    ]
    .concat()
}

/// Encodes an element: type, number of bytes, the bytes, zeros to the next eight.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(data.len() + 16);
    bytes.extend(kind.to_le_bytes());
    bytes.extend((data.len() as u32).to_le_bytes());
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}
