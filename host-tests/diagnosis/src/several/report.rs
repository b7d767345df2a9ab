//! Joins the findings of the recordings into one report.

use std::collections::BTreeSet;

use rlg_findings::result::{
    ChannelEntry, Diagnosis, EffectEntry, ExperimentEntry, FiguresEntry, FitEntry, LocationEntry,
    NoiseEntry, ParameterEntry, RecordingEntry, Verdict, WholeEntry,
};
use rlg_findings::sentences::opening;
use rlg_findings::updated_model::switch_on;
use rlg_model::EffectValue;
use rlg_model::kinds::NOISE_KINDS;
use rlg_signal::fault::Fault;

use crate::confirm::Confirmed;
use crate::confirm::together::Together;
use crate::outcome::Outcome;
use crate::report::findings::written;
use crate::rows::data::Data;
use crate::settings::Settings;
use crate::tiles::pictures::Pictures;

/// Findings of one recording, before they are joined.
struct OfRecording {
    outcome: Outcome,
    /// Effects added to the model.
    added: Vec<rlg_model::ModelEffect>,
    /// Number of named effects, common or its own, first in the list; the others are its noise, its faults and its residual.
    named: usize,
}

/// Data joined with the fitted recordings.
pub(crate) enum Beside {
    /// Figures of recordings that are held out whole.
    HeldOut(Vec<HeldOut>),
    /// The one recording of which all are stretches.
    Whole(Box<Whole>),
}

/// A recording longer than memory.
pub(crate) struct Whole {
    /// Its name.
    pub(crate) recording: String,
    /// Stretches, blocks and figures of the blocks.
    pub(crate) entry: WholeEntry,
    /// Drift of each gyro over its length \[rad/s\], if any.
    pub(crate) wandering_rad_s: [Option<f64>; 3],
    /// Sentences on blocks that deviate from their noise.
    pub(crate) unlike: Vec<String>,
    /// Locations at which its blocks deviate from the model.
    pub(crate) locations: Vec<LocationEntry>,
    /// Pictures of its blocks.
    pub(crate) pictures: Pictures,
}

/// Writes the findings of all recordings.
///
/// # Inputs
/// `faults`: of the data of each recording.
pub(crate) fn outcome(
    all: &[Data],
    together: &mut Together,
    confirmed: &Confirmed,
    faults: &[Vec<Fault>],
    beside: Beside,
    settings: &Settings,
) -> Outcome {
    let each: Vec<OfRecording> = (0..all.len())
        .map(|recording| {
            of_recording(
                &all[recording],
                recording,
                together,
                confirmed,
                &faults[recording],
                settings,
            )
        })
        .collect();
    let mut model = all[0].model.clone();
    for (recording, one) in each.iter().enumerate() {
        let name = &all[recording].streams.piece.recording;
        for (place, effect) in one.added.iter().enumerate() {
            let mut effect = effect.clone();
            if place >= one.named && matches!(beside, Beside::HeldOut(_)) {
                let name = EffectValue::Text(name.clone());
                effect.parameters.insert("recording".to_string(), name);
            }
            switch_on(&mut model, effect);
        }
    }
    let (diagnosis, pictures) = match beside {
        Beside::HeldOut(held_out) => {
            let diagnosis = of_recordings(all, &each, held_out, together.tried);
            let first = each.into_iter().next();
            (diagnosis, first.and_then(|one| one.outcome.pictures))
        }
        Beside::Whole(whole) => of_stretches(&each, *whole, together.tried),
    };
    Outcome {
        diagnosis,
        model,
        pictures,
    }
}

/// Joins the diagnoses of recordings into one.
fn of_recordings(
    all: &[Data],
    each: &[OfRecording],
    held_out: Vec<HeldOut>,
    tried: usize,
) -> Diagnosis {
    let recordings: Vec<RecordingEntry> = all
        .iter()
        .zip(each)
        .map(|(data, one)| {
            let fit = &one.outcome.diagnosis.fit;
            RecordingEntry {
                recording: data.streams.piece.recording.clone(),
                held_out_whole: false,
                fitted_on: fit.fitted_on.clone(),
                held_out: fit.held_out.clone(),
                normalised_power: powers(&fit.channels),
            }
        })
        .collect();
    let channels: Vec<Vec<ChannelEntry>> = each
        .iter()
        .map(|one| one.outcome.diagnosis.fit.channels.clone())
        .chain(held_out.iter().map(|one| one.channels.clone()))
        .collect();
    let recordings: Vec<RecordingEntry> = recordings
        .into_iter()
        .chain(held_out.into_iter().map(|one| one.entry))
        .collect();
    joined(all, each, (recordings, &channels), tried)
}

