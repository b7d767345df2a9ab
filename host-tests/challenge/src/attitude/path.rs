//! Attitude of a motion with body rates in closed form.
//!
//! q̇ = ½ q ω by the fourth-order Magnus expansion at two Gauss–Legendre nodes (Iserles, Munthe-Kaas, Nørsett and Zanna
//! 2000, sec. 4): a step rotates by h/2 (ω₁ + ω₂) + √3/12 h² ω₁ × ω₂.

use nalgebra::{UnitQuaternion, Vector3};

use crate::marks::motion::{Derivative, Motion};

/// Steps of a row.
const STEPS: usize = 16;

/// Attitudes at the ends of rows, and at any time between them.
#[derive(Debug, Clone)]
pub struct Path<'a> {
    motion: &'a Motion,
    start_s: f64,
    period_s: f64,
    nodes: Vec<UnitQuaternion<f64>>,
}

impl<'a> Path<'a> {
    /// Integrates `rows` rows of `period_s` from `start_s` on, with the identity as initial attitude.
    pub fn new(motion: &'a Motion, start_s: f64, period_s: f64, rows: usize) -> Self {
        let step_s = period_s / STEPS as f64;
        let at_nodes = gauss_nodes().map(|node| {
            let rates = |axis| {
                let begin_s = start_s + node * step_s;
                motion.series(Derivative::Rate, axis, begin_s, step_s, rows * STEPS)
            };
            [0, 1, 2].map(rates)
        });
        let rate =
            |node: usize, step: usize| Vector3::from_fn(|axis, _| at_nodes[node][axis][step]);
        let mut attitude = UnitQuaternion::identity();
        let mut nodes = vec![attitude];
        for row in 0..rows {
            for step in row * STEPS..(row + 1) * STEPS {
                attitude *= turn(rate(0, step), rate(1, step), step_s);
            }
            attitude.renormalize();
            nodes.push(attitude);
        }
        Self {
            motion,
            start_s,
            period_s,
            nodes,
        }
    }

    /// Returns the attitude, body to navigation frame, at a time \[s\].
    pub fn at(&self, time_s: f64) -> UnitQuaternion<f64> {
        let row = ((time_s - self.start_s) / self.period_s).floor();
        let row = row.clamp(0.0, (self.nodes.len() - 1) as f64) as usize;
        let begin_s = self.start_s + row as f64 * self.period_s;
        let steps = (STEPS as f64 * (time_s - begin_s).abs() / self.period_s).ceil();
        let step_s = (time_s - begin_s) / steps.max(1.0);
        (0..steps as usize).fold(self.nodes[row], |attitude, step| {
            let [first, second] =
                gauss_nodes().map(|node| self.rate_rad_s(begin_s + (step as f64 + node) * step_s));
            attitude * turn(first, second, step_s)
        })
    }

    /// Returns the body's rate at a time \[rad/s\].
    pub fn rate_rad_s(&self, time_s: f64) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.motion.at(Derivative::Rate, axis, time_s))
    }

    /// Returns the attitudes at the ends of `count` rows from `start_s`, an end of a row, on, and before the first.
    pub fn at_ends(&self, start_s: f64, count: usize) -> &[UnitQuaternion<f64>] {
        let first = ((start_s - self.start_s) / self.period_s).round() as usize;
        &self.nodes[first..=first + count]
    }
}

/// Nodes on 0 … 1.
fn gauss_nodes() -> [f64; 2] {
    [-1.0, 1.0].map(|side| 0.5 + side * 3_f64.sqrt() / 6.0)
}

fn turn(first: Vector3<f64>, second: Vector3<f64>, step_s: f64) -> UnitQuaternion<f64> {
    let angle = 0.5 * step_s * (first + second)
        + 3_f64.sqrt() / 12.0 * step_s * step_s * first.cross(&second);
    UnitQuaternion::from_scaled_axis(angle)
}
