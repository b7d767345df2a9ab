//! The Earth's rotation in the gyros beside an attitude relative to the Earth.
//!
//! On axes that do not turn it is all that a gyro senses beside its bias. A scale or a turn there only changes its size and
//! direction, which its own columns do; a column of the motion holds the gyro's noise besides, which fits that of the rows
//! (errors in variables). So columns are made of motion without what is constant and what is fixed in space ([`Slow`]), and the
//! length of the Earth's rotation is known ([`on_its_length`]).

use nalgebra::{DVector, Matrix3, Matrix6, Vector3, Vector6};
use rlg_plan::EarthPlan;
use rlg_signal::quantiles::median;
use rlg_signal::still::ROTATION_RAD_S;

use crate::likelihood::block_sums::Estimates;
use crate::rows::alignment::places;
use crate::rows::gyro_motion::GyroMotion;
use crate::rows::increments::Increments;

/// Rates by which the gyros exceed the reference.
pub(crate) struct Slow {
    /// Constant in the body's axes \[rad/s\].
    pub(crate) constant_rad_s: Vector3<f64>,
    /// Constant in the start frame \[rad/s\].
    pub(crate) fixed_rad_s: Vector3<f64>,
}

impl Slow {
    /// Estimates both by ridge regression of the rows.
    ///
    /// # Assumptions
    /// The rest of an axis is white, with its median absolute deviation; the fixed rate has the Earth's size in the mean, a prior
    /// that stands alone where the rest is loud.
    pub(crate) fn of(increments: &Increments, motion: &GyroMotion, plan: &EarthPlan) -> Self {
        /// Standard deviation over median absolute deviation, of normal values.
        const NORMAL: f64 = 1.4826;
        let rows = (0..increments.rows()).filter(|row| !increments.is_free(*row));
        let rows: Vec<(usize, Vector3<f64>)> = rows
            .map(|row| (row, increments.excess_rad_s(motion, row)))
            .collect();
        let mut slow = Self {
            constant_rad_s: Vector3::zeros(),
            fixed_rad_s: Vector3::zeros(),
        };
        if rows.is_empty() {
            return slow;
        }
        let of_axis = |axis: usize| -> (f64, f64) {
            let centre = median(rows.iter().map(|(_, excess)| excess[axis])).unwrap_or(0.0);
            let away = rows.iter().map(|(_, excess)| (excess[axis] - centre).abs());
            (centre, NORMAL * median(away).unwrap_or(0.0))
        };
        let axes = [0, 1, 2].map(of_axis);
        let mut information = Matrix6::zeros();
        let mut moment = Vector6::zeros();
        for (row, excess) in &rows {
            let body_from_start = motion
                .frame_from_body(increments.places()[*row])
                .inverse()
                .to_rotation_matrix();
            for (axis, (centre, std)) in axes.into_iter().enumerate() {
                let apart = excess[axis] - centre;
                if std <= 0.0 || apart.abs() > plan.outlier * std {
                    continue;
                }
                let mut column = Vector6::zeros();
                column[axis] = 1.0;
                for fixed in 0..3 {
                    column[3 + fixed] = body_from_start[(axis, fixed)];
                }
                information += column * column.transpose() / (std * std);
                moment += column * (excess[axis] / (std * std));
            }
        }
        for fixed in 3..6 {
            information[(fixed, fixed)] += 3.0 / ROTATION_RAD_S.powi(2);
        }
        if let Some(inverse) = information.try_inverse() {
            let solution = inverse * moment;
            slow.constant_rad_s = solution.fixed_rows::<3>(0).into();
            slow.fixed_rad_s = solution.fixed_rows::<3>(3).into();
        }
        slow
    }
}

/// True if a rate is no longer than the Earth's rotation, within its covariance.
pub(crate) fn is_possible(
    rate_rad_s: Vector3<f64>,
    covariance: &Matrix3<f64>,
    plan: &EarthPlan,
) -> bool {
    let length = rate_rad_s.norm();
    let along = rate_rad_s / length.max(f64::MIN_POSITIVE);
    let std = (along.transpose() * covariance * along)[(0, 0)]
        .max(0.0)
        .sqrt();
    length < ROTATION_RAD_S + plan.possible * std
}

