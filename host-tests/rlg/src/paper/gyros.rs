//! Reproduces Fig. 4 and 5: a laser gyro and a fibre-optic gyro on a coning table, at 15 Hz and at 1 Hz.
//!
//! From a seed it gives a [`Figure`]: both gyros' mean rates over time \[°/h\] about the axis of the cone, and the
//! difference while coning.
//!
//! Expected: Ω³φ²/2 (K_xy + K_xz), the drift of a flexible block under coning: 0.495 °/h at 15 Hz and 0.367°, 0.027 °/h at 1
//! Hz and 5°. The paper prints neither cone angle. 15 Hz: 0.367° follows from its 0.5 °/h and its own Table 3. 1 Hz:
//! "larger"; 5° is easy for a table.
//!
//! As in the paper, the gyros' rates are compared and not their attitudes: the cone's own −2Ω sin²(φ/2) stays.

use super::printed::TABLE_3_S2;
use super::run::{Asked, Correction, Curve, Progress, Run, run};
use super::unit::{ANGLE_RANDOM_WALK_RAD_SQRT_S, Grade, RAMP_S, coning, sections, still};
use crate::error::InputError;
use crate::replay::drift::DEG_H_PER_RAD_S;

/// Cone frequencies \[Hz\] and half-angles \[°\] of the two figures.
pub const CONES: [(f64, f64); 2] = [(15.0, 0.367), (1.0, 5.0)];

/// Rest before and after the motion, and the motion itself \[s\]: two random walks of 0.0015 °/√h give a mean over 300 s a
/// standard deviation of 0.007 °/h, a seventh of the tolerance of Fig. 5.
const REST_S: f64 = 30.0;
/// See [`REST_S`].
const CONING_S: f64 = 302.0;

/// Averaging window of the curves \[s\]: whole cycles of both motions.
const WINDOW_S: f64 = 1.0;

/// Motion of a run for the flexure alone \[s\]: whole cycles suffice without noise.
const SENSITIVITY_S: f64 = 12.0;

/// Results of one coning experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Frequency \[Hz\].
    pub frequency_hz: f64,
    /// Half-angle of the cone \[°\].
    pub angle_deg: f64,
    /// The laser gyro with Eq. (7), less its mean at rest \[°/h\].
    pub laser: Curve,
    /// The fibre-optic gyro likewise.
    pub fibre_optic: Curve,
    /// Laser less fibre-optic while coning \[°/h\], and its standard deviation due to both random walks.
    pub difference_deg_h: f64,
    /// See `difference_deg_h`.
    pub std_deg_h: f64,
    /// Part of it compensated with Table 3, with rotation-consistent signs.
    pub flexure_deg_h: f64,
    /// Residual difference with them.
    pub compensated_deg_h: f64,
    /// Residual difference with Eq. (6) as printed.
    pub literal_deg_h: f64,
    /// Cone angle \[°\] and flexure's drift \[°/h\] at half and twice the angle.
    pub sensitivity: [[f64; 2]; 2],
}

/// Returns the number of rows simulated for both figures.
pub fn rows() -> usize {
    let one = 2.0 * REST_S + CONING_S + 2.0 * SENSITIVITY_S;
    (2.0 * one * super::unit::RATE_HZ) as usize
}

/// Runs both experiments.
pub fn figures(seed: u64, progress: &Progress) -> Result<[Figure; 2], InputError> {
    let [first, second] = CONES;
    Ok([
        figure(first, seed, progress)?,
        figure(second, seed, progress)?,
    ])
}

fn figure(
    (frequency_hz, angle_deg): (f64, f64),
    seed: u64,
    progress: &Progress,
) -> Result<Figure, InputError> {
    let cone = |angle_deg: f64, duration_s: f64| coning("x", frequency_hz, angle_deg, duration_s);
    let text = sections("gyros", Grade::Navigation, &TABLE_3_S2)
        + &still(REST_S)
        + &cone(angle_deg, CONING_S)
        + &still(REST_S);
    let corrections = [
        Correction::Static,
        Correction::Dynamic(TABLE_3_S2),
        Correction::Literal(TABLE_3_S2),
    ];
    let bench = run(&text, seed, rates(&corrections), progress)?;
    let laser = bench.chain(Correction::Static)?;
    let fibre_optic = bench.fibre_optic_rad()?;
    let mean = |rotations: &[[f64; 3]]| bench.mean_deg_h(rotations, bench.periods(1, RAMP_S)).x;
    let left = |correction| -> Result<f64, InputError> {
        Ok(mean(bench.chain(correction)?) - mean(fibre_optic))
    };
    let difference_deg_h = mean(laser) - mean(fibre_optic);
    let compensated_deg_h = left(Correction::Dynamic(TABLE_3_S2))?;
    let mean_s = CONING_S - 2.0 * RAMP_S;
    let mut sensitivity = [[0.0; 2]; 2];
    for (row, factor) in sensitivity.iter_mut().zip([0.5, 2.0]) {
        *row = [
            factor * angle_deg,
            flexure_deg_h(&cone(factor * angle_deg, SENSITIVITY_S), progress)?,
        ];
    }
    Ok(Figure {
        frequency_hz,
        angle_deg,
        laser: shown(&bench, laser),
        fibre_optic: shown(&bench, fibre_optic),
        difference_deg_h,
        std_deg_h: (2.0 / mean_s).sqrt() * ANGLE_RANDOM_WALK_RAD_SQRT_S * DEG_H_PER_RAD_S,
        flexure_deg_h: difference_deg_h - compensated_deg_h,
        compensated_deg_h,
        literal_deg_h: left(Correction::Literal(TABLE_3_S2))?,
        sensitivity,
    })
}

/// Requests one output a sample, so that the chain applies no coning correction of its own and rates stay rates; kept as
/// sums over a tenth of a second, of which all means here consist.
fn rates(corrections: &[Correction]) -> Asked<'_> {
    Asked {
        samples_per_output: 1,
        summed: (super::unit::RATE_HZ / 10.0) as usize,
        corrections,
    }
}

/// Computes the drift of one motion compensated with Table 3 \[°/h\]: two chains on the same pulses, so that the noise
/// cancels.
fn flexure_deg_h(motion: &str, progress: &Progress) -> Result<f64, InputError> {
    let text = sections("sensitivity", Grade::Noiseless, &TABLE_3_S2) + motion;
    let corrections = [Correction::Static, Correction::Dynamic(TABLE_3_S2)];
    let bench = run(&text, 0, rates(&corrections), progress)?;
    let mean = |correction| -> Result<f64, InputError> {
        let rotations_rad = bench.chain(correction)?;
        Ok(bench.mean_deg_h(rotations_rad, bench.periods(0, RAMP_S)).x)
    };
    Ok(mean(Correction::Static)? - mean(Correction::Dynamic(TABLE_3_S2))?)
}

/// Computes the curve about the cone's axis, less its mean at rest before the motion.
fn shown(bench: &Run, rotations_rad: &[[f64; 3]]) -> Curve {
    // the first period only primes the chain
    let rest = bench.periods(0, WINDOW_S);
    let at_rest = bench.mean_deg_h(rotations_rad, rest).x;
    let curve = bench.curve(rotations_rad, 0, WINDOW_S).into_iter();
    curve
        .skip(1)
        .map(|(time_s, rate)| (time_s, rate - at_rest))
        .collect()
}
