//! Block normal equations for jackknife and cross-validation: real noise is neither Gaussian nor stationary, and a
//! likelihood ratio that few rows carry is misleading.
//!
//! Rows are whitened and reduced to the analysed band, free rows are projected out, and contiguous blocks store their normal
//! equations.

use nalgebra::{DMatrix, DVector};
use rlg_inference::score_test::Projected;
use rlg_plan::AttitudeBlockPlan;
use rlg_signal::axes::Triad;

use crate::likelihood::block_sums::{BlockSums, Sums};
use crate::likelihood::equations::BandNoise;
use crate::likelihood::noise::Levels;
use crate::rows::increments::Increments;
use crate::rows::whitener::Whitener;

/// Normal equations of all blocks over all parameters, with their whitened rows.
pub struct Blocks<'a> {
    pub(crate) sums: BlockSums,
    /// Whitened columns and record by block, for columns added later.
    white: Vec<(DMatrix<f64>, DVector<f64>)>,
    whitener: Whitener<'a>,
    plan: &'a AttitudeBlockPlan,
}

/// Whitened residual of a fit, block by block, with the whitened columns of its parameters.
pub(crate) struct Null {
    each: Vec<(DMatrix<f64>, DVector<f64>)>,
    covariance: DMatrix<f64>,
}

impl Null {
    /// Whitened residual of one axis \[σ\].
    pub(crate) fn residual(&self, axis: usize) -> Vec<f64> {
        let of_axis = |left: &DVector<f64>| {
            let rows = left.len() / 3;
            left.rows(axis * rows, rows)
                .iter()
                .copied()
                .collect::<Vec<f64>>()
        };
        self.each
            .iter()
            .flat_map(|(_, left)| of_axis(left))
            .collect()
    }
}

/// Prior of each parameter, of zero mean, and the point about which its column is linearised.
#[derive(Clone, Copy)]
pub struct Prior<'a> {
    /// Precision of the prior.
    pub precisions: &'a [f64],
    /// Parameter at the linearisation point, relative to the model.
    pub moved: &'a [f64],
}

impl<'a> Blocks<'a> {
    /// Whitens rows and columns.
    ///
    /// # Inputs
    /// `rows_rad`: outliers subtracted.
    pub fn new(
        noise: &'a BandNoise,
        levels: &Levels,
        increments: &Increments,
        rows_rad: &Triad,
        columns: &mut dyn Iterator<Item = Triad>,
        prior: Prior,
        plan: &'a AttitudeBlockPlan,
    ) -> Self {
        let (band, Prior { precisions, moved }) = (&noise.band, prior);
        let whitener = Whitener::new(noise, levels, increments);
        let record = whitener.whiten(rows_rad);
        let span_s = increments.period_s * increments.rows() as f64;
        let count = ((span_s / plan.length_s) as usize)
            .max(plan.least)
            .min(band.cut / plan.least_rows);
        let ranges = (0..count).map(|block| rows_of(block, count, band.cut));
        let mut white: Vec<(DMatrix<f64>, DVector<f64>)> = ranges
            .map(|range| {
                let record = DVector::from_vec(within(&record, &range));
                (DMatrix::zeros(record.len(), precisions.len()), record)
            })
            .collect();
        for (k, column) in columns.enumerate() {
            let column = whitener.whiten(&column);
            for (block, (rows, _)) in white.iter_mut().enumerate() {
                let range = rows_of(block, count, band.cut);
                rows.column_mut(k).copy_from_slice(&within(&column, &range));
            }
        }
        // Parameters are total values, not steps from the linearisation point.
        let moved = DVector::from_column_slice(moved);
        let share = 1.0 / count as f64;
        let prior = precisions.iter().map(|precision| precision * share);
        let prior = DMatrix::from_diagonal(&DVector::from_iterator(precisions.len(), prior));
        let sums = white.iter().map(|(rows, record)| {
            let gram = rows.tr_mul(rows);
            let moments = rows.tr_mul(record);
            Sums {
                energy: record.dot(record)
                    + 2.0 * moved.dot(&moments)
                    + moved.dot(&(&gram * &moved)),
                moments: moments + &gram * &moved,
                gram: gram + &prior,
            }
        });
        Self {
            sums: BlockSums::new(sums.collect(), plan),
            white,
            whitener,
            plan,
        }
    }

    /// Returns the blocks with columns appended, without a prior on them.
    ///
    /// # Inputs
    /// `moved`: linearisation point of the first parameters.
    pub fn with(&self, columns: &[Triad], moved: &[f64]) -> Self {
        let more = self.whitened(columns);
        let appended = self.white.iter().zip(&more).map(|((rows, record), more)| {
            let first = rows.ncols();
            let mut wide = rows.clone().resize_horizontally(first + more.ncols(), 0.0);
            wide.columns_mut(first, more.ncols()).copy_from(more);
            (wide, record.clone())
        });
        Self {
            white: appended.collect(),
            sums: self.sums_beside(&more, moved),
            whitener: self.whitener.clone(),
            plan: self.plan,
        }
    }

