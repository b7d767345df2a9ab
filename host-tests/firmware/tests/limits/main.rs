//! The numbers that the documentation of design parameters, configuration, status and health states, to the last digit:
//! a limit that moves by one step of a float fails here by its name.

mod configuration;
mod design;
mod status;
mod unit;
