//! Tests of `trueaxis` that need nothing of `rlg`: the core compiled as a plain dependency, as the target
//! compiles it, with mocks of what stands around it. The tests are in `tests/`; there is no library.
