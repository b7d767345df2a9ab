//! Recordings of units at rest on the Earth: nothing, one effect, lines, or noise that the model does not declare.
//!
//! injected effects (`planted`, `lines`) → trials (`trial`) → recordings (`record`)

pub mod lines;
pub mod planted;
pub mod record;
pub mod trial;
