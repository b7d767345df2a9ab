//! Every operation of both number systems, and of the exact sums, against the formula that its documentation states.
//!
//! Fixed point to the last bit, from the formats in the table of `src/chain/numbers/fixed.rs`; f32 to its roundings.

mod exact;
mod fixed;
mod float;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Number of tests of each operation.
const DRAWS: usize = 2000;

/// The same draws on every machine.
fn draws(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// A word within ±2^bits, of any magnitude alike, so that small ones come too.
fn word(rng: &mut ChaCha8Rng, bits: u32) -> i32 {
    let magnitude = rng.random_range(0..=bits);
    let most = 1i64 << magnitude;
    rng.random_range(-most..=most)
        .clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}
