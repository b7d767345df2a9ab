//! Locates the residual beyond its noise: time × band × channel tiles.
//!
//! Input: a residual \[rad per row\], the noise of each gyro, the regimes and the rows to test. Output: [`Tile`]s with their
//! p-value under the noise model, and [`Location`]s, the significant ones joined.
//!
//! Each tile is Hann-windowed, so that strong lines stay in their band; its power over S, summed over a band, is a gamma
//! variable whose degrees of freedom count the window's correlation between bins. The lowest band is also tested as a mean
//! rate (drift). The threshold counts every tile.

use rayon::prelude::*;
use realfft::RealToComplex;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

use super::noise_spectrum::{LOWEST_SHARE, Noise};
use super::regimes::{Regime, intersect};
use rlg_inference::observations::runs;
use rlg_plan::TilePlan;
use rlg_signal::streams::{Streams, Triad};
use rlg_signal::transforms;

/// Edges of the bands in which tiles are tested \[Hz\], from zero to infinity.
pub fn band_edges_hz(plan: &TilePlan) -> Vec<f64> {
    let inner = plan.edges_hz.into_iter();
    [0.0]
        .into_iter()
        .chain(inner)
        .chain([f64::INFINITY])
        .collect()
}

/// Variance of a sum of Hann-windowed bins over that of independent ones: 1 + 2 (2/3)² + 2 (1/6)².
const HANN_CORRELATION: f64 = 1.0 + 2.0 * (4.0 / 9.0) + 2.0 / 36.0;

/// One time × band × channel tile.
#[derive(Debug, Clone)]
pub struct Tile {
    /// Gyro.
    pub axis: usize,
    /// Rows of the recording.
    pub rows: Range<usize>,
    /// Band \[Hz\].
    pub band_hz: (f64, f64),
    /// Power over that predicted by the noise (1 = noise).
    pub power: f64,
    /// Mean rate \[rad/s\], for the lowest band.
    pub mean_rad_s: f64,
    /// Standard deviation of the mean rate under the noise \[rad/s\].
    pub mean_std_rad_s: f64,
    /// Root mean square of the excess rate in the band \[rad/s\].
    pub excess_rad_s: f64,
    /// p-value under the noise, of this tile alone.
    pub chance: f64,
}

/// Channel or product coherent with a location.
#[derive(Debug, Clone, PartialEq)]
pub struct Companion {
    /// Channel or product, as in expressions.
    pub with: String,
    /// Lag of the residual behind it \[s\].
    pub lag_s: f64,
    /// Coherence, −1 … 1.
    pub coherence: f64,
    /// p-value, expressions and lags counted.
    pub p_value: f64,
}

/// Joined significant tiles.
#[derive(Debug, Clone)]
pub struct Location {
    /// Gyro.
    pub axis: usize,
    /// Rows of the recording.
    pub rows: Range<usize>,
    /// Band \[Hz\].
    pub band_hz: (f64, f64),
    /// Largest mean rate or excess rate \[rad/s\].
    pub size_rad_s: f64,
    /// Smallest p-value among its tiles, trials counted.
    pub p_value: f64,
    /// Relation to the motion, if known.
    pub regime: String,
    /// Channels coherent with it, the surest first.
    pub companions: Vec<Companion>,
}

/// Runs of usable rows inside `rows`, those too short to carry information left out.
fn usable_runs(
    usable: &[bool],
    rows: Range<usize>,
    least_rows: usize,
) -> impl Iterator<Item = Range<usize>> {
    runs(&usable[rows.clone()], true)
        .into_iter()
        .filter(move |run| run.len() >= least_rows)
        .map(move |run| rows.start + run.start..rows.start + run.end)
}

