//! Reproduces Fig. 10 to 13, Tables 4 and 5: a laser system on a shaker, along x and along y, before and after
//! compensation.
//!
//! From a seed and the coefficients for the chain it gives a [`Vibration`]: attitude and velocity of a system of the paper's
//! class, and of one with flexure as the only unmodelled effect.
//!
//! Cause of a drift under linear vibration: the centre of mass lies off the mounts' centre, so the case rocks about the two
//! axes across the vibration; the rocking modes differ, so the two rockings are out of phase: an ellipse in which ω × α has
//! a mean. Chosen values, because the paper prints none of them:
//! - base spectrum 0.04 g²/Hz from 15 to 500 Hz, falling to 2 kHz: that of the general
//!   minimum integrity in MIL-STD-810 method 514, some 5 g rms ("relatively large");
//! - a fifth of it across the vibration, 0.45 of the amplitude: the limit for a fixture in method 514;
//! - mounts at 50 Hz, 15 % damping; rocking at 38, 52 and 45 Hz; the mass 8 to 11 mm off: a tenth of the case;
//! - ten minutes ([`Lengths`]): so that the errors have the size of the paper's.
//!
//! The drift is proportional to the spectrum's level, attitude errors to level and duration, velocity errors to
//! level and duration squared; [`Vibration::sensitivity`] shows half and twice the level.

use trueaxis::CrossAxis;

use super::lengths::Lengths;
use super::printed::TABLE_3_S2;
use super::run::{Asked, Correction, Progress, Run, run};
use super::sins::{Bench, Sins};
use super::unit::{Grade, RAMP_S, RATE_HZ, REST_S, residual_bias, sections, still};
use crate::error::InputError;
use rlg_parameters::SAMPLES_PER_OUTPUT;

/// Length of a run at half or twice the level \[s\].
const SENSITIVITY_S: f64 = 20.0;

/// Rest before and after, without noise during levelling \[s\].
const QUIET_REST_S: f64 = 5.0;

/// Level of the base spectrum \[g²/Hz\].
pub const LEVEL_G2_HZ: f64 = 0.04;

/// Ratio of the spectral density across the vibration to that along it \[1\].
const ACROSS: f64 = 0.2;

/// Corners of the base spectrum: \[Hz\], share of the level.
const SPECTRUM: [(f64, f64); 3] = [(15.0, 1.0), (500.0, 1.0), (1900.0, 0.07)];

const MOUNTS: &str = "
[isolator]
angular_frequency_hz = [38.0, 52.0, 45.0]
angular_damping = [0.15, 0.15, 0.15]
linear_frequency_hz = [50.0, 50.0, 50.0]
linear_damping = [0.15, 0.15, 0.15]
offset_m = [0.009, 0.008, 0.011]
gyration_radius_m = [0.09, 0.09, 0.09]
";

/// Results for one direction of vibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Vibration {
    /// A system of the paper's class, Eq. (7) alone.
    pub before: Sins,
    /// With the dynamic terms.
    pub after: Sins,
    /// With Eq. (6) as printed.
    pub literal: Sins,
    /// With flexure as the only unmodelled effect: before, after, as printed.
    pub alone: [Sins; 3],
    /// Drift of gyros x, y, z due to flexure \[°/h\].
    pub drift_deg_h: [f64; 3],
    /// Level \[g²/Hz\], largest drift of a gyro \[°/h\], and its residual share with the dynamic terms \[%\], at half and
    /// twice the level.
    pub sensitivity: [[f64; 3]; 2],
}

/// Returns the number of rows simulated for both directions.
pub fn rows(lengths: &Lengths) -> usize {
    let moving = lengths.vibration_s + lengths.alone_s + 2.0 * SENSITIVITY_S;
    let one = moving + 2.0 * REST_S + 6.0 * QUIET_REST_S;
    (2.0 * one * RATE_HZ) as usize
}

/// Runs both directions.
pub fn directions(
    seed: u64,
    known_s2: CrossAxis<f64>,
    lengths: &Lengths,
    progress: &Progress,
) -> Result<[Vibration; 2], InputError> {
    let one = |along| vibration(along, seed, known_s2, lengths, progress);
    let (x, y) = rayon::join(|| one(0), || one(1));
    Ok([x?, y?])
}

