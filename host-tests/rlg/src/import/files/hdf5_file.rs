//! Reads HDF5 files, MATLAB's version 7.3 among them: every numeric dataset, `group.dataset` within groups.
//!
//! MATLAB stores a matrix with its sides reversed, so that its columns are contiguous; other writers store rows, the
//! transpose. The longer side is time either way.

use std::path::Path;

use hdf5_pure::{AttrValue, File, Group};

use super::columns::Block;
use super::matrix::{Matrix, to_blocks};
use crate::error::InputError;

/// The first bytes of the format.
const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// MATLAB puts its own header of 512 bytes before the format.
const MATLAB_HEADER_BYTES: usize = 512;

/// Greatest depth of nested groups.
const DEEPEST: usize = 6;

/// True if `bytes` are HDF5.
pub fn is_hdf5(bytes: &[u8]) -> bool {
    [0, MATLAB_HEADER_BYTES].iter().any(|start| {
        bytes
            .get(*start..)
            .is_some_and(|rest| rest.starts_with(SIGNATURE))
    })
}

/// Reads the columns of the HDF5 file `bytes`, which is `file`.
pub fn read(file: &Path, bytes: Vec<u8>) -> Result<Vec<Block>, InputError> {
    let damaged = |error: hdf5_pure::Error| {
        InputError::new(file, format!("is truncated or damaged ({error})"))
            .expected("a whole HDF5 file")
    };
    let opened = File::from_bytes(bytes).map_err(damaged)?;
    let mut matrices = Vec::new();
    add(&opened.root(), "", 0, &mut matrices).map_err(damaged)?;
    Ok(to_blocks(file, matrices))
}

fn add(
    group: &Group,
    prefix: &str,
    depth: usize,
    into: &mut Vec<Matrix>,
) -> Result<(), hdf5_pure::Error> {
    let mut names = group.datasets()?;
    names.sort();
    for name in names {
        let dataset = group.dataset(&name)?;
        let class = dataset.attrs()?.remove("MATLAB_class");
        let is_text = matches!(&class, Some(AttrValue::String(class) | AttrValue::AsciiString(class))
            if class.trim_end_matches('\0') == "char");
        // Text, references and records are no columns.
        let (false, Ok(values)) = (is_text, dataset.read_f64()) else {
            continue;
        };
        let mut sides: Vec<usize> = dataset.shape()?.iter().map(|side| *side as usize).collect();
        sides.reverse();
        into.push(Matrix {
            name: format!("{prefix}{name}"),
            sides,
            values,
        });
    }
    let mut groups = group.groups()?;
    groups.sort();
    for name in groups {
        // MATLAB keeps the cells of cell arrays in `#refs#`.
        if depth < DEEPEST && !name.starts_with('#') {
            add(
                &group.group(&name)?,
                &format!("{prefix}{name}."),
                depth + 1,
                into,
            )?;
        }
    }
    Ok(())
}
