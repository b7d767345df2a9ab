//! How far a slow effect is ahead of a walking rate, exactly.
//!
//! A whole random walk of the rate and a ramp, a step or an exponential approach look alike where only a few of its
//! modes stand above white noise, and a Whittle likelihood of those few is no good judge: periodograms of a walk leak,
//! stretches of it do not fit together at their joints, and its mean depends on where it began. Here the walk has its
//! covariance in time, as it is.
//!
//! Enters: the bench with the noise beside everything. Leaves, for some parameters, by how much the likelihood with
//! them is ahead of that without, each with the walk that suits it best: Σ over gyros of the difference of
//! max_q −½ (ln |C_q| + rᵀ C_q⁻¹ r), C_q = white noise + q (span + min(t_i, t_j)), everything else fitted in both. That
//! span: a walk has been going on before the recording for as long as within it. Rows are summed over blocks; effects
//! above the blocks' band are not slow, and not asked about.
//!
//! Left out: what gyros share (each is fitted by itself, which favours the effect), flicker (drift.rs has it).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

use super::information::scaled_inverse;
use super::portion::Bins;
use super::workbench::Workbench;

/// Blocks of a portion, in their gyros' noise: the work grows with the cube of their number.
const MOST_BLOCKS: f64 = 160.0;

/// No block is shorter \[s\]: white noise of angle would fill it.
const SHORTEST_BLOCK_S: f64 = 0.25;

/// Variance that the walk gathers over the recording, over that of a block's white noise: from nothing to a thousand,
/// or to what the blocks differ by.
const WEAKEST_WALK: f64 = 1e-4;
const STRONGEST_WALK: f64 = 1e3;
const WALKS: usize = 25;

/// What one gyro's blocks say under walks of all strengths.
struct OfGyro {
    /// Parameters that have a column here.
    indices: Vec<usize>,
    /// ln |C|, and the whitened products of the columns and, last, the residual.
    walks: Vec<(f64, DMatrix<f64>)>,
}

/// See the page above.
pub struct Slow {
    gyros: Vec<OfGyro>,
    /// 1/S of each gyro's rows without drift.
    steady_weights: [Vec<f64>; 3],
    /// The rows' first bin above what the blocks show.
    edge: usize,
}

/// Sums of a portion's rows over blocks, none of which crosses a joint.
struct Blocks {
    /// Places in the portion's rows, end to end.
    places: Vec<Range<usize>>,
    /// Middle of each block \[s\] and the recording it is of.
    stamps: Vec<(f64, usize)>,
    rows: usize,
    span_s: f64,
}

impl Blocks {
    fn of(bench: &Workbench) -> Self {
        let portion = &bench.portion;
        let streams = &bench.scene().streams;
        let block_s = (portion.seconds() / MOST_BLOCKS).max(SHORTEST_BLOCK_S);
        let rows = ((block_s * streams.rate_hz).round() as usize).max(1);
        let (mut places, mut stamps) = (Vec::new(), Vec::new());
        let mut before = 0;
        for range in &portion.ranges {
            for block in 0..range.len() / rows {
                let (first, middle) = (block * rows, range.start + block * rows + rows / 2);
                let recording = streams
                    .pieces
                    .iter()
                    .position(|one| one.rows.contains(&middle));
                places.push(before + first..before + first + rows);
                stamps.push((middle as f64 / streams.rate_hz, recording.unwrap_or(0)));
            }
            before += range.len();
        }
        let first_s = stamps.first().map_or(0.0, |one| one.0);
        let span_s = stamps.last().map_or(0.0, |one| one.0) - first_s;
        Self {
            places,
            stamps,
            rows,
            span_s,
        }
    }

    fn sums(&self, rows: &[f64]) -> DVector<f64> {
        let sums = self
            .places
            .iter()
            .map(|place| rows[place.clone()].iter().sum());
        DVector::from_iterator(self.places.len(), sums)
    }

    /// Covariance of a walk that gathers unit variance over the span.
    fn walk(&self) -> DMatrix<f64> {
        let first_s = self.stamps.first().map_or(0.0, |one| one.0);
        DMatrix::from_fn(self.stamps.len(), self.stamps.len(), |a, b| {
            let ((a_s, of_a), (b_s, of_b)) = (self.stamps[a], self.stamps[b]);
            let together = if of_a == of_b { 1.0 } else { 0.0 };
            together * (1.0 + (a_s.min(b_s) - first_s) / self.span_s)
        })
    }

    /// Covariance of the noise without drift: a walk of the angle, and white noise of it, which neighbours share.
    fn steady(&self, walk: f64, white: f64) -> DMatrix<f64> {
        DMatrix::from_fn(self.places.len(), self.places.len(), |a, b| {
            let adjoin = self.places[a].end == self.places[b].start
                || self.places[b].end == self.places[a].start;
            match (a == b, adjoin) {
                (true, _) => self.rows as f64 * walk + 2.0 * white,
                (_, true) => -white,
                _ => 0.0,
            }
        })
    }
}

