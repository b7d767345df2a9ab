//! Calibration: the flexure coefficients K_ij from turntable and shaker programmes, and sensor errors from still
//! [`positions`], with gravity as the only reference.
//!
//! Data flow of the flexure coefficients, a file each:
//!
//! recording → unknowns, columns → rates | attitude (integration, whiten) → record → estimate → agreement → combinations →
//! words
//!
//! From recordings of one instrument and its model: an [`Outcome`] with K and its covariance, the identifiable combinations
//! and the others, and the model with the identified K. `programme/` proposes a motion that determines all six. Equations:
//! physics §1–3 (tilt δ_ij = −K_ij α_j), §6 (noise); Cheng 2023, Eqs. 10–17 for attitude. Out of scope here: a search for
//! other physics; a recording that contains some must be diagnosed first.
//!
//! Uses the motion, columns and noise of the diagnosis; imports nothing of the simulator, the core or its reference, and
//! reads no truth file.

pub mod agreement;

pub mod attitude;

pub mod columns;

pub mod combinations;

pub mod estimate;

pub mod integration;

mod noise;

pub mod programme;

pub mod positions;

pub mod rates;

pub mod record;

pub mod result;

pub mod unknowns;

pub mod whiten;

mod words;

use std::collections::BTreeMap;

use rlg_findings::result::PlanEntry;
use rlg_findings::updated_model::set_choice;
use rlg_inference::Information;
use rlg_model::catalogue::Kind;
use rlg_model::{DeclaredModel, EffectValue, Model, ModelEffect};
use rlg_plan::{CalibrationPlan, NuisancePlan, Plan};
use rlg_recording::error::InputError;
use rlg_recording::{MANIFEST, Quantity, Recording};
use rlg_signal::attitude_samples;
use rlg_signal::streams::AXES;

use attitude::AttitudeRecord;
use combinations::Pair;
use estimate::{Estimate, estimate};
use record::RecordInformation;
use unknowns::{FLEXURE, Unknowns};

/// Result of a calibration.
pub struct Outcome {
    /// `calibration.json`.
    pub calibration: result::Calibration,
    /// The model with the calibrated flexure.
    pub model: Model,
}

/// Gauss-Newton steps: calibrations of K from attitudes are linear to parts in 1e4 after one step from zero; the third
/// changes no printed digit.
const STEPS: usize = 3;

/// Information of a recording, by type of reference.
enum Record {
    Rates(Box<RecordInformation>),
    Attitude(Box<AttitudeRecord>),
}

/// Calibrates the six K from the recordings together.
pub fn calibrate(
    recordings: &[Recording],
    of: DeclaredModel<'_>,
    plan: &Plan,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    agreement::gyros_report_alike(recordings)?;
    let DeclaredModel { model, file } = of;
    let own_plan = &plan.calibration;
    // Flexure in the model would be subtracted by the prediction, and only the remainder be estimated.
    let mut bare = model.clone();
    bare.effects.retain(|effect| effect.kind != FLEXURE);
    let mut records = Vec::new();
    for recording in recordings {
        progress(&format!("reading {}", recording.name));
        records.push(evaluate(recording, DeclaredModel::new(&bare, file), plan)?);
    }
    progress("estimating");
    let unknowns = Unknowns::of(recordings.len());
    let (joint, informations) = solve(&records, &unknowns, &own_plan.prior);
    let mut own = Vec::new();
    for (record, recording) in records.iter().zip(recordings) {
        let unknowns = Unknowns::of(1);
        let estimate = if records.len() == 1 {
            joint.clone()
        } else {
            solve(std::slice::from_ref(record), &unknowns, &own_plan.prior).0
        };
        agreement::is_credible(recording, &estimate, &unknowns, &own_plan.agreement)?;
        own.push((unknowns, estimate));
    }
    let most_rad_s2 = informations
        .iter()
        .flat_map(|part| part.acceleration_rad_s2)
        .fold(0.0, f64::max);
    agreement::moved(file, recordings, &joint, most_rad_s2, own_plan)?;
    agreement::agree(recordings, &own, &joint, &own_plan.agreement)?;
    let pairs = combinations::pairs(&joint, own_plan);
    let findings = words::Findings {
        recordings,
        records: &informations,
        methods: records.iter().map(Record::method).collect(),
        own: &own,
        unknowns: &unknowns,
        joint: &joint,
        pairs: &pairs,
        confused: confused(&informations, &unknowns, &joint, own_plan),
        plan: own_plan,
        changed: &PlanEntry::changed(plan),
    };
    Ok(Outcome {
        calibration: findings.calibration(),
        model: calibrated((model, &bare), &joint, &pairs),
    })
}

impl Record {
    fn method(&self) -> &'static str {
        match self {
            Self::Rates(_) => "rates",
            Self::Attitude(_) => "attitude",
        }
    }
}