/// A recording that is held out whole.
pub(crate) struct HeldOut {
    pub(crate) entry: RecordingEntry,
    pub(crate) channels: Vec<ChannelEntry>,
}

/// Residual power of each gyro over its noise \[1\].
pub(crate) fn powers(channels: &[ChannelEntry]) -> [Option<f64>; 3] {
    [0, 1, 2].map(|axis| {
        let channel = channels.get(axis)?;
        Some(channel.held_out_after.normalised_power_all)
    })
}

/// Findings of one recording: effects of its own, and common ones if it is the first that has them.
fn of_recording(
    data: &Data,
    recording: usize,
    together: &mut Together,
    confirmed: &Confirmed,
    faults: &[Fault],
    settings: &Settings,
) -> OfRecording {
    let share = confirmed.share(together, data, recording);
    let of = together.of(data, recording);
    let (outcome, added) = written(of, &share, faults, settings.seed, &settings.plan);
    OfRecording {
        outcome,
        added,
        named: share.set.named.len(),
    }
}

/// Joins the diagnoses of stretches into one of their recording.
fn of_stretches(each: &[OfRecording], whole: Whole, tried: usize) -> (Diagnosis, Option<Pictures>) {
    let diagnoses: Vec<&Diagnosis> = each.iter().map(|one| &one.outcome.diagnosis).collect();
    let verdict = match (
        verdict_of(diagnoses.iter().map(|one| one.verdict)),
        whole.unlike.is_empty(),
    ) {
        (Verdict::Explained, false) => Verdict::PartlyExplained,
        (Verdict::Matches, false) => Verdict::Unexplained,
        (verdict, _) => verdict,
    };
    let mut summary = vec![opening(verdict).to_string()];
    for line in diagnoses.iter().flat_map(|one| one.summary.iter().skip(1)) {
        if !summary.contains(line) {
            summary.push(line.clone());
        }
    }
    summary.extend(whole.unlike);
    let channels: Vec<Vec<ChannelEntry>> = diagnoses
        .iter()
        .map(|one| one.fit.channels.clone())
        .collect();
    let on_clock = |of: fn(&FitEntry) -> &Vec<[f64; 2]>| {
        let each = diagnoses.iter().flat_map(|one| of(&one.fit).clone());
        each.collect::<Vec<_>>()
    };
    // Drift is determined by the blocks of all rows; the level of a stretch is free.
    let with_drift_of = |one: ChannelEntry| {
        let mut blocks = whole.entry.channels.iter();
        let Some(blocks) = blocks.find(|other| other.channel == one.channel) else {
            return one;
        };
        let of = |own: &FiguresEntry, blocks: &FiguresEntry| FiguresEntry {
            drift_rad_s: blocks.drift_rad_s,
            drift_std_rad_s: blocks.drift_std_rad_s,
            ..own.clone()
        };
        ChannelEntry {
            held_out_before: of(&one.held_out_before, &blocks.held_out_before),
            held_out_after: of(&one.held_out_after, &blocks.held_out_after),
            ..one
        }
    };
    let channels = (0..3).filter_map(|axis| channel(&channels, axis));
    let channels: Vec<ChannelEntry> = channels.map(with_drift_of).collect();
    let fit = FitEntry {
        fitted_on: on_clock(|fit| &fit.fitted_on),
        held_out: on_clock(|fit| &fit.held_out),
        channels,
        recordings: Vec::new(),
        whole: Some(whole.entry),
    };
    let noise = |axis: usize| NoiseEntry {
        wandering_rad_s: whole.wandering_rad_s[axis],
        ..noise(&diagnoses, axis)
    };
    let of_rows = diagnoses.iter().flat_map(|one| one.locations.clone());
    let diagnosis = Diagnosis {
        recording: whole.recording,
        verdict,
        summary,
        locations: whole.locations.into_iter().chain(of_rows).collect(),
        effects: effects_of_stretches(each),
        fit,
        not_excluded: unseen_by_all(&diagnoses),
        next_experiment: next_experiment(each),
        experiment: experiment(each),
        noise: (0..3).map(noise).collect(),
        trials: tried,
        ..diagnoses[0].clone()
    };
    (diagnosis, Some(whole.pictures))
}

