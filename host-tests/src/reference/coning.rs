//! Increments of many periods → one rotation vector.
//!
//! Enters: increments D_k \[rad\], body frame. Leaves, every N of them: Φ = Σ D + β \[rad\].
//!
//! Equation (Bortz, to second order): β = ½ ∫ θ × ω dt. Between periods that is ½ θ_{k−1} × D_k with θ the
//! sum since the interval began; within a period it is (c₁ D_{k−1} + c₂ D_{k−2}) × D_k, with the c_j that
//! make it right for coning: Σ_j c_j sin(jx) · 2(1 − cos x) = ½ (x − sin x), x = ΩT, to the fifth power.
//!
//! The same two terms as the chain under test have: what is compared is arithmetic, not the order of the
//! algorithm. Left at 4 kHz, 100 Hz, 0.1°: 6e-5 °/h.

use super::acceleration::odd_powers_of_sines;
use nalgebra::Vector3;

/// ½ (x − sin x) / (2(1 − cos x)) = x/12 + x³/360 + …
const WITHIN_SERIES: [f64; 2] = [1.0 / 12.0, 1.0 / 360.0];

/// The sums under way.
#[derive(Debug, Clone)]
pub struct Coning {
    coefficients: Vec<f64>,
    periods_per_output: usize,
    periods: usize,
    angle_rad: Vector3<f64>,
    correction_rad: Vector3<f64>,
    /// D_{k−1}, D_{k−2}.
    before_rad: [Vector3<f64>; 2],
}

impl Coning {
    /// Over `periods_per_output` increments each.
    pub fn new(periods_per_output: usize) -> Self {
        Self {
            coefficients: odd_powers_of_sines(&WITHIN_SERIES),
            periods_per_output,
            periods: 0,
            angle_rad: Vector3::zeros(),
            correction_rad: Vector3::zeros(),
            before_rad: [Vector3::zeros(); 2],
        }
    }

    /// Adds one increment; gives the rotation vector when the interval is complete.
    pub fn add(&mut self, increment_rad: Vector3<f64>) -> Option<Vector3<f64>> {
        let [one, two] = self.before_rad;
        let lever = self.angle_rad * 0.5 + one * self.coefficients[0] + two * self.coefficients[1];
        self.correction_rad += lever.cross(&increment_rad);
        self.angle_rad += increment_rad;
        self.before_rad = [increment_rad, one];
        self.periods += 1;
        if self.periods < self.periods_per_output {
            return None;
        }
        self.periods = 0;
        let rotation = self.angle_rad + self.correction_rad;
        self.angle_rad = Vector3::zeros();
        self.correction_rad = Vector3::zeros();
        Some(rotation)
    }
}
