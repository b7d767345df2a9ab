//! Drops rows that repeat the stamp of the row before.

use super::clocks::{Said, stamps_in};
use crate::import::files::columns::Block;
use crate::import::mapping::mapped::Plan;

/// Largest share of rows with a repeated stamp and other values: more are stamps too coarse for their rows.
const MOST: f64 = 0.2;

/// Drops repeated rows of each block whose columns have one column of stamps; returns notes with their counts.
pub fn drop_all(blocks: &mut [Block], plan: &Plan, said: &Said) -> Vec<String> {
    let mut notes = Vec::new();
    for b in 0..blocks.len() {
        let of_block = plan.mapped.iter().filter(|mapped| mapped.block == b);
        let mut stamps: Vec<Option<usize>> = of_block
            .map(|mapped| stamps_in(blocks, mapped, said).map(|(column, _)| column))
            .collect();
        stamps.dedup();
        if let [Some(column)] = stamps[..] {
            notes.extend(drop(&mut blocks[b], column));
        }
    }
    notes
}

fn drop(block: &mut Block, stamps: usize) -> Option<String> {
    let values = &block.columns[stamps].values;
    let repeats: Vec<usize> = (1..block.rows)
        .filter(|row| values[*row] == values[row - 1])
        .collect();
    let same = |a: f64, b: f64| a == b || (a.is_nan() && b.is_nan());
    let is_whole = |row: &&usize| {
        let mut columns = block.columns.iter();
        columns.all(|column| same(column.values[**row], column.values[**row - 1]))
    };
    let whole = repeats.iter().filter(is_whole).count();
    let other = repeats.len() - whole;
    if repeats.is_empty() || other as f64 > MOST * block.rows as f64 {
        return None;
    }
    let mut kept = vec![true; block.rows];
    repeats.iter().for_each(|row| kept[*row] = false);
    for column in &mut block.columns {
        let mut kept = kept.iter();
        column
            .values
            .retain(|_| kept.next().copied().unwrap_or(true));
    }
    block.rows -= repeats.len();
    let file = block.file.file_name().unwrap_or_default().to_string_lossy();
    let name = &block.columns[stamps].name;
    let with = match other {
        0 => "in every column".to_owned(),
        other => format!("{other} of them with other values, of which the first are kept"),
    };
    Some(format!(
        "{file}: {} rows that repeat the stamp of the row before ({name}) are dropped: {with}; the first is row {}",
        repeats.len(),
        repeats[0]
    ))
}
