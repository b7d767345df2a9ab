//! The flow of the accelerometers' diagnosis.

use rlg_plan::{AlignPlan, Plan};
use std::ops::Range;

use rlg_diagnosis::rows::noise_levels::first_levels;
use rlg_diagnosis::tiles::regimes::{Regime, intersect, regimes_of};
use rlg_inference::evaluate::{Effort, evaluate};
use rlg_inference::{Drift, NoiseLevels, Observations, TooFewRows};
use rlg_model::{Model, ModelEffect};
use rlg_recording::{Segment, Site};
use rlg_signal::accelerometer_rows;
use rlg_signal::axes::{Triad, add_triad, each_axis};
use rlg_signal::partition::{Partition, Use};
use rlg_signal::streams::Streams;

use crate::candidates::Pool;
use crate::candidates::Scope;
use crate::carried::Carried;
use crate::confirm::{Confirmed, confirm};
use crate::prediction::{Prediction, warming_k};
use crate::readings::Readings;
use crate::reference::{Reference, ReferenceNoise};
use crate::residual::residual_m_s;
use crate::search::{Found, equations, find, verticals_of};
use crate::shaken::shaken;
use crate::vertical::Vertical;

/// Recording, or a stretch of a long one.
pub struct Part<'a> {
    /// Its rows.
    pub streams: &'a Streams,
    /// Noise of its reference's increments.
    pub reference_noise: ReferenceNoise,
    /// Correction of the reference's noise from the gyros, added to its increments, by row \[rad\]; `None` if not computed.
    pub read_by_gyros: Option<Triad>,
}

/// Inputs of a diagnosis.
pub struct Asked<'a> {
    /// The model that is diagnosed.
    pub model: &'a Model,
    /// Known errors of the reference: those of the model and those diagnosed from the gyros.
    pub effects: &'a [ModelEffect],
    /// Kinds taken out of the catalogue.
    pub left_out: &'a [&'a str],
    /// Further errors of the reference that are tested.
    pub open: &'a [&'a str],
    /// Settings of the analysis.
    pub plan: Plan,
}

/// Result of the accelerometers' diagnosis.
pub struct Diagnosed {
    /// Rows of the accelerometers, all recordings concatenated in time from the first.
    pub streams: Streams,
    /// Stretches of like motion (regimes).
    pub regimes: Vec<Regime>,
    /// Prediction with the fitted verticals.
    pub made_of: Prediction,
    /// Result of the structure search.
    pub found: Found,
    /// Confirmed part of it.
    pub confirmed: Confirmed,
    /// Rows to fit and confirm on, and held-out rows.
    pub fitted: Vec<Range<usize>>,
    /// See `fitted`.
    pub tested: Vec<Range<usize>>,
    /// Names of the regimes that are excluded as shaken.
    pub shaken: Vec<String>,
    /// Span of a recording with a known attitude \[s\], if not all of it, with the recording's name if there are several.
    pub carried_s: Vec<(Option<String>, [f64; 2])>,
    /// Settings of the analysis.
    pub plan: Plan,
    /// Kinds taken out of the catalogue.
    pub left_out: Vec<String>,
    /// White noise that the model declares \[m²/s² per row\].
    pub declared_white: [Option<f64>; 3],
}

/// Diagnoses the accelerometers of aligned and qualified recordings of one unit; its errors are common to all recordings.
///
/// # Errors
/// Reason why the force cannot be predicted, or that too little of it was measured.
pub fn diagnose(
    parts: &[Part],
    asked: &Asked,
    progress: &dyn Fn(&str),
) -> Result<Diagnosed, String> {
    progress("predicting the accelerometers");
    let plan = &asked.plan;
    let Rows {
        bare,
        regimes,
        mut seen,
        tested,
        mut made_of,
    } = prepare(parts, asked)?;
    let model = asked.model;
    settle_verticals(&mut made_of, model, &seen, plan)?;
    let fitted = runs(&seen);
    let residual = residual_m_s(&made_of, model);
    let scope = Scope {
        plan,
        left_out: asked.left_out,
        open: asked.open,
    };
    let was_shaken = shaken(&made_of, &residual, &regimes, &fitted, scope);
    let quiet: Vec<Range<usize>> = regimes
        .iter()
        .zip(&was_shaken)
        .filter(|(_, shaken)| !**shaken)
        .map(|(regime, _)| regime.rows.clone())
        .collect();
    for (regime, _) in regimes.iter().zip(&was_shaken).filter(|(_, was)| **was) {
        seen[regime.rows.clone()].fill(false);
    }
    if seconds(&seen, bare.rate_hz) < plan.force.least_fitted_s {
        return Err(
            "less than two seconds in which the case was turned and not shaken".to_string(),
        );
    }
    let levels = settle_verticals(&mut made_of, model, &seen, plan)?;
    progress("searching the accelerometers' effects");
    let observations = observed(&made_of, &seen)?.to_fast_length();
    let found = find(&mut made_of, model, &observations, levels, scope);
    let confirmed = confirm(&made_of, &found, &seen, plan).map_err(too_few)?;
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
        carried_s: parts
            .iter()
            .filter_map(|part| carried_s(part, parts.len(), &plan.signal.align))
            .collect(),
        plan: asked.plan,
        left_out: asked.left_out.iter().map(ToString::to_string).collect(),
        // n m/s²/√Hz, one-sided, is a velocity random walk of n²T/2 a row.
        declared_white: declared
            .map(|density| (density > 0.0).then(|| density * density / (2.0 * rate_hz))),
    })
}

