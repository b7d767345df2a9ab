//! Several recordings of one unit.

use rlg_diagnosis::rows::channel_correction::{ChannelCorrection, correct_channels};
use rlg_diagnosis::rows::data_words;
use rlg_diagnosis::rows::model_effects::is_predictable;
use rlg_diagnosis::search::structure::Found;
use rlg_diagnosis::several;
use rlg_findings::result::ParameterEntry;
use rlg_force::Part;
use rlg_force::reference::measured_noise;
use rlg_model::DeclaredModel;
use rlg_recording::error::InputError;
use rlg_signal::fault::Fault;
use rlg_signal::qualify;
use rlg_signal::streams::Streams;

use crate::{Aligned, Outcome, Settings, accelerometers, or_unusable, second_pass, too_few_rows};

/// Diagnoses aligned recordings of one unit together; recordings with a held-out piece serve validation only.
///
/// # Errors
/// Two recordings have one name, one is of a unit at rest, axes of one of them are reversed or exchanged, or the model holds
/// an effect that cannot be predicted here.
pub fn diagnose_together(
    settings: &Settings,
    aligned: Vec<Aligned>,
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Outcome, InputError> {
    let DeclaredModel { model, file } = of;
    let (mut aligned, restored): (Vec<Streams>, Vec<Vec<String>>) = aligned
        .into_iter()
        .map(|one| (one.streams, one.restored))
        .unzip();
    distinct(&aligned)?;
    is_predictable(model, file)?;
    with_reference(&aligned)?;
    let names: Vec<String> = aligned
        .iter()
        .map(|one| one.piece.recording.clone())
        .collect();
    let mut turned = Vec::with_capacity(aligned.len());
    for streams in &mut aligned {
        turned.push(correct_channels(settings, streams, model, file)?);
    }
    progress("qualifying the data");
    let mut all = Vec::with_capacity(aligned.len());
    let mut lines = Vec::with_capacity(aligned.len());
    for mut streams in aligned {
        let faults =
            qualify::unknown_faults(&mut streams, &model.effects, &settings.plan.signal.faults);
        lines.push(data_words::lines(&streams, &faults));
        all.push((streams, faults));
    }
    let noise = |found: &Found| measured_noise(&found.motion);
    let sensed =
        |(streams, faults): &(Streams, Vec<Fault>)| (streams.sensed_rad.clone(), faults.clone());
    let kept: Vec<_> = all.iter().map(sensed).collect();
    let run = |settings: &Settings, of: DeclaredModel<'_>| {
        for ((streams, faults), (sensed_rad, own)) in all.iter_mut().zip(&kept) {
            streams.sensed_rad.clone_from(sensed_rad);
            faults.clone_from(own);
        }
        several::diagnose_also(settings, &mut all, of, progress, noise)
    };
    let found = second_pass::until_nothing_returns(settings, of, progress, run);
    let found = found.map(|(mut outcome, noises)| {
        let searched = all.iter().filter(|(streams, _)| !streams.piece.held_out);
        let parts = searched.zip(noises);
        let parts = parts.map(|((streams, _), reference_noise)| Part {
            streams,
            reference_noise,
            read_by_gyros: None,
        });
        accelerometers(settings, parts.collect(), (model, &mut outcome), progress);
        outcome
            .diagnosis
            .judge_noise(&settings.plan.findings.instruments);
        let restored = named(&names, restored);
        outcome.diagnosis.prepend(restored.collect());
        outcome.diagnosis.summary.extend(named(&names, lines));
        report_corrections(&mut outcome, &names, turned);
        outcome
    });
    let why = |rows| format!("of one of the recordings {}", too_few_rows(rows));
    or_unusable(found, &names.join(" + "), settings, model, why)
}

/// Sentences on each recording, after its name.
fn named(names: &[String], sentences: Vec<Vec<String>>) -> impl Iterator<Item = String> {
    names.iter().zip(sentences).flat_map(|(name, sentences)| {
        let of_this = sentences.into_iter();
        of_this.map(move |sentence| format!("{name}: {sentence}"))
    })
}

/// Reports the corrected channels of each recording, with its name among the parameters.
fn report_corrections(
    outcome: &mut Outcome,
    names: &[String],
    corrections: Vec<Option<ChannelCorrection>>,
) {
    for (name, turned) in names.iter().zip(corrections) {
        let Some(turned) = turned else {
            continue;
        };
        let before = outcome.diagnosis.effects.len();
        turned.report(outcome);
        for effect in &mut outcome.diagnosis.effects[before..] {
            let recording = ParameterEntry::text("recording", name);
            effect.parameters.push(recording);
        }
    }
}

/// Checks that the recordings have different names.
fn distinct(all: &[Streams]) -> Result<(), InputError> {
    for (place, streams) in all.iter().enumerate() {
        let name = &streams.piece.recording;
        if all[..place].iter().any(|one| one.piece.recording == *name) {
            return Err(
                InputError::new(name, "has the name of another recording of this list")
                    .expected("distinct names of the recordings (name in recording.toml)"),
            );
        }
    }
    Ok(())
}

/// Checks that no recording is of a unit at rest.
fn with_reference(all: &[Streams]) -> Result<(), InputError> {
    match all.iter().find(|streams| streams.at_rest.is_some()) {
        None => Ok(()),
        Some(streams) => {
            let name = &streams.piece.recording;
            Err(InputError::new(name, "is of a unit at rest")
                .expected("one such recording at a time, or recordings with a reference"))
        }
    }
}
