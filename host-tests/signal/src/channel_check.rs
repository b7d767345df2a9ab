//! Tests if gyros and reference share axes, signs and unit.
//!
//! The map between them is split into scale factors of the gyros and an orthogonal matrix. A small rotation and a factor
//! near one are ordinary errors, left to the search of effects. A large proper rotation is the installation of the unit. An
//! improper rotation (left-handed axes) and a gross factor are faults of the recording.

use nalgebra::{Matrix3, Vector3};
use rlg_plan::ChannelPlan;

use crate::coherent_map::{CoherentMap, measure};

/// Relation of gyros and reference, beyond ordinary errors.
#[derive(Debug, Clone)]
pub struct Crossing {
    /// Orthogonal: the gyros' axes in the reference's. The identity where only factors are gross.
    pub axes: Matrix3<f64>,
    /// Scale factor of each gyro relative to the reference \[1\]; 1 where the factor is ordinary.
    pub factors: [f64; 3],
    /// The estimated map.
    pub measured: CoherentMap,
}

impl Crossing {
    /// True if the axes are exchanged, inverted or rotated.
    pub fn is_turned(&self) -> bool {
        self.axes != Matrix3::identity()
    }

    /// True if the axes are related by an improper rotation.
    pub fn is_improper(&self) -> bool {
        self.axes.determinant() < 0.0
    }

    /// True if any factor is gross.
    pub fn has_factor(&self) -> bool {
        self.factors.iter().any(|factor| *factor != 1.0)
    }

    /// True if the recording is usable after a rotation of the reference into the gyros' axes.
    pub fn is_registration(&self) -> bool {
        !self.is_improper() && !self.has_factor()
    }

    /// Map from the reference's axes to the gyros' samples.
    pub fn map(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::from(self.factors)) * self.axes
    }

    /// Reference axis and sign followed by each gyro, where each follows one axis alone.
    pub fn order(&self) -> Option<[(usize, f64); 3]> {
        let is_unit = self
            .axes
            .iter()
            .all(|value| [0.0, 1.0, -1.0].contains(value));
        let of = |gyro: usize| {
            let axis = self.axes.row(gyro).transpose().iamax();
            (axis, self.axes[(gyro, axis)])
        };
        is_unit.then(|| [0, 1, 2].map(of))
    }
}

/// Compares the gyros with the reference, by increments \[rad\] on common rows.
///
/// # Inputs
/// `expected`: scale factor of each gyro in the model, 1 where it has none; `seen`: rows that may be used.
///
/// # Returns
/// `None` where only ordinary errors are found, or where nothing moves.
pub fn check(
    gyros_rad: [&[f64]; 3],
    reference_rad: [&[f64]; 3],
    expected: [f64; 3],
    (seen, rate_hz): (&[bool], f64),
    plan: &ChannelPlan,
) -> Option<Crossing> {
    let measured = measure(gyros_rad, reference_rad, seen, rate_hz, &plan.map)?;
    let own = Matrix3::from_diagonal(&Vector3::from(expected.map(|scale| 1.0 / scale)));
    let judged = |map: &Matrix3<f64>| judge(&(own * map), measured.moves, plan);
    let (mut axes, mut factors) = judged(&measured.map)?;
    // Attenuation by a soft mount or a filter is no factor.
    for (factor, uneven) in factors.iter_mut().zip(measured.uneven) {
        if uneven > plan.uneven {
            *factor = 1.0;
        }
    }
    // At one frequency a delay of half a period is equivalent to a sign, of a quarter to an exchange: the ordinary
    // explanation is preferred. A delay causes no factor.
    let own_axes = |map| judged(map).is_none_or(|(axes, _)| axes == Matrix3::identity());
    if measured.others.iter().any(own_axes) {
        axes = Matrix3::identity();
    }
    if axes == Matrix3::identity() && factors == [1.0; 3] {
        return None;
    }
    Some(Crossing {
        axes,
        factors,
        measured,
    })
}

/// Factorises a map into scale factors and axes; `None` where both are ordinary.
fn judge(
    map: &Matrix3<f64>,
    moves: [bool; 3],
    plan: &ChannelPlan,
) -> Option<(Matrix3<f64>, [f64; 3])> {
    let moving: Vec<usize> = (0..3).filter(|&axis| moves[axis]).collect();
    if moving.is_empty() {
        return None;
    }
    let (unit, factors) = normalised(map, &moving);
    let axes = orthogonal(&unit, &moving, plan)?;
    let is_ordinary = |factor: f64| {
        let [least, most] = plan.scale;
        factor > least * (1.0 + plan.allowance) && factor < most * (1.0 - plan.allowance)
    };
    let factors = factors.map(|factor| if is_ordinary(factor) { 1.0 } else { factor });
    (axes != Matrix3::identity() || factors != [1.0; 3]).then_some((axes, factors))
}

