//! The command `rlg`, its demonstration and the paper's experiments, on top of the packages of the host half:
//!
//! recording → replay or prediction → residual → locate → hypothesise → fit → select → validate → report

pub use rlg_calibration as calibrate;
pub use rlg_challenge as challenge;
pub use rlg_flow as diagnose;
pub use rlg_model as model;
pub use rlg_parameters as parameters;
pub use rlg_recording as recording;
pub use rlg_recording::{error, output, toml_file};
pub use rlg_reference as reference;
pub use rlg_replay as replay;
pub use rlg_replay::navigate;
pub use rlg_report as report;
pub use rlg_simulator as simulate;
pub use rlg_target as target;

pub mod import;

pub mod export;

pub mod health_check;

pub mod limits_file;

pub mod plan_file;

pub mod plausibility;

pub mod fleet;

pub mod terminal;

mod json;

pub mod unit_port;

pub mod command;

pub mod close_loop;
pub mod demo;

pub mod paper;
