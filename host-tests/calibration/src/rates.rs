//! Extracts the information of a recording with a rate reference: generalised least squares with the model's noise.
//!
//! The recording's `reference_increment` lies on the gyros' rows. The result is [`Information`] on the catalogue's
//! parameters. Residual = sensed − predicted; its noise is white in angle plus a random walk, so the likelihood is
//! Whittle's (physics §6). Stages and noise fit are those of the diagnosis.
//!
//! The whole recording serves: nothing is selected, so nothing need be held out. Memory: some thirty columns
//! of 8 bytes a row, 0.4 GB for 400 s at 4 kHz.

use std::path::Path;

use super::unknowns::{RIVAL, Unknowns, effect};
use rlg_diagnosis::noise_spectrum::Noise;
use rlg_diagnosis::portion::Portion;
use rlg_diagnosis::split::usable_runs;
use rlg_model::Model;
use rlg_older::hypotheses::{CATALOGUE, no_effects};
use rlg_older::information::Information;
use rlg_older::scene::Scene;
use rlg_older::workbench::{Parameters, Workbench};
use rlg_older::{declared_noise, reference_noise, residual};
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_signal::qualify;
use rlg_signal::streams::Streams;

/// Least seconds of usable rows: below this not even the noise is known.
const LEAST_S: f64 = 2.0;

/// The information of one recording, and what it rests on.
#[derive(Clone)]
pub struct RecordingInformation {
    /// Information on the parameters of the catalogue.
    pub information: Information,
    /// Noise of each gyro, as fitted.
    pub noise: [Noise; 3],
    /// Seconds that were used.
    pub seconds: f64,
    /// Real degrees of freedom of the residual, all gyros.
    pub degrees: f64,
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// The greatest angular acceleration about each axis \[rad/s²\].
    pub acceleration_rad_s2: [f64; 3],
}

/// Too little of a recording can be used.
pub fn too_short(recording: &Recording, seconds: f64) -> InputError {
    InputError::new(
        recording.folder.join("recording.toml"),
        "has too few rows with all channels measured",
    )
    .value(format!("{seconds:.2} s"))
    .expected(format!("at least {LEAST_S} s"))
}

/// Computes the information of `recording`. `model` must not contain flexure, which would be predicted away.
pub fn recording_information(
    recording: &Recording,
    model: &Model,
    model_file: &Path,
    catalogue: &Parameters,
) -> Result<RecordingInformation, InputError> {
    let mut streams = Streams::align(recording, model)?;
    qualify::qualify(&mut streams);
    let rate_hz = streams.rate_hz;
    let runs = usable_runs(&streams.usable, 0..streams.rows);
    let portion = Portion::new(runs, rate_hz).ok_or_else(|| too_short(recording, 0.0))?;
    let seconds = portion.seconds();
    if seconds < LEAST_S {
        return Err(too_short(recording, seconds));
    }
    let scene = Scene::new(streams, reference_noise(model), model.gyro.scale_error);
    let acceleration_rad_s2 = [0, 1, 2].map(|axis: usize| greatest(&scene, axis));
    let residual_rad = residual::residual_rad(&scene, model, model_file)?;

    let mut fitted = Unknowns::nuisances_and_flexure(!model.earth_rate_in_reference);
    fitted.retain(|&effect| CATALOGUE[effect].missing(&scene).is_none());
    let mut all = fitted.clone();
    all.push(effect(RIVAL));
    let mut bench = Workbench::new(
        &scene,
        &residual_rad,
        catalogue,
        portion,
        [Noise::unit(rate_hz); 3],
        &all,
        &no_effects(),
    );
    bench.refit_noise(&fitted, &declared_noise(model, rate_hz), true);
    let joints = bench.joints().len();
    Ok(RecordingInformation {
        information: bench.information(),
        noise: bench.noise,
        seconds,
        degrees: 3.0 * (bench.portion.rows() - joints) as f64,
        rate_hz,
        acceleration_rad_s2,
    })
}

/// The greatest |α| about an axis \[rad/s²\].
pub fn greatest(scene: &Scene, axis: usize) -> f64 {
    scene.acceleration_rad_s2[axis]
        .iter()
        .fold(0.0, |most: f64, value| most.max(value.abs()))
}
