//! Attitude integrated from the gyros alone.
//!
//! A row rotates the body by the integral of its rates and the coning of adjacent rows (Savage 1998, eq. 33); within a row
//! the angle is interpolated by a cubic spline of the sums.

use nalgebra::{UnitQuaternion, Vector3};

/// Attitudes from increments, starting from the identity.
#[derive(Debug)]
pub struct GyroPath {
    start_s: f64,
    period_s: f64,
    nodes: Vec<UnitQuaternion<f64>>,
    sums: [Spline; 3],
}

impl GyroPath {
    /// Integrates increments of the body \[rad by row\] from `start_s` on.
    pub fn new(body_rad: &[Vector3<f64>], (start_s, period_s): (f64, f64)) -> Self {
        let mut attitude = UnitQuaternion::identity();
        let mut nodes = vec![attitude];
        let mut before = Vector3::zeros();
        let mut sum = Vector3::zeros();
        let mut sums = vec![sum];
        for row in body_rad {
            attitude *= UnitQuaternion::from_scaled_axis(row + before.cross(row) / 12.0);
            attitude.renormalize();
            nodes.push(attitude);
            sum += row;
            sums.push(sum);
            before = *row;
        }
        Self {
            start_s,
            period_s,
            nodes,
            sums: std::array::from_fn(|axis| {
                Spline::new(sums.iter().map(|sum| sum[axis]).collect())
            }),
        }
    }

    /// Attitude at a time \[s\]; `None` outside the record.
    pub fn at(&self, time_s: f64) -> Option<UnitQuaternion<f64>> {
        let place = (time_s - self.start_s) / self.period_s;
        let last = self.nodes.len() - 1;
        if !(0.0..=last as f64).contains(&place) {
            return None;
        }
        let row = (place as usize).min(last - 1);
        let grown = |axis: usize| {
            let sums = &self.sums[axis];
            sums.at(row, place - row as f64) - sums.at(row, 0.0)
        };
        let turned = Vector3::from_fn(|axis, _| grown(axis));
        Some(self.nodes[row] * UnitQuaternion::from_scaled_axis(turned))
    }
}

/// Natural cubic spline over integers.
#[derive(Debug)]
struct Spline {
    values: Vec<f64>,
    /// Second derivatives.
    bends: Vec<f64>,
}

impl Spline {
    fn new(values: Vec<f64>) -> Self {
        let last = values.len() - 1;
        // Thomas algorithm for a tridiagonal matrix: 1, 4, 1.
        let (mut above, mut right) = (vec![0.0; last + 1], vec![0.0; last + 1]);
        for k in 1..last {
            let curved = 6.0 * (values[k + 1] - 2.0 * values[k] + values[k - 1]);
            above[k] = 1.0 / (4.0 - above[k - 1]);
            right[k] = (curved - right[k - 1]) * above[k];
        }
        let mut bends = vec![0.0; last + 1];
        for k in (1..last).rev() {
            bends[k] = right[k] - above[k] * bends[k + 1];
        }
        Self { values, bends }
    }

    /// Value at a fraction of the way from one integer to the next.
    fn at(&self, from: usize, share: f64) -> f64 {
        let bend = |share: f64| (share.powi(3) - share) / 6.0;
        (1.0 - share) * self.values[from]
            + share * self.values[from + 1]
            + bend(1.0 - share) * self.bends[from]
            + bend(share) * self.bends[from + 1]
    }
}