/// Tests all tiles of the rows in `looked_at`.
pub fn tiles(
    streams: &Streams,
    residual_rad: &Triad,
    noise: &[Noise; 3],
    regimes: &[Regime],
    looked_at: &[Range<usize>],
    plan: &TilePlan,
) -> Vec<Tile> {
    let mut pieces: Vec<Range<usize>> = Vec::new();
    for regime in regimes {
        for stretch in intersect(std::slice::from_ref(&regime.rows), looked_at) {
            for stretch in usable_runs(&streams.usable, stretch, plan.least_run_rows) {
                let seconds = stretch.len() as f64 / streams.rate_hz;
                let count = (seconds / plan.longest_s).ceil().max(1.0) as usize;
                pieces.extend((0..count).map(|piece| {
                    stretch.start + stretch.len() * piece / count
                        ..stretch.start + stretch.len() * (piece + 1) / count
                }));
            }
        }
    }
    pieces.retain(|rows| rows.len() >= plan.least_rows);
    let mut lengths: Vec<usize> = pieces.iter().map(even).collect();
    lengths.sort_unstable();
    lengths.dedup();
    let kinds: Vec<Kind> = lengths
        .into_par_iter()
        .map(|count| Kind::new(count, (streams.rate_hz, streams.span_s()), noise, plan))
        .collect();
    pieces
        .into_par_iter()
        .flat_map_iter(|rows| {
            let kind = kinds
                .binary_search_by_key(&even(&rows), |kind| kind.count)
                .map(|place| &kinds[place])
                .expect("every length has its kind");
            (0..3).flat_map(move |axis| {
                let values = &residual_rad[axis][rows.clone()];
                kind.test(axis, rows.clone(), values)
            })
        })
        .collect()
}

fn even(rows: &Range<usize>) -> usize {
    rows.len() & !1
}

/// Quantities common to tiles of one length.
struct Kind {
    count: usize,
    rate_hz: f64,
    window: Vec<f64>,
    norm: f64,
    forward: Arc<dyn RealToComplex<f64>>,
    /// Expected noise power of each gyro in each bin after the window.
    levels: [Vec<f64>; 3],
    mean_std_rad_s: [f64; 3],
    edges_hz: Vec<f64>,
}

impl Kind {
    fn new(
        count: usize,
        (rate_hz, span_s): (f64, f64),
        noise: &[Noise; 3],
        plan: &TilePlan,
    ) -> Self {
        let seconds = count as f64 / rate_hz;
        let window: Vec<f64> = (0..count)
            .map(|k| 0.5 - 0.5 * (TAU * (k as f64 + 0.5) / count as f64).cos())
            .collect();
        // Drift continues across tiles.
        let floor_hz = LOWEST_SHARE / span_s;
        let levels = noise.each_ref().map(|noise| {
            let at = |bin: usize| noise.at(bin as f64 / seconds, floor_hz);
            let level: Vec<f64> = (0..=count / 2 + 1).map(at).collect();
            // The window adds a sixth of either neighbour's noise to each bin, which matters in a short tile.
            (0..=count / 2)
                .map(|bin| (4.0 * level[bin] + level[bin.abs_diff(1)] + level[bin + 1]) / 6.0)
                .collect()
        });
        Self {
            count,
            rate_hz,
            norm: window.iter().map(|w| w * w).sum(),
            window,
            forward: transforms::forward(count),
            levels,
            edges_hz: band_edges_hz(plan),
            mean_std_rad_s: noise
                .each_ref()
                .map(|noise| noise.mean_rate_std_rad_s(seconds, span_s)),
        }
    }

