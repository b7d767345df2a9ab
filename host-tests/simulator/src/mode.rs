//! Second-order mechanical mode, integrated with the simulator's own quadrature.
//!
//! Frequency in Hz, damping ratio and a drive g at the four nodes of a period give x and x' at the nodes.
//!
//! Equation: x'' + 2ζω₀ x' + ω₀² x = g(t). Gauss collocation at the nodes of [`Quadrature`]: order eight and A-stable, so
//! that a mode far above the sample rate settles to its static limit x = g/ω₀². The stages are linear in (x, x') and in g:
//! solved once, then two small products.
//!
//! Assumes x = x' = 0 at the start.

use super::attitude::Quadrature;
use nalgebra::{SMatrix, SVector, Vector2, Vector4};
use std::f64::consts::TAU;

/// Mode and its state.
#[derive(Debug, Clone)]
pub struct Mode {
    /// ω₀ \[rad/s\].
    pub omega_rad_s: f64,
    /// ζ \[1\].
    pub damping: f64,
    stages_from_state: SMatrix<f64, 8, 2>,
    stages_from_drive: SMatrix<f64, 8, 4>,
    end_from_stages: SMatrix<f64, 2, 8>,
    end_from_drive: Vector4<f64>,
    state: Vector2<f64>,
}

impl Mode {
    /// Mode at rest.
    pub fn new(frequency_hz: f64, damping: f64, quadrature: &Quadrature, period_s: f64) -> Self {
        let omega_rad_s = TAU * frequency_hz;
        let (stiffness, friction) = (omega_rad_s.powi(2), 2.0 * damping * omega_rad_s);
        // rows 2i and 2i + 1 hold x and x' at node i
        let mut system = SMatrix::<f64, 8, 8>::identity();
        let mut drive = SMatrix::<f64, 8, 4>::zeros();
        let mut end_from_stages = SMatrix::<f64, 2, 8>::zeros();
        for i in 0..4 {
            for j in 0..4 {
                let step = period_s * quadrature.collocation[(i, j)];
                system[(2 * i, 2 * j + 1)] -= step;
                system[(2 * i + 1, 2 * j)] += step * stiffness;
                system[(2 * i + 1, 2 * j + 1)] += step * friction;
                drive[(2 * i + 1, j)] = step;
            }
            let weight = period_s * quadrature.weights[i];
            end_from_stages[(0, 2 * i + 1)] = weight;
            end_from_stages[(1, 2 * i)] = -weight * stiffness;
            end_from_stages[(1, 2 * i + 1)] = -weight * friction;
        }
        let solve = system
            .try_inverse()
            .expect("Gauss collocation of a damped mode always has a solution");
        let states = SMatrix::<f64, 8, 2>::from_fn(|row, column| f64::from(row % 2 == column));
        Self {
            omega_rad_s,
            damping,
            stages_from_state: solve * states,
            stages_from_drive: solve * drive,
            end_from_stages,
            end_from_drive: Vector4::from(quadrature.weights) * period_s,
            state: Vector2::zeros(),
        }
    }

    /// Advances the mode by one period; returns x and x' at its nodes.
    pub fn advance(&mut self, drive: [f64; 4]) -> [[f64; 2]; 4] {
        let drive = Vector4::from(drive);
        let stages: SVector<f64, 8> =
            self.stages_from_state * self.state + self.stages_from_drive * drive;
        self.state += self.end_from_stages * stages;
        self.state[1] += self.end_from_drive.dot(&drive);
        std::array::from_fn(|node| [stages[2 * node], stages[2 * node + 1]])
    }

    /// x'' for known x, x' and drive.
    pub fn second_derivative(&self, drive: f64, [value, slope]: [f64; 2]) -> f64 {
        drive - 2.0 * self.damping * self.omega_rad_s * slope - self.omega_rad_s.powi(2) * value
    }
}
