//! Recordings of accelerometers in still positions without a reference: nothing, or errors of the accelerometers, in the noise that a
//! bench has and nobody declares.
//!
//! what is planted (`planted`) → positions and what disturbs them (`trial`) → recordings (`record`)

pub mod planted;
pub mod record;
pub mod trial;
