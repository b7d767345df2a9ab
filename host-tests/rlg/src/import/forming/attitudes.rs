//! Forms the quaternions of the contract, body to navigation frame, from logged attitudes.

use std::path::Path;

use crate::error::InputError;

/// Largest norm of a missing quaternion: some systems write zeros if they have no fix.
const NOTHING: f64 = 1e-6;

/// Largest deviation of a norm from 1; beyond it the numbers are no unit quaternion, or in another unit.
const OFF_NORM: f64 = 0.05;

/// A sequence of rotations about three axes of the moving body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EulerOrder([usize; 3]);

impl EulerOrder {
    /// Parses the order: `zyx` is yaw, then pitch about the new y, then roll about the newest x.
    pub fn parse(text: &str) -> Option<Self> {
        let places: Vec<usize> = text
            .chars()
            .filter_map(|letter| "xyz".find(letter))
            .collect();
        let order: [usize; 3] = places.try_into().ok()?;
        let mut sorted = order;
        sorted.sort_unstable();
        (text.len() == 3 && sorted == [0, 1, 2]).then_some(Self(order))
    }

    /// Computes the quaternion w x y z of the angles about x, y and z \[rad\]; NaN if one is missing.
    fn quaternion(self, angles_rad: [f64; 3]) -> [f64; 4] {
        let turn = |axis: usize| {
            let (sine, cosine) = (angles_rad[axis] / 2.0).sin_cos();
            let mut quaternion = [cosine, 0.0, 0.0, 0.0];
            quaternion[axis + 1] = sine;
            quaternion
        };
        let [first, second, third] = self.0.map(turn);
        product(product(first, second), third)
    }
}

/// Computes Hamilton's product.
fn product([a, b, c, d]: [f64; 4], [e, f, g, h]: [f64; 4]) -> [f64; 4] {
    [
        a * e - b * f - c * g - d * h,
        a * f + b * e + c * h - d * g,
        a * g - b * h + c * e + d * f,
        a * h + b * g - c * f + d * e,
    ]
}

/// Forms unit quaternions of the components w x y z; their conjugates if `is_inverse`.
///
/// # Errors
/// A quaternion whose norm is not 1. All zeros are a missing value.
pub fn unit(
    file: &Path,
    names: [&str; 4],
    mut components: [Vec<f64>; 4],
    is_inverse: bool,
) -> Result<[Vec<f64>; 4], InputError> {
    let rows = components[0].len();
    for row in 0..rows {
        let squares = components
            .iter()
            .map(|component| component[row] * component[row]);
        let norm = squares.sum::<f64>().sqrt();
        if (norm - 1.0).abs() > OFF_NORM && norm > NOTHING {
            let found = [0, 1, 2, 3].map(|part| components[part][row].to_string());
            return Err(InputError::new(file, "is no unit quaternion")
                .channel(names.join(", "))
                .row(row as u64)
                .value(found.join(" "))
                .expected("w² + x² + y² + z² = 1, zeros or nothing where it was not measured"));
        }
        let is_nothing = norm.is_nan() || norm <= NOTHING;
        for (part, component) in components.iter_mut().enumerate() {
            let sign = if is_inverse && part > 0 { -1.0 } else { 1.0 };
            component[row] = if is_nothing {
                f64::NAN
            } else {
                sign * component[row] / norm
            };
        }
    }
    Ok(components)
}

/// Computes the quaternions of the angles about x, y and z \[rad\].
pub fn of_euler(order: EulerOrder, angles_rad: [Vec<f64>; 3]) -> [Vec<f64>; 4] {
    let mut components = [const { Vec::new() }; 4];
    let [x, y, z] = angles_rad;
    for ((x, y), z) in x.into_iter().zip(y).zip(z) {
        let quaternion = order.quaternion([x, y, z]);
        for (component, value) in components.iter_mut().zip(quaternion) {
            component.push(value);
        }
    }
    components
}

/// Computes the quaternions of rotation matrices, row by row of the matrix, that take the body's axes into the navigation
/// frame's.
///
/// # Errors
/// A matrix that is no rotation. All zeros are a missing value.
pub fn of_matrix(
    file: &Path,
    names: [&str; 4],
    elements: &[Vec<f64>],
) -> Result<[Vec<f64>; 4], InputError> {
    let mut components = [const { Vec::new() }; 4];
    for row in 0..elements[0].len() {
        let at = |i: usize, j: usize| elements[3 * i + j][row];
        let (trace, total) = (
            at(0, 0) + at(1, 1) + at(2, 2),
            elements
                .iter()
                .map(|element| element[row].powi(2))
                .sum::<f64>(),
        );
        let quaternion = match total > NOTHING {
            false => [f64::NAN; 4],
            true => of_elements(at, trace),
        };
        if (total - 3.0).abs() > OFF_NORM && total > NOTHING {
            return Err(InputError::new(file, "is no rotation matrix")
                .channel(names.join(", "))
                .row(row as u64)
                .value(format!("squares that add up to {total}"))
                .expected("nine elements whose squares add up to 3, zeros or nothing where it was not measured"));
        }
        for (component, value) in components.iter_mut().zip(quaternion) {
            component.push(value);
        }
    }
    Ok(components)
}

/// Computes the unit quaternion of a rotation matrix by its greatest component (Shepperd 1978).
fn of_elements(at: impl Fn(usize, usize) -> f64, trace: f64) -> [f64; 4] {
    let squares = [trace, at(0, 0), at(1, 1), at(2, 2)];
    let greatest = (0..4)
        .max_by(|a, b| squares[*a].total_cmp(&squares[*b]))
        .unwrap_or(0);
    let skew = [
        at(2, 1) - at(1, 2),
        at(0, 2) - at(2, 0),
        at(1, 0) - at(0, 1),
    ];
    let mut quaternion = [0.0; 4];
    match greatest {
        0 => quaternion = [1.0 + trace, skew[0], skew[1], skew[2]],
        place => {
            let own = place - 1;
            quaternion[0] = skew[own];
            for other in 0..3 {
                quaternion[other + 1] = at(own, other) + at(other, own);
            }
            quaternion[place] = 1.0 + 2.0 * at(own, own) - trace;
        }
    }
    let norm = quaternion
        .iter()
        .map(|part| part * part)
        .sum::<f64>()
        .sqrt();
    quaternion.map(|part| part / norm)
}

/// Computes the angle over each row's period \[rad\] from an encoder's angle at the rows' ends \[rad\], unwrapped.
///
/// The first row, and a row after a missing one, have none: the angle over one period is unknown.
pub fn increments_of_angle(angle_rad: &[f64]) -> Vec<f64> {
    let turn = std::f64::consts::TAU;
    let mut before = f64::NAN;
    let step = |now: &f64| {
        let step = now - before;
        before = *now;
        step - turn * (step / turn).round()
    };
    angle_rad.iter().map(step).collect()
}
