//! The stages, in the order of the data flow.

pub mod counts;

pub mod dither;

pub mod rate_correction;

pub mod acceleration;

pub mod installation;

pub mod compensation;

pub mod coning;

pub mod frame;
