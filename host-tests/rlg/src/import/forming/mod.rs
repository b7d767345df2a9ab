//! Forms a recording from mapped columns: clocks from stamps, attitudes, increments, tables, comments and the model.

pub mod resample;

pub mod stamps;

pub mod attitude_channels;

pub mod attitudes;

pub mod clocks;

pub mod sense;

mod column_stems;

pub mod assemble;

pub mod described;

pub mod evidence;

pub mod repeats;

pub mod settle;

pub mod settle_angle;

pub mod settle_times;

pub mod settle_units;

mod unnamed;
