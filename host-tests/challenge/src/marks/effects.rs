//! Concealed effects of a recording: the contract's equations on closed-form motion.
//!
//! Independent of the simulator's and of the diagnosis' own equations: linear effects are exact differences of angles,
//! the others are integrated over each row at three Gauss–Legendre nodes.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::case::Case;
use super::motion::Derivative;

/// Nodes and weights on 0 … 1.
pub const GAUSS: [(f64, f64); 3] = [
    (0.112_701_665_379_258_31, 5.0 / 18.0),
    (0.5, 8.0 / 18.0),
    (0.887_298_334_620_741_7, 5.0 / 18.0),
];

/// x, y, z in parameter names.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// An effect with its parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// The contract's kind.
    pub kind: &'static str,
    /// Gyro of a step or slip.
    pub axis: Option<usize>,
    /// Parameters by the contract's names; a `time_s` is no size.
    pub values: BTreeMap<String, f64>,
}

/// Effect with its strength.
#[derive(Debug, Clone, PartialEq)]
pub struct Strong {
    /// The effect.
    pub effect: Effect,
    /// Matched-filter SNR in the added noise.
    pub rho: f64,
}

/// Concealed effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Concealed {
    /// The contract's kind.
    pub kind: String,
    /// Parameters by the contract's names.
    pub parameters: Map<String, Value>,
    /// Matched-filter SNR in the added noise.
    pub rho: f64,
}

impl Strong {
    /// Converts the effect to its form in the commitment.
    pub fn concealed(&self) -> Concealed {
        let axis = self
            .effect
            .axis
            .map(|axis| ("axis".to_owned(), Value::from(AXES[axis])));
        let numbers = self.effect.values.iter();
        let numbers = numbers.map(|(name, value)| (name.clone(), Value::from(*value)));
        Concealed {
            kind: self.effect.kind.to_owned(),
            parameters: axis.into_iter().chain(numbers).collect(),
            rho: self.rho,
        }
    }
}

/// Contribution of an effect to increments \[rad\].
#[derive(Debug, Clone, PartialEq)]
pub struct Perturbation {
    /// Contribution to the rates sensed by the gyros, before 1/(1 − s).
    pub gyro_rad: [Vec<f64>; 3],
    /// Contribution to the reference's increments.
    pub reference_rad: [Vec<f64>; 3],
}

impl Perturbation {
    /// Returns a zero perturbation of some rows.
    pub fn none(rows: usize) -> Self {
        let zeros = || std::array::from_fn(|_| vec![0.0; rows]);
        Self {
            gyro_rad: zeros(),
            reference_rad: zeros(),
        }
    }

    /// Adds another one.
    pub fn add(&mut self, other: &Self) {
        for axis in 0..3 {
            add_scaled(&mut self.gyro_rad[axis], 1.0, &other.gyro_rad[axis]);
            add_scaled(
                &mut self.reference_rad[axis],
                1.0,
                &other.reference_rad[axis],
            );
        }
    }

    /// Returns the effect on gyro less reference \[rad\].
    pub fn residual_rad(&self, axis: usize, sensing_from_body: &Matrix3<f64>) -> Vec<f64> {
        let mut left = self.gyro_rad[axis].clone();
        for (body, read) in self.reference_rad.iter().enumerate() {
            add_scaled(&mut left, -sensing_from_body[(axis, body)], read);
        }
        left
    }
}

fn add_scaled(sum: &mut [f64], factor: f64, series: &[f64]) {
    if factor != 0.0 {
        for (value, more) in sum.iter_mut().zip(series) {
            *value += factor * more;
        }
    }
}

/// Gyro i and tilt axis j of a name such as "xy".
fn pair(name: &str) -> Option<(usize, usize)> {
    let mut letters = name
        .chars()
        .map(|letter| AXES.iter().position(|axis| axis.starts_with(letter)));
    Some((letters.next()??, letters.next()??))
}

impl Effect {
    /// Returns a parameter by the contract's name; 0 if absent.
    pub fn value(&self, name: &str) -> f64 {
        self.values.get(name).copied().unwrap_or(0.0)
    }

