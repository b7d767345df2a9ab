//! The orthonormal DCT-II, in which stationary noise with free ends is diagonal.
//!
//! By `rustdct` (on `rustfft`, both maintained by the same author): O(n log n) at any length.

use std::sync::Arc;

use rustdct::{DctPlanner, TransformType2And3};

/// Transforms of one length.
#[derive(Clone)]
pub struct Dct {
    plan: Arc<dyn TransformType2And3<f64>>,
    rows: usize,
}

impl Dct {
    /// Plans transforms of `rows` values.
    pub fn new(rows: usize) -> Self {
        Self {
            plan: DctPlanner::new().plan_dct2(rows),
            rows,
        }
    }

    /// Transforms `values` in place: coefficient k is `√(2/n) Σ y_i cos(π (i + ½) k / n)`, the first one `√(1/n) Σ y_i`.
    ///
    /// # Panics
    /// `values` is not as long as planned.
    pub fn forward(&self, values: &mut [f64]) {
        self.plan.process_dct2(values);
        let scale = (2.0 / self.rows as f64).sqrt();
        values.iter_mut().for_each(|value| *value *= scale);
        values[0] *= 0.5_f64.sqrt();
    }

    /// Undoes [`Dct::forward`].
    ///
    /// # Panics
    /// `values` is not as long as planned.
    pub fn inverse(&self, values: &mut [f64]) {
        let scale = (2.0 / self.rows as f64).sqrt();
        values.iter_mut().for_each(|value| *value *= scale);
        values[0] *= 2.0_f64.sqrt();
        self.plan.process_dct3(values);
    }
}

#[cfg(test)]
mod tests {
    use super::Dct;

    #[test]
    fn a_cosine_of_the_basis_has_one_coefficient_of_unit_size_and_comes_back() {
        for rows in [7_usize, 30, 64] {
            let dct = Dct::new(rows);
            for k in 0..rows {
                let norm = if k == 0 { 1.0 } else { 2.0 } / rows as f64;
                let cosine = |row: usize| {
                    let phase = std::f64::consts::PI * (row as f64 + 0.5) * k as f64 / rows as f64;
                    norm.sqrt() * phase.cos()
                };
                let wave: Vec<f64> = (0..rows).map(cosine).collect();
                let mut values = wave.clone();
                dct.forward(&mut values);
                for (other, value) in values.iter().enumerate() {
                    let expected = if other == k { 1.0 } else { 0.0 };
                    assert!((value - expected).abs() < 1e-12, "{rows} {k} {other}");
                }
                dct.inverse(&mut values);
                for (value, wave) in values.iter().zip(&wave) {
                    assert!((value - wave).abs() < 1e-12);
                }
            }
        }
    }
}
