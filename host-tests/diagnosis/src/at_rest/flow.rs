//! Diagnosis of a unit at rest, from its aligned channels to its findings.

use rlg_findings::result::ForceNoiseEntry;
use rlg_model::DeclaredModel;
use rlg_recording::error::InputError;
use rlg_signal::fault::Fault;
use rlg_signal::streams::{AXES, Streams, add_triad};

use super::answer::{Answer, Recorder};
use super::one_rate::look;
use super::{allan_terms, control, rows};
use crate::outcome::Outcome;
use crate::settings::Settings;

/// Diagnoses a qualified recording, using up its sensed increments; `None` where too few rows can be fitted.
///
/// If the residual deviates from noise of the fitted terms, rows are summed until it agrees: fast effects then do not
/// disturb slow ones.
///
/// # Errors
/// The model's installation matrix has no inverse.
pub fn diagnose(
    settings: &Settings,
    streams: &mut Streams,
    faults: &[Fault],
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Option<Outcome>, InputError> {
    let summing = settings.plan.rest.summing;
    let forces = streams.accelerometers.as_ref().ok();
    let forces = forces
        .and_then(|rows| allan_terms::of_accelerometers(rows, &settings.plan))
        .unwrap_or_default();
    let mut sensed_rad = streams.sensed_rad.clone();
    let Some(first) = look(settings, streams, faults, of, true, progress)? else {
        return Ok(None);
    };
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
        let Some(next) = look(settings, streams, &[], of, false, progress)? else {
            break;
        };
        is_noise = next.is_noise;
        answer.take_slow(next);
    }
    Ok(Some(answer.outcome(forces_in_words(&forces), forces)))
}

fn forces_in_words(forces: &[ForceNoiseEntry]) -> Vec<String> {
    let each = forces.iter().enumerate().filter_map(|(axis, one)| {
        let terms = one.terms.as_ref()?;
        Some(allan_terms::sentence_of_force(AXES[axis], terms))
    });
    each.collect()
}
