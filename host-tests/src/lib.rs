//! The host half of the project: recordings in, truth out.
//!
//! recording → replay or prediction → residual → locate → hypothesise → fit → select → validate → report

pub mod error;

pub mod output;

mod toml_file;

pub mod recording;

pub mod import;

pub mod model;

pub mod simulate;

pub mod reference;

pub mod replay;

pub mod navigate;

pub mod target;

pub mod terminal;

pub mod command;

pub mod diagnose;

pub mod calibrate;

pub mod challenge;

pub mod report;

pub mod demo;

pub mod paper;
