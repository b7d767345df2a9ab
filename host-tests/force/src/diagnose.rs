//! The flow of the accelerometers' diagnosis.

use std::ops::Range;

use rlg_diagnosis::noise_levels::{first_levels, mean};
use rlg_diagnosis::regimes::{Regime, intersect, regimes_of};
use rlg_inference::search::DriftPrior;
use rlg_inference::{NoiseLevels, Observations, Search};
use rlg_model::{Model, ModelEffect};
use rlg_recording::Site;
use rlg_signal::partition::{Partition, Use};
use rlg_signal::streams::Streams;

use crate::candidates::Pool;
use crate::carried::Carried;
use crate::confirm::{Confirmed, confirm};
use crate::plan::ForcePlan;
use crate::prediction::{Prediction, warming_k};
use crate::reference::{Reference, ReferenceNoise};
use crate::residual::residual_m_s;
use crate::search::{Found, equations, find, vertical_of};
use crate::shaken::shaken;
use crate::vertical::Vertical;

/// What is asked.
pub struct Asked<'a> {
    /// The model that is diagnosed.
    pub model: &'a Model,
    /// What is known of the reference's errors: the model's, and what was found beside it.
    pub effects: &'a [ModelEffect],
    /// Noise of the reference's increments.
    pub reference_noise: ReferenceNoise,
    /// Kinds taken out of the catalogue.
    pub left_out: &'a [&'a str],
    /// Errors of the reference beside `effects` that may be there.
    pub open: &'a [&'a str],
    /// The numbers of the analysis.
    pub plan: ForcePlan,
}

/// What the accelerometers showed.
pub struct Diagnosed {
    /// The accelerometers' rows with their segments, nothing on them.
    pub streams: Streams,
    /// Stretches of like motion.
    pub regimes: Vec<Regime>,
    /// The prediction beside the vertical that the set left.
    pub made_of: Prediction,
    /// What was searched.
    pub found: Found,
    /// What of it stands.
    pub confirmed: Confirmed,
    /// Rows to fit and confirm on, and rows that only test.
    pub fitted: Vec<Range<usize>>,
    /// See `fitted`.
    pub tested: Vec<Range<usize>>,
    /// Names of regimes left out because the case was shaken in them.
    pub shaken: Vec<String>,
    /// What of the recording has a known attitude \[s\], where that is not all of it.
    pub carried_s: Option<[f64; 2]>,
    /// The numbers of the analysis.
    pub plan: ForcePlan,
    /// Kinds taken out of the catalogue.
    pub left_out: Vec<String>,
    /// White noise that the model declares \[m²/s² per row\].
    pub declared_white: [Option<f64>; 3],
}

/// Diagnoses the accelerometers of an aligned and qualified recording.
///
/// # Errors
/// Why the force cannot be predicted, or too little of it was measured.
pub fn diagnose(
    streams: &Streams,
    asked: &Asked,
    progress: &dyn Fn(&str),
) -> Result<Diagnosed, String> {
    progress("predicting the accelerometers");
    let plan = &asked.plan;
    let Rows {
        bare,
        mut seen,
        tested,
        mut made_of,
    } = prepare(streams, asked)?;
    let model = asked.model;
    let regimes = regimes_of(&bare);
    settle_vertical(&mut made_of, model, &seen, plan)?;
    let fitted = runs(&seen);
    let residual = residual_m_s(&made_of, model);
    let of = (&regimes[..], &fitted[..]);
    let beside = (plan, asked.left_out, asked.open);
    let was_shaken = shaken(&made_of, &residual, of, beside);
    let quiet: Vec<Range<usize>> = regimes
        .iter()
        .zip(&was_shaken)
        .filter(|(_, shaken)| !**shaken)
        .map(|(regime, _)| regime.rows.clone())
        .collect();
    for (regime, _) in regimes.iter().zip(&was_shaken).filter(|(_, was)| **was) {
        seen[regime.rows.clone()].fill(false);
    }
    if seconds(&seen, bare.rate_hz) < plan.least_fitted_s {
        return Err(
            "less than two seconds in which the case was turned and not shaken".to_string(),
        );
    }
    let levels = settle_vertical(&mut made_of, model, &seen, plan)?;
    progress("searching the accelerometers' effects");
    let observations = observed(&seen)?.to_fast_length();
    let found = find(&mut made_of, model, &observations, levels, beside);
    let confirmed = confirm(&made_of, &found, &seen, plan).ok_or_else(too_few)?;
    let carried = streams.longest_carried();
    let carried_s = (carried.len() < streams.rows)
        .then(|| [carried.start, carried.end].map(|row| streams.begin_s(row)));
    let rate_hz = bare.rate_hz;
    let declared = model
        .accelerometer
        .as_ref()
        .map_or([0.0; 3], |accelerometer| accelerometer.noise_m_s2_sqrt_hz);
    Ok(Diagnosed {
        shaken: regimes
            .iter()
            .zip(&was_shaken)
            .filter(|(_, shaken)| **shaken)
            .map(|(regime, _)| regime.name.clone())
            .collect(),
        regimes: regimes
            .into_iter()
            .filter(|regime| quiet.contains(&regime.rows))
            .collect(),
        fitted: runs(&seen),
        tested: intersect(&tested, &quiet),
        streams: bare,
        made_of,
        found,
        confirmed,
        carried_s,
        plan: asked.plan,
        left_out: asked.left_out.iter().map(ToString::to_string).collect(),
        // n m/s²/√Hz, one-sided, is a random walk of velocity of n²T/2 a row.
        declared_white: declared
            .map(|density| (density > 0.0).then(|| density * density / (2.0 * rate_hz))),
    })
}

