//! Golden table: results of the diagnosis on fixed recordings, one row each, for comparison after a change.
//!
//! Data flow: `estimate` (a value and its σ as text) → `row` (one diagnosis as cells) → `quality` (counts of correct rows)
//! → `table` (rows and a header as text) → `compare` (two tables, field by field) → `make` (rows from trials and from
//! recordings).
//!
//! A change that only moves code keeps every row. For a change of method the differing rows and fields are listed.

mod compare;
mod estimate;
mod make;
mod quality;
mod row;
mod table;

pub use compare::{Comparison, FieldDifference, RowDifference, compare};
pub use make::{guard_rows, recording_row, trial_rows};
pub use quality::Quality;
pub use row::{COLUMNS, Row, diagnosis_sha256, trial_name};
pub use table::{Header, Table};
