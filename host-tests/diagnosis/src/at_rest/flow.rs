//! Diagnosis of a unit at rest, from its aligned channels to its findings.

use rlg_findings::result::ForceNoiseEntry;
use rlg_inference::Observations;
use rlg_model::DeclaredModel;
use rlg_plan::{FindingsPlan, Plan};
use rlg_signal::accelerometer_rows::Rows;
use rlg_signal::fault::Fault;
use rlg_signal::streams::{AXES, Streams, add_triad};

use super::answer::{Answer, Recorder};
use super::one_rate::look;
use super::{allan_terms, control, narrowband, rows};
use crate::outcome::Outcome;
use crate::settings::Settings;
use crate::unfit::Unfit;

/// Diagnoses a qualified recording, using up its sensed increments.
///
/// If the residual deviates from noise of the fitted terms, rows are summed until it agrees: fast effects then do not
/// disturb slow ones.
///
/// # Errors
/// The model's installation matrix has no inverse, or too few rows can be fitted.
pub fn diagnose(
    settings: &Settings,
    streams: &mut Streams,
    faults: &[Fault],
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Outcome, Unfit> {
    let summing = settings.plan.rest.summing;
    let forces = streams.accelerometers.as_ref().ok();
    let forces = forces
        .and_then(|rows| allan_terms::of_accelerometers(rows, &settings.plan))
        .unwrap_or_default();
    let mut sensed_rad = streams.sensed_rad.clone();
    let first = look(settings, streams, faults, of, true, progress)?;
    progress("permutation control");
    let recorder = Recorder {
        rows: rows::search(streams, of.model, &first.left_rad, &first.parted, settings),
        control: control::of_shuffled(&first, streams.rate_hz, &settings.plan, settings.seed),
    };
    let mut is_noise = first.is_noise;
    let mut answer = Answer::new(first, recorder, streams, of.model);
    if let Some(narrow) = &answer.first.narrow {
        add_triad(&mut sensed_rad, &narrow.rows_rad(), -1.0);
    }
    while !is_noise && streams.rows / summing.summed >= summing.least_rows {
        streams.sensed_rad = sensed_rad;
        streams.sum_rows(summing.summed);
        sensed_rad = streams.sensed_rad.clone();
        let next = match look(settings, streams, &[], of, false, progress) {
            Err(Unfit::TooFewRows(_)) => break,
            next => next?,
        };
        is_noise = next.is_noise;
        answer.take_slow(next);
    }
    let plan = &settings.plan.findings;
    Ok(answer.outcome(forces_in_words(&forces, plan), forces, plan))
}

/// Noise of accelerometers that stand still, as entries, and in words with their steady lines.
pub fn still_forces(rows: &Rows, plan: &Plan) -> (Vec<ForceNoiseEntry>, Vec<String>) {
    let forces = allan_terms::of_accelerometers(rows, plan).unwrap_or_default();
    let mut said = forces_in_words(&forces, &plan.findings);
    let Ok(observations) = Observations::bridged(&rows.usable) else {
        return (forces, said);
    };
    for (axis, name) in AXES.iter().enumerate() {
        let lines = narrowband::lines(&rows.sensed_m_s[axis], &observations, &plan.rest.steady);
        let each = lines.iter().map(|line| {
            let of_row_hz = rows.rate_hz;
            format!(
                "{:.2} Hz of {:.2e} m/s²",
                line.share * of_row_hz,
                line.amplitude * of_row_hz
            )
        });
        let each: Vec<String> = each.collect();
        if !each.is_empty() {
            said.push(format!("Lines: accelerometer {name}: {}.", each.join(", ")));
        }
    }
    (forces, said)
}

fn forces_in_words(forces: &[ForceNoiseEntry], plan: &FindingsPlan) -> Vec<String> {
    let each = forces.iter().enumerate().filter_map(|(axis, one)| {
        let terms = one.terms.as_ref()?;
        Some(allan_terms::sentence_of_force(AXES[axis], terms, plan))
    });
    each.collect()
}
