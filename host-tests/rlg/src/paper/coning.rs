//! Reproduces Fig. 6 to 9: two strapdown systems on a coning table, the laser one before and after compensation.
//!
//! From a seed and the coefficients for the chain it gives a [`Coning`]: attitude and velocity of the laser
//! system with Eq. (7) alone, with the dynamic terms, with Eq. (6) as printed, and of the fibre-optic system.
//!
//! The cone is that of Fig. 4, about the pitch axis, as the paper's error is in pitch. The paper prints no duration: 300 s
//! ([`Lengths`]) are chosen, for which half a degree an hour becomes 0.04°, as in its Table 4. The error in pitch is
//! proportional to the duration, the velocity to its square: half and twice the duration give a half and twice, a quarter
//! and four times.

use trueaxis::CrossAxis;

use super::gyros::CONES;
use super::lengths::Lengths;
use super::printed::TABLE_3_S2;
use super::run::{Asked, Correction, Progress, run};
use super::sins::{Bench, Sins};
use super::unit::{Grade, RATE_HZ, REST_S, coning, residual_bias, sections, still};
use crate::error::InputError;
use rlg_parameters::SAMPLES_PER_OUTPUT;

/// Errors of the systems on the same table.
#[derive(Debug, Clone, PartialEq)]
pub struct Coning {
    /// Laser gyros, Eq. (7) alone.
    pub before: Sins,
    /// With the dynamic terms.
    pub after: Sins,
    /// With Eq. (6) as it is printed.
    pub literal: Sins,
    /// Fibre-optic gyros, the same accelerometers.
    pub fibre_optic: Sins,
}

/// Returns the number of simulated rows.
pub fn rows(lengths: &Lengths) -> usize {
    ((2.0 * REST_S + lengths.coning_s) * RATE_HZ) as usize
}

/// Runs the experiment.
pub fn systems(
    seed: u64,
    known_s2: CrossAxis<f64>,
    lengths: &Lengths,
    progress: &Progress,
) -> Result<Coning, InputError> {
    let (frequency_hz, angle_deg) = CONES[0];
    let text = sections("systems", Grade::Navigation, &TABLE_3_S2)
        + &residual_bias()
        + &still(REST_S)
        + &coning("x", frequency_hz, angle_deg, lengths.coning_s)
        + &still(REST_S);
    let asked = Asked {
        samples_per_output: SAMPLES_PER_OUTPUT,
        summed: 1,
        corrections: &[
            Correction::Static,
            Correction::Dynamic(known_s2),
            Correction::Literal(known_s2),
        ],
    };
    let run = run(&text, seed, asked, progress)?;
    let bench = Bench::new(&run)?;
    let laser = |correction| bench.sins(run.chain(correction)?);
    Ok(Coning {
        before: laser(Correction::Static)?,
        after: laser(Correction::Dynamic(known_s2))?,
        literal: laser(Correction::Literal(known_s2))?,
        fibre_optic: bench.sins(run.fibre_optic_rad()?)?,
    })
}