fn evaluate(
    recording: &Recording,
    of: DeclaredModel<'_>,
    plan: &Plan,
) -> Result<Record, InputError> {
    let rates = AXES.iter().any(|axis| {
        recording
            .channel(&Quantity::ReferenceIncrement, axis)
            .is_some()
    });
    if rates {
        rates::record_information(recording, of, plan).map(|own| Record::Rates(Box::new(own)))
    } else if attitude_samples::has_attitude(recording) {
        AttitudeRecord::new(recording, of, plan).map(|record| Record::Attitude(Box::new(record)))
    } else {
        Err(InputError::new(
            recording.folder.join(MANIFEST),
            "has no reference to calibrate against",
        )
        .channel("reference_increment, reference_attitude")
        .expected(
            "reference increments on x, y, z at the gyros' rate, or attitude samples w, x, y, z",
        ))
    }
}

/// Solves for all unknowns; recordings with attitudes are linearised again at each estimate.
fn solve(
    records: &[Record],
    unknowns: &Unknowns,
    prior: &NuisancePlan,
) -> (Estimate, Vec<RecordInformation>) {
    let set: Vec<usize> = unknowns.fitted().collect();
    let nonlinear = records
        .iter()
        .any(|record| matches!(record, Record::Attitude(_)));
    let mut values = vec![0.0; unknowns.count()];
    for _ in 0..if nonlinear { STEPS - 1 } else { 0 } {
        let parts = informations(records, unknowns, &values);
        values = estimate(unknowns, &total(&parts, unknowns), &set, prior).values;
    }
    let parts = informations(records, unknowns, &values);
    (
        estimate(unknowns, &total(&parts, unknowns), &set, prior),
        parts,
    )
}

/// Information of each recording, linearised at the joint unknowns `values`.
fn informations(records: &[Record], unknowns: &Unknowns, values: &[f64]) -> Vec<RecordInformation> {
    let of = |(place, record): (usize, &Record)| match record {
        Record::Rates(own) => (**own).clone(),
        Record::Attitude(record) => {
            let own = unknowns.of_recording(place).into_iter();
            record.information(&own.map(|index| values[index]).collect::<Vec<f64>>())
        }
    };
    records.iter().enumerate().map(of).collect()
}

/// Sum of all recordings' information on the joint unknowns.
fn total(parts: &[RecordInformation], unknowns: &Unknowns) -> Information {
    let mut total = Information::none(unknowns.count());
    for (place, part) in parts.iter().enumerate() {
        total.add(&part.information, &unknowns.of_recording(place));
    }
    total
}

/// True if an elastic rate W would explain the recordings as well: flexure then is less than `separate_deviations` outside
/// the span of W.
fn confused(
    parts: &[RecordInformation],
    unknowns: &Unknowns,
    joint: &Estimate,
    plan: &CalibrationPlan,
) -> bool {
    let set: Vec<usize> = unknowns.fitted().chain(unknowns.rivals()).collect();
    let with_rival = estimate(unknowns, &total(parts, unknowns), &set, &plan.prior);
    let k = nalgebra::DVector::from_column_slice(&joint.values[..unknowns::COEFFICIENTS]);
    let alone = estimate::quadratic(&joint.covariance, &k).sqrt();
    let outside = estimate::quadratic(&with_rival.covariance, &k).sqrt();
    alone >= plan.separate_deviations && outside < plan.separate_deviations
}

/// Model with the identified K switched on; its setting for the firmware's compensation is unchanged.
fn calibrated((model, bare): (&Model, &Model), joint: &Estimate, pairs: &[Pair; 3]) -> Model {
    let fixed = combinations::for_model(joint, pairs);
    let fixed = result::NAMES.iter().zip(fixed);
    let mut parameters: BTreeMap<String, EffectValue> = fixed
        .filter_map(|(name, value)| Some(((*name).to_owned(), EffectValue::Number(value?))))
        .collect();
    let mut calibrated = bare.clone();
    if !parameters.is_empty() {
        let mut known = model.effects.iter().filter(|effect| effect.kind == FLEXURE);
        let said = known
            .next()
            .into_iter()
            .flat_map(|effect| &effect.parameters);
        let kept = Kind::named(FLEXURE).map_or(&[][..], |kind| kind.compensation);
        let is_kept = |name: &str| kept.iter().any(|group| group.names.contains(&name));
        let said = said.filter(|(name, _)| is_kept(name));
        parameters.extend(said.map(|(name, value)| (name.clone(), value.clone())));
        let mut effect = ModelEffect {
            kind: FLEXURE.to_owned(),
            parameters,
        };
        set_choice(&mut effect, combinations::choice(pairs));
        calibrated.effects.push(effect);
    }
    calibrated
}
