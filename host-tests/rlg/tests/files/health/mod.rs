//! Health of a unit from end to end: limits and identity from `rlg params` to the firmware, slow channels from the bank's
//! bytes or a scenario to `rlg inspect`.

mod bank;
mod bench;
mod limits;
mod parameters;
mod scenario;
mod seen;
mod simulated;
mod upload;
