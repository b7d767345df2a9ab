//! The content of flash: the chain's parameters as a block of bytes and as two slots of it, and firmware images with the
//! records by which one is chosen at boot.

pub mod parameter_block;

pub mod parameter_slots;

pub mod upload;

pub mod image_layout;

pub mod image;

pub mod image_state;

pub mod image_journal;

pub mod image_slots;

pub mod image_upload;

pub mod flash_check;
