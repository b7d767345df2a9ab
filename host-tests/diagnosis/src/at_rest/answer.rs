//! Joins the findings on a unit at rest.

use rlg_findings::result::{
    ControlEntry, Diagnosis, EffectEntry, ExperimentEntry, ForceNoiseEntry, LocationEntry, Verdict,
};
use rlg_findings::sentences::{DEG_H, effect_lines, opening};
use rlg_model::kinds::{FAULT_KINDS, NOISE_KINDS};
use rlg_model::{Model, ModelEffect};
use rlg_plan::FindingsPlan;
use rlg_signal::still::ROTATION_RAD_S;
use rlg_signal::streams::{AXES, Streams};

use super::control::Control;
use super::one_rate::Looked;
use super::rows::RowsFound;
use crate::lines_at_rest::line::Clock;
use crate::lines_at_rest::{band_words, line_words};
use crate::outcome::Outcome;
use crate::rows::entries_of_rows::model_effect_of;

/// Findings on the recorder, and the control.
pub(super) struct Recorder {
    pub(super) rows: RowsFound,
    pub(super) control: Control,
}

/// The next experiment in words and in figures.
fn next(diagnosis: &Diagnosis) -> (String, Option<ExperimentEntry>) {
    let entry = diagnosis.experiment.clone();
    (diagnosis.next_experiment.clone(), entry)
}

/// Findings under assembly.
pub(super) struct Answer {
    /// Result of the rows as they were recorded.
    pub(super) first: Looked,
    recorder: Recorder,
    /// Lines and bands.
    lines: Vec<EffectEntry>,
    /// Number of lines dropped because shuffled rows show them as well.
    dropped: usize,
    /// Slow effects, the model with them and the experiment that separates them, by the last rows analysed.
    slow: Vec<EffectEntry>,
    model: Model,
    next: (String, Option<ExperimentEntry>),
    /// Sentences on the Earth's rotation and the held-out rows.
    said: Vec<String>,
}

impl Answer {
    pub(super) fn new(
        mut first: Looked,
        recorder: Recorder,
        streams: &Streams,
        model: &Model,
    ) -> Self {
        let clock = Clock {
            rows: streams.rows,
            rate_hz: streams.rate_hz,
        };
        let narrow = first.narrow.as_ref();
        let lines = narrow.map_or(&[][..], |narrow| &narrow.lines.lines);
        let mut lines = line_words::entries(lines, clock, model);
        let bands = narrow.map_or(&[][..], |narrow| &narrow.bands.bands);
        let bands = band_words::entries(bands, model);
        let before = lines.len();
        // A gain of ln L is half of 2 Δ ln L.
        lines.retain(|line| 2.0 * line.log_evidence_gain > recorder.control.strongest);
        Self {
            dropped: before - lines.len(),
            lines: [lines, bands].concat(),
            slow: std::mem::take(&mut first.slow),
            model: first.outcome.model.clone(),
            next: next(&first.outcome.diagnosis),
            said: [
                vec![of_the_earth(&first)],
                of_held_out(&first, clock.rate_hz),
            ]
            .concat(),
            recorder,
            first,
        }
    }

    /// Replaces the slow effects by those of summed rows.
    pub(super) fn take_slow(&mut self, next: Looked) {
        let is_of_noise = |effect: &EffectEntry| NOISE_KINDS.contains(&&*effect.kind);
        self.slow.retain(is_of_noise);
        self.slow.splice(0..0, next.slow);
        self.model = next.outcome.model;
        self.next = self::next(&next.outcome.diagnosis);
    }

    /// Joins all findings as entries, in words and in the model.
    pub(super) fn outcome(
        self,
        force_lines: Vec<String>,
        forces: Vec<ForceNoiseEntry>,
        plan: &FindingsPlan,
    ) -> Outcome {
        let Looked {
            outcome: first,
            terms,
            noise_lines,
            ..
        } = self.first;
        let mut diagnosis = first.diagnosis;
        let mut model = self.model;
        // Noise and faults are those of the rows as they were recorded.
        let is_of_rows = |one: &ModelEffect| {
            FAULT_KINDS.contains(&&*one.kind) || NOISE_KINDS.contains(&&*one.kind)
        };
        model.effects.retain(|one| !is_of_rows(one));
        let as_recorded = first.model.effects.iter();
        model
            .effects
            .extend(as_recorded.filter(|one| is_of_rows(one)).cloned());
        let of_rows = self.lines.iter().chain(&self.recorder.rows.effects);
        model.effects.extend(of_rows.map(model_effect_of));
        let is_told = diagnosis.verdict.is_consistent();
        let has_fault = diagnosis
            .effects
            .iter()
            .any(|one| FAULT_KINDS.contains(&&*one.kind));
        let mut effects = self.slow;
        effects.extend(self.recorder.rows.effects.iter().cloned());
        effects.extend(self.lines);
        diagnosis.verdict = Verdict::of(!effects.is_empty() || has_fault, is_told);
        effects.append(&mut diagnosis.effects);
        diagnosis.effects = effects;
        (diagnosis.next_experiment, diagnosis.experiment) = self.next;
        for (entry, terms) in diagnosis.noise.iter_mut().zip(terms) {
            entry.terms = terms;
        }
        diagnosis.accelerometer_noise = forces;
        let control = ControlEntry {
            lines: self.recorder.control.lines,
            strongest: self.recorder.control.strongest,
            cycles: self.recorder.rows.cycles_of_shuffled,
            dropped: self.dropped + self.recorder.rows.dropped,
        };
        let noise_lines = noise_lines.into_iter().chain(force_lines).collect();
        diagnosis.summary = summary(&diagnosis, &control, self.said, noise_lines, plan);
        diagnosis.control = Some(control);
        diagnosis.not_excluded.push(
            "counter_slip: not distinguishable from a jolt of the case without a reference; such places are located"
                .to_string(),
        );
        Outcome {
            diagnosis,
            model,
            pictures: first.pictures,
        }
    }
}

