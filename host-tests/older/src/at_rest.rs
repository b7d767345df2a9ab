//! A unit at rest: what acts slowly by one likelihood, and beside it the stages for lines, clock, cycles and faults.

use std::path::Path;

use rlg_diagnosis::at_rest::{self, KINDS, SlowEffects};
use rlg_model::Model;
use rlg_model::kinds::NOISE_KINDS;
use rlg_recording::error::InputError;
use rlg_signal::qualify;

use crate::result::Verdict;
use crate::sentences::{effect_lines, opening};
use crate::streams::Streams;
use crate::{Outcome, Settings, diagnose_aligned};

/// Diagnoses the aligned channels of a unit at rest; `again` aligns them once more.
pub(super) fn diagnose(
    settings: &Settings,
    (mut streams, again): (Streams, &dyn Fn() -> Result<Streams, InputError>),
    (model, model_file): (&Model, &Path),
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let faults = qualify::qualify(&mut streams);
    if !faults.is_empty() {
        streams.stand_still_again(model);
    }
    let of = (model, model_file);
    let slow = at_rest::diagnose(&settings.of_new_engine(), &mut streams, of, progress)?;
    drop(streams);
    let stages = |left_out: &[&str], model: &Model| {
        let aligned = vec![again()?];
        diagnose_aligned(
            left_out,
            aligned,
            None,
            model,
            model_file,
            settings.seed,
            progress,
        )
    };
    let Some(slow) = slow else {
        return stages(settings.left_out, model);
    };
    let mut left_out: Vec<&str> = settings.left_out.iter().copied().chain(KINDS).collect();
    let mut quieter = slow.model.clone();
    quieter.gyro.pulse_weight_rad = slow.quieter_pulses_rad;
    if slow.is_noise {
        left_out.extend(NOISE_KINDS);
        let walk = |gyro: usize| Some(slow.noise[gyro].terms?.angle_random_walk_rad_sqrt_s.value);
        if let (Some(x), Some(y), Some(z)) = (walk(0), walk(1), walk(2)) {
            quieter.gyro.angle_random_walk_rad_sqrt_s = Some([x, y, z]);
        }
    }
    let mut rest = stages(&left_out, &quieter)?;
    rest.model.gyro = model.gyro.clone();
    Ok(joined(slow, rest))
}

/// The slow effects before everything else that was found beside them.
fn joined(slow: SlowEffects, mut rest: Outcome) -> Outcome {
    let found = &mut rest.diagnosis;
    if !slow.effects.is_empty() {
        found.verdict = match found.verdict {
            Verdict::Matches => Verdict::Explained,
            Verdict::Unexplained => Verdict::PartlyExplained,
            verdict => verdict,
        };
        found.summary[0] = opening(found.verdict).to_string();
        if slow.effects.len() > slow.rows.effects.len() {
            found.next_experiment = slow.next_experiment;
        }
        for (channel, before) in found.fit.channels.iter_mut().zip(slow.channels) {
            channel.held_out_before = before.held_out_before;
        }
        let known = std::mem::replace(&mut found.locations, slow.locations);
        found.locations.extend(known);
    }
    if let Some(control) = &mut found.control {
        control.cycles = slow.rows.cycles_of_shuffled;
        control.dropped += slow.rows.dropped;
    }
    let lines = slow.effects.iter().flat_map(effect_lines);
    let lines: Vec<String> = lines.chain(slow.noise_lines).collect();
    found.summary.splice(1..1, lines);
    found.effects.splice(0..0, slow.effects);
    if !found.noise.is_empty() {
        found.noise = slow.noise;
    }
    if !slow.accelerometer_noise.is_empty() {
        found.accelerometer_noise = slow.accelerometer_noise;
    }
    rest
}
