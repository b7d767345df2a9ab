//! Parameters: as values, as a block of bytes, and as two slots of flash.

pub mod parameters;

pub mod parameter_block;

pub mod parameter_slots;
