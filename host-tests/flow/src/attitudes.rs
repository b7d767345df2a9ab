//! Gyros with an attitude reference by their own likelihood, and the accelerometers on the estimated motion.
//!
//! Gravity is propagated by the gyros, corrected for their estimated errors. The remaining gyro errors are of the size
//! of the undetectable effects; a slow rotation of the vertical is fitted with the accelerometers.

use rlg_attitude::conventions::converted;
use rlg_diagnosis::unfit::TooFewRows;
use rlg_model::{DeclaredModel, Model};
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_signal::streams::Streams;

use crate::lost_rows::{self, Whole};
use crate::result::Verdict;
use crate::{Outcome, Settings, or_unusable, second_pass};

/// Attitudes of a recording without a rotation between two.
const AT_MOST_ONE: TooFewRows = TooFewRows { have: 1, need: 2 };

/// Diagnoses gyros with an attitude reference, and the accelerometers described by the model.
///
/// # Errors
/// As of [`rlg_attitude::diagnose`].
pub(super) fn diagnose(
    settings: &Settings,
    recording: &Recording,
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let model = of.model;
    progress("aligning the channels");
    let converted = converted(recording, of, &settings.plan, settings.anyway)?;
    let recording = converted.as_ref().map_or(recording, |one| &one.recording);
    // Its streams are freed: the rows are aligned again, without the reference.
    let Whole {
        recording, said, ..
    } = lost_rows::put_back(
        recording,
        model,
        &settings.plan.signal.lost_rows,
        |recording, model| rlg_attitude::beside_gyros(recording, model, &settings.plan),
    )?;
    let run = |settings: &Settings, of: DeclaredModel<'_>| {
        let found = rlg_attitude::diagnose(settings, &recording, of, progress)?;
        let found = found.ok_or(AT_MOST_ONE)?;
        Ok((found.outcome, found.corrected))
    };
    let found = second_pass::until_nothing_returns(settings, of, progress, run);
    let found = found.map(|(mut outcome, corrected)| {
        if model.accelerometer.is_some() && outcome.diagnosis.verdict != Verdict::Unusable {
            let found = corrected.and_then(|streams| {
                accelerometers(settings, &streams, (model, &outcome), progress)
            });
            match found {
                Ok(found) => found.add_to(&mut outcome),
                Err(reason) => rlg_force::say_why_not(&reason, &mut outcome),
            }
        }
        let sentences = converted.as_ref().map(|one| one.sentence.clone());
        let sentences = sentences.into_iter().chain(said).collect();
        outcome.diagnosis.prepend(sentences);
        outcome
    });
    let why = |_| "fewer than two attitudes lie within the gyros' record".to_string();
    or_unusable(found, &recording.name, settings, model, why)
}

/// Diagnoses the accelerometers on a motion without known errors: errors of the reference do not affect gravity.
///
/// # Errors
/// Reason for not testing them.
fn accelerometers(
    settings: &Settings,
    streams: &Streams,
    (model, outcome): (&Model, &Outcome),
    progress: &dyn Fn(&str),
) -> Result<rlg_force::Diagnosed, String> {
    let mut walk_rad_sqrt_s = [0.0; 3];
    for (walk, noise) in walk_rad_sqrt_s.iter_mut().zip(&outcome.diagnosis.noise) {
        *walk = noise.angle_random_walk_rad_sqrt_s;
    }
    let asked = rlg_force::Asked {
        model,
        effects: &[],
        left_out: settings.left_out,
        open: &[],
        plan: settings.plan,
    };
    let part = rlg_force::Part {
        streams,
        reference_noise: rlg_force::reference::gyro_noise(model, walk_rad_sqrt_s, streams.rate_hz),
        read_by_gyros: None,
    };
    rlg_force::diagnose(&[part], &asked, progress)
}
