//! Effects that a model may lack, as hypotheses over design columns.
//!
//! [`signals`] holds the measured inputs and the motion derived from them; [`mod@column`] makes one design column of them;
//! [`entries`] is the catalogue, one row an effect; [`candidates`] spells its rows out for the search, with the price of
//! each.

pub mod signals;

pub mod column;

pub mod entries;

pub mod candidates;

pub use candidates::{Candidate, Pool};
pub use column::Column;
pub use entries::{CATALOGUE, Entry};
pub use signals::Signals;
