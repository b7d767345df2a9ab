//! Direction of gravity carried by the gyros over a turn, and mean rates at rest, with their derivatives.
//!
//! Reading of the gyros, in body axes: ω_m = ω + b + s ∘ ω + δ-terms (the catalogue's equations); ω is the rate against the
//! stars, and the Earth's rotation e stands in the axes that the body had at the first position. To first order an error of
//! rate δω turns the attitude after a turn by φ = ∫ R δω dt in the axes at its beginning, and the carried direction Rᵀu by
//! Rᵀ(u × φ) (Savage, Strapdown Analytics, sec. 3.5).

use std::ops::Range;

use nalgebra::{Matrix3, Rotation3, SMatrix, Vector3};
use rlg_catalogue::entry::tilt;
use rlg_model::ModelEffect;

use super::readings::{Gyros, Turn};
use crate::unknowns::{PAIRS, names};

/// Parameters of the gyros: three biases, three scale errors, six tilts.
pub const OWN: usize = 12;
/// Behind them: the Earth's rotation at the first position.
pub const ALL: usize = OWN + 3;
/// Place of the first tilt.
pub const TILTS: usize = 6;

/// Derivatives of three components by the parameters.
pub type Derivatives = SMatrix<f64, 3, ALL>;

/// Sizes of the parameters: rad/s, 1, rad, rad/s.
pub type Sizes = nalgebra::SVector<f64, ALL>;

/// Kinds that rests and turns show.
pub const KINDS: [&str; 3] = ["gyro_bias", "gyro_scale", "installation"];

/// Places of the parameters of a kind among all.
pub fn places(kind: &str) -> Range<usize> {
    match kind {
        "gyro_bias" => 0..3,
        "gyro_scale" => 3..TILTS,
        _ => TILTS..OWN,
    }
}

/// Sizes of the gyros' effects in a model.
pub fn of_model(effects: &[ModelEffect]) -> Sizes {
    let mut sizes = Sizes::zeros();
    for effect in effects {
        for kind in KINDS.into_iter().filter(|kind| effect.kind == *kind) {
            for (at, name) in places(kind).zip(names(kind)) {
                sizes[at] += effect.number(name);
            }
        }
    }
    sizes
}

/// True for an effect of a model that [`of_model`] takes into account, or that no gyro shows here.
pub fn is_predicted(effect: &ModelEffect) -> bool {
    let kind = effect.kind.as_str();
    KINDS.contains(&kind) || kind.starts_with("accel_")
}

/// Factor of the rate in the reading: 1 + s on the diagonal, tilts beside it.
fn mixing(sizes: &Sizes) -> Matrix3<f64> {
    let mut all = Matrix3::identity();
    for i in 0..3 {
        all[(i, i)] += sizes[3 + i];
    }
    for (at, (i, j)) in PAIRS.into_iter().enumerate() {
        let (sign, third) = tilt(i, j);
        all[(i, third)] += sign * sizes[TILTS + at];
    }
    all
}

/// Derivative of the reading by the gyros' parameters at a rate \[rad/s\].
fn by_own(rate_rad_s: &Vector3<f64>) -> SMatrix<f64, 3, OWN> {
    let mut all = SMatrix::zeros();
    for i in 0..3 {
        all[(i, i)] = 1.0;
        all[(i, 3 + i)] = rate_rad_s[i];
    }
    for (at, (i, j)) in PAIRS.into_iter().enumerate() {
        let (sign, third) = tilt(i, j);
        all[(i, TILTS + at)] = sign * rate_rad_s[third];
    }
    all
}

/// Predictions at some sizes.
pub struct Predicted {
    /// Attitude at each position against the first.
    pub attitude: Vec<Rotation3<f64>>,
    /// Mean rate at each position \[rad/s\], with derivatives.
    pub rests: Vec<(Vector3<f64>, Derivatives)>,
    /// Direction of the force behind each turn, with derivatives.
    pub turns: Vec<(Vector3<f64>, Derivatives)>,
}

