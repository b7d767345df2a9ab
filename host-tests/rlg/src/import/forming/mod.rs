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

mod settle_orders;

pub mod settle_times;

mod settle_unknown;

pub mod settle_units;

mod unnamed;
