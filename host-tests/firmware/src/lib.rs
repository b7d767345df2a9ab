//! Tests of `trueaxis` that need nothing of `rlg`: the core compiled as a plain dependency, as the target
//! compiles it, with mocks of what stands around it. The tests are in `tests/`.
//!
//! The library is the fault campaign, which runs on the host here and in the emulator from `rlg`'s tests:
//! [`mod@unit`] is a dithered unit that is well, [`campaign`] makes it ill at random moments, [`player`] plays
//! the result into the firmware's processor, [`verdict`] holds the counters against what was done; [`boots`]
//! is what a boot may find. [`nor`] is flash that loses power, for the tests of what is stored.
//!
//! [`sensing_block`] is a simulator of tilting sensing axes with the true attitude: what the chain's flexure compensation
//! is measured against in `tests/flexure_truth/`.

pub mod unit;

pub mod campaign;

pub mod player;

pub mod verdict;

pub mod boots;

pub mod nor;

pub mod sensing_block;
