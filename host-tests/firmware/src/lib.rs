//! Tests of `trueaxis` that need nothing of `rlg`: the core compiled as a plain dependency, as the target compiles it,
//! with mocks of its surroundings. The tests are in `tests/`.
//!
//! The library is the fault campaign, which runs on the host here and in the emulator from `rlg`'s tests: [`mod@unit`]
//! is a dithered unit without faults, [`campaign`] inserts faults at random moments, [`player`] plays the result into
//! the firmware's processor, [`verdict`] compares the counters with the inserted faults; [`boots`] has the faults of a
//! boot. [`nor`] is flash that loses power, for the tests of stored data; [`image_unit`] the same for firmware images.
//!
//! [`sensing_block`] is a simulator of tilting sensing axes with the true attitude: the reference of the chain's
//! flexure compensation in `tests/flexure_truth/`.

pub mod service;

pub mod unit;

pub mod campaign;

pub mod player;

pub mod verdict;

pub mod boots;

pub mod nor;

pub mod image_unit;

pub mod sensing_block;
