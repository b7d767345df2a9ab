//! How far a slow effect is ahead of a wandering rate, exactly.
//!
//! A random walk of the rate and a ramp, a step or an exponential approach look alike where only a few of its modes
//! stand above white noise.
//!
//! Enters: the bench with the noise beside everything. Leaves, for some parameters, by how much the likelihood with
//! them is ahead of that without, the latter with the drift that suits it best (wander.rs), the former either with its
//! own or with none: Σ over gyros of the difference of max_q −½ (ln |C_q| + rᵀ C_q⁻¹ r), everything else fitted in
//! both. Rows are summed over blocks; effects above the blocks' band are not slow, and not asked about. What a slow one
//! explains above it is no drift's, and counts as well.
//!
//! A weak walk that one effect takes up whole leaves no drift beside it; a strong one does. So where none is left, less
//! is needed (drift.rs).
//!
//! Left out: what gyros share (each is fitted by itself, which favours the effect).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::Range;

use super::information::{fit_away, scaled_inverse};
use super::portion::{Bins, inner};
use super::regressor::Regressor;
use super::wander::{Blocks, Drift, Wander};
use super::workbench::Workbench;

/// What one gyro's blocks say under drift of all strengths.
struct OfGyro {
    /// Parameters that have a column here.
    indices: Vec<usize>,
    /// Which drift, ln |C|, and the whitened products of the columns, then the residual and a walk's first mode.
    wanders: Vec<(Option<Drift>, f64, DMatrix<f64>)>,
}

/// See the page above.
pub struct Slow {
    gyros: Vec<OfGyro>,
    /// 1/S of each gyro's rows without drift.
    steady_weights: [Vec<f64>; 3],
    /// The rows' first bin above what the blocks show.
    edge: usize,
}

impl Slow {
    /// Of all parameters in `indices`, against the kinds of drift that will be asked about; `None` where there are too few
    /// blocks to tell a walk from anything.
    pub fn new(bench: &Workbench, indices: &[usize], drifts: &[Drift]) -> Option<Self> {
        let blocks = Blocks::of(bench, drifts)?;
        let gyros = (0..3_usize)
            .into_par_iter()
            .map(|axis| of_gyro(bench, indices, axis, &blocks))
            .collect();
        let portion = &bench.portion;
        let mut bins = 0..portion.bins();
        let edge = bins.find(|&bin| portion.frequency_hz(bin) > blocks.edge_hz);
        Some(Self {
            gyros,
            steady_weights: bench.noise.map(|noise| noise.steady().weights(portion)),
            edge: edge.unwrap_or(portion.bins()),
        })
    }

    /// ln of the likelihood by which everything, with any of `drifts`, is ahead of everything without `own`.
    pub fn ahead(&self, own: &[Range<usize>], drifts: &[Drift]) -> f64 {
        self.ahead_by_gyro(own, drifts).iter().sum()
    }

    /// The same of each gyro on which `own` has a column.
    pub fn ahead_by_gyro(&self, own: &[Range<usize>], drifts: &[Drift]) -> Vec<f64> {
        self.with(own)
            .map(|gyro| gyro.likelihood(&[], drifts) - gyro.likelihood(own, drifts))
            .collect()
    }

    /// The same with no drift beside everything.
    pub fn ahead_steadily(&self, own: &[Range<usize>], drifts: &[Drift]) -> f64 {
        self.with(own)
            .map(|gyro| gyro.likelihood(&[], &[]) - gyro.likelihood(own, drifts))
            .sum()
    }

    /// ln of the likelihood by which `values`, fitted to everything, are ahead above the blocks' band of the same without
    /// `own`, whatever the others then become. The noise there is the bench's, the tail of any drift within.
    pub fn ahead_above(
        &self,
        bench: &Workbench,
        own: &[Range<usize>],
        values: &[(usize, f64)],
    ) -> f64 {
        let left = bench.left_over(values);
        let indices: Vec<usize> = values.iter().map(|(index, _)| *index).collect();
        let of_axis = |axis: usize| {
            let columns = bench.columns_of(&indices, axis);
            let (mine, others): (Vec<_>, Vec<_>) = columns
                .into_iter()
                .partition(|(index, _)| is_of(own, *index));
            if mine.is_empty() {
                return 0.0;
            }
            let mut weights = bench.noise[axis].weights(&bench.portion);
            weights[..self.edge].fill(0.0);
            let power = |bins: &Bins| -> f64 { inner(bins, bins, &weights) };
            let mut without = left[axis].clone();
            for (index, column) in mine {
                let value = values.iter().find(|(known, _)| *known == index);
                column.add_to(&mut without, value.map_or(0.0, |(_, value)| *value));
            }
            let others: Vec<&Regressor> = others.into_iter().map(|(_, column)| column).collect();
            let beside: Vec<&Regressor> = bench.joints().iter().chain(others).collect();
            fit_away(&mut without, &beside, &weights);
            0.5 * (power(&without) - power(&left[axis]))
        };
        (0..3).map(of_axis).sum::<f64>().max(0.0)
    }

