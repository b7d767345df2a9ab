//! Noise of unit tests: uniform, of unit variance, the same on every machine.

/// Returns a generator of independent numbers of mean 0 and variance 1 (Knuth's MMIX congruence).
pub(crate) fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 12.0_f64.sqrt()
    }
}