fn vibration(
    along: usize,
    seed: u64,
    known_s2: CrossAxis<f64>,
    lengths: &Lengths,
    progress: &Progress,
) -> Result<Vibration, InputError> {
    let corrections = [
        Correction::Static,
        Correction::Dynamic(known_s2),
        Correction::Literal(known_s2),
    ];
    let asked = Asked {
        samples_per_output: SAMPLES_PER_OUTPUT,
        summed: 1,
        corrections: &corrections,
    };
    let bare = |duration_s, level_g2_hz| {
        let text = sections("shaker", Grade::Noiseless, &TABLE_3_S2)
            + MOUNTS
            + &shake(along, duration_s, QUIET_REST_S, level_g2_hz);
        run(&text, seed, asked, progress)
    };
    let systems = |run: &Run| -> Result<[Sins; 3], InputError> {
        let bench = Bench::new(run)?;
        let [before, after, literal] =
            corrections.map(|correction| bench.sins(run.chain(correction)?));
        Ok([before?, after?, literal?])
    };
    let whole = sections("shaker", Grade::Navigation, &TABLE_3_S2)
        + &residual_bias()
        + MOUNTS
        + &shake(along, lengths.vibration_s, REST_S, LEVEL_G2_HZ);
    let [before, after, literal] = systems(&run(&whole, seed, asked, progress)?)?;

    let quiet = bare(lengths.alone_s, LEVEL_G2_HZ)?;
    let (drift_deg_h, _) = drifts(&quiet, known_s2)?;
    let alone = systems(&quiet)?;

    let mut sensitivity = [[0.0; 3]; 2];
    for (row, factor) in sensitivity.iter_mut().zip([0.5, 2.0]) {
        let level_g2_hz = factor * LEVEL_G2_HZ;
        let (drift, left) = drifts(&bare(SENSITIVITY_S, level_g2_hz)?, known_s2)?;
        *row = [
            level_g2_hz,
            drift[along],
            100.0 * (left[along] / drift[along]).abs(),
        ];
    }
    Ok(Vibration {
        before,
        after,
        literal,
        alone,
        drift_deg_h,
        sensitivity,
    })
}

/// Computes the drift with Eq. (7) alone, and with the dynamic terms \[°/h\].
fn drifts(run: &Run, known_s2: CrossAxis<f64>) -> Result<([f64; 3], [f64; 3]), InputError> {
    let periods = run.periods(1, RAMP_S);
    let truth = run.mean_deg_h(&run.truth_rad, periods.clone());
    let drift = |correction| -> Result<[f64; 3], InputError> {
        let rotations_rad = run.chain(correction)?;
        Ok((run.mean_deg_h(rotations_rad, periods.clone()) - truth).into())
    };
    Ok((
        drift(Correction::Static)?,
        drift(Correction::Dynamic(known_s2))?,
    ))
}

/// Formats rest, vibration along `along`, rest.
fn shake(along: usize, duration_s: f64, rest_s: f64, level_g2_hz: f64) -> String {
    use crate::recording::units::STANDARD_GRAVITY_M_S2;
    let table = |share: f64| {
        let points = SPECTRUM.map(|(hz, of_level)| {
            let density = share * of_level * level_g2_hz * STANDARD_GRAVITY_M_S2.powi(2);
            format!("[{hz:.1}, {density:e}]")
        });
        points.join(", ")
    };
    let axes = [0, 1, 2].map(|axis| {
        let letter = ["x", "y", "z"][axis];
        format!(
            "{letter} = [{}]",
            table(if axis == along { 1.0 } else { ACROSS })
        )
    });
    still(rest_s)
        + &format!(
            "\n[[motion]]\nkind = \"random_vibration\"\nduration_s = {duration_s:.4}\nramp_s = {RAMP_S:.1}\n\
             linear_psd_m2_s4_hz = {{ {} }}\n",
            axes.join(", ")
        )
        + &still(rest_s)
}
