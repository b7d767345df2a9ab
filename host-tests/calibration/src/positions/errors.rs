//! Accelerometer errors applied to a specific force, and their inverse: the contract's equations for a unit at rest.

use nalgebra::Vector3;
use rlg_model::{Model, ModelEffect};
use rlg_signal::axes::AXES;

/// Errors of three accelerometers at rest, where delays and lever arms have no effect.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    /// b_i \[m/s²\].
    pub bias_m_s2: [f64; 3],
    /// s_i \[1\].
    pub scale: [f64; 3],
    /// δ_ij, sensing axis i about body axis j \[rad\].
    pub tilt_rad: [[f64; 3]; 3],
    /// q_i \[s²/m\].
    pub quadratic_s2_m: [f64; 3],
}

impl Errors {
    /// Errors of a model's effects, and the model's accelerometer bias.
    pub fn of_model(model: &Model) -> Self {
        let mut errors = Self::default();
        if let Some(accelerometer) = &model.accelerometer {
            errors.bias_m_s2 = accelerometer.bias_m_s2;
        }
        for effect in &model.effects {
            errors.add(effect);
        }
        errors
    }

    /// Adds an effect; effects other than those of accelerometers are ignored.
    pub fn add(&mut self, effect: &ModelEffect) {
        for (i, axis) in AXES.iter().enumerate() {
            let own = effect.number(axis);
            match effect.kind.as_str() {
                "accel_bias" => self.bias_m_s2[i] += own,
                "accel_scale" => self.scale[i] += own,
                "accel_quadratic" => self.quadratic_s2_m[i] += own,
                "accel_misalignment" => {
                    for (j, about) in AXES.iter().enumerate() {
                        self.tilt_rad[i][j] += effect.number(&format!("{axis}{about}"));
                    }
                }
                _ => {}
            }
        }
    }

    /// Sum of two sets of errors.
    pub fn plus(&self, more: &Self) -> Self {
        let sum = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|i: usize| a[i] + b[i]);
        Self {
            bias_m_s2: sum(self.bias_m_s2, more.bias_m_s2),
            scale: sum(self.scale, more.scale),
            tilt_rad: [0, 1, 2].map(|i: usize| sum(self.tilt_rad[i], more.tilt_rad[i])),
            quadratic_s2_m: sum(self.quadratic_s2_m, more.quadratic_s2_m),
        }
    }

    /// Error of a measured force \[m/s²\], x y z.
    pub fn added_m_s2(&self, force_m_s2: &Vector3<f64>) -> Vector3<f64> {
        Vector3::from_fn(|i, _| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let f = force_m_s2;
            self.bias_m_s2[i] + self.scale[i] * f[i] + self.tilt_rad[i][k] * f[j]
                - self.tilt_rad[i][j] * f[k]
                + self.quadratic_s2_m[i] * f[i] * f[i]
        })
    }

    /// Specific force that accelerometers with these errors and the model's scale error measure as `read_m_s2` \[m/s²\]
    /// (fixed-point iteration).
    pub fn undone_m_s2(&self, read_m_s2: &Vector3<f64>, scale_error: [f64; 3]) -> Vector3<f64> {
        /// Errors of a twentieth converge to below rounding.
        const STEPS: usize = 14;
        let read = Vector3::from_fn(|i, _| read_m_s2[i] * (1.0 - scale_error[i]));
        (0..STEPS).fold(read, |force, _| read - self.added_m_s2(&force))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_errors_add_is_taken_away_again() {
        let mut errors = Errors {
            bias_m_s2: [0.3, -0.2, 0.1],
            scale: [0.03, 0.01, -0.04],
            quadratic_s2_m: [2e-4, 0.0, -5e-4],
            ..Errors::default()
        };
        errors.tilt_rad[0] = [0.0, 0.02, -0.03];
        errors.tilt_rad[2] = [0.01, 0.04, 0.0];
        let scale_error = [0.02, 0.0, -0.01];
        let force = Vector3::new(3.0, -8.0, 4.5);
        let added = errors.added_m_s2(&force);
        // z: + δ_zy f_x − δ_zx f_y
        let expected = 0.1 - 0.04 * 4.5 + 0.04 * 3.0 + 0.01 * 8.0 - 5e-4 * 4.5 * 4.5;
        assert!((added.z - expected).abs() < 1e-12);
        let sensed = force + added;
        let read = Vector3::from_fn(|i, _| sensed[i] / (1.0 - scale_error[i]));
        let undone = errors.undone_m_s2(&read, scale_error);
        assert!((undone - force).norm() < 1e-9, "{undone}");
    }
}
