//! Candidates of a pass: families of columns by score tests, windows, lines, events.

pub mod scores;

pub mod lock_in;

pub(crate) mod filters;

pub(crate) mod resonances;

pub(crate) mod windows;

pub mod families;

pub(crate) mod events;
