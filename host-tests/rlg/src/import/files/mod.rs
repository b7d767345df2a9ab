//! Reads files with columns of numbers: one file a format, and the units that people write beside them.

pub mod units;

pub mod columns;

pub mod matrix;

pub mod text_table;

pub mod mat_file;

pub mod hdf5_file;
