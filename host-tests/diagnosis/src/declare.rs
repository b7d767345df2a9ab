//! What is decided before looking at the data: significance, bands, splits (diagnosis road, step 0).

/// Chance of at least one false name per recording over all hypotheses of the catalogue, were the noise known exactly
/// and white: with it a six-parameter effect among a dozen shows at a matched-filter SNR of 6 in 87 % of recordings, and
/// at 7 in 98 % (diagnosis.md, marks).
pub const CATALOGUE_SIGNIFICANCE: f64 = 1e-3;

/// The same over all terms that were picked in the data itself: events, lines, expressions.
pub const FAMILY_SIGNIFICANCE: f64 = 1e-4;

/// Chance of at least one falsely located tile per recording.
pub const TILE_SIGNIFICANCE: f64 = 1e-4;

/// Two effects whose predictions differ by less than this many standard deviations of the noise form one
/// class (diagnosis road, step 8).
pub const SEPARATION: f64 = 5.0;

/// Share of each stretch of like motion that is kept for validation, at its end.
pub const HELD_OUT_SHARE: f64 = 0.3;

/// Shorter stretches than this are fitted whole: they would leave nothing to validate on.
pub const SHORTEST_SPLIT_S: f64 = 2.0;

/// Where a recording names no segments, stretches of this length stand in for them.
pub const UNNAMED_STRETCH_S: f64 = 5.0;

/// Regressors come from measured motion and the model's constants, which are good to about this share;
/// an addition to a strong effect must be larger than what such errors leave behind.
pub const REGRESSOR_FIDELITY: f64 = 3e-3;

/// Width of the prior of a fit, in units of an effect's typical size: wide enough to leave values alone,
/// finite so that what the data do not fix keeps a finite covariance.
pub const FIT_PRIOR: f64 = 30.0;

/// Edges of the bands in which tiles are tested \[Hz\]: half decades, with the dither band on its own.
pub const BAND_EDGES_HZ: [f64; 9] = [
    0.0,
    1.0,
    3.0,
    10.0,
    30.0,
    100.0,
    300.0,
    600.0,
    f64::INFINITY,
];

/// Blocks per second of a recording longer than memory \[Hz\]: an hour of the whole catalogue takes 40 MB.
pub const LONG_BLOCK_HZ: f64 = 20.0;

/// Of such a recording the blocks answer below, the rows above \[Hz\]: half of what the blocks resolve, where what is
/// folded into them is weak, and below where white noise of angle meets the random walk.
pub const LONG_SPLIT_HZ: f64 = LONG_BLOCK_HZ / 4.0;

/// Seconds of such a recording that are at the full rate at once while it is read.
pub const LONG_CHUNK_S: f64 = 30.0;

/// Stretches of such a recording that are kept at the full rate: every one costs a free jump of angle.
pub const LONG_STRETCHES: usize = 12;

/// Rows that are held at once, 0.9 kB each: two and a half minutes at 4 kHz.
pub const MOST_ROWS: usize = 600_000;

/// Longest tile \[s\].
pub const TILE_S: f64 = 6.0;
