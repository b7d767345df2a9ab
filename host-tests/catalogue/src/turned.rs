//! Rotated reference: a rotation beyond the small angles for which its linear term suffices.
//!
//! A reference rotated by the rotation vector r outputs m = Rᵀ(r) ω, so that the case rotates with ω = R(r) m.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use rlg_inference::{Fixed, Term};

use crate::candidates::{Candidate, Pool, along};
use crate::column::Column;
use crate::sensed::Sensed;
use crate::signals::{AXES, Signals};

/// The contract's kind.
pub const TURNED: &str = "reference_misalignment";

/// Kind of the scale error of a reference, rotated or not.
const STRETCHED: &str = "reference_scale";

/// Computes the increment of a rotation over the identity: R(r) − 1.
///
/// # Inputs
/// `turned_rad`: rotation vector \[rad\], body axes.
pub fn turn(turned_rad: Vector3<f64>) -> Matrix3<f64> {
    Rotation3::from_scaled_axis(turned_rad).into_inner() - Matrix3::identity()
}

/// Rotation vector \[rad\] of the rotation nearest to a map from the reference's output to the case's rate.
pub fn nearest(map: &Matrix3<f64>) -> Vector3<f64> {
    let parts = map.svd(true, true);
    let (Some(left), Some(right)) = (parts.u, parts.v_t) else {
        return Vector3::zeros();
    };
    // By the quaternion: the arc cosine of a trace is inaccurate at small angles.
    let rotation = Rotation3::from_matrix_unchecked(left * right);
    UnitQuaternion::from_rotation_matrix(&rotation).scaled_axis()
}

/// Derivative of R(r) with respect to a component of r: R(r) [J e]×, J the right Jacobian of the rotation group
/// 1 − (1 − cos θ)/θ² [r]× + (θ − sin θ)/θ³ [r]×² (Solà, "A micro Lie theory", Eq. 143).
fn by_component(turned_rad: Vector3<f64>, component: usize) -> Matrix3<f64> {
    let angle = turned_rad.norm();
    // Below this the next terms of both series are smaller than one part in 1e16.
    let (first, second) = if angle < 1e-4 {
        (0.5, 1.0 / 6.0)
    } else {
        let square = angle * angle;
        let (sin, cos) = angle.sin_cos();
        ((1.0 - cos) / square, (angle - sin) / (square * angle))
    };
    let cross = turned_rad.cross_matrix();
    let jacobian = Matrix3::identity() - cross * first + cross * cross * second;
    let about: Vector3<f64> = jacobian.column(component).into();
    Rotation3::from_scaled_axis(turned_rad).into_inner() * about.cross_matrix()
}

/// Sensed increment of each gyro per unit output of each reference axis \[1\], for a map from output to the case's
/// rate.
fn sensed(map: &Matrix3<f64>, signals: &Signals) -> Matrix3<f64> {
    Matrix3::from_fn(|gyro, axis| {
        let body = 0..3;
        body.map(|body| along(signals, gyro, body) * map[(body, axis)])
            .sum()
    })
}

/// Terms of a rotated reference in the gyros' increments beyond its output: gyro, column, size.
pub fn known_turn(turned_rad: Vector3<f64>, signals: &Signals) -> Vec<(usize, Sensed, f64)> {
    let sizes = sensed(&turn(turned_rad), signals);
    let all = (0..3).flat_map(|gyro| (0..3).map(move |axis| (gyro, axis)));
    all.map(|(gyro, axis)| {
        let column = Sensed::known(Column::Increment(axis));
        (gyro, column, sizes[(gyro, axis)])
    })
    .collect()
}

impl Pool {
    /// Terms of a kind with a rotated reference: effects of gyros act on the case's motion, those of the reference on
    /// its output.
    ///
    /// # Inputs
    /// `turned_rad`: rotation vector \[rad\] of the reference.
    pub fn carried(
        &mut self,
        (kind, terms): (&str, Vec<Term>),
        turned_rad: Vector3<f64>,
        signals: &Signals,
    ) -> Vec<Term> {
        let rotation = turn(turned_rad) + Matrix3::identity();
        let read = sensed(&rotation, signals);
        let (increments, mut carried): (Vec<Term>, Vec<Term>) = terms
            .into_iter()
            .partition(|term| self.increment(term).is_some());
        let mut sizes: BTreeMap<(usize, usize, usize), f64> = BTreeMap::new();
        for term in increments {
            let along = self.increment(&term).expect("only increments are left");
            if kind == STRETCHED {
                // The scale error acts on every gyro that senses the rotated axis, with the sign of the law.
                for gyro in 0..3 {
                    sizes.insert((term.parameter, gyro, along), -read[(gyro, along)]);
                }
            } else {
                for axis in 0..3 {
                    let size = sizes
                        .entry((term.parameter, term.record, axis))
                        .or_default();
                    *size += term.coefficient * rotation[(along, axis)];
                }
            }
        }
        carried.extend(sizes.into_iter().filter(|(_, size)| *size != 0.0).map(
            |((parameter, record, axis), coefficient)| Term {
                parameter,
                record,
                column: self.tried(Column::Increment(axis), record, signals),
                coefficient,
            },
        ));
        carried
    }