/// Sentence on the mean rates and their ratio to the Earth's.
fn of_the_earth(looked: &Looked) -> String {
    let rest = &looked.rest;
    let mean_rad_s = rest.mean_rad_s;
    let length = format!(
        "At rest: the mean rate is {:.3} °/h, {:.4} of the Earth's;",
        mean_rad_s.norm() * DEG_H,
        mean_rad_s.norm() / ROTATION_RAD_S
    );
    match (&rest.up, rest.latitude_rad) {
        (Some(up), Some(latitude_rad)) => format!(
            "{length} its vertical component {:.4} of that at latitude {:.4}°. The mean force is {:.5} of the site's gravity. The azimuth was fitted.",
            mean_rad_s.dot(up) / (ROTATION_RAD_S * latitude_rad.sin()),
            latitude_rad.to_degrees(),
            rest.force_over_gravity.unwrap_or(f64::NAN),
        ),
        (_, None) => format!("{length} without a [site] its direction was fitted."),
        (None, _) => format!("{length} without accelerometers its direction was fitted."),
    }
}

/// Sentences on the scatter of the held-out rows before and after.
fn of_held_out(looked: &Looked, rate_hz: f64) -> Vec<String> {
    let rows = || looked.parted.held_out.iter().flat_map(Clone::clone);
    let count = rows().count().max(1) as f64;
    let scatter = |values: &[f64]| {
        let sum: f64 = rows().map(|row| values[row] * values[row]).sum();
        (sum / count).sqrt() * rate_hz * DEG_H
    };
    let each = AXES.iter().enumerate().filter_map(|(gyro, axis)| {
        let [before, after] = [&looked.before_rad, &looked.left_rad].map(|rad| scatter(&rad[gyro]));
        (before != after).then(|| {
            format!(
                "Held-out rows: standard deviation of the rate of gyro {axis} {before:.2} °/h before and {after:.2} °/h after."
            )
        })
    });
    each.collect()
}

fn place(location: &LocationEntry) -> String {
    format!(
        "Where: {} between {:.3} and {:.3} s, {:.0} to {:.0} Hz, {:.3} °/h.",
        location.channel.replace('_', " "),
        location.start_s,
        location.end_s,
        location.low_hz,
        location.high_hz,
        location.size * DEG_H,
    )
}

/// Summary in sentences.
fn summary(
    diagnosis: &Diagnosis,
    control: &ControlEntry,
    said: Vec<String>,
    noise_lines: Vec<String>,
    plan: &FindingsPlan,
) -> Vec<String> {
    /// Largest number of places in the summary of a disturbed unit at rest.
    const MOST_PLACES: usize = 4;
    let mut lines = vec![opening(diagnosis.verdict).to_string()];
    let is_fault = |effect: &&EffectEntry| FAULT_KINDS.contains(&&*effect.kind);
    let effects = diagnosis.effects.iter().filter(|effect| !is_fault(effect));
    lines.extend(effects.flat_map(|one| effect_lines(one, plan)));
    // Effects are reported above, as at rest they have more names.
    let is_more = |line: &&String| !line.starts_with("Found:") && !noise_lines.contains(line);
    lines.extend(diagnosis.summary.iter().skip(1).filter(is_more).cloned());
    lines.extend(noise_lines);
    lines.extend(said);
    let places = &diagnosis.locations;
    if places.len() > MOST_PLACES {
        lines.push(format!(
            "Where: {} places, all in diagnosis.json; the first {MOST_PLACES}:",
            places.len()
        ));
    }
    lines.extend(places.iter().take(MOST_PLACES).map(place));
    lines.push(format!(
        "Permutation control: the same search on shuffled rows finds {} lines and {} cycles; {} findings rejected.",
        control.lines, control.cycles, control.dropped
    ));
    lines
}