    /// Returns the parameters x, y, z.
    pub fn by_axis(&self) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.value(AXES[axis]))
    }

    /// Returns the same effect with every size multiplied.
    pub fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        for (name, value) in &mut scaled.values {
            if name != "time_s" {
                *value *= factor;
            }
        }
        scaled
    }

    /// Returns the largest size among the parameters.
    pub fn largest(&self) -> f64 {
        self.values
            .iter()
            .filter(|(name, _)| *name != "time_s")
            .map(|(_, value)| value.abs())
            .fold(0.0, f64::max)
    }

    /// Returns the effect's contribution to the increments of a case.
    pub fn perturbation(&self, case: &Case, sensing_from_body: &Matrix3<f64>) -> Perturbation {
        let mut added = Perturbation::none(case.rows);
        match self.kind {
            "gyro_bias_step" | "counter_slip" => self.add_event(case, &mut added),
            "gyro_delay" => self.add_gyro_delay(case, sensing_from_body, &mut added),
            "reference_delay" | "reference_scale" | "reference_misalignment" => {
                self.add_to_reference(case, &mut added);
            }
            "installation" | "axis_flexure" | "gyro_g_bias" => self.add_pairs(case, &mut added),
            _ => self.add_own(case, &mut added),
        }
        added
    }

    /// Effects with one parameter a gyro.
    fn add_own(&self, case: &Case, added: &mut Perturbation) {
        for (axis, name) in AXES.iter().enumerate() {
            let size = self.value(name);
            if size == 0.0 {
                continue;
            }
            let shape = match self.kind {
                "gyro_bias" => vec![case.period_s; case.rows],
                "gyro_scale" => case.increments_rad[axis].clone(),
                // Smoothing by its variance: v/2 times the second derivative.
                "gyro_bandwidth" => {
                    let increments = &case.increments_rad[axis];
                    let last = case.rows - 1;
                    let at = |row: usize| increments[row];
                    (0..case.rows)
                        .map(|row| {
                            at(row.saturating_sub(1)) - 2.0 * at(row) + at((row + 1).min(last))
                        })
                        .map(|second| 0.5 * second / case.period_s.powi(2))
                        .collect()
                }
                "gyro_scale_asymmetry" => {
                    integral(case, |node_s| rates(case, axis, node_s), |rate| rate.abs())
                }
                "gyro_scale_quadratic" => {
                    integral(case, |node_s| rates(case, axis, node_s), |rate| rate * rate)
                }
                // Temperature at the row's middle, from that at its two ends; the first row begins at the start.
                "gyro_bias_temperature" => {
                    case.warming_k.as_ref().map_or_else(Vec::new, |warming| {
                        let ends = &warming[axis];
                        let before = std::iter::once(&0.0).chain(ends);
                        before
                            .zip(ends)
                            .map(|(begin, end)| 0.5 * (begin + end) * case.period_s)
                            .collect()
                    })
                }
                _ => Vec::new(),
            };
            add_scaled(&mut added.gyro_rad[axis], size, &shape);
        }
    }

    /// Effects with a parameter for each gyro and another axis.
    fn add_pairs(&self, case: &Case, added: &mut Perturbation) {
        for (name, &size) in &self.values {
            let Some((gyro, about)) = pair(name) else {
                continue;
            };
            if self.kind == "gyro_g_bias" {
                if let Some(force) = &case.force_m_s2 {
                    let sum = &mut added.gyro_rad[gyro];
                    add_scaled(sum, size * case.period_s, &force[about]);
                }
                continue;
            }
            // i, j, k cyclic: gyro i senses + δ_ik ω_j − δ_ij ω_k
            let third = 3 - gyro - about;
            let sign = if (gyro + 1) % 3 == about { -1.0 } else { 1.0 };
            if self.kind == "installation" {
                let sum = &mut added.gyro_rad[gyro];
                add_scaled(sum, sign * size, &case.increments_rad[third]);
            } else {
                let bent = integral(
                    case,
                    |node_s| {
                        let alpha = series(case, Derivative::Acceleration, about, node_s);
                        let rate = series(case, Derivative::Rate, third, node_s);
                        alpha.iter().zip(&rate).map(|(a, w)| -a * w).collect()
                    },
                    |product| product,
                );
                add_scaled(&mut added.gyro_rad[gyro], sign * size, &bent);
            }
        }
    }

    fn add_event(&self, case: &Case, added: &mut Perturbation) {
        let (Some(axis), time_s, size) = (self.axis, self.value("time_s"), self.value("size"))
        else {
            return;
        };
        for (row, value) in added.gyro_rad[axis].iter_mut().enumerate() {
            let (begin_s, end_s) = (row as f64 * case.period_s, (row + 1) as f64 * case.period_s);
            if self.kind == "gyro_bias_step" {
                *value += size * (end_s - time_s.max(begin_s)).max(0.0);
            } else if (begin_s..end_s).contains(&time_s) {
                *value += size;
            }
        }
    }

    fn add_gyro_delay(
        &self,
        case: &Case,
        sensing_from_body: &Matrix3<f64>,
        added: &mut Perturbation,
    ) {
        for (gyro, name) in AXES.iter().enumerate() {
            let delay_s = self.value(name);
            if delay_s == 0.0 {
                continue;
            }
            for body in 0..3 {
                let late = lateness(case, body, delay_s);
                let share = sensing_from_body[(gyro, body)];
                add_scaled(&mut added.gyro_rad[gyro], share, &late);
            }
        }
    }

    fn add_to_reference(&self, case: &Case, added: &mut Perturbation) {
        for (axis, sum) in added.reference_rad.iter_mut().enumerate() {
            match self.kind {
                "reference_delay" => {
                    add_scaled(sum, 1.0, &lateness(case, axis, self.value("all")));
                }
                "reference_scale" => {
                    add_scaled(sum, self.value(AXES[axis]), &case.increments_rad[axis]);
                }
                // ω − r × ω
                _ => {
                    let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                    add_scaled(sum, -self.value(AXES[j]), &case.increments_rad[k]);
                    add_scaled(sum, self.value(AXES[k]), &case.increments_rad[j]);
                }
            }
        }
    }
}

/// Delayed increments less increments \[rad\].
fn lateness(case: &Case, axis: usize, delay_s: f64) -> Vec<f64> {
    let mut late = case
        .motion
        .increments_rad(axis, -delay_s, case.period_s, case.rows);
    add_scaled(&mut late, -1.0, &case.increments_rad[axis]);
    late
}

fn series(case: &Case, derivative: Derivative, axis: usize, start_s: f64) -> Vec<f64> {
    case.motion
        .series(derivative, axis, start_s, case.period_s, case.rows)
}

fn rates(case: &Case, axis: usize, start_s: f64) -> Vec<f64> {
    series(case, Derivative::Rate, axis, start_s)
}

/// Integrates a function of a series over each row.
fn integral(case: &Case, at: impl Fn(f64) -> Vec<f64>, function: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut sum = vec![0.0; case.rows];
    for (node, weight) in GAUSS {
        let values = at(node * case.period_s);
        for (value, own) in sum.iter_mut().zip(values) {
            *value += weight * case.period_s * function(own);
        }
    }
    sum
}