/// Span of a recording with a known attitude \[s\], if not all of it.
fn carried_s(part: &Part, of: usize, plan: &AlignPlan) -> Option<(Option<String>, [f64; 2])> {
    let streams = part.streams;
    let carried = streams.longest_carried(plan);
    let name = (of > 1).then(|| streams.piece.recording.clone());
    let span_s = [carried.start, carried.end].map(|row| streams.begin_s(row));
    (carried.len() < streams.rows).then_some((name, span_s))
}

/// Reason why the force of a unit at rest identifies no error.
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
        "at rest the accelerometers measure one number, the magnitude of the specific force{length}: bias, scale error and an error of local g are not distinguishable"
    )
}

/// Rows of the accelerometers with a first prediction.
struct Rows {
    bare: Streams,
    regimes: Vec<Regime>,
    /// Rows to fit and confirm on.
    seen: Vec<bool>,
    tested: Vec<Range<usize>>,
    made_of: Prediction,
}

/// Rows of one recording, and the motion of the case on them.
struct Own<'a> {
    part: &'a Part<'a>,
    site: Site,
    rows: accelerometer_rows::Rows,
    regimes: Vec<Regime>,
    /// Its named stretches.
    segments: Vec<Range<usize>>,
}

impl<'a> Own<'a> {
    fn new(part: &'a Part<'a>, plan: &Plan) -> Result<Self, String> {
        let streams = part.streams;
        let mut rows = streams.accelerometers.clone()?;
        rows.mask(streams, &plan.signal.align);
        let site: Site = streams
            .site
            .filter(|site| site.gravity_m_s2 > 0.0)
            .ok_or("the recording names no site with its gravity")?;
        if streams.at_rest.is_some() {
            return Err(why_not_at_rest(streams));
        }
        let piece = &streams.piece;
        let bare = Streams::bare(rows.rate_hz, rows.start_s, rows.usable.clone(), piece);
        let segments = piece.segments.iter();
        let rows_of = |one: &Segment| bare.row_at(one.start_s)..bare.row_at(one.end_s);
        Ok(Self {
            part,
            site,
            regimes: regimes_of(&bare, &plan.judgement.regimes),
            segments: segments.map(rows_of).collect(),
            rows,
        })
    }

    fn carried(&self, asked: &Asked) -> Carried {
        let streams = self.part.streams;
        let name = &*streams.piece.recording;
        let effects = asked.effects.iter();
        // Errors of one recording's reference do not act on the others.
        let acts = |one: &&ModelEffect| one.text("recording").is_none_or(|other| other == name);
        let own: Vec<ModelEffect> = effects.filter(acts).cloned().collect();
        let mut read_rad = streams.case_rad.clone();
        if let Some(more_rad) = &self.part.read_by_gyros {
            add_triad(&mut read_rad, more_rad, 1.0);
        }
        let reference = Reference::new(
            &read_rad,
            streams.rate_hz,
            &own,
            &self.part.reference_noise,
            (&asked.plan.signal.gate, &asked.plan.force),
        );
        Carried::new(&reference, &self.rows)
    }

    fn warming_k(&self) -> Option<Triad> {
        let streams = self.part.streams;
        let temperature_k = streams.temperature_k.as_ref()?;
        let of_begin = [0, 1, 2].map(|axis: usize| {
            let values: &Vec<f64> = &temperature_k[axis];
            values.first().copied().unwrap_or(0.0)
        });
        let origin = streams.piece.origin.as_ref();
        let start_k = origin.and_then(|origin| origin.temperature_k);
        let start_k = start_k.unwrap_or(of_begin);
        Some(warming_k(
            temperature_k,
            start_k,
            streams.rate_hz,
            &self.rows,
        ))
    }
}

