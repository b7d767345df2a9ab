//! Circular coning in closed form, tapered ends included.
//!
//! From the cone's axis, the cone frequency in rad/s and the half-angle with its derivatives in rad: the body rate and its
//! first two derivatives, body frame.
//!
//! Equation: the attitude is the rotation φ(t) about u(t) = (0, cos ψ, sin ψ), ψ = Ωt, so that exactly
//! ω = φ' u + sin φ u' − (1 − cos φ) u × u'.

use super::BodyMotion;
use super::jet::Jet;

/// Exact body rate of coning. In the plane across the axis the rate is (P + iQ) e^{iψ} with P = φ' and Q = Ω sin φ; each
/// derivative adds iΩ times the bracket to the bracket's own derivative.
pub fn coning(motion: &mut BodyMotion, axis: usize, omega_rad_s: f64, time_s: f64, angle: Jet) {
    let (sin_phase, cos_phase) = (omega_rad_s * time_s).sin_cos();
    let (sin, cos) = angle[0].sin_cos();
    let p = [angle[1], angle[2], angle[3]];
    let q = [
        omega_rad_s * sin,
        omega_rad_s * cos * angle[1],
        omega_rad_s * (cos * angle[2] - sin * angle[1].powi(2)),
    ];
    let along = [
        -omega_rad_s * (2.0 * (0.5 * angle[0]).sin().powi(2)),
        -omega_rad_s * sin * angle[1],
        -omega_rad_s * (cos * angle[1].powi(2) + sin * angle[2]),
    ];
    let across = [
        (p[0], q[0]),
        (p[1] - omega_rad_s * q[0], q[1] + omega_rad_s * p[0]),
        (
            p[2] - 2.0 * omega_rad_s * q[1] - omega_rad_s.powi(2) * p[0],
            q[2] + 2.0 * omega_rad_s * p[1] - omega_rad_s.powi(2) * q[0],
        ),
    ];
    let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
    for (vector, (along, (re, im))) in [
        &mut motion.rate_rad_s,
        &mut motion.acceleration_rad_s2,
        &mut motion.jerk_rad_s3,
    ]
    .into_iter()
    .zip(along.into_iter().zip(across))
    {
        vector[axis] = along;
        vector[first] = re * cos_phase - im * sin_phase;
        vector[second] = re * sin_phase + im * cos_phase;
    }
}
