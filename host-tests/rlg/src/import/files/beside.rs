//! Puts files without stamps of their own beside files of the same number of rows.

use super::columns::{Block, Column};

/// Joins each block of another file that has no stamps to the first block of as many rows; `has_stamps` is true of a block
/// with some. Names that both have become `FILE:COLUMN`.
pub fn join(blocks: Vec<Block>, has_stamps: impl Fn(&Block) -> bool) -> Vec<Block> {
    let mut joined: Vec<Block> = Vec::new();
    for block in blocks {
        let is_stamped = has_stamps(&block);
        let beside = joined
            .iter_mut()
            .find(|other| other.rows == block.rows && other.file != block.file);
        match beside.filter(|other| !is_stamped || !has_stamps(other)) {
            Some(other) => put(other, block),
            None => joined.push(block),
        }
    }
    joined
}

/// Adds the columns of `block`.
fn put(into: &mut Block, block: Block) {
    let name = |block: &Block| {
        let name = block.file.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let (own, other) = (name(into), name(&block));
    into.notes.extend(block.notes);
    into.notes.push(format!(
        "{own} and {other} have {} rows each and one of them no stamps: their rows are put side by side",
        block.rows
    ));
    into.rate_hz = into.rate_hz.or(block.rate_hz);
    for column in block.columns {
        let is_there = into.columns.iter().any(|there| there.name == column.name);
        let name = match is_there {
            true => format!("{other}:{}", column.name),
            false => column.name.clone(),
        };
        into.columns.push(Column { name, ..column });
    }
}