/// Normalises the columns or rows of the map to unit length. Returns it with the factor of each gyro, 1 where it follows no
/// moving axis.
///
/// A gyro of another unit stretches its row, an axis of the reference of another unit its column; the normalisation closer
/// to orthogonality is selected.
fn normalised(map: &Matrix3<f64>, moving: &[usize]) -> (Matrix3<f64>, [f64; 3]) {
    let mut by_column = Matrix3::zeros();
    let mut factors = [1.0; 3];
    for &axis in moving {
        let column = map.column(axis);
        let length = column.norm();
        by_column.set_column(axis, &(column / length));
        factors[column.iamax()] = length;
    }
    let rows = [0, 1, 2].map(|gyro: usize| map.row(gyro).norm());
    if moving.len() < 3 || rows.contains(&0.0) {
        return (by_column, factors);
    }
    let by_row = Matrix3::from_fn(|gyro, axis| map[(gyro, axis)] / rows[gyro]);
    let shear = |unit: &Matrix3<f64>| (unit.transpose() * unit - Matrix3::identity()).amax();
    if shear(&by_row) <= shear(&by_column) {
        (by_row, rows)
    } else {
        (by_column, factors)
    }
}

/// Computes the orthogonal matrix nearest to a map of unit columns (polar factor, by the singular value decomposition), the
/// identity for a small rotation; `None` where the map is far from orthogonal.
fn orthogonal(unit: &Matrix3<f64>, moving: &[usize], plan: &ChannelPlan) -> Option<Matrix3<f64>> {
    if let Some(exchanged) = exchanged(unit, moving, plan.tilt_rad) {
        return Some(exchanged);
    }
    let whole = completed(unit, moving, plan.square);
    let parts = whole.svd(true, true);
    let nearest = parts.u? * parts.v_t?;
    if (whole - nearest).amax() > plan.shear {
        return None;
    }
    let cosine = 0.5 * (nearest.trace() - 1.0);
    let is_small = nearest.determinant() > 0.0 && cosine > plan.tilt_rad.cos();
    Some(if is_small {
        Matrix3::identity()
    } else {
        nearest
    })
}

/// Signed permutation matrix of the axes, where every moving axis is within the tilt of one of the gyros' axes. Axes at rest
/// keep the model's assignment, as far as a rotation allows.
fn exchanged(unit: &Matrix3<f64>, moving: &[usize], tilt_rad: f64) -> Option<Matrix3<f64>> {
    let mut axes = Matrix3::zeros();
    for &axis in moving {
        let column = unit.column(axis);
        let gyro = column.iamax();
        let is_taken = (0..3).any(|other| axes[(gyro, other)] != 0.0);
        if is_taken || column[gyro].abs() < tilt_rad.cos() * column.norm() {
            return None;
        }
        axes[(gyro, axis)] = column[gyro].signum();
    }
    let mut still: Vec<usize> = (0..3).filter(|axis| !moving.contains(axis)).collect();
    let is_free = |axes: &Matrix3<f64>, gyro: usize| axes.row(gyro).amax() == 0.0;
    still.retain(|&axis| {
        let keeps = is_free(&axes, axis);
        if keeps {
            axes[(axis, axis)] = 1.0;
        }
        !keeps
    });
    // At most one is left: two gyros that are free would be two axes that keep their own.
    for axis in still {
        let gyro = (0..3).find(|&gyro| is_free(&axes, gyro))?;
        axes[(gyro, axis)] = 1.0;
        axes[(gyro, axis)] = axes.determinant().signum();
    }
    Some(axes)
}

/// Fills in the columns of axes at rest, as near to the model's as a right-handed set allows.
///
/// # Inputs
/// `square`: cosine below which an axis is perpendicular to its place in the model.
fn completed(unit: &Matrix3<f64>, moving: &[usize], square: f64) -> Matrix3<f64> {
    let mut whole = *unit;
    match *moving {
        [one] => {
            let from = Vector3::ith(one, 1.0);
            let to: Vector3<f64> = unit.column(one).into();
            if let Some(turn) = nalgebra::Rotation3::rotation_between(&from, &to) {
                whole = *turn.matrix();
            }
        }
        [a, b] => {
            let third = 3 - a - b;
            // a × b is the third axis, or its opposite, by their order.
            let sign = if (a + 1) % 3 == b { 1.0 } else { -1.0 };
            let mut cross = unit.column(a).cross(&unit.column(b)) * sign;
            if cross[third] < -square {
                cross = -cross;
            }
            whole.set_column(third, &cross.normalize());
        }
        _ => {}
    }
    whole
}
