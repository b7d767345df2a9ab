//! Reproduces Table 3: the coefficients from attitude before and after coning, the paper's way with Eq. (15) to (17)
//! corrected.
//!
//! From a seed it gives a [`Calibration`]: K_ij + K_ik of each gyro \[s²\], with standard deviations.
//!
//! Equation: coning about gyro i's axis at Ω and half-angle φ drifts it by −(K_ij + K_ik) Ω³φ²/2 (physics: the mean of −K (ω
//! × α)); the attitude before and after, on a table that returns to its initial position, gives the drift. Eq. (17) as
//! printed has the difference K_xy − K_xz in its place and divides by a rate instead of multiplying.
//!
//! Only the sums are identifiable: for any stationary oscillation ⟨α_j ω_k⟩ = −⟨α_k ω_j⟩, so that in any position of a
//! coning table a difference K_ij − K_ik enters only in terms of order φ². The paper's six separate values rest on those.
//! Vibration depends on the sums; each coefficient is passed on as half of its gyro's.
//!
//! The paper does not print the cone: 15 Hz at 0.63°, 98 rad/s², for 200 s an axis are chosen, for which a random walk of
//! 0.0015 °/√h is 0.6 % of the drift. Half the angle gives a quarter of the drift and four times that share.

use std::f64::consts::TAU;

use trueaxis::CrossAxis;

use super::printed::TABLE_3_S2;
use super::run::{Asked, Correction, Progress, run};
use super::unit::{
    ANGLE_RANDOM_WALK_RAD_SQRT_S, Grade, RAMP_S, RATE_HZ, coning, residual_bias, sections,
};
use crate::error::InputError;
use crate::replay::drift::DEG_H_PER_RAD_S;
use rlg_parameters::SAMPLES_PER_OUTPUT;

/// Cone frequency \[Hz\].
pub const FREQUENCY_HZ: f64 = 15.0;

/// Cone half-angle \[°\].
pub const ANGLE_DEG: f64 = 0.63;

/// Duration at full amplitude on each axis \[s\].
pub const CONING_S: f64 = 200.0;

/// Estimates from coning about the three axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// K_xy + K_xz, K_yx + K_yz, K_zx + K_zy \[s²\].
    pub sums_s2: [f64; 3],
    /// Standard deviation due to the gyros' random walk \[s²\].
    pub std_s2: f64,
}

/// Returns the same sums of Table 3 \[s²\].
pub fn printed_sums_s2() -> [f64; 3] {
    let k = TABLE_3_S2;
    [k.xy + k.xz, k.yx + k.yz, k.zx + k.zy]
}

impl Calibration {
    /// Returns the coefficients for the chain: half a gyro's sum each.
    pub fn coefficients_s2(&self) -> CrossAxis<f64> {
        let [x, y, z] = self.sums_s2.map(|sum| 0.5 * sum);
        CrossAxis {
            xy: x,
            xz: x,
            yx: y,
            yz: y,
            zx: z,
            zy: z,
        }
    }
}

/// Returns the number of simulated rows.
pub fn rows() -> usize {
    (3.0 * (CONING_S + 2.0 * RAMP_S) * RATE_HZ) as usize
}

/// Cones about each axis in turn.
pub fn calibrate(seed: u64, progress: &Progress) -> Result<Calibration, InputError> {
    use rayon::prelude::*;
    let drift_per_sum = (TAU * FREQUENCY_HZ).powi(3) * ANGLE_DEG.to_radians().powi(2) / 2.0;
    let sums: Vec<f64> = (0..3_usize)
        .into_par_iter()
        .map(|axis| {
            let cone = coning(
                ["x", "y", "z"][axis],
                FREQUENCY_HZ,
                ANGLE_DEG,
                CONING_S + 2.0 * RAMP_S,
            );
            let text =
                sections("calibration", Grade::Navigation, &TABLE_3_S2) + &residual_bias() + &cone;
            let asked = Asked {
                samples_per_output: SAMPLES_PER_OUTPUT,
                summed: 1,
                corrections: &[Correction::Static],
            };
            let run = run(&text, seed, asked, progress)?;
            let periods = run.periods(0, RAMP_S);
            let laser = run.chain(Correction::Static)?;
            let drift =
                run.mean_deg_h(laser, periods.clone()) - run.mean_deg_h(&run.truth_rad, periods);
            Ok(-drift[axis] / DEG_H_PER_RAD_S / drift_per_sum)
        })
        .collect::<Result<_, InputError>>()?;
    Ok(Calibration {
        sums_s2: [sums[0], sums[1], sums[2]],
        std_s2: ANGLE_RANDOM_WALK_RAD_SQRT_S / CONING_S.sqrt() / drift_per_sum,
    })
}
