//! Recordings with an attitude reference: nothing, one effect, or a fault of the reference.
//!
//! motions (`courses`) → the attitude, integrated exactly (`path`) → injected effects (`planted`, `low_pass`), scaled to a
//! matched-filter SNR (`strength`) → references with their noise (`reference`) and faults (`faults`) → trials (`trial`) →
//! recordings (`record`)

pub mod courses;
pub mod faults;
pub mod low_pass;
pub mod path;
pub mod planted;
pub mod record;
pub mod reference;
pub mod strength;
pub mod trial;