    /// Axis of a term whose column is an increment of the motion.
    fn increment(&self, term: &Term) -> Option<usize> {
        match self.columns[term.column].column {
            Column::Increment(axis) => Some(axis),
            _ => None,
        }
    }

    /// Linearises a rotated reference about a rotation: the parameters are the total rotation beyond `known_rad`.
    ///
    /// # Inputs
    /// `candidate`: of this pool, linearised about zero; `known_rad`: rotation in the model; `found_rad`: rotation
    /// found beyond it.
    pub fn about_turn(
        &mut self,
        candidate: &mut Candidate,
        (known_rad, found_rad): (Vector3<f64>, Vector3<f64>),
        signals: &Signals,
    ) {
        let terms = candidate.hypothesis.terms.iter();
        let moving: BTreeSet<usize> = terms.filter_map(|term| self.increment(term)).collect();
        let about_rad = known_rad + found_rad;
        // Part of the rotation beyond the known one and beyond the linear term of the found one.
        let mut beyond = turn(about_rad) - turn(known_rad);
        let mut slopes: Vec<Matrix3<f64>> = Vec::new();
        for name in &candidate.names {
            let component = AXES.iter().position(|axis| axis == name);
            let component = component.expect("a rotation's parameters are axes");
            let slope = by_component(about_rad, component);
            beyond -= slope * found_rad[component];
            slopes.push(sensed(&slope, signals));
        }
        let beyond = sensed(&beyond, signals);
        let hypothesis = &mut candidate.hypothesis;
        hypothesis.terms.clear();
        hypothesis.fixed.clear();
        for gyro in 0..3 {
            for &axis in &moving {
                let column = self.tried(Column::Increment(axis), gyro, signals);
                for (parameter, slope) in slopes.iter().enumerate() {
                    hypothesis.terms.push(Term {
                        parameter,
                        record: gyro,
                        column,
                        coefficient: slope[(gyro, axis)],
                    });
                }
                hypothesis.fixed.push(Fixed {
                    record: gyro,
                    column,
                    size: beyond[(gyro, axis)],
                });
            }
        }
        hypothesis.terms.retain(|term| term.coefficient != 0.0);
        hypothesis.fixed.retain(|one| one.size != 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_is_that_of_the_rotation() {
        for scale in [1e-6, 9e-5, 1.1e-4, 0.02, 0.3, 2.0] {
            let turned_rad = Vector3::new(0.4, -0.7, 0.5) * scale;
            for component in 0..3 {
                const STEP_RAD: f64 = 1e-4;
                let step = Vector3::ith(component, STEP_RAD);
                let difference =
                    (turn(turned_rad + step) - turn(turned_rad - step)) / (2.0 * STEP_RAD);
                let derivative = by_component(turned_rad, component);
                // The third derivative is 1 at most; its contribution is STEP²/6.
                assert!((difference - derivative).amax() < 1e-8, "{scale}");
            }
        }
    }

    #[test]
    fn the_nearest_rotation_leaves_a_stretch() {
        let turned_rad = Vector3::new(0.1, -0.2, 0.3);
        let rotation = turn(turned_rad) + Matrix3::identity();
        let stretched = rotation * Matrix3::new(1.1, 0.02, 0.0, 0.02, 0.9, 0.01, 0.0, 0.01, 1.0);
        assert!((nearest(&stretched) - turned_rad).amax() < 1e-12);
        let slight = Matrix3::identity() * 0.98
            + Matrix3::new(0.0, 1e-9, 0.0, -1e-9, 0.0, 0.0, 0.0, 0.0, 1e-12);
        let nearest = nearest(&slight);
        assert!(
            (nearest - Vector3::new(0.0, 0.0, -1e-9 / 0.98)).amax() < 1e-15,
            "{nearest}"
        );
    }

    #[test]
    fn a_small_rotation_is_the_cross_product() {
        let turned_rad = Vector3::new(1e-6, 2e-6, -3e-6);
        let rate = Vector3::new(0.3, 0.5, 0.7);
        let turned = turn(turned_rad) * rate;
        assert!((turned - turned_rad.cross(&rate)).amax() < 1e-11);
    }
}
