//! The flow of a diagnosis against attitudes.

use std::path::Path;

use nalgebra::Vector3;
use rlg_diagnosis::Outcome;
use rlg_diagnosis::put_right::{self, PutRight};
use rlg_model::{Model, MotionSource};
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_signal::attitude_samples::has_attitude;

use crate::channels;
use crate::coarse;
use crate::findings;
use crate::observed::{Observed, no_inverse, observe};
use crate::physics::Gyro;
use crate::plan::AttitudePlan;
use crate::registration::{Alignment, Free, Registration, register};
use crate::said::Said;
use crate::search::{Candidates, Named, all_groups, search};

/// How a recording is diagnosed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Settings<'a> {
    /// Kinds that are taken out of the catalogue.
    pub left_out: &'a [&'a str],
    /// Numbers that decide.
    pub plan: AttitudePlan,
    /// Seed that `diagnosis.json` names.
    pub seed: u64,
    /// Whether channels that are reversed, exchanged or of another unit are put right and reported instead of refused.
    pub anyway: bool,
}

/// Whether attitudes are the reference of a recording that this likelihood serves: gyros without dither counts, and no
/// accelerometers that the model describes.
pub fn serves(recording: &Recording, model: &Model) -> bool {
    let is_dithered = recording
        .channel(&rlg_recording::Quantity::GyroCount, "x")
        .is_some();
    model.motion == MotionSource::Reference
        && has_attitude(recording)
        && !is_dithered
        && model.accelerometer.is_none()
}

/// Diagnoses a recording; `None` where too few attitudes were stamped for the noise to be known from them.
///
/// # Errors
/// The recording lacks a channel or its attitudes are none; the model's installation matrix has no inverse.
pub fn diagnose(
    settings: &Settings,
    recording: &Recording,
    (model, model_file): (&Model, &Path),
    progress: &dyn Fn(&str),
) -> Result<Option<Outcome>, InputError> {
    let plan = &settings.plan;
    progress("aligning the channels");
    let Some(mut observed) = observe(recording, (model, model_file), plan)? else {
        return Ok(None);
    };
    let put_right = check_channels(settings, &mut observed, (model, model_file))?;
    let of_model = Alignment::of_model(model);
    let start = coarse::start(
        &observed.gyros,
        &observed.samples,
        &observed.tested,
        &of_model,
    );
    let fitted = |observed: &Observed, start: &Alignment, free: &Free| {
        let about = (&of_model, start.clone(), free);
        register(
            &observed.gyros,
            &observed.samples,
            &observed.tested,
            about,
            progress,
        )
    };
    let all = all_groups();
    let Some(mut registered) = fitted(&observed, &start, &all) else {
        return Ok(None);
    };
    let Some(mut gyro) = Gyro::new(&observed.streams, model, &registered.about.conditioned_rad)
    else {
        return Err(no_inverse(model_file));
    };
    let known_rad = gyro.known_rad(model);
    if known_rad.iter().flatten().any(|value| *value != 0.0) {
        progress("once more without what the model knows");
        for (row, sensed) in observed.gyros.sensed_rad.iter_mut().enumerate() {
            *sensed -= Vector3::from_fn(|axis, _| known_rad[axis][row]);
        }
        let Some(again) = fitted(&observed, &start, &all) else {
            return Ok(None);
        };
        registered = again;
    }
    let (pool, effects) = gyro.candidates(settings.left_out);
    let candidates = Candidates::new(effects);
    let searched = |registered: &Registration, gyro: &Gyro, observed: &Observed| {
        progress("searching for physics");
        let beyond = registered.alignment.beyond(&of_model);
        let about = (&of_model, &beyond);
        let of = (gyro, &pool, &candidates);
        search((&observed.gyros, registered), about, of, plan)
    };
    let mut found = searched(&registered, &gyro, &observed);
    // Once more about what is called for alone: the rest is then near enough to be linear.
    let free: Free = found.registration.iter().map(Named::group).collect();
    let start = registered.alignment.with(&free, &of_model);
    if let Some(again) = fitted(&observed, &start, &free) {
        registered = again;
        gyro = Gyro::new(&observed.streams, model, &registered.about.conditioned_rad)
            .ok_or_else(|| no_inverse(model_file))?;
        found = searched(&registered, &gyro, &observed);
    }
    let beyond = registered.alignment.beyond(&of_model);
    progress("writing the findings");
    let said = Said {
        observed: &observed,
        of_model: &of_model,
        registered: &registered,
        gyro: &gyro,
        pool: &pool,
        candidates: &candidates,
        beyond: &beyond,
        found: &found,
        plan,
        seed: settings.seed,
    };
    let mut outcome = findings::outcome(&said);
    if let Some(put_right) = put_right {
        put_right.report(&mut outcome);
    }
    Ok(Some(outcome))
}

/// Puts gyros and reference on the same axes where they are not.
///
/// # Errors
/// Axes are reversed or exchanged, or a factor is gross, and the settings do not say to put it right.
fn check_channels(
    settings: &Settings,
    observed: &mut Observed,
    (model, model_file): (&Model, &Path),
) -> Result<Option<PutRight>, InputError> {
    let asked = rlg_diagnosis::Settings {
        anyway: settings.anyway,
        ..Default::default()
    };
    let streams = &mut observed.streams;
    let rows = channels::reference_rows(&observed.samples, streams);
    let own_rad = std::mem::replace(&mut streams.case_rad, rows);
    streams.own_motion = false;
    let checked = put_right::put_right(&asked, streams, model, model_file);
    streams.own_motion = true;
    streams.case_rad = own_rad;
    let found = checked?;
    if let Some(found) = &found {
        let map = channels::map(&found.effects());
        channels::put_right(&map, &mut observed.samples, &mut observed.gyros.sensed_rad);
    }
    Ok(found)
}