    /// Whether columns of `own` hold most of what a walk from nothing looks like, on any gyro.
    pub fn holds_a_walk(&self, own: &[Range<usize>]) -> bool {
        const MOST: f64 = 0.7;
        self.with(own).any(|gyro| gyro.share_of_mode(own) > MOST)
    }

    /// The gyros on which `own` has a column.
    fn with(&self, own: &[Range<usize>]) -> impl Iterator<Item = &OfGyro> {
        let has_any = |gyro: &&OfGyro| gyro.indices.iter().any(|index| is_of(own, *index));
        self.gyros.iter().filter(has_any)
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

fn of_gyro(bench: &Workbench, indices: &[usize], axis: usize, blocks: &Blocks) -> OfGyro {
    let (indices, all) = sums(bench, indices, axis, blocks);
    let residual = all.column(indices.len()).into_owned();
    let wanders = blocks.wanders(&bench.noise[axis], &residual);
    OfGyro::new(indices, all, &blocks.first_mode(), &wanders)
}

/// Sums over blocks of the columns of some parameters on a gyro and, last, of its residual; those that have one.
pub(super) fn sums(
    bench: &Workbench,
    indices: &[usize],
    axis: usize,
    blocks: &Blocks,
) -> (Vec<usize>, DMatrix<f64>) {
    let mut residual = bench.residual()[axis].clone();
    for (_, offset) in bench.offsets_of(indices, axis) {
        offset.add_to(&mut residual, -1.0);
    }
    let columns = bench.columns_of(indices, axis);
    let mut all = DMatrix::zeros(blocks.count(), columns.len() + 1);
    for (place, (_, column)) in columns.iter().enumerate() {
        let rows = bench.portion.rows_of(&column.to_bins());
        all.set_column(place, &blocks.sums(&rows));
    }
    let residual = blocks.sums(&bench.portion.rows_of(&residual));
    all.set_column(columns.len(), &residual);
    (columns.iter().map(|(index, _)| *index).collect(), all)
}

impl OfGyro {
    /// `all` are sums of the columns and, last, of the residual; `mode` is a walk's first.
    fn new(
        indices: Vec<usize>,
        all: DMatrix<f64>,
        mode: &DVector<f64>,
        wanders: &[Wander],
    ) -> Self {
        let count = all.ncols();
        let mut all = all.insert_column(count, 0.0);
        all.set_column(count, mode);
        let products = |wander: &Wander| {
            let mut white = all.clone();
            wander.whiten(&mut white);
            (wander.kind, wander.log_volume, white.tr_mul(&white))
        };
        Self {
            indices,
            wanders: wanders.iter().map(products).collect(),
        }
    }

    /// ln of the likelihood without some parameters, under none or whichever of `drifts` suits it best.
    fn likelihood(&self, without: &[Range<usize>], drifts: &[Drift]) -> f64 {
        let kept = self.places(|index| !is_of(without, index));
        let last = self.indices.len();
        let wanders = self.wanders.iter();
        let wanders = wanders.filter(|(kind, ..)| kind.is_none_or(|kind| drifts.contains(&kind)));
        let each = wanders.map(|(_, log_volume, products)| {
            -0.5 * (log_volume + products[(last, last)] - explained(products, &kept, last))
        });
        each.fold(f64::NEG_INFINITY, f64::max)
    }

    /// The share of a walk's first mode, in white noise, that some parameters' columns hold.
    fn share_of_mode(&self, own: &[Range<usize>]) -> f64 {
        let kept = self.places(|index| is_of(own, index));
        let mode = self.indices.len() + 1;
        let steady = self.wanders.iter().find(|(kind, ..)| kind.is_none());
        steady.map_or(1.0, |(_, _, products)| {
            explained(products, &kept, mode) / products[(mode, mode)]
        })
    }

    fn places(&self, wanted: impl Fn(usize) -> bool) -> Vec<usize> {
        let places = 0..self.indices.len();
        places
            .filter(|&place| wanted(self.indices[place]))
            .collect()
    }
}

/// What some columns explain of another, all by their products.
fn explained(products: &DMatrix<f64>, columns: &[usize], of: usize) -> f64 {
    let count = columns.len();
    let own = DMatrix::from_fn(count, count, |a, b| products[(columns[a], columns[b])]);
    let right = DVector::from_fn(count, |a, _| products[(columns[a], of)]);
    right.dot(&(scaled_inverse(&own) * &right))
}
