//! Decides what each column of a foreign file is: by the caller's word, its name, or a known form of file.

pub mod targets;

pub mod column_names;

pub mod known_forms;

pub mod map_options;

pub mod column_map;

pub mod own_rows;
