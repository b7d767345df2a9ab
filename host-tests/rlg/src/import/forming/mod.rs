//! Forms a recording from mapped columns: clocks from stamps, attitudes, increments, tables, comments and the model.

pub mod resample;

pub mod stamps;

pub mod attitudes;

pub mod clocks;

pub mod sense;

pub mod assemble;

pub mod described;