/// Conditions estimates on the length of the Earth's rotation among them, where that is less known than its length: a constant
/// bias that no motion separates from it follows.
///
/// # Inputs
/// `set`: places of the estimates.
pub(crate) fn on_its_length(set: &[usize], estimates: &mut Estimates, plan: &EarthPlan) {
    let at = |kind: &str| -> Vec<usize> {
        let each = places(kind);
        each.filter_map(|place| set.iter().position(|one| *one == place))
            .collect()
    };
    let own = at("earth_rate");
    if own.len() < 3 {
        return;
    }
    let rate = |values: &[f64]| Vector3::from_fn(|axis, _| values[own[axis]]);
    let begun = rate(&estimates.values);
    let of_rate = Matrix3::from_fn(|a, b| estimates.covariance[(own[a], own[b])]);
    let eigen = of_rate.symmetric_eigen();
    let weakest = eigen.eigenvalues.imax();
    let [std, across_std] =
        [weakest, eigen.eigenvalues.imin()].map(|place| eigen.eigenvalues[place].max(0.0).sqrt());
    let open: Vector3<f64> = eigen.eigenvectors.column(weakest).into();
    let across = begun - open * open.dot(&begun);
    let is_possible = across.norm() < ROTATION_RAD_S + plan.possible * across_std;
    if std < plan.known * ROTATION_RAD_S || !is_possible {
        return;
    }
    let rest = (ROTATION_RAD_S.powi(2) - across.norm_squared()).max(0.0);
    // The length leaves both senses along what is open: that of the smaller bias is taken.
    let bias = at("gyro_bias");
    let both = [1.0, -1.0].map(|sense| {
        let from = across + open * (sense * rest.sqrt());
        let conditioned = conditioned(estimates, &own, from);
        let squares = bias.iter().map(|place| conditioned.values[*place].powi(2));
        (squares.sum::<f64>(), conditioned)
    });
    let [one, other] = both;
    *estimates = if one.0 <= other.0 { one.1 } else { other.1 };
}

/// Estimates under the condition that three of them have the length of the Earth's rotation, linear about a rate of which they
/// come near.
fn conditioned(estimates: &Estimates, own: &[usize], mut about: Vector3<f64>) -> Estimates {
    /// Steps, and the move in lengths at which they stand.
    const STEPS: usize = 50;
    const SETTLED: f64 = 1e-9;
    let begun = Vector3::from_fn(|axis, _| estimates.values[own[axis]]);
    let mut found = estimates.clone();
    for _ in 0..STEPS {
        let along = about.normalize();
        let mut slope = DVector::zeros(estimates.values.len());
        for (place, along) in own.iter().zip(along.iter()) {
            slope[*place] = *along;
        }
        let gain = &estimates.covariance * &slope;
        let variance = slope.dot(&gain);
        let short = ROTATION_RAD_S - along.dot(&begun);
        let by = &gain * (short / variance);
        let pairs = estimates.values.iter().zip(by.iter());
        found.values = pairs.map(|(value, by)| value + by).collect();
        found.covariance = &estimates.covariance - &gain * gain.transpose() / variance;
        let next = Vector3::from_fn(|axis, _| found.values[own[axis]]);
        let moved = (next - about).norm();
        about = next;
        if moved < SETTLED * ROTATION_RAD_S {
            break;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    /// Bias and rotation of a table about z: their sums along z are known, the rest each by itself.
    #[test]
    fn a_rotation_that_is_open_along_an_axis_gets_the_earths_length() {
        let set: Vec<usize> = places("gyro_bias").chain(places("earth_rate")).collect();
        let truth: Vector3<f64> = Vector3::new(4.22e-5, -2.42e-5, 0.0);
        let up = (ROTATION_RAD_S.powi(2) - truth.norm_squared()).sqrt();
        let (small, wide) = (1e-7_f64.powi(2), 7e-5_f64.powi(2));
        let mut covariance = DMatrix::from_diagonal(&DVector::from_element(6, small));
        for (a, b, sign) in [(2, 2, 1.0_f64), (5, 5, 1.0), (2, 5, -1.0), (5, 2, -1.0)] {
            covariance[(a, b)] += sign * wide;
        }
        let mut estimates = Estimates {
            values: vec![5.8e-5, 0.0, up, truth.x, truth.y, 0.0],
            covariance,
        };
        on_its_length(&set, &mut estimates, &Default::default());
        let values = &estimates.values;
        assert!(
            (values[5] - up).abs() < 1e-7 && values[2].abs() < 1e-7,
            "{values:?}"
        );
        assert!((values[0] - 5.8e-5).abs() < 1e-12, "{values:?}");
        let std = estimates.covariance[(2, 2)].sqrt();
        assert!((1e-8..1e-6).contains(&std), "{std:e}");
    }
}
