//! Weighted least squares over columns, and inverses of nearly singular matrices.

use std::borrow::Borrow;

use nalgebra::DMatrix;

use super::portion::Bins;
use super::regressor::{Regressor, gram};

/// Fits the columns to `left` by weighted least squares (normal equations), subtracts them and returns their coefficients.
pub fn fit_away<R: Borrow<Regressor>>(left: &mut Bins, columns: &[R], weights: &[f64]) -> Vec<f64> {
    let columns: Vec<&Regressor> = columns.iter().map(Borrow::borrow).collect();
    let count = columns.len();
    let gram = gram(&columns, left, weights);
    let right = gram.view((count, 0), (1, count)).transpose();
    let sizes = scaled_inverse(&gram.view((0, 0), (count, count)).into_owned()) * right;
    for (column, size) in columns.iter().zip(&sizes) {
        column.add_to(left, -size);
    }
    sizes.iter().copied().collect()
}

/// [`stable_inverse`] of a matrix whose units differ, computed at unit diagonal.
pub fn scaled_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let size = matrix.nrows();
    let scale: Vec<f64> = (0..size)
        .map(|a| matrix[(a, a)].max(f64::MIN_POSITIVE).sqrt().recip())
        .collect();
    let scaled = DMatrix::from_fn(size, size, |a, b| matrix[(a, b)] * scale[a] * scale[b]);
    let inverse = stable_inverse(&scaled);
    DMatrix::from_fn(size, size, |a, b| inverse[(a, b)] * scale[a] * scale[b])
}

/// Pseudo-inverse of a positive semidefinite matrix; eigenvalues below 1e-12 of the largest are left out, being below the
/// rounding of a sum of 1e5 products in double precision.
pub fn stable_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    const SMALLEST: f64 = 1e-12;
    if matrix.nrows() == 0 {
        return matrix.clone();
    }
    let root = matrix.clone().symmetric_eigen();
    let largest = root.eigenvalues.iter().copied().fold(0.0, f64::max);
    let inverted = root.eigenvalues.map(|value| {
        if value > SMALLEST * largest {
            value.recip()
        } else {
            0.0
        }
    });
    &root.eigenvectors * DMatrix::from_diagonal(&inverted) * root.eigenvectors.transpose()
}