/// Joins the effects of stretches, those with a name first.
fn effects_of_stretches(each: &[OfRecording]) -> Vec<EffectEntry> {
    let mut effects: Vec<EffectEntry> = Vec::new();
    for own in each {
        effects.extend_from_slice(&own.outcome.diagnosis.effects[..own.named]);
    }
    for own in each {
        for effect in &own.outcome.diagnosis.effects[own.named..] {
            // The noise is common to all stretches: the first entry of a kind is kept.
            let is_noise = NOISE_KINDS.contains(&effect.kind.as_str());
            if !is_noise || effects.iter().all(|other| other.kind != effect.kind) {
                effects.push(effect.clone());
            }
        }
    }
    effects
}

/// Sentences on kinds that none of the recordings could show.
fn unseen_by_all(diagnoses: &[&Diagnosis]) -> Vec<String> {
    let unseen: Vec<BTreeSet<&String>> = diagnoses
        .iter()
        .map(|one| one.not_excluded.iter().collect())
        .collect();
    let nobody = |line: &&String| unseen.iter().all(|own| own.contains(line));
    let lines = diagnoses[0].not_excluded.iter();
    lines.filter(nobody).cloned().collect()
}

/// Diagnosis with the next experiment of all: the first with a named effect.
fn leading(each: &[OfRecording]) -> Option<&Diagnosis> {
    let naming = each.iter().find(|one| one.named > 0);
    naming.or(each.first()).map(|one| &one.outcome.diagnosis)
}

fn next_experiment(each: &[OfRecording]) -> String {
    leading(each).map_or_else(String::new, |one| one.next_experiment.clone())
}

fn experiment(each: &[OfRecording]) -> Option<ExperimentEntry> {
    leading(each).and_then(|one| one.experiment.clone())
}

/// Joins the diagnoses of all recordings into one.
fn joined(
    all: &[Data],
    each: &[OfRecording],
    (recordings, channels): (Vec<RecordingEntry>, &[Vec<ChannelEntry>]),
    tried: usize,
) -> Diagnosis {
    let names: Vec<&str> = recordings.iter().map(|one| &*one.recording).collect();
    let diagnoses: Vec<&Diagnosis> = each.iter().map(|one| &one.outcome.diagnosis).collect();
    let verdict = verdict_of(diagnoses.iter().map(|one| one.verdict));
    let mut summary = vec![opening(verdict).to_string()];
    for (data, one) in all.iter().zip(&diagnoses) {
        let name = &data.streams.piece.recording;
        summary.extend(one.summary.iter().skip(1).map(|line| {
            let is_said = line.starts_with("Found");
            if is_said {
                line.clone()
            } else {
                format!("{name}: {line}")
            }
        }));
    }
    let mut effects = Vec::new();
    let mut rest = Vec::new();
    for (data, one) in all.iter().zip(each) {
        let mut own = one.outcome.diagnosis.effects.clone();
        let mut of_data = own.split_off(one.named);
        for entry in of_data
            .iter_mut()
            .filter(|one| one.text("recording").is_none())
        {
            let recording = ParameterEntry::text("recording", &data.streams.piece.recording);
            entry.parameters.push(recording);
        }
        effects.extend(own);
        rest.extend(of_data);
    }
    effects.extend(rest);
    let locations = all.iter().zip(&diagnoses).flat_map(|(data, one)| {
        one.locations.iter().map(|location| LocationEntry {
            recording: Some(data.streams.piece.recording.clone()),
            ..location.clone()
        })
    });
    Diagnosis {
        recording: names.join(" + "),
        verdict,
        summary,
        locations: locations.collect(),
        effects,
        fit: FitEntry {
            fitted_on: in_a_row(all, &diagnoses, |fit| &fit.fitted_on),
            held_out: in_a_row(all, &diagnoses, |fit| &fit.held_out),
            channels: (0..3).filter_map(|axis| channel(channels, axis)).collect(),
            recordings,
            whole: None,
        },
        not_excluded: unseen_by_all(&diagnoses),
        next_experiment: next_experiment(each),
        experiment: experiment(each),
        noise: (0..3).map(|axis| noise(&diagnoses, axis)).collect(),
        trials: tried,
        ..diagnoses[0].clone()
    }
}

