//! The chain's parameters in flash: as a block of bytes, and as two slots of it.

pub mod parameter_block;

pub mod parameter_slots;

pub mod upload;
