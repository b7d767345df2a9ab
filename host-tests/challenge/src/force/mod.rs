//! Recordings of a turned unit with accelerometers beside gyros and a reference of rate: nothing, or one effect of the
//! accelerometers, the gyros or the reference.
//!
//! what is planted (`planted`) → gravity in the body (`felt`) → what the accelerometers make of it (`effects`) → trials
//! (`trial`) → recordings (`record`)

pub mod effects;
pub mod felt;
pub mod planted;
pub mod record;
pub mod trial;