/// Why the force of a unit at rest names nothing.
pub fn why_not_at_rest(streams: &Streams) -> String {
    if let Err(reason) = &streams.accelerometers {
        return reason.clone();
    }
    let ratio = streams
        .at_rest
        .as_ref()
        .and_then(|rest| rest.force_over_gravity);
    let length = ratio.map_or_else(String::new, |ratio| {
        format!(" ({ratio:.6} of the site's gravity)")
    });
    format!(
        "the unit stood still, and the accelerometers show one number there, the length of the force{length}, in which bias, scale error and a wrong gravity are the same"
    )
}

/// The accelerometers' rows with a first prediction.
struct Rows {
    bare: Streams,
    /// Rows to fit and confirm on.
    seen: Vec<bool>,
    tested: Vec<Range<usize>>,
    made_of: Prediction,
}

fn prepare(streams: &Streams, asked: &Asked) -> Result<Rows, String> {
    let mut rows = streams.accelerometers.clone()?;
    rows.mask(streams);
    let site: Site = streams
        .site
        .filter(|site| site.gravity_m_s2 > 0.0)
        .ok_or("the recording names no site with its gravity")?;
    if streams.at_rest.is_some() {
        return Err(why_not_at_rest(streams));
    }
    let plan = &asked.plan;
    let piece = &streams.piece;
    let bare = Streams::bare(rows.rate_hz, rows.start_s, rows.usable.clone(), piece);
    let segments: Vec<Range<usize>> = piece
        .segments
        .iter()
        .map(|segment| bare.row_at(segment.start_s)..bare.row_at(segment.end_s))
        .collect();
    let partition = Partition::new(rows.count, rows.rate_hz, &segments, &plan.shared.partition);
    let seen = partition.rows_of(&[Use::Train, Use::Confirm], &rows.usable);
    let tested = runs(&partition.rows_of(&[Use::Test], &rows.usable));
    if seconds(&seen, rows.rate_hz) < plan.least_fitted_s {
        return Err("fewer than two seconds with accelerometers and motion measured".to_string());
    }
    let reference = Reference::new(
        &streams.case_rad,
        streams.rate_hz,
        asked.effects,
        &asked.reference_noise,
        &plan.shared.gate,
    );
    let carried = Carried::new(&reference, &rows);
    let site = (site, asked.model.earth_rate_in_reference);
    let vertical = Vertical::new(&rows, &carried, site, &runs(&seen), plan.far_from_gravity)
        .ok_or("the specific force is not the site's gravity carried about by the reference")?;
    let scale_error = asked
        .model
        .accelerometer
        .as_ref()
        .map_or([0.0; 3], |accelerometer| accelerometer.scale_error);
    let temperature = streams.temperature_k.as_ref();
    let warming = temperature.map(|triad| warming_k(triad, streams.rate_hz, &rows));
    Ok(Rows {
        made_of: Prediction::new(rows, carried, vertical, scale_error, warming),
        bare,
        seen,
        tested,
    })
}

/// Fits the vertical alone, until it stays, and the noise beside it.
fn settle_vertical(
    made_of: &mut Prediction,
    model: &Model,
    seen: &[bool],
    plan: &ForcePlan,
) -> Result<Vec<NoiseLevels>, String> {
    /// From a per cent of tilt to below a microradian.
    const STEPS: usize = 4;
    let observations = observed(seen)?.to_fast_length();
    let mut levels = Vec::new();
    for _ in 0..STEPS {
        let residual = residual_m_s(made_of, model);
        levels = first_levels(&residual, &observations);
        let sums = equations(
            made_of,
            &residual,
            &observations,
            &Pool::default(),
            mean(&levels),
        );
        let none = DriftPrior::Declared(vec![rlg_inference::Drift::None; 3]);
        let prices = &plan.shared.search;
        let mut search = Search::new(&sums, &[], 1, prices, &none, levels.clone());
        let fit = search.fit(&[], None);
        let (moves, stays) = vertical_of(&fit, plan.settled);
        made_of.move_vertical(&moves);
        levels = fit.levels;
        if stays {
            break;
        }
    }
    Ok(levels)
}

fn observed(seen: &[bool]) -> Result<Observations, String> {
    Observations::bridged(seen).ok_or_else(too_few)
}

fn too_few() -> String {
    "too few rows of the accelerometers while the case's motion is known".to_string()
}

fn runs(seen: &[bool]) -> Vec<Range<usize>> {
    rlg_inference::observations::runs(seen, true)
}

fn seconds(seen: &[bool], rate_hz: f64) -> f64 {
    seen.iter().filter(|seen| **seen).count() as f64 / rate_hz
}
