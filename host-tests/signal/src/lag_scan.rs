//! Residual variance of the gyros at every lag of the reference, by correlations and cumulative sums.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use realfft::num_complex::Complex64;

use crate::transforms;

/// Cumulative sums of the reference and of its products up to each row.
pub(crate) struct Sums<'a> {
    reference: &'a [Vector3<f64>],
    values: Vec<Vector3<f64>>,
    products: Vec<Matrix3<f64>>,
}

impl<'a> Sums<'a> {
    pub(crate) fn of(rows: &'a [Vector3<f64>]) -> Self {
        let mut sums = Self {
            reference: rows,
            values: vec![Vector3::zeros()],
            products: vec![Matrix3::zeros()],
        };
        for row in rows {
            sums.values.push(sums.values[sums.values.len() - 1] + row);
            let product = row * row.transpose();
            sums.products
                .push(sums.products[sums.products.len() - 1] + product);
        }
        sums
    }

    /// Sum of products of `count` rows from `start` on, about their mean; rows beyond the record are zero.
    fn centred(&self, start: i64, count: usize) -> Matrix3<f64> {
        let last = self.values.len() - 1;
        let within = |row: i64| usize::try_from(row).unwrap_or(0).min(last);
        let (from, to) = (within(start), within(start + count as i64));
        let sum = self.values[to] - self.values[from];
        self.products[to] - self.products[from] - sum * sum.transpose() / count as f64
    }
}

/// Residual share of the gyros' variance in some rows after the least-squares map of the reference, at each lag from
/// −`reach` to `reach` \[rows\]; `None` where they do not move.
pub(crate) fn left_by_lag(
    gyros: &[Vector3<f64>],
    rows: Range<usize>,
    sums: &Sums,
    reach: usize,
) -> Option<Vec<f64>> {
    let count = rows.len() as f64;
    let own = &gyros[rows.clone()];
    let mean = own.iter().sum::<Vector3<f64>>() / count;
    let whole: f64 = own.iter().map(|row| (row - mean).norm_squared()).sum();
    if whole <= 0.0 {
        return None;
    }
    let length = transforms::smooth_length(rows.len() + 2 * reach);
    let forward = transforms::forward(length);
    let spectrum = |value: &dyn Fn(usize) -> f64| {
        let mut input: Vec<f64> = (0..length).map(value).collect();
        let mut output = forward.make_output_vec();
        if forward.process(&mut input, &mut output).is_err() {
            unreachable!("both buffers are as long as planned");
        }
        output
    };
    let gyros = [0, 1, 2]
        .map(|axis: usize| spectrum(&|row| own.get(row).map_or(0.0, |own| own[axis] - mean[axis])));
    // The reference begins `reach` rows before the stretch.
    let beside = |row: usize| {
        let row = (rows.start + row).checked_sub(reach);
        row.and_then(|row| sums.reference.get(row))
    };
    let reference = [0, 1, 2].map(|axis: usize| {
        spectrum(&|row| match row < own.len() + 2 * reach {
            true => beside(row).map_or(0.0, |beside| beside[axis]),
            false => 0.0,
        })
    });
    let back = transforms::inverse(length);
    let products = |gyro: &[Complex64], reference: &[Complex64]| {
        let pairs = gyro.iter().zip(reference);
        let mut input: Vec<Complex64> = pairs
            .map(|(gyro, reference)| gyro.conj() * reference / length as f64)
            .collect();
        // Imaginary rounding errors of real coefficients.
        input[0].im = 0.0;
        if length.is_multiple_of(2) {
            input[length / 2].im = 0.0;
        }
        let mut output = back.make_output_vec();
        if back.process(&mut input, &mut output).is_err() {
            unreachable!("both buffers are as long as planned");
        }
        output
    };
    let across = gyros.each_ref().map(|gyro| {
        reference
            .each_ref()
            .map(|reference| products(gyro, reference))
    });
    let left = (0..=2 * reach).map(|at| {
        // At this lag the stretch is paired with the reference's rows from `start − lag` on.
        let lag = at as i64 - reach as i64;
        let begins = 2 * reach - at;
        let across = Matrix3::from_fn(|gyro, axis| across[gyro][axis][begins]);
        let own = sums.centred(rows.start as i64 - lag, rows.len());
        let ridge = Matrix3::identity() * (1e-9 * own.trace().max(f64::MIN_POSITIVE));
        let inverse = (own + ridge).try_inverse().unwrap_or_default();
        1.0 - (across * inverse * across.transpose()).trace() / whole
    });
    Some(left.collect())
}
