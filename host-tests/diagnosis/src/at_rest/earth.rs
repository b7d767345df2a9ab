//! Direction of the Earth's rotation in a body at rest, and the uncertainty of a bias by it.
//!
//! The magnitude of the rotation is known, and by accelerometers its vertical part; the azimuth is not. A mean rate m is
//! bias b plus rotation e, with e anywhere on a circle (on a sphere without a known vertical). The size of a bias has a
//! scale-free prior, p(b) ∝ 1/|b|³, so e is weighted by 1/|m − e|³: a bias that is small beside the rotation determines the
//! azimuth, a large one leaves it open.

use nalgebra::{Matrix3, Vector3};
use rlg_signal::still::{AtRest, ROTATION_RAD_S};

/// Second moment of the rotation about its value nearest to `mean_rad_s` \[rad²/s²\], in the body.
///
/// # Inputs
/// `mean_rad_s`: constant rate of the gyros; `variance`: of its noise, all axes together \[rad²/s²\].
pub(super) fn spread(rest: &AtRest, mean_rad_s: Vector3<f64>, variance: f64) -> Matrix3<f64> {
    let nearest = rest.nearest_earth_rad_s(mean_rad_s);
    let least = (mean_rad_s - nearest).norm_squared() + variance;
    let (around, radius) = match rest.up.zip(rest.latitude_rad) {
        Some((up, latitude_rad)) => (
            mean_rad_s - up * up.dot(&mean_rad_s),
            ROTATION_RAD_S * latitude_rad.cos().abs(),
        ),
        None => (mean_rad_s, ROTATION_RAD_S),
    };
    // |m − e|² = least + growth · (1 − cos ψ), ψ the angle from the nearest.
    let growth = 2.0 * around.norm() * radius;
    let moments = moments(least / growth.max(f64::MIN_POSITIVE), rest.up.is_some());
    let along = around
        .try_normalize(f64::MIN_POSITIVE)
        .unwrap_or_else(|| any_across(rest.up));
    let across = match rest.up {
        Some(up) => {
            let east = up.cross(&along);
            east * east.transpose() * moments.across
        }
        None => (Matrix3::identity() - along * along.transpose()) * (0.5 * moments.across),
    };
    (along * along.transpose() * moments.along + across) * radius * radius
}

/// Returns a unit vector across `up`, or any.
fn any_across(up: Option<Vector3<f64>>) -> Vector3<f64> {
    let up = up.unwrap_or_else(Vector3::z);
    let other = Vector3::ith(up.iamin(), 1.0);
    (other - up * up.dot(&other)).normalize()
}

/// Mean squares of 1 − cos ψ and of sin ψ.
struct Moments {
    along: f64,
    across: f64,
}

/// # Inputs
/// `ratio`: of the least square to its growth; `is_circle`: on a circle, else on a sphere.
fn moments(ratio: f64, is_circle: bool) -> Moments {
    /// Points, evenly in ln ψ: the weight falls off as a power.
    const POINTS: u32 = 4000;
    const SMALLEST: f64 = 1e-9;
    let step = (std::f64::consts::PI / SMALLEST).ln() / f64::from(POINTS);
    let (mut sum, mut along, mut across) = (0.0, 0.0, 0.0);
    for point in 0..POINTS {
        let psi = SMALLEST * ((f64::from(point) + 0.5) * step).exp();
        let off = 2.0 * (0.5 * psi).sin().powi(2);
        let measure = if is_circle { psi } else { psi * psi.sin() };
        // Scaled so that the largest weight is 1 where the least is 0.
        let weight = measure * ((ratio + off) / (ratio + 1.0)).powf(-1.5);
        sum += weight;
        along += weight * off * off;
        across += weight * psi.sin().powi(2);
    }
    Moments {
        along: along / sum,
        across: across / sum,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rest(up: Option<Vector3<f64>>) -> AtRest {
        AtRest {
            earth_rad_s: Vector3::zeros(),
            mean_rad_s: Vector3::zeros(),
            up,
            force_over_gravity: None,
            latitude_rad: Some(0.8),
        }
    }

    #[test]
    fn beside_a_large_bias_the_rotation_may_lie_anywhere_and_beside_a_small_one_it_is_fixed() {
        let level = ROTATION_RAD_S * 0.8_f64.cos();
        let up = rest(Some(Vector3::z()));
        let large = spread(&up, Vector3::new(1.0, 0.0, 0.0), 0.0) / (level * level);
        // About one end of a circle: 1 + 1/2 along, 1/2 across, nothing upwards.
        let expected = Matrix3::from_diagonal(&Vector3::new(1.5, 0.5, 0.0));
        assert!((large - expected).norm() < 1e-2, "{large}");
        let sphere = spread(&rest(None), Vector3::new(0.0, 1.0, 0.0), 0.0) / ROTATION_RAD_S.powi(2);
        let expected = Matrix3::from_diagonal(&Vector3::new(1.0, 4.0, 1.0)) / 3.0;
        assert!((sphere - expected).norm() < 1e-2, "{sphere}");
        let earth = up.nearest_earth_rad_s(Vector3::new(1.0, 0.0, 0.0));
        let small = spread(&up, earth + Vector3::new(0.0, 0.0, 1e-9), 0.0);
        assert!(small[(1, 1)].sqrt() < 0.02 * level, "{small}");
    }
}
