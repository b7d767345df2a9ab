//! Estimates the angular acceleration from successive increments D_k \[rad per period\], as α̂T² \[rad per period²\].
//!
//! For the gyros' tilts α̂T² = Σ_p a_p (D_{k+p} − D_{k−p}), of the period three before the latest. The a_p are those
//! with which the *product* of α̂_k and D_k rectifies as α × ω does, and not at all where two axes move in phase. For a
//! motion of x = ΩT this requires 2 Σ_p a_p sin(px) · 2(1 − cos x) = x³, that is 2 Σ_p a_p sin(px) = x (x/2 /
//! sin(x/2))². Equal powers of x give Σ_p 2a_p p^{2n+1} (−1)ⁿ/(2n+1)! = g_n with the series of the right-hand side, g =
//! 1, 1/12, 1/240, 1/6048: solved here, not copied from a table.
//!
//! For the size effect, a velocity that telescopes, α̂T² = Σ_p c_p (D_k − D_{k−p}) of the latest period, c_p = 2a_p of four terms.

use nalgebra::{DMatrix, DVector, Vector3};

/// x (x/2 / sin(x/2))² = Σ g_n x^{2n+1}.
const PRODUCT_SERIES: [f64; 4] = [1.0, 1.0 / 12.0, 1.0 / 240.0, 1.0 / 6048.0];

/// Increments on each side of the period whose acceleration is formed.
pub const PAIRS: usize = 3;

/// a_1, a_2, a_3.
pub fn central_coefficients() -> [f64; PAIRS] {
    let doubled = odd_powers_of_sines(&PRODUCT_SERIES[..PAIRS]);
    [0, 1, 2].map(|p| doubled[p] / 2.0)
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

/// The increments about the period whose acceleration is formed.
#[derive(Debug, Clone)]
pub struct Central {
    coefficients: [f64; PAIRS],
    /// D_{k+3} … D_{k−3}; empty before the first increment.
    about_rad: Vec<Vector3<f64>>,
}

/// The acceleration and the increment of the period three before the latest.
#[derive(Debug, Clone, Copy)]
pub struct Centred {
    /// α̂T² \[rad per period²\].
    pub turn_per_period2: Vector3<f64>,
    /// D \[rad\].
    pub increment_rad: Vector3<f64>,
}

impl Default for Central {
    fn default() -> Self {
        Self {
            coefficients: central_coefficients(),
            about_rad: Vec::new(),
        }
    }
}

impl Central {
    /// Takes the latest increment. Before the first one the rate is taken as constant.
    pub fn add(&mut self, increment_rad: Vector3<f64>) -> Centred {
        if self.about_rad.is_empty() {
            self.about_rad = vec![increment_rad; 2 * PAIRS + 1];
        }
        self.about_rad.rotate_right(1);
        self.about_rad[0] = increment_rad;
        let pairs = self.coefficients.iter().zip(1..);
        Centred {
            turn_per_period2: pairs
                .map(|(a, p)| (self.about_rad[PAIRS - p] - self.about_rad[PAIRS + p]) * *a)
                .sum(),
            increment_rad: self.about_rad[PAIRS],
        }
    }
}

/// The acceleration of the latest period, for the size effect, and the increments it remembers.
#[derive(Debug, Clone)]
pub struct Latest {
    coefficients: Vec<f64>,
    /// D_{k−1}, D_{k−2}, …; empty before the first increment.
    before_rad: Vec<Vector3<f64>>,
}

impl Default for Latest {
    fn default() -> Self {
        Self {
            coefficients: odd_powers_of_sines(&PRODUCT_SERIES),
            before_rad: Vec::new(),
        }
    }
}

impl Latest {
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