/// Predicts the rests and the turns from the directions of the force at the positions.
pub fn predict(gyros: &Gyros, up: &[Vector3<f64>], sizes: &Sizes) -> Predicted {
    let mixing = mixing(sizes);
    let bias = Vector3::new(sizes[0], sizes[1], sizes[2]);
    let earth = Vector3::new(sizes[OWN], sizes[OWN + 1], sizes[OWN + 2]);
    let correction = Correction {
        unmixed: mixing.try_inverse().unwrap_or_else(Matrix3::identity),
        bias_rad_s: bias,
        earth_rad_s: earth,
        period_s: gyros.period_s,
    };
    let mut attitude = vec![Rotation3::identity(); up.len()];
    let mut turns = Vec::with_capacity(gyros.turns.len());
    let mut known = gyros.turns.iter().peekable();
    for place in 0..up.len().saturating_sub(1) {
        let Some(turn) = known.next_if(|turn| turn.from == place) else {
            // A turn without all its rows is the shortest one between the two directions.
            let back = Rotation3::rotation_between(&up[place + 1], &up[place]);
            attitude[place + 1] = attitude[place] * back.unwrap_or_else(Rotation3::identity);
            continue;
        };
        let (turned, by_sizes) = correction.carry(turn, &attitude[place]);
        let to_end = turned.inverse();
        let direction = to_end * up[place];
        let derivatives = to_end.matrix() * up[place].cross_matrix() * by_sizes;
        turns.push((direction, derivatives));
        attitude[place + 1] = attitude[place] * turned;
    }
    let rests = attitude.iter().map(|attitude| {
        let own = attitude.inverse() * earth;
        let mut derivatives = Derivatives::zeros();
        derivatives
            .fixed_columns_mut::<OWN>(0)
            .copy_from(&by_own(&own));
        let by_earth = mixing * attitude.inverse().matrix();
        derivatives.fixed_columns_mut::<3>(OWN).copy_from(&by_earth);
        (mixing * own + bias, derivatives)
    });
    Predicted {
        rests: rests.collect(),
        turns,
        attitude,
    }
}

/// Correction of a reading to the rate of the body.
struct Correction {
    unmixed: Matrix3<f64>,
    bias_rad_s: Vector3<f64>,
    earth_rad_s: Vector3<f64>,
    period_s: f64,
}

impl Correction {
    /// Integrates a turn that begins in the attitude `before`.
    ///
    /// # Returns
    /// Attitude at its end against its beginning, and the derivative of its rotation vector φ in the axes at its beginning.
    fn carry(&self, turn: &Turn, before: &Rotation3<f64>) -> (Rotation3<f64>, Derivatives) {
        let mut turned = Rotation3::identity();
        let mut by_sizes = Derivatives::zeros();
        let by_earth = before.inverse().into_inner() * self.period_s;
        for row_rad in &turn.rows_rad {
            let rate = self.unmixed * (row_rad / self.period_s - self.bias_rad_s);
            // The Earth's rotation and the derivative belong to the row's middle.
            let middle = turned * Rotation3::new(0.5 * self.period_s * rate);
            let earth = (before * middle).inverse() * self.earth_rad_s;
            let step = (rate - earth) * self.period_s;
            let by_row = middle.matrix() * self.unmixed * by_own(&rate) * self.period_s;
            let mut own = by_sizes.fixed_columns_mut::<OWN>(0);
            own -= by_row;
            let mut of_earth = by_sizes.fixed_columns_mut::<3>(OWN);
            of_earth -= by_earth;
            turned *= Rotation3::new(step);
        }
        (turned, by_sizes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::positions::turns::readings::Rest;

    /// Derivatives against central differences, and the contract's tilt as a cross product. Neglected is the turn of the
    /// Earth's rotation by the gyros' errors: 7e-5 rad/s over two seconds.
    #[test]
    fn derivatives_are_those_of_the_prediction() {
        let row = |k: usize| {
            let t = k as f64 * 0.01;
            Vector3::new(0.8 * (3.0 * t).sin(), 0.9, 0.4 * (5.0 * t).cos()) * 0.01
        };
        let gyros = Gyros {
            period_s: 0.01,
            rests: vec![
                Some(Rest {
                    mean_rad_s: Vector3::zeros(),
                    length_s: 10.0,
                });
                2
            ],
            turns: vec![Turn {
                from: 0,
                rows_rad: (0..200).map(row).collect(),
                span_s: [0.0, 2.0],
            }],
            lost_s: Vec::new(),
            walk_rad_sqrt_s: Vector3::repeat(1e-5),
        };
        let up = [Vector3::new(0.1, -0.3, 0.95).normalize(); 2];
        let mut at = Sizes::from_fn(|k, _| 1e-3 * (k as f64 - 6.0));
        let earth_rad_s = Vector3::new(4e-5, -4e-5, 4e-5);
        at.fixed_rows_mut::<3>(OWN).copy_from(&earth_rad_s);
        let whole = predict(&gyros, &up, &at);
        for k in 0..ALL {
            let beside = |step: f64| {
                let mut sizes = at;
                sizes[k] += step;
                predict(&gyros, &up, &sizes)
            };
            let (more, less) = (beside(1e-5), beside(-1e-5));
            let slope = |pair: (&Vector3<f64>, &Vector3<f64>)| (pair.0 - pair.1) / 2e-5;
            let turns = slope((&more.turns[0].0, &less.turns[0].0));
            assert!(
                (turns - whole.turns[0].1.column(k)).norm() < 2e-3,
                "turn {k}"
            );
            let rests = slope((&more.rests[0].0, &less.rests[0].0));
            assert!(
                (rests - whole.rests[0].1.column(k)).norm() < 1e-3,
                "rest {k}"
            );
        }
        for (i, j) in PAIRS {
            let unit = |axis: usize| Vector3::ith(axis, 1.0);
            let (sign, third) = tilt(i, j);
            assert_eq!(unit(j).cross(&unit(i)), sign * unit(third), "{i} {j}");
        }
    }
}
