//! Whitening of a series by the true noise, the metric of all strengths and bounds.
//!
//! A series of increments of one gyro \[rad per row\] on the selected rows becomes independent values in units of standard
//! deviations; their inner products are those of the Cramér–Rao bound.
//!
//! The noise of row k is T b_k + w_k + v_k − v_{k−1}: rate random walk, angle random walk, white angle noise. A Kalman
//! filter of (b, v) gives its innovations, exactly and also over gaps. The angle step at the start of each stretch is a
//! free parameter (a joint), so its first row carries no information.
//!
//! Independent of the diagnosis, which whitens in the frequency domain.

use std::ops::Range;

use super::scene::Scene;

/// Quantisation steps of the reference and the pickoff \[rad\]: uniform errors with a twelfth of the square as variance.
const REFERENCE_STEP_RAD: f64 = 4.8e-9;
const PICKOFF_STEP_RAD: f64 = 9.7e-9;

/// Variances of one gyro's residual.
#[derive(Debug, Clone, Copy)]
pub struct Variances {
    /// Variance of w \[rad²\].
    pub walk: f64,
    /// Variance of v \[rad²\].
    pub angle: f64,
    /// Variance of a step of b \[(rad/s)²\].
    pub bias_step: f64,
    /// T \[s\].
    pub period_s: f64,
}

impl Variances {
    /// Variances of gyro `axis` in a scene.
    pub fn of(scene: &Scene, axis: usize) -> Self {
        let levels = &scene.levels;
        let period_s = 1.0 / scene.rate_hz;
        let walk = levels.walk_rad_sqrt_s[axis].powi(2) + levels.reference_walk_rad_sqrt_s.powi(2);
        let pickoff = if scene.is_dithered() {
            levels.pickoff_rad.powi(2) + PICKOFF_STEP_RAD.powi(2) / 12.0
        } else {
            0.0
        };
        Self {
            walk: walk * period_s,
            angle: levels.pulse_rad[axis].powi(2) / 12.0
                + levels.reference_rad.powi(2)
                + REFERENCE_STEP_RAD.powi(2) / 12.0
                + pickoff,
            bias_step: levels.rate_walk_rad_s_sqrt_s[axis].powi(2) * period_s,
            period_s,
        }
    }
}

impl Variances {
    /// ½ Σ (ln S'/S)² over the bins of `rows` rows when variances are added to w and v: deflection by a change of the noise
    /// alone.
    pub fn deflection(&self, walk: f64, angle: f64, rows: usize) -> f64 {
        // the rate random walk dominates only a few bins, and is neglected here
        let power = |walk: f64, angle: f64, bin: usize| {
            let sine = (std::f64::consts::PI * bin as f64 / rows as f64).sin();
            walk + 4.0 * sine * sine * angle
        };
        (1..rows / 2)
            .map(|bin| {
                let before = power(self.walk, self.angle, bin);
                let after = power(self.walk + walk, self.angle + angle, bin);
                // two degrees of freedom a bin
                (after / before).ln().powi(2)
            })
            .sum()
    }
}

/// Row of the filter, common to all series.
#[derive(Debug, Clone, Copy)]
struct Step {
    row: usize,
    /// First row of a stretch: the angle before it is unknown.
    joint: bool,
    gain: [f64; 2],
    spread: f64,
}

/// Kalman filter of one gyro over certain rows.
#[derive(Debug, Clone)]
pub struct Whitener {
    steps: Vec<Step>,
    period_s: f64,
}

impl Whitener {
    /// Computes the gains.
    pub fn new(variances: Variances, ranges: &[Range<usize>]) -> Self {
        let Variances {
            walk,
            angle,
            bias_step,
            period_s,
        } = variances;
        let mut steps = Vec::new();
        // covariance of (b, v)
        let (mut bb, mut bv, mut vv) = (0.0, 0.0, angle);
        let mut row = 0;
        for range in ranges {
            for (place, next) in range.clone().enumerate() {
                bb += bias_step * (next - row) as f64;
                row = next;
                if place == 0 {
                    (bv, vv) = (0.0, angle);
                    steps.push(Step {
                        row: next,
                        joint: true,
                        gain: [0.0; 2],
                        spread: 1.0,
                    });
                    continue;
                }
                let variance = period_s * period_s * bb - 2.0 * period_s * bv + vv + walk + angle;
                let gain = [(period_s * bb - bv) / variance, angle / variance];
                bb -= gain[0] * gain[0] * variance;
                bv = -gain[0] * gain[1] * variance;
                vv = angle - gain[1] * gain[1] * variance;
                steps.push(Step {
                    row: next,
                    joint: false,
                    gain,
                    spread: variance.sqrt(),
                });
            }
        }
        Self { steps, period_s }
    }

    /// Innovations of a series, each over its standard deviation.
    pub fn whiten(&self, series: &[f64]) -> Vec<f64> {
        let (mut b, mut v) = (0.0, 0.0);
        let mut white = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            if step.joint {
                v = 0.0;
                continue;
            }
            let innovation = series[step.row] - (self.period_s * b - v);
            b += step.gain[0] * innovation;
            v = step.gain[1] * innovation;
            white.push(innovation / step.spread);
        }
        white
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn whitening_is_generalised_least_squares_with_the_dense_covariance() {
        let variances = Variances {
            walk: 0.3,
            angle: 1.7,
            bias_step: 0.02,
            period_s: 0.5,
        };
        let ranges = [2..9, 12..17];
        let series: Vec<f64> = (0..20)
            .map(|k| (1.3 * k as f64).sin() + 0.1 * k as f64)
            .collect();
        let rows: Vec<usize> = ranges.iter().flat_map(Clone::clone).collect();
        let count = rows.len();
        let covariance = DMatrix::from_fn(count, count, |a, b| {
            let (i, j) = (rows[a], rows[b]);
            let walked = variances.bias_step * i.min(j) as f64 * variances.period_s.powi(2);
            let same = if i == j {
                variances.walk + 2.0 * variances.angle
            } else {
                0.0
            };
            walked + same
                - if i.abs_diff(j) == 1 {
                    variances.angle
                } else {
                    0.0
                }
        });
        let inverse = covariance.try_inverse().expect("positive definite");
        let y = DVector::from_fn(count, |a, _| series[rows[a]]);
        let joints = DMatrix::from_fn(count, 2, |a, j| {
            f64::from(u8::from(rows[a] == ranges[j].start))
        });
        let against = joints.transpose() * &inverse;
        let inside = (&against * &joints).try_inverse().expect("two joints");
        let fitted = &against * &y;
        let dense = (y.transpose() * &inverse * &y)[0] - (fitted.transpose() * inside * &fitted)[0];
        let white = Whitener::new(variances, &ranges).whiten(&series);
        let ours: f64 = white.iter().map(|w| w * w).sum();
        assert!((ours / dense - 1.0).abs() < 1e-9, "{ours} {dense}");
    }
}