/// Joins the verdicts on the recordings.
fn verdict_of(each: impl Iterator<Item = Verdict> + Clone) -> Verdict {
    let is_told = |verdict| matches!(verdict, Verdict::Explained | Verdict::PartlyExplained);
    let is_consistent = |verdict| matches!(verdict, Verdict::Explained | Verdict::Matches);
    Verdict::of(each.clone().any(is_told), each.clone().all(is_consistent))
}

/// Times \[s\] on a clock that continues from the first recording's without a gap.
fn in_a_row<'a>(
    all: &[Data],
    each: &[&'a Diagnosis],
    of: impl Fn(&'a FitEntry) -> &'a Vec<[f64; 2]>,
) -> Vec<[f64; 2]> {
    let mut before_s = all[0].streams.start_s;
    let mut times = Vec::new();
    for (data, one) in all.iter().zip(each) {
        let streams = data.streams;
        let later = before_s - streams.start_s;
        times.extend(
            of(&one.fit)
                .iter()
                .map(|span| span.map(|time_s| time_s + later)),
        );
        before_s += streams.rows as f64 / streams.rate_hz;
    }
    times
}

/// Joint figures of one gyro: drift as weighted mean, powers as mean, p-value as the smallest times their number
/// (Bonferroni).
fn channel(all: &[Vec<ChannelEntry>], axis: usize) -> Option<ChannelEntry> {
    let each: Vec<&ChannelEntry> = all.iter().filter_map(|one| one.get(axis)).collect();
    let first = *each.first()?;
    let figures = |of: &dyn Fn(&ChannelEntry) -> FiguresEntry| {
        let all: Vec<FiguresEntry> = each.iter().map(|one| of(one)).collect();
        let count = all.len() as f64;
        let weight: f64 = all.iter().map(|one| one.drift_std_rad_s.powi(-2)).sum();
        let weighted = |one: &FiguresEntry| one.drift_rad_s * one.drift_std_rad_s.powi(-2);
        let mean = |of: &dyn Fn(&FiguresEntry) -> f64| all.iter().map(of).sum::<f64>() / count;
        let least = all.iter().map(|one| one.white_p_value).fold(1.0, f64::min);
        FiguresEntry {
            drift_rad_s: all.iter().map(weighted).sum::<f64>() / weight,
            drift_std_rad_s: weight.sqrt().recip(),
            normalised_power: mean(&|one| one.normalised_power),
            normalised_power_all: mean(&|one| one.normalised_power_all),
            white_p_value: (least * count).min(1.0),
        }
    };
    Some(ChannelEntry {
        held_out_before: figures(&|one| one.held_out_before.clone()),
        held_out_after: figures(&|one| one.held_out_after.clone()),
        ..first.clone()
    })
}

/// Noise of one gyro: the root mean square over the recordings.
fn noise(each: &[&Diagnosis], axis: usize) -> NoiseEntry {
    let count = each.len() as f64;
    let rms = |of: &dyn Fn(&NoiseEntry) -> f64| {
        let squares = each.iter().map(|one| of(&one.noise[axis]).powi(2));
        (squares.sum::<f64>() / count).sqrt()
    };
    let wanders = each
        .iter()
        .any(|one| one.noise[axis].wandering_rad_s.is_some());
    NoiseEntry {
        channel: each[0].noise[axis].channel.clone(),
        angle_random_walk_rad_sqrt_s: rms(&|one| one.angle_random_walk_rad_sqrt_s),
        angle_noise_rad: rms(&|one| one.angle_noise_rad),
        wandering_rad_s: wanders.then(|| rms(&|one| one.wandering_rad_s.unwrap_or(0.0))),
        terms: None,
    }
}
