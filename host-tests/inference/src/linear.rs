//! Small dense algebra.

use nalgebra::{DMatrix, SymmetricEigen};

/// Inverse over the directions that are there, rows scaled to unit diagonal before.
pub(crate) fn pseudo_inverse(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    let scale: Vec<f64> = (0..matrix.nrows())
        .map(|k| 1.0 / matrix[(k, k)].max(1e-200).sqrt())
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

/// Σ a b, in eight sums side by side.
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
