//! Recordings of accelerometers in still positions without a reference: nothing, or accelerometer errors, in an undeclared
//! bench noise.
//!
//! injected effects (`planted`) → positions and their disturbances (`trial`) → recordings (`record`)

pub mod planted;
pub mod record;
pub mod trial;
