//! Effects that a model may lack, as hypotheses over design columns.
//!
//! [`signals`] holds the measured inputs and the motion derived from them; [`mod@column`] names the design columns and
//! [`sensed`] computes them;
//! [`expression`] holds effects outside the catalogue as products of channels ([`mod@vocabulary`] lists those tried), [`resonance`] second-order systems
//! ([`resonance_basis`] spans them by few responses),
//! [`lock_in`] dead bands; [`entries`] is the catalogue, one row per effect; [`candidates`] expands its rows into
//! priced hypotheses for the search, `members` those with nonlinear parameters, `turned` a reference rotated by more
//! than a small angle; [`families`] are effects with a nonlinear parameter (order, frequency, time constant), searched
//! on a grid; [`accelerometers`] lists the kinds of accelerometers; [`experiment`] predicts the information of rate-table experiments, composed of [`moves`], on hypotheses.

pub mod signals;

pub mod resonance;

pub mod expression;

pub mod vocabulary;

pub mod lock_in;

pub mod low_pass;

pub mod high_pass;

pub mod column;

pub mod sensed;

pub mod entry;

pub mod entries;

pub mod candidates;

pub mod accelerometers;

pub mod resonance_basis;

pub mod families;

mod members;

mod stiffness;

pub mod turned;

pub mod moves;

pub mod experiment;

pub use candidates::{Candidate, Pool};
pub use column::Column;
pub use entries::CATALOGUE;
pub use entry::Entry;
pub use expression::Expression;
pub use sensed::Sensed;
pub use signals::Signals;
