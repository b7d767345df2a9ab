//! Sequence of a diagnosis against a reference on the gyros' rows.

use rlg_inference::TooFewRows;
use rlg_model::DeclaredModel;

use crate::confirm::sums::Recordings;
use crate::confirm::together::Together;
use crate::confirm::{confirmed, fallen, until_none_falls};
use crate::outcome::Outcome;
use crate::report::findings;
use crate::rows::data;
use crate::search::{passes, structure};
use crate::settings::{Scope, Settings};
use crate::unfit::Unfit;

use super::registration;
use rlg_signal::fault::Fault;
use rlg_signal::streams::Streams;

/// Diagnoses an aligned and qualified recording, consuming its sensed increments.
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
    diagnose_also(settings, streams, faults, of, progress, |_, _| ()).map(|(outcome, ())| outcome)
}

/// Aligns gyros and reference of an aligned and qualified recording: a diagnosis without physical effects, with estimates
/// also of registration parameters that the recording does not require.
///
/// # Errors
/// The model's installation matrix has no inverse, or too few rows can be fitted.
pub fn align(
    settings: &Settings,
    streams: &mut Streams,
    faults: &[Fault],
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Outcome, Unfit> {
    let mut left_out = registration::physics();
    left_out.extend(settings.left_out);
    let asked = Settings {
        left_out: &left_out,
        ..*settings
    };
    let beside = |data: &data::Data, found: &structure::Found| {
        registration::beside(data, found, &settings.plan)
    };
    let (mut outcome, beside) = diagnose_also(&asked, streams, faults, of, progress, beside)?;
    let diagnosis = &mut outcome.diagnosis;
    diagnosis.registration = registration::entries(&diagnosis.effects, beside);
    Ok(outcome)
}

/// Finds the best set and writes its findings.
///
/// # Returns
/// The findings, and the result of `also` on the set while it has its columns.
///
/// # Errors
/// The model's installation matrix has no inverse, or too few rows can be fitted.
pub fn diagnose_also<T>(
    settings: &Settings,
    streams: &mut Streams,
    faults: &[Fault],
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
    also: impl Fn(&data::Data, &structure::Found) -> T,
) -> Result<(Outcome, T), Unfit> {
    let DeclaredModel { model, file } = of;
    let Settings {
        left_out,
        ref plan,
        seed,
        ..
    } = *settings;
    let mut data = data::Data::new(streams, model, plan, file)?;
    data.take_own_lines(&plan.signal.own_lines);
    let searched = until_none_falls(left_out, progress, |without| -> Result<_, TooFewRows> {
        let found = passes::find(
            &mut data,
            Scope {
                plan,
                left_out: without,
            },
            progress,
        )?;
        let also = also(&data, &found);
        let mut together = Together::of_one(found);
        progress("self-test on this recording");
        let tested = together.self_test(None, plan, seed);
        together.release();
        progress("writing the findings");
        let confirmed = confirmed(Recordings::of_one(&data), &mut together, plan)?;
        let fallen = fallen(&confirmed.set.reenacted_away, &together.found[0]);
        Ok(((together, confirmed, tested, also), fallen))
    })?;
    let ((mut together, mut confirmed, tested, also), shown_anyway) = searched;
    confirmed.set.shown_anyway = shown_anyway;
    let share = confirmed.share(&mut together, &data, 0);
    let mut outcome = findings::outcome(together.of(&data, 0), &share, faults, seed, plan);
    outcome.diagnosis.add_self_test(tested);
    Ok((outcome, also))
}
