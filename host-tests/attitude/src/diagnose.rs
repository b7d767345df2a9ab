//! Workflow of a diagnosis against attitudes.

use rlg_diagnosis::Outcome;
use rlg_diagnosis::Settings;
use rlg_diagnosis::rows::channel_correction::{self, ChannelCorrection, Stopped};
use rlg_model::{DeclaredModel, Model, MotionSource};
use rlg_recording::error::InputError;
use rlg_recording::{Clock, Quantity, Recording};
use rlg_signal::attitude_samples::has_attitude;
use rlg_signal::axes::Triad;
use rlg_signal::channels::SAME_ROW;
use rlg_signal::streams::Streams;

use crate::fits::many_fit;
use crate::fits::report_inputs::Said;
use crate::fits::sparse_fit;
use crate::gyros::channels;
use crate::gyros::zeroing;
use crate::registration::observed::{Observed, observe};
use crate::report::case_motion;
use crate::report::findings;
use crate::rows::alignment::Alignment;

/// A diagnosis and the corrected motion.
pub struct Diagnosed {
    /// Findings on the gyros.
    pub outcome: Outcome,
    /// Channels with the case's motion measured by the gyros, less their identified errors; else the reason of its absence.
    pub corrected: Result<Streams, String>,
}

/// True if the reference of a recording gives attitudes, or increments on other rows than the gyros'.
pub fn serves(recording: &Recording, model: &Model) -> bool {
    if model.motion != MotionSource::Reference {
        return false;
    }
    let mut gyros = Quantity::GYROS.iter();
    let gyro = gyros.find_map(|quantity| recording.channel(quantity, "x"));
    let reference = recording.channel(&Quantity::ReferenceIncrement, "x");
    let clocks = gyro.zip(reference).map(|((gyro, _), (reference, _))| {
        let clocks = (&gyro.clock, &reference.clock);
        (clocks, gyro.rows)
    });
    let Some((
        (
            Clock::Uniform { rate_hz, start_s },
            Clock::Uniform {
                rate_hz: own_hz,
                start_s: own_s,
            },
        ),
        rows,
    )) = clocks
    else {
        return has_attitude(recording);
    };
    let drift_rows = (own_hz - rate_hz) / rate_hz * rows as f64;
    let offset_rows = (own_s - start_s) * rate_hz;
    drift_rows.abs() >= SAME_ROW || (offset_rows - offset_rows.round()).abs() >= SAME_ROW
}

/// Diagnoses a recording; `None` if fewer than two attitudes lie within the gyros' record.
///
/// # Errors
/// The recording lacks a channel or its attitudes are invalid; the model's installation matrix has no inverse.
pub fn diagnose(
    settings: &Settings,
    recording: &Recording,
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Option<Diagnosed>, InputError> {
    let model = of.model;
    progress("aligning the channels");
    let Some(mut observed) = observe(recording, of, &settings.plan)? else {
        return Ok(None);
    };
    let mut correction = None;
    if !observed.is_few {
        observed.take_settling(&Alignment::of_model(model), &settings.plan);
        correction = match check_channels(settings, &mut observed, of) {
            Err(Stopped::Apart(why, _)) => {
                let outcome =
                    channel_correction::of_two_motions(&recording.name, settings.seed, &why, model);
                return Ok(Some(Diagnosed {
                    outcome,
                    corrected: Err(why),
                }));
            }
            checked => checked?,
        };
    }
    if !observed.is_few {
        let rows = channels::reference_rows(
            &observed.sound_samples(),
            &observed.streams,
            &settings.plan.attitude.rows,
        );
        let seen = observed.fitted_rows(&rows.doubtful);
        let reference = (&rows.increments_rad, &seen[..]);
        observed.zeroed = zeroing::find(
            &observed.gyros,
            reference,
            (
                &settings.plan.attitude.zeroing,
                &settings.plan.catalogue.grids,
            ),
        );
        zeroing::undo(&mut observed.gyros, zeroing::high_passes(&observed.zeroed));
        observed.take_lines(reference, &settings.plan.signal.own_lines);
    }
    let of_model = Alignment::of_model(model).without(&observed.recorded_from_case);
    let fit = if observed.is_few {
        sparse_fit::fit
    } else {
        many_fit::fit
    };
    let Some(fitted) = fit(settings, &mut observed, &of_model, progress)? else {
        return Ok(None);
    };
    progress("writing the findings");
    let said = Said {
        observed: &observed,
        of_model: &of_model,
        registered: &fitted.registered,
        gyro: &fitted.gyro,
        pool: &fitted.pool,
        candidates: &fitted.candidates,
        beyond: &fitted.registered.alignment.beyond(&of_model),
        found: &fitted.found,
        few: fitted.few.as_ref(),
        plan: &settings.plan,
        seed: settings.seed,
    };
    let mut outcome = findings::outcome(&said);
    // Gravity is transported for accelerometers alone.
    let corrected_rad = match model.accelerometer {
        Some(_) => case_motion::corrected_rad(&said),
        None => Err("the model describes no accelerometers".to_string()),
    };
    if let Some(correction) = correction {
        correction.report(&mut outcome);
    }
    let mut streams = observed.streams;
    let corrected = corrected_rad.map(|case_rad| {
        streams.case_rad = case_rad;
        streams
    });
    Ok(Some(Diagnosed { outcome, corrected }))
}

/// Transforms gyros and reference to the same axes if they differ.
///
/// # Errors
/// As in [`channel_correction::correct_channels`].
fn check_channels(
    settings: &Settings,
    observed: &mut Observed,
    of: DeclaredModel<'_>,
) -> Result<Option<ChannelCorrection>, Stopped> {
    let DeclaredModel { model, file } = of;
    let samples = observed.sound_samples();
    let reference_hz = channels::readings_hz(&observed.samples);
    let streams = &mut observed.streams;
    let mut rows = channels::reference_rows(&samples, streams, &settings.plan.attitude.rows);
    channels::map_increments(&model.effects, &mut rows.increments_rad);
    streams.case_rad = rows.increments_rad;
    let usable = streams.usable.clone();
    for (usable, doubtful) in streams.usable.iter_mut().zip(rows.doubtful) {
        *usable &= !doubtful;
    }
    (streams.own_motion, streams.reference_hz) = (false, reference_hz);
    let checked = channel_correction::correct_channels(settings, streams, model, file);
    (streams.own_motion, streams.reference_hz) = (true, None);
    streams.case_rad = Triad::default();
    streams.usable = usable;
    // A pure rotation of any size is left to the registration, which uses attitudes as they are.
    let found = checked?.filter(|found| !found.is_turn_alone());
    if let Some(found) = &found {
        let map = channels::map(&found.effects());
        channels::apply_map(&map, &mut observed.samples, &mut observed.gyros.sensed_rad);
        observed.recorded_from_case = channels::on_gyros(&map) * observed.recorded_from_case;
    }
    Ok(found)
}
