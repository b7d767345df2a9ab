//! `trueaxis`: the chain that keeps each ring-laser gyro's sensing axis true.
//!
//! The name says what the code does: a dithered block lags its case under angular acceleration, the
//! sensing axis tilts by δ = −K α, and the chain turns the tilted reading back to the true body axis.
#![no_std]
