//! Moving gyros without any reference: bounds of their noise, faults of the data; their errors are not observable.

use std::ops::Range;

use rlg_diagnosis::rows::data_words;
use rlg_diagnosis::{Outcome, Settings};
use rlg_findings::numbers::number;
use rlg_findings::sentences::DEG_H;
use rlg_inference::Dct;
use rlg_inference::observations::runs;
use rlg_model::Model;
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_signal::qualify;
use rlg_signal::streams::{AXES, Streams};

/// Reason for which no error is sought.
const WHY: &str = "the unit rotates, and no other channel measures its rotation";

/// Experiment that shows more.
const NEXT: &str = "Record a reference of the motion (turntable, cameras, a second unit), or hold the unit still in six positions or more, ten seconds each: rests tell biases, and turns between them scale and misalignment by gravity.";

/// Bounds the noise of moving gyros without a reference, and lists faults of the data.
///
/// # Errors
/// The gyros' channels are missing.
pub fn diagnose_without_reference(
    settings: &Settings,
    recording: &Recording,
    model: &Model,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let plan = &settings.plan;
    progress("bounding the gyros' noise");
    let mut streams = Streams::align_without_reference(recording, model, &plan.signal.align)?;
    let faults = qualify::unknown_faults(&mut streams, &model.effects, &plan.signal.faults);
    let mut outcome = Outcome::unusable(&recording.name, settings.seed, WHY, model);
    let diagnosis = &mut outcome.diagnosis;
    diagnosis.summary = vec![format!(
        "Errors of the gyros are not observable (bias, scale, misalignment): {WHY}."
    )];
    diagnosis
        .summary
        .extend(data_words::lines(&streams, &faults));
    diagnosis
        .summary
        .extend(noise(&streams, plan.force.least_coefficients));
    diagnosis.next_experiment = NEXT.to_string();
    Ok(outcome)
}

/// Sentence on the white noise of rate that each gyro has at most: the power of its quietest octave, motion included.
fn noise(streams: &Streams, least_coefficients: usize) -> Option<String> {
    let measured = runs(&streams.usable, true);
    let longest = measured.into_iter().max_by_key(Range::len)?;
    let dct = Dct::new(longest.len());
    let of_gyro = |gyro: usize| {
        let mut spectrum = streams.sensed_rad[gyro][longest.clone()].to_vec();
        dct.forward(&mut spectrum);
        let quietest = quietest(&spectrum, least_coefficients)?;
        Some((quietest * streams.rate_hz).sqrt())
    };
    let each = AXES.iter().enumerate().map(|(gyro, axis)| {
        let walk_rad_sqrt_s: f64 = of_gyro(gyro)?;
        Some(format!("{axis} {}", number(walk_rad_sqrt_s * DEG_H / 60.0)))
    });
    let each: Vec<String> = each.collect::<Option<_>>()?;
    Some(format!(
        "Noise: N at most {} °/√h, the power of the quietest octave, motion included.",
        each.join(", ")
    ))
}

/// Mean square of the coefficients in the quietest octave; `None` for a record without an octave of enough of them.
fn quietest(spectrum: &[f64], least_coefficients: usize) -> Option<f64> {
    let mut end = spectrum.len();
    let mut least: Option<f64> = None;
    while end / 2 >= least_coefficients {
        let octave = &spectrum[end / 2..end];
        let power = octave.iter().map(|c| c * c).sum::<f64>() / octave.len() as f64;
        least = Some(least.map_or(power, |least| least.min(power)));
        end /= 2;
    }
    least
}
