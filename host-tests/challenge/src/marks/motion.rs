//! Motions in closed form: angle of the case about each body axis as a sum of terms.
//!
//! A term gives its angle and the two derivatives, so that increments are exact differences of angles, and nonlinear
//! effects can be integrated at any resolution.

use std::f64::consts::FRAC_PI_2;

/// Number of rows after which a running phasor is recomputed: its rounding error stays below 1e-13.
const PHASOR_ROWS: usize = 512;

/// Derivative of an angle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Derivative {
    /// The angle \[rad\].
    Angle,
    /// The rate \[rad/s\].
    Rate,
    /// The angular acceleration \[rad/s²\].
    Acceleration,
}

/// Term of an angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Term {
    /// A constant rate \[rad/s\].
    Spin {
        /// Rate \[rad/s\].
        rate_rad_s: f64,
    },
    /// amplitude · sin(ωt + φ).
    Sine {
        /// Amplitude \[rad\].
        amplitude_rad: f64,
        /// ω \[rad/s\].
        angular_frequency_rad_s: f64,
        /// φ \[rad\].
        phase_rad: f64,
    },
    /// amplitude · sin(ωt + ½ s t² + φ): a linear sweep.
    Chirp {
        /// Amplitude \[rad\].
        amplitude_rad: f64,
        /// ω at the start \[rad/s\].
        angular_frequency_rad_s: f64,
        /// s \[rad/s²\].
        sweep_rad_s2: f64,
        /// φ \[rad\].
        phase_rad: f64,
    },
    /// A rotation from rest to rest: angle · (10u³ − 15u⁴ + 6u⁵), u = (t − start)/duration clamped to 0 … 1.
    Turn {
        /// Start \[s\].
        start_s: f64,
        /// Duration \[s\].
        duration_s: f64,
        /// Angle \[rad\].
        angle_rad: f64,
    },
}

impl Term {
    /// Returns the derivative at a time \[s\].
    pub fn at(&self, derivative: Derivative, time_s: f64) -> f64 {
        match *self {
            Self::Spin { rate_rad_s } => match derivative {
                Derivative::Angle => rate_rad_s * time_s,
                Derivative::Rate => rate_rad_s,
                Derivative::Acceleration => 0.0,
            },
            Self::Sine {
                amplitude_rad,
                angular_frequency_rad_s,
                phase_rad,
            } => {
                let order = derivative.order();
                amplitude_rad
                    * angular_frequency_rad_s.powi(order)
                    * (angular_frequency_rad_s * time_s + phase_rad + FRAC_PI_2 * f64::from(order))
                        .sin()
            }
            Self::Chirp {
                amplitude_rad,
                angular_frequency_rad_s,
                sweep_rad_s2,
                phase_rad,
            } => {
                let phase =
                    phase_rad + (angular_frequency_rad_s + 0.5 * sweep_rad_s2 * time_s) * time_s;
                let rate = angular_frequency_rad_s + sweep_rad_s2 * time_s;
                let (sin, cos) = phase.sin_cos();
                amplitude_rad
                    * match derivative {
                        Derivative::Angle => sin,
                        Derivative::Rate => rate * cos,
                        Derivative::Acceleration => sweep_rad_s2 * cos - rate * rate * sin,
                    }
            }
            Self::Turn {
                start_s,
                duration_s,
                angle_rad,
            } => {
                let u = ((time_s - start_s) / duration_s).clamp(0.0, 1.0);
                let shape = match derivative {
                    Derivative::Angle => u * u * u * (10.0 + u * (6.0 * u - 15.0)),
                    Derivative::Rate => 30.0 * u * u * (1.0 - u) * (1.0 - u),
                    Derivative::Acceleration => 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u),
                };
                angle_rad * shape / duration_s.powi(derivative.order())
            }
        }
    }

    /// Adds the derivative at `start_s` + k `period_s` to `sum[k]`.
    fn add_to(&self, derivative: Derivative, start_s: f64, period_s: f64, sum: &mut [f64]) {
        let Self::Sine {
            amplitude_rad,
            angular_frequency_rad_s,
            phase_rad,
        } = *self
        else {
            for (row, value) in sum.iter_mut().enumerate() {
                *value += self.at(derivative, start_s + row as f64 * period_s);
            }
            return;
        };
        let order = derivative.order();
        let amplitude = amplitude_rad * angular_frequency_rad_s.powi(order);
        let phase = phase_rad + FRAC_PI_2 * f64::from(order);
        let (step_sin, step_cos) = (angular_frequency_rad_s * period_s).sin_cos();
        for (block, values) in sum.chunks_mut(PHASOR_ROWS).enumerate() {
            let time_s = start_s + (block * PHASOR_ROWS) as f64 * period_s;
            let (mut sin, mut cos) = (angular_frequency_rad_s * time_s + phase).sin_cos();
            for value in values {
                *value += amplitude * sin;
                (sin, cos) = (
                    sin * step_cos + cos * step_sin,
                    cos * step_cos - sin * step_sin,
                );
            }
        }
    }
}

impl Derivative {
    fn order(self) -> i32 {
        match self {
            Self::Angle => 0,
            Self::Rate => 1,
            Self::Acceleration => 2,
        }
    }
}

/// Motion of the case relative to space: terms of the angle about each body axis.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Motion {
    /// x, y, z.
    pub terms: [Vec<Term>; 3],
}

impl Motion {
    /// Returns the derivative about `axis` at a time \[s\].
    pub fn at(&self, derivative: Derivative, axis: usize, time_s: f64) -> f64 {
        self.terms[axis]
            .iter()
            .map(|term| term.at(derivative, time_s))
            .sum()
    }

    /// Returns the derivative about `axis` at `start_s` + k `period_s`, k below `count`.
    pub fn series(
        &self,
        derivative: Derivative,
        axis: usize,
        start_s: f64,
        period_s: f64,
        count: usize,
    ) -> Vec<f64> {
        let mut sum = vec![0.0; count];
        for term in &self.terms[axis] {
            term.add_to(derivative, start_s, period_s, &mut sum);
        }
        sum
    }

    /// Returns the increments \[rad\] of `rows` rows about `axis`, the first from `start_s` on.
    pub fn increments_rad(
        &self,
        axis: usize,
        start_s: f64,
        period_s: f64,
        rows: usize,
    ) -> Vec<f64> {
        if self.terms[axis].is_empty() {
            return vec![0.0; rows];
        }
        let angles = self.series(Derivative::Angle, axis, start_s, period_s, rows + 1);
        angles.windows(2).map(|pair| pair[1] - pair[0]).collect()
    }

    /// True if there is motion about an axis.
    pub fn moves(&self, axis: usize) -> bool {
        !self.terms[axis].is_empty()
    }
}
