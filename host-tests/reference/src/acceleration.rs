//! Estimates the angular acceleration from successive increments.
//!
//! From increments D_k \[rad per period\] it forms α̂T² = Σ_p c_p (D_k − D_{k−p}) \[rad per period²\].
//!
//! The c_p are those with which the *product* of α̂_k and D_k rectifies as α × ω does. For a motion of
//! x = ΩT that asks Σ_p c_p sin(px) · 2(1 − cos x) = x³, that is Σ_p c_p sin(px) = x (x/2 / sin(x/2))².
//! Equal powers of x give Σ_p c_p p^{2n+1} (−1)ⁿ/(2n+1)! = g_n with the series of the right-hand side,
//! g = 1, 1/12, 1/240, 1/6048: solved here, not copied from a table.

use nalgebra::{DMatrix, DVector, Vector3};

/// x (x/2 / sin(x/2))² = Σ g_n x^{2n+1}.
const PRODUCT_SERIES: [f64; 4] = [1.0, 1.0 / 12.0, 1.0 / 240.0, 1.0 / 6048.0];

/// c_1 … c_order.
pub fn coefficients(order: usize) -> Vec<f64> {
    odd_powers_of_sines(&PRODUCT_SERIES[..order])
}

/// The c_p, p = 1 …, with Σ_p c_p sin(px) = Σ_n series_n x^{2n+1} to as many powers as there are terms.
pub(super) fn odd_powers_of_sines(series: &[f64]) -> Vec<f64> {
    let order = series.len();
    let matrix = DMatrix::from_fn(order, order, |n, p| {
        let power = 2 * n + 1;
        let factorial: f64 = (1..=power).map(|m| m as f64).product();
        let sign = if n % 2 == 0 { 1.0 } else { -1.0 };
        sign * ((p + 1) as f64).powi(power as i32) / factorial
    });
    let solution = matrix
        .lu()
        .solve(&DVector::from_column_slice(series))
        // rows of distinct odd powers of 1, 2, … are independent
        .expect("a Vandermonde matrix of distinct nodes can be solved");
    solution.iter().copied().collect()
}

/// The filter and the increments it remembers.
#[derive(Debug, Clone)]
pub struct Acceleration {
    coefficients: Vec<f64>,
    /// D_{k−1}, D_{k−2}, …; empty before the first increment.
    before_rad: Vec<Vector3<f64>>,
}

impl Acceleration {
    /// With `order` terms, 1 to 4.
    pub fn new(order: usize) -> Self {
        Self {
            coefficients: coefficients(order),
            before_rad: Vec::new(),
        }
    }

    /// α̂T² with this increment the latest. Before the first one the rate is taken as constant.
    pub fn add(&mut self, increment_rad: Vector3<f64>) -> Vector3<f64> {
        if self.before_rad.is_empty() {
            self.before_rad = vec![increment_rad; self.coefficients.len()];
        }
        let acceleration = self
            .coefficients
            .iter()
            .zip(&self.before_rad)
            .map(|(c, before)| (increment_rad - before) * *c)
            .sum();
        self.before_rad.rotate_right(1);
        self.before_rad[0] = increment_rad;
        acceleration
    }
}
