//! Passes of linearisation and structure search, with step control, until the set converges.

pub(crate) mod linearisation;

pub mod structure;

pub(crate) mod step_control;

pub mod passes;
