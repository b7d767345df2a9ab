//! The stages, in the order of the data flow.

pub mod limits;

pub mod counts;

pub mod dither;

pub mod adaptation;

pub mod installation;

pub mod compensation;

pub mod flexure;

pub mod coning;

pub mod velocity;

pub mod sculling;

pub mod size_effect;

pub mod turning;

pub mod gap;

pub mod frame;
