//! Gyros beside attitudes by their own likelihood, and the stages for accelerometers on the motion that it finds.
//!
//! Gravity is carried by the gyros, less what was found of their errors. What they still err by is of the size of what the
//! search could not see; a slow turn of the vertical is fitted with it.

use std::path::Path;

use rlg_attitude::Diagnosed;
use rlg_model::Model;
use rlg_recording::Recording;
use rlg_recording::error::InputError;

use crate::accelerometer::{self, Given};
use crate::declared::own_noise;
use crate::explain;
use crate::scene::Scene;
use crate::split::Part;
use crate::streams::Streams;
use crate::workbench::Parameters;
use crate::{Outcome, Settings};

/// Diagnoses gyros beside attitudes, and the accelerometers that the model describes.
///
/// # Errors
/// As of [`rlg_attitude::diagnose`].
pub(super) fn diagnose(
    settings: &Settings,
    recording: &Recording,
    (model, model_file): (&Model, &Path),
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let asked = rlg_attitude::Settings {
        left_out: settings.left_out,
        seed: settings.seed,
        anyway: settings.anyway,
        ..Default::default()
    };
    let of = (model, model_file);
    let diagnosed = rlg_attitude::diagnose(&asked, recording, of, progress)?;
    let Some(Diagnosed {
        mut outcome,
        corrected,
    }) = diagnosed
    else {
        let why = "fewer than two attitudes lie within the gyros' record";
        return Ok(Outcome {
            diagnosis: explain::unusable(&recording.name, settings.seed, why, Vec::new()),
            model: model.clone(),
            pictures: None,
        });
    };
    if model.accelerometer.is_some() {
        let found =
            corrected.and_then(|streams| accelerometers(settings, streams, model, progress));
        accelerometer::add(found, &mut outcome);
    }
    Ok(outcome)
}

/// Weighs the accelerometers' effects on a motion without known errors.
///
/// # Errors
/// Why they cannot be.
fn accelerometers(
    settings: &Settings,
    streams: Streams,
    model: &Model,
    progress: &dyn Fn(&str),
) -> Result<accelerometer::Found, String> {
    // The reference's errors do not carry gravity.
    let mut model = model.clone();
    let is_of_gyros = |kind: &str| !kind.starts_with("reference_");
    model.effects.retain(|effect| is_of_gyros(&effect.kind));
    let white_rad2 = (0..3).map(|axis| {
        model.gyro.pulse_weight_rad[axis].powi(2) / 12.0 + model.pickoff_white_rad2(axis)
    });
    let noise = own_noise(&model, white_rad2.fold(0.0, f64::max).sqrt());
    let mut scene = Scene::new(streams, Some(noise), model.gyro.scale_error);
    let given = Given {
        model: &model,
        left_out: settings.left_out,
        held_out: Part::End,
    };
    accelerometer::weigh_alone(&mut scene, &given, &Parameters::of_catalogue(), progress)
}
