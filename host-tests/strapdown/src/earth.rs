//! Describes the Earth as the WGS-84 ellipsoid: radii, normal gravity, its rotation seen from the local level frame.
//!
//! Arguments are geodetic latitude \[rad\], height \[m\] and velocity \[m/s\] in north, east, down; results are in m,
//! m/s² and rad/s, in the same frame.
//!
//! Source: NIMA TR8350.2 (3rd ed. 2000), tables 3.1 to 3.4, eq. 4-1; Groves 2013, eq. 2.105, 2.106, 5.42; Heiskanen
//! & Moritz, *Physical Geodesy*, 1967, eq. 2-20 (Bruns). Not Groves' eq. 2.140 for the lean to the north,
//! −8.08e-9 h sin 2L: against the potential it is 3.5e-7 m/s² off at 10 km.
//!
//! Out of scope: the geoid, anomalies of gravity, tides, polar motion. Where gravity was measured,
//! its difference from normal gravity is a number that the caller adds.

use nalgebra::Vector3;

/// Semi-major axis \[m\].
pub const SEMI_MAJOR_AXIS_M: f64 = 6_378_137.0;

/// Flattening.
pub const FLATTENING: f64 = 1.0 / 298.257_223_563;

/// First eccentricity squared.
pub const ECCENTRICITY2: f64 = FLATTENING * (2.0 - FLATTENING);

/// Rotation against the stars \[rad/s\].
pub const ROTATION_RAD_S: f64 = 7.292_115e-5;

/// Normal gravity at the equator \[m/s²\].
pub const EQUATOR_GRAVITY_M_S2: f64 = 9.780_325_335_9;

/// Somigliana's constant (b γ_p)/(a γ_e) − 1.
const SOMIGLIANA: f64 = 0.001_931_852_652_41;

/// Radius of curvature along the meridian \[m\].
pub fn meridian_radius_m(latitude_rad: f64) -> f64 {
    let flat = 1.0 - ECCENTRICITY2 * latitude_rad.sin().powi(2);
    SEMI_MAJOR_AXIS_M * (1.0 - ECCENTRICITY2) / (flat * flat.sqrt())
}

/// Radius of curvature across it, east–west \[m\].
pub fn transverse_radius_m(latitude_rad: f64) -> f64 {
    SEMI_MAJOR_AXIS_M / (1.0 - ECCENTRICITY2 * latitude_rad.sin().powi(2)).sqrt()
}

/// Normal gravity (the centrifugal part included), north, east, down \[m/s²\].
///
/// On the ellipsoid Somigliana's γ, exact. With height h: down by Bruns, ∂γ/∂h = −2 J γ − 2 ω² with the mean curvature
/// J, exact to first order, and the sphere's second, 3 γ (h/a)²; north by the field's being free of curl, −h/R_M ∂γ/∂L:
/// plumb lines are curved. At 10 km the residual is 6e-7 m/s² down and 1e-7 north (`tests/earth_model.rs`).
pub fn gravity_m_s2(latitude_rad: f64, height_m: f64) -> Vector3<f64> {
    let sin2 = latitude_rad.sin().powi(2);
    let flat = 1.0 - ECCENTRICITY2 * sin2;
    let on_ellipsoid = EQUATOR_GRAVITY_M_S2 * (1.0 + SOMIGLIANA * sin2) / flat.sqrt();
    let per_sin2 =
        EQUATOR_GRAVITY_M_S2 * SOMIGLIANA / flat.sqrt() + 0.5 * ECCENTRICITY2 * on_ellipsoid / flat;
    let along_m = meridian_radius_m(latitude_rad);
    let curvature = 0.5 / along_m + 0.5 / transverse_radius_m(latitude_rad);
    let share = height_m / SEMI_MAJOR_AXIS_M;
    let down = on_ellipsoid * (1.0 - 2.0 * curvature * height_m + 3.0 * share * share)
        - 2.0 * ROTATION_RAD_S.powi(2) * height_m;
    let north = -height_m / along_m * per_sin2 * (2.0 * latitude_rad).sin();
    Vector3::new(north, 0.0, down)
}

/// The Earth's rotation \[rad/s\].
pub fn earth_rate_rad_s(latitude_rad: f64) -> Vector3<f64> {
    let (sin, cos) = latitude_rad.sin_cos();
    Vector3::new(ROTATION_RAD_S * cos, 0.0, -ROTATION_RAD_S * sin)
}

/// The rotation of the local level frame over the Earth, which a moving unit drags along \[rad/s\].
pub fn transport_rate_rad_s(
    latitude_rad: f64,
    height_m: f64,
    velocity_m_s: &Vector3<f64>,
) -> Vector3<f64> {
    let across = velocity_m_s.y / (transverse_radius_m(latitude_rad) + height_m);
    let along = velocity_m_s.x / (meridian_radius_m(latitude_rad) + height_m);
    Vector3::new(across, -along, -across * latitude_rad.tan())
}
