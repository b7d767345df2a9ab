//! What is decided before looking at the data: significance, bands, splits (diagnosis road, step 0).

pub use rlg_diagnosis::locate::{BAND_EDGES_HZ, TILE_S, TILE_SIGNIFICANCE};
pub use rlg_diagnosis::split::{HELD_OUT_SHARE, SHORTEST_SPLIT_S, UNNAMED_STRETCH_S};
pub use rlg_signal::pieces::{LONG_BLOCK_HZ, LONG_SPLIT_HZ};

/// Chance of at least one false name per recording over all hypotheses of the catalogue, were the noise known exactly
/// and white: with it a six-parameter effect among a dozen shows at a matched-filter SNR of 6 in 87 % of recordings, and
/// at 7 in 98 % (diagnosis.md, marks).
pub const CATALOGUE_SIGNIFICANCE: f64 = 1e-3;

/// The same over all terms that were picked in the data itself: events, lines, expressions.
pub const FAMILY_SIGNIFICANCE: f64 = 1e-4;

/// Two effects whose predictions differ by less than this many standard deviations of the noise form one
/// class (diagnosis road, step 8).
pub const SEPARATION: f64 = 5.0;

/// Regressors come from measured motion and the model's constants, which are good to about this share;
/// an addition to a strong effect must be larger than what such errors leave behind.
pub const REGRESSOR_FIDELITY: f64 = 3e-3;

/// Width of the prior of a fit, in units of an effect's typical size: wide enough to leave values alone,
/// finite so that what the data do not fix keeps a finite covariance.
pub const FIT_PRIOR: f64 = 30.0;

/// Seconds of such a recording that are at the full rate at once while it is read.
pub const LONG_CHUNK_S: f64 = 30.0;

/// Stretches of such a recording that are kept at the full rate: every one costs a free jump of angle.
pub const LONG_STRETCHES: usize = 12;

/// Rows that are held at once, 0.9 kB each: two and a half minutes at 4 kHz.
pub const MOST_ROWS: usize = 600_000;