    /// Normal equations with columns appended, without a prior on them.
    ///
    /// # Inputs
    /// `moved`: linearisation point of the first parameters.
    pub(crate) fn sums_with(&self, columns: &[Triad], moved: &[f64]) -> BlockSums {
        self.sums_beside(&self.whitened(columns), moved)
    }

    /// Whitened columns by block.
    fn whitened(&self, columns: &[Triad]) -> Vec<DMatrix<f64>> {
        let columns: Vec<Triad> = columns
            .iter()
            .map(|column| self.whitener.whiten(column))
            .collect();
        let count = self.sums.each.len();
        let ranges = (0..count).map(|block| rows_of(block, count, self.whitener.band.cut));
        ranges.map(|range| matrix(&columns, &range)).collect()
    }

    fn sums_beside(&self, more: &[DMatrix<f64>], moved: &[f64]) -> BlockSums {
        let blocks = self.sums.each.iter().zip(&self.white).zip(more);
        let each = blocks.map(|((old, (rows, record)), more)| {
            let across = rows.tr_mul(more);
            let (first, count) = across.shape();
            let all = first + count;
            let mut gram = old.gram.clone().resize(all, all, 0.0);
            gram.view_mut((0, first), (first, count)).copy_from(&across);
            gram.view_mut((first, 0), (count, first))
                .copy_from(&across.transpose());
            gram.view_mut((first, first), (count, count))
                .copy_from(&more.tr_mul(more));
            let mut moments = old.moments.clone().resize_vertically(all, 0.0);
            let beyond = DVector::from_fn(first, |k, _| moved.get(k).copied().unwrap_or(0.0));
            let own = more.tr_mul(record) + across.tr_mul(&beyond);
            moments.rows_mut(first, count).copy_from(&own);
            Sums {
                gram,
                moments,
                energy: old.energy,
            }
        });
        BlockSums::new(each.collect(), self.plan)
    }

    /// Forms the normal equations of another whitened record on the same columns.
    ///
    /// # Inputs
    /// `value`: of each whitened row, by block.
    pub(crate) fn of_others(&self, mut value: impl FnMut(usize) -> f64) -> BlockSums {
        let blocks = self.sums.each.iter().zip(&self.white).enumerate();
        let each = blocks.map(|(block, (sums, (rows, _)))| {
            let record = DVector::from_fn(rows.nrows(), |_, _| value(block));
            Sums {
                gram: sums.gram.clone(),
                moments: rows.tr_mul(&record),
                energy: record.norm_squared(),
            }
        });
        BlockSums::new(each.collect(), self.plan)
    }

    /// Residual of the fit of a set, as the null model of score tests.
    ///
    /// # Inputs
    /// `moved`: linearisation point of the first parameters, all of them in the set.
    pub(crate) fn null(&self, set: &[usize], moved: &[f64]) -> Null {
        let (values, covariance) = self.sums.fit(set);
        let beyond = set.iter().zip(values.iter());
        let beyond = beyond.map(|(k, value)| value - moved.get(*k).copied().unwrap_or(0.0));
        let beyond = DVector::from_iterator(set.len(), beyond);
        let each = self.white.iter();
        let each = each.map(|(rows, record)| {
            let rows = rows.select_columns(set);
            let left = record - &rows * &beyond;
            (rows, left)
        });
        Null {
            each: each.collect(),
            covariance,
        }
    }

    /// Information and score of columns given a null model.
    pub(crate) fn project(&self, null: &Null, columns: &[Triad]) -> Projected {
        let (count, known) = (columns.len(), null.covariance.nrows());
        let mut own = DMatrix::zeros(count, count);
        let mut cross = DMatrix::zeros(count, known);
        let mut score = DVector::zeros(count);
        for ((rows, left), more) in null.each.iter().zip(self.whitened(columns)) {
            own += more.tr_mul(&more);
            cross += more.tr_mul(rows);
            score += more.tr_mul(left);
        }
        let free = &own - &cross * &null.covariance * cross.transpose();
        Projected::new(free, score, own.diagonal())
    }

    /// Number of analysed coefficients of an axis.
    pub(crate) fn coefficients(&self) -> usize {
        self.whitener.band.cut
    }

    /// Number of whitened rows in each block.
    pub(crate) fn rows(&self) -> impl Iterator<Item = usize> + '_ {
        self.white.iter().map(|(rows, _)| rows.nrows())
    }
}

/// Range of whitened rows in one of `count` blocks.
fn rows_of(block: usize, count: usize, cut: usize) -> std::ops::Range<usize> {
    block * cut / count..(block + 1) * cut / count
}

/// Rows of all axes within a range.
fn within(values: &Triad, range: &std::ops::Range<usize>) -> Vec<f64> {
    let axes = values.iter();
    axes.flat_map(|values| values[range.clone()].iter().copied())
        .collect()
}

fn matrix(columns: &[Triad], range: &std::ops::Range<usize>) -> DMatrix<f64> {
    let values = columns.iter().flat_map(|column| within(column, range));
    DMatrix::from_iterator(3 * range.len(), columns.len(), values)
}
