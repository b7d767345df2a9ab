//! Sequence of a diagnosis against a reference on the gyros' rows.

use std::path::Path;

use rlg_model::Model;
use rlg_recording::error::InputError;

use super::confirm::{confirmed, fallen, until_none_falls};
use super::outcome::Outcome;
use super::settings::Settings;
use super::{data, findings, registration, search, self_test, settle};
use rlg_signal::fault::Fault;
use rlg_signal::streams::Streams;

/// Diagnoses an aligned and qualified recording, consuming its sensed increments; `None` where too few rows can be fitted.
///
/// # Errors
/// The model's installation matrix has no inverse.
pub fn diagnose(
    settings: &Settings,
    streams: &mut Streams,
    faults: &[Fault],
    of: (&Model, &Path),
    progress: &dyn Fn(&str),
) -> Result<Option<Outcome>, InputError> {
    diagnose_also(settings, streams, faults, of, progress, |_, _| ())
        .map(|found| found.map(|(outcome, ())| outcome))
}

/// Aligns gyros and reference of an aligned and qualified recording: a diagnosis without physical effects, with estimates
/// also of registration parameters that the recording does not require.
///
/// # Errors
/// The model's installation matrix has no inverse.
pub fn align(
    settings: &Settings,
    streams: &mut Streams,
    faults: &[Fault],
    of: (&Model, &Path),
    progress: &dyn Fn(&str),
) -> Result<Option<Outcome>, InputError> {
    let mut left_out = registration::physics();
    left_out.extend(settings.left_out);
    let asked = Settings {
        left_out: &left_out,
        ..*settings
    };
    let beside = |data: &data::Data, found: &search::Found| {
        registration::beside(data, found, &settings.plan)
    };
    let found = diagnose_also(&asked, streams, faults, of, progress, beside)?;
    Ok(found.map(|(mut outcome, beside)| {
        let diagnosis = &mut outcome.diagnosis;
        diagnosis.registration = registration::entries(&diagnosis.effects, beside);
        outcome
    }))
}

/// Finds the best set and writes its findings.
///
/// # Returns
/// The findings, and the result of `also` on the set while it has its columns.
///
/// # Errors
/// The model's installation matrix has no inverse.
pub fn diagnose_also<T>(
    settings: &Settings,
    streams: &mut Streams,
    faults: &[Fault],
    (model, model_file): (&Model, &Path),
    progress: &dyn Fn(&str),
    also: impl Fn(&data::Data, &search::Found) -> T,
) -> Result<Option<(Outcome, T)>, InputError> {
    let Settings {
        left_out,
        ref plan,
        seed,
        ..
    } = *settings;
    let mut data = data::Data::new(streams, model, plan, model_file)?;
    data.take_own_lines(&plan.signal.own_lines);
    let searched = until_none_falls(left_out, progress, |without| {
        let mut found = settle::find(&mut data, without, plan, progress)?;
        let also = also(&data, &found);
        progress("trying the search on this recording");
        let tested = self_test::self_test(&found, plan, seed);
        // The set is final: its findings need no spectra of columns, which are most of the memory.
        found.equations.truncate(0);
        progress("writing the findings");
        let confirmed = confirmed(&data, &mut found, plan)?;
        let fallen = fallen(&confirmed.reenacted_away, &found);
        Some(((found, confirmed, tested, also), fallen))
    });
    let Some(((found, mut confirmed, tested, also), shown_anyway)) = searched else {
        return Ok(None);
    };
    confirmed.shown_anyway = shown_anyway;
    let mut outcome = findings::outcome((&data, &found), &confirmed, faults, seed, plan);
    outcome.diagnosis.tell(tested);
    Ok(Some((outcome, also)))
}
