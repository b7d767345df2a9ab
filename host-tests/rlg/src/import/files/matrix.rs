//! Splits matrix variables into columns: the longer side is time.

use super::columns::{Block, Column, blocks};
use std::path::Path;

/// Largest number of columns of a matrix: a full 3 × 3 and a few more. Images and the like are left out.
const MOST_COLUMNS: usize = 16;

/// Names under which files state the rows per second.
const RATE_NAMES: [&str; 10] = [
    "sampling_rate",
    "samplingrate",
    "sample_rate",
    "samplerate",
    "fs",
    "rate",
    "rate_hz",
    "freq",
    "frequency",
    "sampling_frequency",
];

/// A numeric variable, column by column as MATLAB stores it.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    /// Its name; of a field `variable.field`.
    pub name: String,
    /// Its sides.
    pub sides: Vec<usize>,
    /// The values, the first index running fastest.
    pub values: Vec<f64>,
}

/// Returns the columns of all matrices, and the rate stated by a scalar among them.
pub fn to_blocks(file: &Path, matrices: Vec<Matrix>) -> Vec<Block> {
    let mut rate_hz = None;
    let mut columns = Vec::new();
    for matrix in matrices {
        if let [value] = matrix.values[..] {
            let last = matrix.name.rsplit('.').next().unwrap_or_default();
            if RATE_NAMES.contains(&last.to_lowercase().as_str()) && value > 0.0 {
                rate_hz = Some(value);
            }
            continue;
        }
        columns.extend(matrix.columns());
    }
    blocks(file, columns, rate_hz)
}

impl Matrix {
    /// Returns a vector as one column, a matrix as `name[0]`, `name[1]`, ...; nothing if more than two sides exceed 1.
    fn columns(self) -> Vec<Column> {
        let sides: Vec<usize> = self
            .sides
            .iter()
            .copied()
            .filter(|side| *side != 1)
            .collect();
        match sides[..] {
            [rows] if rows == self.values.len() => vec![Column::new(self.name, self.values)],
            [first, second] if first * second == self.values.len() => {
                let (rows, count) = (first.max(second), first.min(second));
                if count > MOST_COLUMNS {
                    return Vec::new();
                }
                // If time runs along the second side, neighbours in a column are `count` apart.
                let (step, stride) = if first == rows { (rows, 1) } else { (1, count) };
                (0..count)
                    .map(|column| {
                        let values = (0..rows).map(|row| self.values[column * step + row * stride]);
                        Column::new(format!("{}[{column}]", self.name), values.collect())
                    })
                    .collect()
            }
            _ => Vec::new(),
        }
    }
}
