//! Writes recordings as files that other programs open: CSV, MATLAB, Parquet, MCAP; and as the frames of a counter bank.
//!
//! A recording becomes [`sheet::Sheet`]s, a table each: stamps and columns of f64 in SI, with names that hold the unit. The
//! writers do not depend on recordings. `rlg import` reads the files of all formats but MCAP back, value for value.

pub mod bank_file;

pub mod sheet;

pub mod mat_file;

pub mod mcap_file;
