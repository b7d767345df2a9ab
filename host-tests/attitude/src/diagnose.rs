//! The flow of a diagnosis against attitudes.

use std::path::Path;

use nalgebra::Vector3;
use rlg_diagnosis::Outcome;
use rlg_diagnosis::put_right::{self, PutRight};
use rlg_model::{EffectValue, Model, MotionSource};
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_signal::attitude_samples::{AttitudeSample, attitude_samples, has_attitude};
use rlg_signal::fault::Fault;
use rlg_signal::own_motion::take_own_motion;
use rlg_signal::qualify;
use rlg_signal::residual::body_from_sensing;
use rlg_signal::streams::Streams;

use crate::channels;
use crate::coarse;
use crate::findings::{self, Said};
use crate::physics::Gyro;
use crate::plan::AttitudePlan;
use crate::registration::{Alignment, Free, Gyros, Registration, register};
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

/// A recording, ready.
pub(crate) struct Observed<'a> {
    pub(crate) recording: &'a Recording,
    pub(crate) model: &'a Model,
    pub(crate) streams: Streams,
    pub(crate) faults: Vec<Fault>,
    pub(crate) samples: Vec<AttitudeSample>,
    /// Stamps that serve the last test alone.
    pub(crate) tested: Vec<bool>,
    pub(crate) gyros: Gyros,
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

fn no_inverse(model_file: &Path) -> InputError {
    InputError::new(model_file, "the installation matrix has no inverse")
        .channel("gyro.installation_rad")
}

fn observe<'a>(
    recording: &'a Recording,
    (model, model_file): (&'a Model, &Path),
    plan: &AttitudePlan,
) -> Result<Option<Observed<'a>>, InputError> {
    let mut samples = attitude_samples(recording)?;
    if samples.len() < plan.least_stamps {
        return Ok(None);
    }
    let mut streams = Streams::align_without_reference(recording, model)?;
    let from_sensing = body_from_sensing(&model.gyro.installation_rad);
    if from_sensing.try_inverse().is_none() {
        return Err(no_inverse(model_file));
    }
    take_own_motion(&mut streams, model, &from_sensing);
    let faults = qualify::qualify(&mut streams)
        .into_iter()
        .filter(|fault| !qualify::is_known(fault, &streams, &model.effects))
        .collect();
    let case = &streams.case_rad;
    let sensed_rad = (0..streams.rows)
        .map(|row| Vector3::from_fn(|axis, _| case[axis][row]))
        .collect();
    let mut lost_before = vec![0];
    for usable in &streams.usable {
        let before = lost_before[lost_before.len() - 1];
        lost_before.push(before + usize::from(!usable));
    }
    let mut gyros = Gyros {
        start_s: streams.start_s,
        rate_hz: streams.rate_hz,
        sensed_rad,
        lost_before,
    };
    let map = channels::map(&model.effects);
    channels::put_right(&map, &mut samples, &mut gyros.sensed_rad);
    let fitted = samples.len() - (plan.tested_share * samples.len() as f64) as usize;
    let masked = known_faults(model);
    let tested = samples
        .iter()
        .enumerate()
        .map(|(stamp, sample)| {
            stamp >= fitted
                || masked
                    .iter()
                    .any(|span| span[0] <= sample.time_s && sample.time_s <= span[1])
        })
        .collect();
    Ok(Some(Observed {
        recording,
        model,
        streams,
        faults,
        samples,
        tested,
        gyros,
    }))
}

/// Times that the model knows to be without a reference \[s\].
fn known_faults(model: &Model) -> Vec<[f64; 2]> {
    let of_kind = |kind: &str| matches!(kind, "reference_dropout" | "reference_spike");
    let faults = model.effects.iter().filter(|effect| of_kind(&effect.kind));
    faults
        .filter_map(|effect| {
            let number = |name: &str| match effect.parameters.get(name) {
                Some(EffectValue::Number(value)) => Some(*value),
                _ => None,
            };
            /// A spike is stamped at one time.
            const AT_ONCE_S: f64 = 1e-6;
            match number("time_s") {
                Some(time_s) => Some([time_s - AT_ONCE_S, time_s + AT_ONCE_S]),
                None => Some([number("start_s")? - AT_ONCE_S, number("end_s")? + AT_ONCE_S]),
            }
        })
        .collect()
}
