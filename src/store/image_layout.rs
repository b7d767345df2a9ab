//! Divides flash and RAM of the STM32F405 between the boot selector, its records, two firmware images and the parameter slots.
//!
//! Sectors are those of RM0090 table 5: 0 to 3 of 16 KiB, 4 of 64 KiB, 5 to 11 of 128 KiB.
//!
//! | sectors | address | bytes | hold |
//! |---|---|---|---|
//! | 0 | 0x0800 0000 | 16 KiB | the boot selector |
//! | 1, 2 | 0x0800 4000 | 2 × 16 KiB | its records ([`image_journal`](crate::store::image_journal)) |
//! | 3, 4 | 0x0800 C000 | 16 + 64 KiB | nothing |
//! | 5, 6 | 0x0802 0000 | 256 KiB | image A |
//! | 7, 8 | 0x0806 0000 | 256 KiB | image B |
//! | 9 | 0x080A 0000 | 128 KiB | nothing |
//! | 10, 11 | 0x080C 0000 | 2 × 128 KiB | parameter slots |
//!
//! An image without a selector fills sectors 0 to 9 (memory.x). build.rs makes the linker's regions of all other images from
//! these numbers, so this file imports nothing.

/// Beginning of flash, and of the selector.
pub const FLASH_BEGIN: u32 = 0x0800_0000;

/// Room of the selector \[bytes\].
pub const SELECTOR_BYTES: u32 = 16 * 1024;

/// First sector of the selector's records.
pub const JOURNAL_SECTOR: u8 = 1;

/// Beginning of the selector's records.
pub const JOURNAL_BEGIN: u32 = 0x0800_4000;

/// Bytes of a sector of records.
pub const JOURNAL_SECTOR_BYTES: u32 = 16 * 1024;

/// Sectors of records.
pub const JOURNAL_SECTORS: u32 = 2;

/// First sector of image A.
pub const IMAGE_SECTOR: u8 = 5;

/// Beginning of image A.
pub const IMAGES_BEGIN: u32 = 0x0802_0000;

/// Bytes of a sector of an image.
pub const IMAGE_SECTOR_BYTES: u32 = 128 * 1024;

/// Room of an image with its header \[bytes\].
pub const IMAGE_SLOT_BYTES: u32 = 2 * IMAGE_SECTOR_BYTES;

/// Bytes in front of an image's vector table: a table of 98 vectors is aligned to 512 bytes (PM0214 4.4.4).
pub const IMAGE_HEADER_BYTES: u32 = 512;

/// Beginning of the parameter slots, as in memory.x.
pub const PARAMETER_SLOTS_BEGIN: u32 = 0x080C_0000;

/// Room of both parameter slots \[bytes\].
pub const PARAMETER_SLOTS_BYTES: u32 = 256 * 1024;

/// Beginning of RAM.
pub const RAM_BEGIN: u32 = 0x2000_0000;

/// Contiguous RAM (RM0090 2.3.1) \[bytes\].
pub const RAM_BYTES: u32 = 128 * 1024;

/// Bytes at the end of RAM where the selector leaves its note for the image; neither uses them otherwise.
pub const NOTE_BYTES: u32 = 32;

/// Beginning of the selector's note.
pub const NOTE_BEGIN: u32 = RAM_BEGIN + RAM_BYTES - NOTE_BYTES;

/// RAM of the selector, in front of the note \[bytes\]: there every image has its stack, so the selector overwrites no memory
/// that an image keeps over a reset.
pub const SELECTOR_RAM_BYTES: u32 = 8 * 1024;