    fn test(&self, axis: usize, rows: Range<usize>, values: &[f64]) -> Vec<Tile> {
        let (count, rate_hz) = (self.count, self.rate_hz);
        let seconds = count as f64 / rate_hz;
        let mut input: Vec<f64> = values[..count]
            .iter()
            .zip(&self.window)
            .map(|(v, w)| v * w)
            .collect();
        let mut bins = self.forward.make_output_vec();
        self.forward
            .process(&mut input, &mut bins)
            .expect("lengths come from the plan");
        let mean_rad_s = values.iter().sum::<f64>() / values.len() as f64 * rate_hz;
        let mean_std_rad_s = self.mean_std_rad_s[axis];
        self.edges_hz
            .windows(2)
            .filter_map(|edges| {
                let (low_hz, high_hz) = (edges[0], edges[1].min(rate_hz / 2.0));
                let first = (low_hz * seconds).ceil() as usize;
                let last = ((high_hz * seconds).ceil() as usize).min(count / 2);
                if first >= last {
                    return None;
                }
                let (mut ratio, mut excess) = (0.0, 0.0);
                let levels = &self.levels[axis];
                for (value, level) in bins[first..last].iter().zip(&levels[first..last]) {
                    let power = value.norm_sqr() / self.norm;
                    ratio += power / level;
                    excess += 2.0 * (power - level) / count as f64;
                }
                let number = (last - first) as f64;
                let degrees = 2.0 * number / if number > 1.0 { HANN_CORRELATION } else { 1.0 };
                let power = ratio / number;
                let mut chance =
                    ChiSquared::new(degrees).map_or(1.0, |law| law.sf(power * degrees));
                if first == 0 {
                    let z = mean_rad_s / mean_std_rad_s;
                    let both_sides = 2.0 * Normal::standard().sf(z.abs());
                    // Two tests of one tile.
                    chance = (2.0 * chance.min(both_sides)).min(1.0);
                }
                Some(Tile {
                    axis,
                    rows: rows.clone(),
                    band_hz: (low_hz, high_hz),
                    power,
                    mean_rad_s,
                    mean_std_rad_s,
                    excess_rad_s: excess.max(0.0).sqrt() * rate_hz,
                    chance,
                })
            })
            .collect()
    }
}

/// Joins the significant tiles that touch in time on the same channel and band. A location that reaches the end of the
/// tested rows in a regime is extended to the end of the regime.
pub fn join(
    tiles: &[Tile],
    regimes: &[Regime],
    looked_at: &[Range<usize>],
    plan: &TilePlan,
) -> Vec<Location> {
    let trials = tiles.len().max(1) as f64;
    let mut found: Vec<&Tile> = tiles
        .iter()
        .filter(|tile| is_significant(tile, tiles.len(), plan))
        .collect();
    found.sort_by(|a, b| {
        (a.axis, a.rows.start)
            .cmp(&(b.axis, b.rows.start))
            .then(a.band_hz.0.total_cmp(&b.band_hz.0))
    });
    let mut locations: Vec<Location> = Vec::new();
    for tile in found {
        let size = if tile.band_hz.0 == 0.0 {
            tile.mean_rad_s.abs().max(tile.excess_rad_s)
        } else {
            tile.excess_rad_s
        };
        let p_value = (tile.chance * trials).min(1.0);
        let end = regimes
            .iter()
            .find(|regime| regime.rows.contains(&tile.rows.start))
            .filter(|regime| {
                let beyond = intersect(
                    std::slice::from_ref(&(tile.rows.end..regime.rows.end)),
                    looked_at,
                );
                beyond.is_empty()
            })
            .map_or(tile.rows.end, |regime| regime.rows.end);
        let near = |location: &&mut Location| {
            location.axis == tile.axis
                && tile.rows.start <= location.rows.end
                && tile.band_hz.0 <= location.band_hz.1
                && tile.band_hz.1 >= location.band_hz.0
        };
        match locations.iter_mut().find(near) {
            Some(location) => {
                location.rows.end = location.rows.end.max(end);
                location.band_hz.0 = location.band_hz.0.min(tile.band_hz.0);
                location.band_hz.1 = location.band_hz.1.max(tile.band_hz.1);
                location.size_rad_s = location.size_rad_s.max(size);
                location.p_value = location.p_value.min(p_value);
            }
            None => locations.push(Location {
                axis: tile.axis,
                rows: tile.rows.start..end,
                band_hz: tile.band_hz,
                size_rad_s: size,
                p_value,
                regime: String::new(),
                companions: Vec::new(),
            }),
        }
    }
    locations
}

/// True if a tile among `count` is significant (Bonferroni).
pub fn is_significant(tile: &Tile, count: usize, plan: &TilePlan) -> bool {
    tile.chance * (count.max(1) as f64) < plan.significance
}
