//! Foreign streams into recordings: one file a format.
//!
//! Enters: the bytes of a file. Leaves: a [`Recording`](crate::recording::Recording) in memory and what was
//! met on the way. A new format is a file here and a variant of `command::import`.

pub mod frames;
