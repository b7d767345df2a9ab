//! Makes perfect increments from trajectories in closed form: the tests' own truth.
//!
//! A [`Trajectory`] gives place and attitude as functions of time. From it come exact rotation vectors and velocity
//! increments, and the true solution.
//!
//! Everything is done in inertial space, so that nothing of the mechanisation is used: no Earth rate in a
//! level frame, no transport rate, no Coriolis term, no radii along and across.
//!
//! ```text
//! rotation vector   log(C_ib(t)ᵀ C_ib(t + T))                                   exact
//! velocity          C_ib(t)ᵀ (ṙ_i(t + T) − ṙ_i(t) − ∫ G(r_i) dt)                exact but for Simpson's rule
//! ```
//! G is the ellipsoid's own attraction as zonal harmonics to J10 of the potential (TR8350.2 eq. 5-3 and 3-5),
//! not Somigliana's formula.

// each test file takes the part it needs
#![allow(dead_code)]

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use strapdown::{EulerAngles, Increment, Solution};

/// Semi-major axis \[m\], eccentricity squared, GM \[m³/s²\], rotation \[rad/s\], J2: TR8350.2, tables 3.1, 3.3.
const A_M: f64 = 6_378_137.0;
const E2: f64 = 6.694_379_990_14e-3;
const GM: f64 = 3.986_004_418e14;
const OMEGA: f64 = 7.292_115e-5;
const J2: f64 = 1.082_629_821_3e-3;

/// A path over the Earth in closed form.
pub trait Trajectory {
    /// The ellipsoid's normal at the unit (up, Earth-fixed axes) and its rate \[1/s\].
    fn normal(&self, time_s: f64) -> (Vector3<f64>, Vector3<f64>);
    /// Height \[m\] and its rate \[m/s\].
    fn height_m(&self, time_s: f64) -> (f64, f64);
    /// Heading, pitch and roll.
    fn euler(&self, time_s: f64) -> EulerAngles;
}

/// The unit in inertial space at one time.
struct Inertial {
    position_m: Vector3<f64>,
    velocity_m_s: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
}

/// Attraction without the centrifugal part, any axes that have z along the Earth's \[m/s²\].
pub fn attraction_m_s2(position_m: &Vector3<f64>) -> Vector3<f64> {
    let radius_m = position_m.norm();
    let up = position_m / radius_m;
    let s = up.z;
    // V = GM/r (1 − Σ J_2n (a/r)^2n P_2n(s)); gradient along r and along z across r
    let (mut before, mut legendre) = (1.0, s);
    let mut slope_before = 0.0;
    let mut slope = 1.0;
    let mut radial = 1.0;
    let mut polar = 0.0;
    for degree in 2..=10_u32 {
        let n = f64::from(degree);
        let next = ((2.0 * n - 1.0) * s * legendre - (n - 1.0) * before) / n;
        let next_slope = slope_before + (2.0 * n - 1.0) * legendre;
        (before, legendre) = (legendre, next);
        (slope_before, slope) = (slope, next_slope);
        if degree % 2 == 0 {
            let half = n / 2.0;
            let sign = if (degree / 2) % 2 == 0 { -1.0 } else { 1.0 };
            let j = sign * 3.0 * E2.powi(degree as i32 / 2) / ((n + 1.0) * (n + 3.0))
                * (1.0 - half + 5.0 * half * J2 / E2);
            let reach = j * (A_M / radius_m).powi(degree as i32);
            radial -= (n + 1.0) * reach * legendre;
            polar -= reach * slope;
        }
    }
    let pole_across = Vector3::z() - up * s;
    (up * -radial + pole_across * polar) * (GM / radius_m.powi(2))
}

/// Position on the Earth \[m\] above a point whose normal is `normal`, Earth-fixed axes.
pub fn position_m(normal: &Vector3<f64>, height_m: f64) -> Vector3<f64> {
    let across_m = A_M / (1.0 - E2 * normal.z * normal.z).sqrt();
    normal * (across_m + height_m) - Vector3::z() * (E2 * across_m * normal.z)
}

/// Velocity over the Earth \[m/s\], Earth-fixed axes: the derivative of [`position_m`].
fn velocity_m_s(
    (normal, normal_rate): (Vector3<f64>, Vector3<f64>),
    (height_m, climb_m_s): (f64, f64),
) -> Vector3<f64> {
    let flat = 1.0 - E2 * normal.z * normal.z;
    let across_m = A_M / flat.sqrt();
    let across_m_s = across_m * E2 * normal.z * normal_rate.z / flat;
    normal_rate * (across_m + height_m) + normal * (across_m_s + climb_m_s)
        - Vector3::z() * (E2 * (across_m * normal_rate.z + across_m_s * normal.z))
}

/// Rotation of north, east, down into Earth-fixed axes.
pub fn earth_from_ned(normal: &Vector3<f64>) -> UnitQuaternion<f64> {
    let down = -normal;
    let east = Vector3::z().cross(normal).normalize();
    let north = east.cross(&down);
    let matrix = Matrix3::from_columns(&[north, east, down]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}

fn inertial(path: &impl Trajectory, time_s: f64) -> Inertial {
    let normal = path.normal(time_s);
    let height = path.height_m(time_s);
    let fixed_m = position_m(&normal.0, height.0);
    let fixed_m_s = velocity_m_s(normal, height);
    let spin = Vector3::z() * OMEGA;
    let inertial_from_earth = UnitQuaternion::from_scaled_axis(spin * time_s);
    Inertial {
        position_m: inertial_from_earth * fixed_m,
        velocity_m_s: inertial_from_earth * (fixed_m_s + spin.cross(&fixed_m)),
        attitude: inertial_from_earth * earth_from_ned(&normal.0) * path.euler(time_s).attitude(),
    }
}

/// The true solution at a time.
pub fn solution(path: &impl Trajectory, time_s: f64) -> Solution {
    let normal = path.normal(time_s);
    let height = path.height_m(time_s);
    Solution {
        ned_from_body: path.euler(time_s).attitude(),
        velocity_m_s: earth_from_ned(&normal.0).inverse() * velocity_m_s(normal, height),
        latitude_rad: normal.0.z.atan2(normal.0.x.hypot(normal.0.y)),
        longitude_rad: normal.0.y.atan2(normal.0.x),
        height_m: height.0,
    }
}

/// Perfect increments of periods of `period_s` from time 0 on.
pub fn increments(path: &impl Trajectory, period_s: f64) -> impl Iterator<Item = Increment> {
    let mut begin = inertial(path, 0.0);
    let mut begin_attraction = attraction_m_s2(&begin.position_m);
    (1_u64..).map(move |count| {
        // from the count, so that times do not add up rounding
        let end_s = count as f64 * period_s;
        let end = inertial(path, end_s);
        let end_attraction = attraction_m_s2(&end.position_m);
        // the middle by Hermite's cubic through both ends, T⁴/384 times the snap off the true one
        let middle_m = 0.5 * (begin.position_m + end.position_m)
            + (begin.velocity_m_s - end.velocity_m_s) * (period_s / 8.0);
        let attracted_m_s = (begin_attraction + 4.0 * attraction_m_s2(&middle_m) + end_attraction)
            * (period_s / 6.0);
        let body_from_inertial = begin.attitude.inverse();
        let increment = Increment {
            rotation_rad: (body_from_inertial * end.attitude).scaled_axis(),
            velocity_m_s: body_from_inertial
                * (end.velocity_m_s - begin.velocity_m_s - attracted_m_s),
            period_s,
        };
        begin = end;
        begin_attraction = end_attraction;
        increment
    })
}
