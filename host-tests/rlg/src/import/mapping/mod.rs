//! Maps each column of a foreign file to a quantity: as stated by the caller, by its name, or by a known form of file.

pub mod targets;

pub mod mapped;

pub mod column_names;

pub mod name_table;

pub mod one_attitude;

pub mod questions;

pub mod known_forms;

pub mod time_names;

pub mod map_options;

pub mod column_map;

pub mod own_rows;
