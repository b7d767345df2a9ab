//! Moves columns filled in every second, third, ... row only to rows of their own: an encoder logged with gyros of twice its
//! rate.

use super::mapped::{Mapped, Plan};
use super::time_names;
use crate::import::files::columns::{Block, Column};

/// Smallest share of equal steps from one filled row to the next: any other empty row is a missing value.
const ALIKE: f64 = 0.9;

/// Smallest number of filled rows for which a regularity is detected.
const FEWEST: usize = 10;

/// Moves such columns of `plan` into blocks of their own, with the stamps of their rows.
///
/// In a block without stamps, those of the stated rate take their place; without either nothing is moved.
pub fn separate(blocks: &mut Vec<Block>, plan: &mut Plan, rate_hz: Option<f64>) {
    let mut made: Vec<(usize, usize, Vec<usize>)> = Vec::new();
    for mapped in plan
        .mapped
        .iter_mut()
        .filter(|mapped| !mapped.target.is_gyro())
    {
        let column = &blocks[mapped.block].columns[mapped.column];
        let Some(filled) = filled_rows(&column.values) else {
            continue;
        };
        let from = mapped.block;
        let known = made
            .iter()
            .find(|(block, _, rows)| *block == from && *rows == filled);
        let to = match known {
            Some((_, to, _)) => *to,
            None => {
                let Some(stamps) = stamps(&blocks[from], rate_hz, &filled) else {
                    continue;
                };
                blocks.push(Block {
                    file: blocks[from].file.clone(),
                    rows: filled.len(),
                    columns: stamps,
                    rate_hz: None,
                    notes: Vec::new(),
                });
                made.push((from, blocks.len() - 1, filled.clone()));
                blocks.len() - 1
            }
        };
        let column = thinned(&blocks[from].columns[mapped.column], &filled);
        blocks[to].columns.push(column);
        *mapped = Mapped {
            block: to,
            column: blocks[to].columns.len() - 1,
            ..mapped.clone()
        };
    }
}

/// Returns the rows with a value, if they are every second, third, ... one.
fn filled_rows(values: &[f64]) -> Option<Vec<usize>> {
    let rows = (0..values.len()).filter(|row| !values[*row].is_nan());
    let filled: Vec<usize> = rows.collect();
    let mut steps: Vec<usize> = filled.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable();
    let usual = *steps.get(steps.len() / 2)?;
    let alike = steps.iter().filter(|step| **step == usual).count();
    let is_regular = filled.len() >= FEWEST && alike as f64 >= ALIKE * steps.len() as f64;
    (usual > 1 && is_regular).then_some(filled)
}

/// Returns the columns of times of a block at these rows.
fn stamps(block: &Block, rate_hz: Option<f64>, rows: &[usize]) -> Option<Vec<Column>> {
    let is_time =
        |column: &&Column| column.dates.is_some() || time_names::time_in(block, column).is_some();
    let times = block.columns.iter().filter(is_time);
    let times: Vec<Column> = times.map(|column| thinned(column, rows)).collect();
    if !times.is_empty() {
        return Some(times);
    }
    let rate_hz = rate_hz.or(block.rate_hz)?;
    let ends_s = rows.iter().map(|row| (row + 1) as f64 / rate_hz);
    Some(vec![Column::new("t (s)", ends_s.collect())])
}

fn thinned(column: &Column, rows: &[usize]) -> Column {
    Column {
        values: rows.iter().map(|row| column.values[*row]).collect(),
        ..column.clone()
    }
}
