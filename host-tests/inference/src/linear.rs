//! Small dense algebra.

use std::ops::Range;

use nalgebra::{DMatrix, SymmetricEigen};

/// Information below which a direction is empty.
pub(crate) const LEAST_INFORMATION: f64 = 1e-200;

/// Pseudo-inverse over the nonzero eigenvalues, after scaling to unit diagonal.
pub fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    pseudo_inverse_beside(matrix, matrix)
}

/// Pseudo-inverse of a Schur complement, scaled by the diagonal of the `whole` matrix: smaller eigenvalues are rounding.
pub fn pseudo_inverse_beside(matrix: &DMatrix<f64>, whole: &DMatrix<f64>) -> DMatrix<f64> {
    let scale: Vec<f64> = (0..matrix.nrows())
        .map(|k| 1.0 / whole[(k, k)].max(1e-200).sqrt())
        .collect();
    let count = matrix.nrows();
    if count == 0 {
        return matrix.clone();
    }
    let scaled = DMatrix::from_fn(count, count, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let eigen = SymmetricEigen::new(scaled);
    let mut inverse = DMatrix::zeros(count, count);
    for (value, direction) in eigen
        .eigenvalues
        .iter()
        .zip(eigen.eigenvectors.column_iter())
    {
        if *value > 1e-8 {
            inverse += direction * direction.transpose() / *value;
        }
    }
    DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j])
}

/// Dot product Σ a b, in eight parallel sums.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a_eight, b_eight) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a_eight
        .remainder()
        .iter()
        .zip(b_eight.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in a_eight.zip(b_eight) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Inverse and ln determinant of a positive matrix, after scaling to unit diagonal.
pub fn invert(precision: &DMatrix<f64>) -> (DMatrix<f64>, f64) {
    let count = precision.nrows();
    if count == 0 {
        return (DMatrix::zeros(0, 0), 0.0);
    }
    let scale: Vec<f64> = (0..count)
        .map(|k| 1.0 / precision[(k, k)].max(LEAST_INFORMATION).sqrt())
        .collect();
    // Collinear members make the matrix singular; their set is rejected by its rank.
    for ridge in [1e-12, 1e-9, 1e-6] {
        let mut scaled =
            DMatrix::from_fn(count, count, |i, j| precision[(i, j)] * scale[i] * scale[j]);
        for k in 0..count {
            scaled[(k, k)] += ridge;
        }
        if let Some(cholesky) = scaled.cholesky() {
            let log_determinant = 2.0
                * (0..count)
                    .map(|k| cholesky.l_dirty()[(k, k)].ln() - scale[k].ln())
                    .sum::<f64>();
            let inverse = cholesky.inverse();
            let inverse =
                DMatrix::from_fn(count, count, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
            return (inverse, log_determinant);
        }
    }
    (DMatrix::zeros(count, count), f64::INFINITY)
}

/// Diagonal block of a matrix.
pub(crate) fn sub_matrix(matrix: &DMatrix<f64>, block: &Range<usize>) -> DMatrix<f64> {
    matrix
        .view((block.start, block.start), (block.len(), block.len()))
        .into_owned()
}