fn prepare(parts: &[Part], asked: &Asked) -> Result<Rows, String> {
    let plan = &asked.plan;
    let mut each = Vec::with_capacity(parts.len());
    for part in parts {
        let name = &part.streams.piece.recording;
        let own = Own::new(part, plan).map_err(|reason| match parts.len() {
            1 => reason,
            _ => format!("{name}: {reason}"),
        });
        each.push(own?);
    }
    let rows: Vec<_> = each
        .iter()
        .map(|one| (&*one.part.streams.piece.recording, one.rows.clone()))
        .collect();
    let readings = Readings::joined(&rows)?;
    let first = &each[0];
    let bare = Streams::bare(
        readings.rate_hz,
        first.rows.start_s,
        readings.usable.clone(),
        &first.part.streams.piece,
    );
    let (mut segments, mut regimes) = (Vec::new(), Vec::new());
    for (one, piece) in each.iter().zip(&readings.pieces) {
        segments.extend(one.segments.iter().map(|rows| piece.among_all(rows)));
        if one.segments.is_empty() && each.len() > 1 {
            segments.push(piece.rows.clone());
        }
        regimes.extend(one.regimes.iter().map(|regime| Regime {
            name: regime.name.clone(),
            rows: piece.among_all(&regime.rows),
        }));
    }
    let rate_hz = readings.rate_hz;
    let partition = Partition::new(readings.count, rate_hz, &segments, &plan.signal.partition);
    let seen = partition.rows_of(&[Use::Fit], &readings.usable);
    let tested = runs(&partition.rows_of(&[Use::Test], &readings.usable));
    if seconds(&seen, rate_hz) < plan.force.least_fitted_s {
        return Err("fewer than two seconds with accelerometers and motion measured".to_string());
    }
    let carried = Carried::joined(each.iter().map(|one| one.carried(asked)).collect());
    let mut verticals = Vec::with_capacity(each.len());
    for (one, piece) in each.iter().zip(&readings.pieces) {
        let used = intersect(&runs(&seen), std::slice::from_ref(&piece.rows));
        let site = (one.site, asked.model.earth_rate_in_reference);
        let far = plan.force.far_from_gravity;
        let vertical = Vertical::new(&readings, &carried, site, &used, far)
            .ok_or("specific force inconsistent with gravity transported by the reference")?;
        verticals.push(vertical);
    }
    let scale_error = asked
        .model
        .accelerometer
        .as_ref()
        .map_or([0.0; 3], |accelerometer| accelerometer.scale_error);
    let warming = each.iter().map(Own::warming_k).collect::<Option<Vec<_>>>();
    let warming = warming.map(|each| {
        each_axis(|axis| {
            let values = each.iter().flat_map(|one| &one[axis]);
            values.copied().collect()
        })
    });
    Ok(Rows {
        made_of: Prediction::new(readings, carried, verticals, scale_error, warming),
        bare,
        regimes,
        seen,
        tested,
    })
}

/// Fits the verticals alone until they converge, and the noise given them.
///
/// All accelerometers have the same weight here: the residual of a vertical may be an accelerometer error that is not yet
/// modelled. Counted as noise of its axis, it would let the vertical give up one axis to fit the others.
fn settle_verticals(
    made_of: &mut Prediction,
    model: &Model,
    seen: &[bool],
    plan: &Plan,
) -> Result<Vec<NoiseLevels>, String> {
    /// Converges from a tilt of one per cent to below a microradian.
    const STEPS: usize = 4;
    let observations = observed(made_of, seen)?.to_fast_length();
    let recordings = made_of.rows.looked_at(&observations);
    /// One alternation: the noise is known.
    const ONCE: Effort = Effort {
        alternations: 1,
        ..Effort::QUICK
    };
    for _ in 0..STEPS {
        let residual = residual_m_s(made_of, model);
        let all = NoiseLevels::mean(&first_levels(&residual, &observations)).stationary();
        let sums = equations(made_of, &residual, &observations, &Pool::default(), all);
        let fit = evaluate(
            &sums,
            &[],
            &[all; 3],
            &[Drift::None; 3],
            ONCE,
            &plan.inference.search,
        );
        let (moves, stays) = verticals_of(&fit, &recordings, plan.force.settled);
        made_of.move_verticals(&moves);
        if stays {
            break;
        }
    }
    let residual = residual_m_s(made_of, model);
    Ok(first_levels(&residual, &observations))
}

fn observed(made_of: &Prediction, seen: &[bool]) -> Result<Observations, String> {
    made_of.rows.bridged(seen).map_err(too_few)
}

fn too_few(of: TooFewRows) -> String {
    format!("{of}: rows of the accelerometers while the case's motion is known")
}

fn runs(seen: &[bool]) -> Vec<Range<usize>> {
    rlg_inference::observations::runs(seen, true)
}

fn seconds(seen: &[bool], rate_hz: f64) -> f64 {
    seen.iter().filter(|seen| **seen).count() as f64 / rate_hz
}