impl Slow {
    /// Of all parameters in `indices`; `None` where there are too few blocks to tell a walk from anything.
    pub fn new(bench: &Workbench, indices: &[usize]) -> Option<Self> {
        /// Fewer have no room for a dozen columns and a walk.
        const FEWEST_BLOCKS: usize = 24;
        let blocks = Blocks::of(bench);
        if blocks.places.len() < FEWEST_BLOCKS {
            return None;
        }
        let walk = blocks.walk();
        let gyros = (0..3_usize)
            .into_par_iter()
            .map(|axis| of_gyro(bench, indices, axis, &blocks, &walk))
            .collect();
        let portion = &bench.portion;
        let edge_hz = 0.5 * bench.scene().streams.rate_hz / blocks.rows as f64;
        let mut bins = 0..portion.bins();
        let edge = bins.find(|&bin| portion.frequency_hz(bin) > edge_hz);
        Some(Self {
            gyros,
            steady_weights: bench.noise.map(|noise| noise.steady().weights(portion)),
            edge: edge.unwrap_or(portion.bins()),
        })
    }

    /// ln of the likelihood by which everything is ahead of everything without `own`.
    pub fn ahead(&self, own: &[Range<usize>]) -> f64 {
        let each = self.gyros.iter().map(|gyro| {
            let has_any = gyro.indices.iter().any(|index| is_of(own, *index));
            let ahead = || gyro.likelihood(&[]) - gyro.likelihood(own);
            if has_any { ahead() } else { 0.0 }
        });
        each.sum()
    }

    /// Columns of `own` on all gyros: each is one more number that can imitate a walk.
    pub fn columns(&self, own: &[Range<usize>]) -> usize {
        let each = self.gyros.iter().flat_map(|gyro| &gyro.indices);
        each.filter(|index| is_of(own, **index)).count()
    }

    /// The share of a pattern's power over noise without drift that lies in the blocks' band.
    pub fn share(&self, bench: &Workbench, pattern: &[(usize, f64)]) -> f64 {
        let indices: Vec<usize> = pattern.iter().map(|(index, _)| *index).collect();
        let [inside, whole] = (0..3).fold([0.0; 2], |[inside, whole], axis| {
            let weights = &self.steady_weights[axis];
            let mut sum: Bins = vec![Default::default(); bench.portion.bins()];
            for (index, column) in bench.columns_of(&indices, axis) {
                let value = pattern.iter().find(|(known, _)| *known == index);
                column.add_to(&mut sum, value.map_or(0.0, |(_, value)| *value));
            }
            let power = |bins: Range<usize>| -> f64 {
                let of_bins = sum[bins.clone()].iter().zip(&weights[bins]);
                of_bins.map(|(bin, weight)| bin.norm_sqr() * weight).sum()
            };
            [inside + power(0..self.edge), whole + power(0..sum.len())]
        });
        inside / whole
    }
}

fn is_of(ranges: &[Range<usize>], index: usize) -> bool {
    ranges.iter().any(|range| range.contains(&index))
}

fn of_gyro(
    bench: &Workbench,
    indices: &[usize],
    axis: usize,
    blocks: &Blocks,
    walk: &DMatrix<f64>,
) -> OfGyro {
    let mut residual = bench.residual()[axis].clone();
    for (_, offset) in bench.offsets_of(indices, axis) {
        offset.add_to(&mut residual, -1.0);
    }
    let columns = bench.columns_of(indices, axis);
    let mut all = DMatrix::zeros(blocks.places.len(), columns.len() + 1);
    for (place, (_, column)) in columns.iter().enumerate() {
        let rows = bench.portion.rows_of(&column.to_bins());
        all.set_column(place, &blocks.sums(&rows));
    }
    let residual = blocks.sums(&bench.portion.rows_of(&residual));
    all.set_column(columns.len(), &residual);
    let [angle_walk, white, ..] = bench.noise[axis].theta;
    let steady = blocks.steady(angle_walk, white);
    let level = steady.diagonal().mean();
    let neighbours = residual.as_slice().windows(2);
    let steps = neighbours
        .map(|pair| (pair[1] - pair[0]).powi(2))
        .sum::<f64>()
        / level;
    let strongest = STRONGEST_WALK.max(steps);
    let ratio = (strongest / WEAKEST_WALK).powf(1.0 / (WALKS - 1) as f64);
    let strengths = (0..WALKS).map(|k| WEAKEST_WALK * ratio.powi(k as i32));
    let walks = std::iter::once(0.0)
        .chain(strengths)
        .filter_map(|strength| {
            let root = (&steady + walk * (strength * level)).cholesky()?;
            let log_volume: f64 = root.l_dirty().diagonal().iter().map(|d| 2.0 * d.ln()).sum();
            let mut white = all.clone();
            root.l_dirty().solve_lower_triangular_mut(&mut white);
            Some((log_volume, white.tr_mul(&white)))
        })
        .collect();
    OfGyro {
        indices: columns.iter().map(|(index, _)| *index).collect(),
        walks,
    }
}

impl OfGyro {
    /// ln of the likelihood without some parameters, under the walk that suits it best.
    fn likelihood(&self, without: &[Range<usize>]) -> f64 {
        let kept: Vec<usize> = (0..self.indices.len())
            .filter(|&place| !is_of(without, self.indices[place]))
            .collect();
        let last = self.indices.len();
        let each = self.walks.iter().map(|(log_volume, products)| {
            let own = DMatrix::from_fn(kept.len(), kept.len(), |a, b| products[(kept[a], kept[b])]);
            let right = DVector::from_fn(kept.len(), |a, _| products[(kept[a], last)]);
            let explained = right.dot(&(scaled_inverse(&own) * &right));
            -0.5 * (log_volume + products[(last, last)] - explained)
        });
        each.fold(f64::NEG_INFINITY, f64::max)
    }
}
