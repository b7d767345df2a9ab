//! Recordings of a rotated unit with accelerometers, gyros and a reference of rate: nothing, or one effect of the
//! accelerometers, the gyros or the reference.
//!
//! injected effects (`planted`) → gravity in the body (`felt`) → accelerometer errors (`effects`) → trials (`trial`) →
//! recordings (`record`)

pub mod effects;
pub mod felt;
pub mod planted;
pub mod record;
pub mod trial;
