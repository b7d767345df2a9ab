//! Mapping of the columns of a foreign file.

use super::targets::Target;
use crate::recording::units::Unit;

/// A mapped column.
#[derive(Debug, Clone, PartialEq)]
pub struct Mapped {
    /// Index of its block.
    pub block: usize,
    /// Index in the block.
    pub column: usize,
    /// Quantity it becomes.
    pub target: Target,
    /// Axis of the quantity.
    pub axis: Option<String>,
    /// Its unit.
    pub unit: Unit,
    /// The unit as written.
    pub unit_text: String,
    /// True if the caller named it.
    pub is_given: bool,
    /// True if its unit stands nowhere: `unit` is that of SI until the data or the caller decide.
    pub is_open: bool,
}

/// Mapping of all columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Plan {
    /// Mapped columns.
    pub mapped: Vec<Mapped>,
    /// Columns left out: name and reason.
    pub left_out: Vec<(String, String)>,
    /// Columns left out that may be an attitude, an angle or a temperature: block and index.
    pub telling: Vec<(usize, usize)>,
    /// Quaternions `q1` to `q4`, whose scalar is the first or the last: block and index of the four.
    pub unordered: Vec<(usize, usize)>,
}
