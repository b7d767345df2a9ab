//! Whitening of the steps of a random walk that is measured with white noise.
//!
//! From the covariance of each step's walk, of the measurement at its end and of that at the very start: a transform of
//! vectors to unit covariance.
//!
//! Covariance of the steps: D_m = walk_m + end_m + end_{m−1}, between neighbours −end_m; its Cholesky factor is block
//! bidiagonal and computed step by step, so the cost is linear in the number of steps.

use nalgebra::{Matrix3, Vector3};

/// Inverse Cholesky factor of the covariance.
pub struct Whitener {
    blocks: Vec<Block>,
}

struct Block {
    lower_inverse: Matrix3<f64>,
    from_previous: Matrix3<f64>,
}

impl Whitener {
    /// `begin`: noise of the first measurement; `steps`: walk, and noise of the measurement at the end. The sum must be
    /// positive definite; the caller provides a positive walk.
    pub fn new(
        begin: &Matrix3<f64>,
        steps: impl Iterator<Item = (Matrix3<f64>, Matrix3<f64>)>,
    ) -> Self {
        let mut blocks: Vec<Block> = Vec::new();
        let mut shared = *begin;
        for (walk, end) in steps {
            let from_previous = blocks.last().map_or_else(Matrix3::zeros, |previous| {
                -shared.transpose() * previous.lower_inverse.transpose()
            });
            let left = walk + end + shared - from_previous * from_previous.transpose();
            let lower = left
                .cholesky()
                .expect("a positive walk leaves every step its own noise")
                .unpack();
            let lower_inverse = lower
                .try_inverse()
                .expect("a Cholesky factor has an inverse");
            blocks.push(Block {
                lower_inverse,
                from_previous,
            });
            shared = end;
        }
        Self { blocks }
    }

    /// Vectors of all steps in units of their noise.
    pub fn whiten(&self, steps: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let mut before = Vector3::zeros();
        self.blocks
            .iter()
            .zip(steps)
            .map(|(block, step)| {
                before = block.lower_inverse * (step - block.from_previous * before);
                before
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn whitened_steps_have_the_weight_of_the_whole_inverse_covariance() {
        let walk = Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 0.5));
        let end = Matrix3::new(3.0, 0.4, 0.1, 0.4, 2.0, 0.2, 0.1, 0.2, 1.0);
        let count = 5;
        let whitener = Whitener::new(&end, (0..count).map(|_| (walk, end)));
        let mut covariance = DMatrix::zeros(3 * count, 3 * count);
        for m in 0..count {
            let mut put = |row: usize, column: usize, block: Matrix3<f64>| {
                covariance
                    .fixed_view_mut::<3, 3>(3 * row, 3 * column)
                    .copy_from(&block);
            };
            put(m, m, walk + end * 2.0);
            if m > 0 {
                put(m, m - 1, -end);
                put(m - 1, m, -end);
            }
        }
        let vector =
            |k: usize| Vector3::new((k as f64).sin(), (2.0 * k as f64).cos(), 0.3 - k as f64);
        let steps: Vec<Vector3<f64>> = (0..count).map(vector).collect();
        let stacked = nalgebra::DVector::from_iterator(
            3 * count,
            steps.iter().flat_map(|step| step.iter().copied()),
        );
        let weight = covariance
            .try_inverse()
            .map(|inverse| stacked.dot(&(inverse * &stacked)))
            .expect("positive definite");
        let whitened: f64 = whitener
            .whiten(&steps)
            .iter()
            .map(Vector3::norm_squared)
            .sum();
        assert!((whitened - weight).abs() < 1e-10 * weight);
    }
}
