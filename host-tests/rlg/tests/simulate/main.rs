//! The simulator compared with formulas written here, not with itself.

mod basics;
mod beside;
mod command;
mod effects;
mod errors;
mod gyro_effects;
mod lock_in;
mod motion;
mod statistics;
mod support;
