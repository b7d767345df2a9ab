//! Elliptic coning and coning at several frequencies, exact.
//!
//! From the tones of a rotation vector across an axis and the time in s: the body rate and its first two derivatives, body
//! frame.
//!
//! Equations: φ(t) = w(t) Σ (A cos ψ, B sin ψ) in the plane across the axis, ψ = 2πft + ψ0, and (Bortz)
//! ω = φ' − c₁(x) φ × φ' + c₂(x) φ × (φ × φ'), x = |φ|², c₁ = (1 − cos √x)/x, c₂ = (√x − sin √x)/x^{3/2}.
//! Derivatives by Leibniz's rule; c₁ and c₂ by their series, which avoid a division by a small x.
//!
//! Assumes |φ| ≤ π, where twelve terms of the series are exact to 1e-14.

use super::BodyMotion;
use super::jet::{Jet, ShortJet, product, short_product};
use std::f64::consts::TAU;

/// Tone of the rotation vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ConingTone {
    /// Frequency; negative for the opposite sense \[Hz\].
    pub frequency_hz: f64,
    /// Semi-axis of the ellipse along the first axis after the cone's \[rad\].
    pub angle_rad: f64,
    /// Semi-axis along the second axis after the cone's \[rad\].
    pub across_angle_rad: f64,
    /// Phase at the segment's start \[rad\].
    pub phase_rad: f64,
}

/// Number of terms of the series.
const TERMS: usize = 12;

/// Σ (−x)^k/(2k + first)! with its derivatives with respect to x.
fn series(x: f64, first: u32) -> [f64; 3] {
    // 1/first!, then each term's factor from the one before
    let mut coefficient = 1.0 / f64::from((1..=first).product::<u32>());
    let mut coefficients = [0.0; TERMS];
    for (k, slot) in coefficients.iter_mut().enumerate() {
        *slot = coefficient;
        let next = f64::from(first) + 2.0 * k as f64;
        coefficient *= -1.0 / ((next + 1.0) * (next + 2.0));
    }
    let mut sums = [0.0; 3];
    for (k, c) in coefficients.iter().enumerate().rev() {
        let k = k as f64;
        sums[0] = sums[0] * x + c;
        if k >= 1.0 {
            sums[1] = sums[1] * x + k * c;
        }
        if k >= 2.0 {
            sums[2] = sums[2] * x + k * (k - 1.0) * c;
        }
    }
    sums
}

fn of(function: [f64; 3], x: &ShortJet) -> ShortJet {
    [
        function[0],
        function[1] * x[1],
        function[2] * x[1] * x[1] + function[1] * x[2],
    ]
}

/// Motion of the body at `time_s`; `taper` is w(t).
pub fn rotation_vector(
    motion: &mut BodyMotion,
    axis: usize,
    tones: &[ConingTone],
    time_s: f64,
    taper: &Jet,
) {
    let mut plane = [[0.0; 4]; 2];
    for tone in tones {
        let omega = TAU * tone.frequency_hz;
        let (sin, cos) = (omega * time_s + tone.phase_rad).sin_cos();
        let (square, cube) = (omega * omega, omega * omega * omega);
        for (sum, term) in plane[0]
            .iter_mut()
            .zip([cos, -omega * sin, -square * cos, cube * sin])
        {
            *sum += tone.angle_rad * term;
        }
        for (sum, term) in plane[1]
            .iter_mut()
            .zip([sin, omega * cos, -square * sin, -cube * cos])
        {
            *sum += tone.across_angle_rad * term;
        }
    }
    // a, b: the components across the axis; φ × φ' then lies along it
    let [a, b] = plane.map(|component| product(taper, &component));
    let short = |jet: &Jet| -> ShortJet { [jet[0], jet[1], jet[2]] };
    let slope = |jet: &Jet| -> ShortJet { [jet[1], jet[2], jet[3]] };
    let (value_a, value_b, slope_a, slope_b) = (short(&a), short(&b), slope(&a), slope(&b));
    let add = |p: ShortJet, q: ShortJet| -> ShortJet { std::array::from_fn(|i| p[i] + q[i]) };
    let minus = |p: ShortJet, q: ShortJet| -> ShortJet { std::array::from_fn(|i| p[i] - q[i]) };
    let x = add(
        short_product(&value_a, &value_a),
        short_product(&value_b, &value_b),
    );
    let (first, second) = (of(series(x[0], 2), &x), of(series(x[0], 3), &x));
    let along = minus(
        short_product(&value_a, &slope_b),
        short_product(&value_b, &slope_a),
    );
    let turned = short_product(&second, &along);
    // φ × (along e) = along (b, −a) in the plane
    let rates = [
        short_product(&first, &along).map(|value| -value),
        add(slope_a, short_product(&turned, &value_b)),
        minus(slope_b, short_product(&turned, &value_a)),
    ];
    for (offset, jet) in rates.into_iter().enumerate() {
        let place = (axis + offset) % 3;
        motion.rate_rad_s[place] = jet[0];
        motion.acceleration_rad_s2[place] = jet[1];
        motion.jerk_rad_s3[place] = jet[2];
    }
}
