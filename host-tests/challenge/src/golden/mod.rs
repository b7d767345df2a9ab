//! The golden table: what the diagnosis says of fixed recordings, one row each, to be compared after a change.
//!
//! One direction: `estimate` (a value and its σ as text) → `row` (one diagnosis as cells) → `quality` (how many are right) →
//! `table` (rows and a header
//! as text) → `compare` (two tables, field by field) → `make` (rows from trials and from recordings).
//!
//! A change that only moves code keeps every row. A change of method shows which rows differ, and in which fields.

mod compare;
mod estimate;
mod make;
mod quality;
mod row;
mod table;

pub use compare::{Comparison, FieldDifference, RowDifference, compare};
pub use make::{recording_row, trial_rows};
pub use quality::Quality;
pub use row::{COLUMNS, Row, diagnosis_sha256, trial_name};
pub use table::{Header, Table};
