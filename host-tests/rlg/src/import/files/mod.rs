//! Reads files with columns of numbers: one file a format.

pub mod beside;

pub mod split_stamps;

pub mod columns;

pub mod fill_values;

pub mod matrix;

mod text_lines;

pub mod text_table;

pub mod mat_file;

pub mod date_times;
pub mod hdf5_file;
