//! Residual and rows of a recording: channels corrected, effects of the model applied, rows to fit and rows to test.

pub mod data_words;

pub mod entries_of_rows;

pub(crate) mod channel_words;

pub mod channel_correction;

pub mod preprocessed_parts;

pub mod model_effects;

pub mod pulse_resolution;

pub mod data;

pub mod noise_levels;
