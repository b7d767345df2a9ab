//! Effects that a model may lack, as hypotheses over design columns.
//!
//! [`signals`] holds the measured inputs and the motion derived from them; [`mod@column`] makes one design column of them;
//! [`expression`] writes physics outside the catalogue as products of channels, [`resonance`] second-order systems, [`lock_in`] dead bands;
//! [`entries`] is the catalogue, one row an effect; [`candidates`] spells its rows out for the search, with the price of
//! each, `members` those with a number inside, `turned` a reference turned by more than a small angle; [`families`] are effects with a number inside
//! (order, frequency, time constant) that is gone through in a grid; [`experiment`] is what a rate table could do next, in
//! [`moves`], and what that would say of hypotheses.

pub mod signals;

pub mod resonance;

pub mod expression;

pub mod lock_in;

pub mod low_pass;

pub mod high_pass;

pub mod column;

pub mod entries;

pub mod candidates;

pub mod families;

mod members;

mod stiffness;

pub mod turned;

pub mod moves;

pub mod experiment;

pub use candidates::{Candidate, Pool};
pub use column::{Column, Sensed};
pub use entries::{CATALOGUE, Entry};
pub use expression::Expression;
pub use signals::Signals;
