//! Accepted findings in the types of `diagnosis.json`.

use std::collections::BTreeMap;

use rlg_catalogue::entries;
use rlg_diagnosis::Outcome;
use rlg_diagnosis::report::entries_of_findings::followed;
use rlg_diagnosis::report::next_experiment::NONE_NEEDED;
use rlg_diagnosis::report::own_lines;
use rlg_diagnosis::report::summary::no_channel;
use rlg_diagnosis::rows::data_words;
use rlg_diagnosis::rows::entries_of_rows::{fault_effect, fault_entry};
use rlg_findings::absolute;
use rlg_findings::combinations::identifiable;
use rlg_findings::entries::append;
use rlg_findings::result::{
    ChannelEntry, Diagnosis, EffectEntry, ExperimentEntry, FORMAT, FitEntry, NoiseEntry,
    ParameterEntry, RegistrationEntry, RunnerUp, Verdict,
};
use rlg_findings::updated_model::{set_choice, switch_on};
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_signal::axes::AXES;

use crate::fits::report_inputs::Said;
use crate::gyros::gyro_times;
use crate::gyros::scanned::Scanned;
use crate::gyros::zeroing;
use crate::reference::cards::card;
use crate::registration::gauss_newton::Registration;
use crate::report::held_out::{HeldOut, held_out};
use crate::report::line_entry;
use crate::report::mount;
use crate::report::parameter_values::{Numbers, numbers};
use crate::report::promise;
use crate::report::reference_spans::{self, JumpSeen, Span};
use crate::rows::alignment::{GROUPS, places};
use crate::rows::gyro_motion::Reads;
use crate::selection::group_selection::Named;

/// Entry and model effect of an error that was removed before the registration.
type Preprocessed = (EffectEntry, ModelEffect);

/// Composes the outcome of a diagnosis.
pub(crate) fn outcome(said: &Said) -> Outcome {
    let Said {
        observed, found, ..
    } = *said;
    let tested = held_out(said);
    let seen = Seen::new(said);
    let named = &seen.named;
    let effects = seen.entries(said);
    let is_left = tested
        .as_ref()
        .is_some_and(|tested| tested.power_after > said.plan.attitude.most_power);
    let verdict = Verdict::of(!effects.is_empty(), !is_left);
    let experiment = promise::promised(said);
    let mut diagnosis = Diagnosis {
        format: FORMAT,
        recording: observed.recording.name.clone(),
        version: env!("CARGO_PKG_VERSION").to_string(),
        seed: said.seed,
        verdict,
        summary: summary(said, verdict, &seen, tested.as_ref()),
        locations: Vec::new(),
        effects,
        registration: registration(said),
        fit: fit(said, tested.as_ref()),
        not_excluded: not_excluded(said),
        next_experiment: next_experiment(named, experiment.as_ref()),
        experiment,
        residual: tested.as_ref().and_then(|tested| tested.residual.clone()),
        noise: noise(said.registered),
        accelerometer_noise: Vec::new(),
        trials: found.tried,
        runners_up: runners_up(named),
        sensitivity: Vec::new(),
        control: None,
        self_test: None,
        plan: Vec::new(),
    };
    diagnosis.add_self_test(found.tested.clone());
    let in_step = tested.as_ref().and_then(|tested| tested.in_step);
    if let Some(found) = in_step {
        diagnosis.mark_unexplained(vec![absolute::in_step(
            found.share,
            found.moving_over_still,
        )]);
    }
    Outcome {
        diagnosis,
        model: seen.model(said),
        pictures: tested.map(|tested| tested.pictures),
    }
}

/// Findings of all stages.
struct Seen<'a> {
    /// Accepted effects with their values, without lines.
    named: Vec<(&'a Named, Numbers)>,
    /// Lines that the model does not have.
    lines: Vec<Preprocessed>,
    /// Errors that were removed before the registration.
    preprocessed: Vec<Preprocessed>,
    /// Stretches with faults of the reference.
    spans: Vec<Span>,
    /// Jumps of the reference.
    jumps: Vec<JumpSeen>,
}

impl<'a> Seen<'a> {
    fn new(said: &Said<'a>) -> Self {
        let Said {
            observed,
            registered,
            found,
            ..
        } = *said;
        let combinations = &said.plan.findings.combinations;
        let values = (&found.named_set[..], &found.of_named);
        let named = found.registration.iter().chain(&found.physics);
        let streams = &observed.streams;
        let mut preprocessed = own_lines::entries(
            &observed.lines,
            streams.rows,
            streams.rate_hz,
            observed.model,
        );
        preprocessed.extend(observed.settling.map(|one| one.entry()));
        preprocessed.extend(zeroing::entry(&observed.zeroed));
        preprocessed.extend(gyro_times::entry(&observed.late));
        let named = named.map(|one| {
            let numbers = numbers(said, one.kind, &one.places, values);
            (one, numbers.written(one.kind, combinations))
        });
        let (lines, named) = named.partition::<Vec<_>, _>(|(one, _)| one.line().is_some());
        let lines = lines
            .iter()
            .filter_map(|(one, numbers)| line_entry::of(said, one, numbers));
        Self {
            lines: lines.collect(),
            named,
            preprocessed,
            spans: reference_spans::spans(&observed.samples, &observed.known, &registered.known),
            jumps: reference_spans::jumps(said),
        }
    }

    /// Findings with an entry and an effect of their own.
    fn alone(&self) -> impl Iterator<Item = &Preprocessed> {
        self.lines.iter().chain(&self.preprocessed)
    }

    /// Entries of effects, lines, removed errors and faults.
    fn entries(&self, said: &Said) -> Vec<EffectEntry> {
        let plan = &said.plan.attitude.reference_faults;
        let observed = said.observed;
        let named = self.named.iter();
        let faults = observed.faults.iter();
        named
            .map(|(one, numbers)| entry(said, one, numbers))
            .chain(self.alone().map(|(entry, _)| entry.clone()))
            .chain(self.spans.iter().map(|span| span.entry(plan)))
            .chain(self.jumps.iter().map(JumpSeen::entry))
            .chain(faults.map(|fault| fault_entry(&observed.streams, fault)))
            .collect()
    }

    /// The model with all effects, removed errors and faults.
    fn model(&self, said: &Said) -> Model {
        let observed = said.observed;
        let named = self.named.iter();
        let faults = observed.faults.iter();
        let effects = named
            .map(|(one, numbers)| model_effect(said, one, numbers))
            .chain(self.alone().map(|(_, effect)| effect.clone()))
            .chain(self.spans.iter().map(Span::effect))
            .chain(self.jumps.iter().flat_map(JumpSeen::effects))
            .chain(faults.map(|fault| fault_effect(fault, &observed.streams)));
        let mut model = observed.model.clone();
        for effect in effects {
            switch_on(&mut model, effect);
        }
        model
    }
}

/// Meaning of an effect, with the sag of a mount if its parameters show one.
fn meaning(kind: &str, numbers: &Numbers) -> String {
    let meaning = card(kind).meaning.to_string();
    if kind != "elastic_rate_by_force" {
        return meaning;
    }
    let names = numbers.names.iter().map(|name| &**name);
    let each: Vec<(&str, f64)> = names.zip(numbers.values.iter().copied()).collect();
    match mount::sags(&each) {
        Some(sags) => format!("{meaning} {sags}"),
        None => meaning,
    }
}

fn entry(said: &Said, one: &Named, numbers: &Numbers) -> EffectEntry {
    let card = card(one.kind);
    let (mut parameters, mut covariance) = numbers.parameters();
    let axis = one.scanned.map(|scanned| AXES[scanned.axis()]);
    parameters.extend(axis.map(|axis| ParameterEntry::text("axis", axis)));
    let expression = one.expression(said.gyro);
    let written = expression.as_ref();
    parameters.extend(written.map(|one| ParameterEntry::text("expression", one)));
    if let Some(Scanned::Step(step)) = one.scanned {
        let std = said.registered.about.increments.period_s;
        let time = ParameterEntry::number("time_s", said.begins_s(step), std, "s");
        append(&mut parameters, &mut covariance, time);
    }
    EffectEntry {
        kind: one.kind.to_string(),
        indistinguishable_from: one.alike.iter().map(|kind| (*kind).to_string()).collect(),
        gravity_speaks_against: Vec::new(),
        equation: card.equation.to_string(),
        parameters,
        covariance,
        identifiable: identifiable(
            &numbers.known(one.kind),
            &numbers.covariance,
            &said.plan.findings.combinations,
        ),
        log_evidence_gain: one.gain,
        p_value: one.p_value,
        what_was_left_out: match axis.zip(expression.as_ref()) {
            Some((axis, expression)) => followed(axis, expression),
            None => meaning(one.kind, numbers),
        },
        expression,
        regimes: Vec::new(),
        evidence: Some(one.evidence()),
    }
}

fn model_effect(said: &Said, one: &Named, numbers: &Numbers) -> ModelEffect {
    let values = numbers.names.iter().zip(&numbers.values);
    let mut parameters: BTreeMap<String, EffectValue> = values
        .map(|(name, value)| (name.clone(), EffectValue::Number(*value)))
        .collect();
    let mut text = |name: &str, value: String| {
        parameters.insert(name.to_string(), EffectValue::Text(value));
    };
    if let Some(scanned) = one.scanned {
        text("axis", AXES[scanned.axis()].to_string());
    }
    if let Some(expression) = one.expression(said.gyro) {
        text("expression", expression);
    }
    if let Some(Scanned::Step(step)) = one.scanned {
        let time_s = EffectValue::Number(said.begins_s(step));
        parameters.insert("time_s".to_string(), time_s);
    }
    let mut effect = ModelEffect {
        kind: one.kind.to_string(),
        parameters,
    };
    set_choice(&mut effect, numbers.choice.clone());
    effect
}

fn registration(said: &Said) -> Vec<RegistrationEntry> {
    let found = said.found;
    let entries = GROUPS.iter().map(|group| {
        let own: Vec<usize> = places(group.kind).collect();
        let mut named = found.registration.iter();
        let named = named.find(|one| one.group() == group.kind);
        // A filter attributed to the reference is named so here, too.
        let kind = named.map_or(group.kind, |one| one.kind);
        RegistrationEntry {
            kind: kind.to_string(),
            parameters: numbers(said, kind, &own, (&found.set, &found.estimates))
                .parameters()
                .0,
            supported: named.is_some(),
        }
    });
    entries.collect()
}

fn reference_line(said: &Said) -> String {
    let increments = &said.registered.about.increments;
    let count = said.observed.samples.len();
    let what = match said.observed.gyros.reads {
        Reads::Attitudes => "attitudes",
        Reads::Sums => "sums of increments",
    };
    let noise_rad = said.registered.levels.mean(1).sqrt();
    let Some(few) = said.few else {
        let changes = match said.registered.levels.range() {
            1.0 => String::new(),
            range => {
                format!(", in the mean: its level varies in time by a factor of up to {range:.0}")
            }
        };
        return format!(
            "Reference: {count} {what}, one every {:.4} s, {noise_rad:.2e} rad of white noise{changes}; the last fifth is held out.",
            increments.period_s,
        );
    };
    let reference = said.observed.model.reference.as_ref();
    let declared = match reference.and_then(|reference| reference.angle_noise_rad) {
        Some(_) => "as the model declares",
        None => "a typical value, as the model declares none",
    };
    let rest = match few.rest_s {
        0.0 => String::new(),
        rest_s => {
            format!(" and {rest_s:.1} s at rest after the motion")
        }
    };
    format!(
        "Reference: {count} {what}, {} numbers{rest}; none is held out. Their white noise is assumed as {noise_rad:.1e} rad, {declared}; so few cannot show it.",
        3 * increments.rows(),
    )
}

fn summary(said: &Said, verdict: Verdict, seen: &Seen, tested: Option<&HeldOut>) -> Vec<String> {
    let Seen {
        named,
        spans,
        jumps,
        ..
    } = seen;
    let mut lines = vec![rlg_findings::sentences::opening(verdict).to_string()];
    lines.push(reference_line(said));
    for (one, numbers) in named {
        let alike = match one.alike.is_empty() {
            true => String::new(),
            false => format!(", or {}", one.alike.join(" or ")),
        };
        let of_gyro = match one.scanned {
            Some(Scanned::Expression(on)) => {
                let text = on.expression.text(&said.gyro.signals);
                format!(" {text} on gyro {}", AXES[on.axis])
            }
            _ => String::new(),
        };
        lines.push(format!(
            "Found: {}{of_gyro}{alike}: {}.",
            one.kind,
            numbers.sentence()
        ));
    }
    lines.extend(sampled_at_instants(said, named));
    let removed = seen.alone();
    lines.extend(removed.map(|(entry, _)| own_lines::sentence(entry)));
    let has_as_many = said.found.named_set.len() >= 3 * said.registered.about.increments.rows();
    if !named.is_empty() && said.few.is_some() && has_as_many {
        lines.push("The effects found have as many parameters as the attitudes have numbers, so other effects would fit as well: a rotation about another axis or by another angle would test them.".to_string());
    }
    lines.extend(reference_spans::sentence(spans));
    lines.extend(reference_spans::jumps_sentence(jumps));
    lines.extend(data_words::lines(
        &said.observed.streams,
        &said.observed.faults,
    ));
    if let Some(tested) = tested {
        let residual = tested.residual.as_ref();
        lines.extend(residual.map(|one| absolute::beside_motion(one.share_of_motion)));
        lines.push(tested.sentence(&said.plan.attitude.held_out));
    }
    lines
}

/// Names the common cause of a delay of half a row h and a smoothing less by h²/12 on all axes: rates sampled at the end of
/// each row and read as means over it.
fn sampled_at_instants(said: &Said, named: &[(&Named, Numbers)]) -> Option<String> {
    let plan = &said.plan.attitude.instants;
    let of = |kind: &str| named.iter().find(|(one, _)| one.kind == kind);
    let (delay, smoothing) = (of("reference_delay")?, of("reference_bandwidth")?);
    let row_s = 1.0 / said.observed.gyros.rate_hz;
    let less_smooth_s2 = row_s * row_s / 12.0;
    let late_s = *delay.1.values.first()?;
    let is_half = (late_s - 0.5 * row_s).abs() < plan.delay_rows * row_s;
    let mut each = smoothing.1.values.iter().enumerate();
    let is_square = each.all(|(axis, value)| {
        let std = smoothing.1.covariance[(axis, axis)].max(0.0).sqrt();
        (value - less_smooth_s2).abs() < plan.smoothing * std
    });
    (is_half && is_square).then(|| {
        format!(
            "Common cause: gyros sampled at the end of each row ({:.4} s long) but read as means over it are late by half a row, {:.4} s, and less smooth by its square over 12, {less_smooth_s2:.3e} s^2. Import them with --sampling instant.",
            row_s,
            0.5 * row_s
        )
    })
}

fn fit(said: &Said, tested: Option<&HeldOut>) -> FitEntry {
    let times = &said.registered.about.increments.times_s;
    let fitted = [times[0], times[times.len() - 1]];
    FitEntry {
        fitted_on: vec![fitted],
        held_out: tested.map(|tested| tested.span_s).into_iter().collect(),
        recordings: Vec::new(),
        whole: None,
        channels: tested.map_or_else(Vec::new, |tested| {
            (0..3)
                .map(|axis| ChannelEntry {
                    channel: format!("gyro_{}", AXES[axis]),
                    unit: None,
                    band_hz: tested.band_hz,
                    held_out_before: tested.before[axis].clone(),
                    held_out_after: tested.after[axis].clone(),
                })
                .collect()
        }),
    }
}

/// Catalogue kinds not observable with attitudes or these channels, with the reasons.
fn not_excluded(said: &Said) -> Vec<String> {
    let streams = &said.observed.streams;
    let tried = |kind: &str| {
        let mut effects = said.candidates.effects.iter();
        effects.any(|(candidate, _)| candidate.kind == kind)
            || GROUPS.iter().any(|group| group.kind == kind)
    };
    let reason = |kind: &str| match kind {
        "reference_scale" => {
            "not distinguishable from gyro_scale by an attitude reference; reported with it"
        }
        _ => no_channel(kind, streams).unwrap_or("not excited by the motion"),
    };
    let listed = entries::CATALOGUE.iter().map(|entry| entry.kind);
    let mut lines: Vec<String> = listed
        .filter(|kind| !tried(kind))
        .map(|kind| format!("{kind}: {}", reason(kind)))
        .collect();
    lines.extend(["reference_harmonic", "isolator_mode"].map(|kind| {
        format!("{kind}: needs the reference at every row; it is known only at its stamps")
    }));
    lines
}

/// Rejected kinds, each with its least deficit to a named one.
fn runners_up(named: &[(&Named, Numbers)]) -> Vec<RunnerUp> {
    let rivals = named.iter().flat_map(|(one, _)| &one.behind);
    let is_named = |kind: &str| named.iter().any(|(one, _)| one.kind == kind);
    let others = rivals.filter(|(kind, _)| !is_named(kind));
    RunnerUp::nearest(others.map(|(kind, behind)| (*kind, *behind)))
}

fn next_experiment(named: &[(&Named, Numbers)], experiment: Option<&ExperimentEntry>) -> String {
    if let Some(experiment) = experiment {
        let promised = promise::sentence(experiment);
        return format!("{} {promised}", card("axis_flexure").experiment);
    }
    let confused = named.iter().find(|(one, _)| !one.alike.is_empty());
    match confused.or(named.first()) {
        Some((one, _)) => card(one.kind).experiment.to_string(),
        None => NONE_NEEDED.to_string(),
    }
}

/// Noise terms of the gyros: common to all three, or of each its own for sums of increments.
fn noise(registered: &Registration) -> Vec<NoiseEntry> {
    let period_s = registered.about.increments.period_s;
    AXES.iter()
        .zip([0, 1, 2].map(|axis| registered.levels.of(axis)))
        .map(|(axis, levels)| NoiseEntry {
            channel: format!("gyro_{axis}"),
            angle_random_walk_rad_sqrt_s: (levels[0] / period_s).sqrt(),
            angle_noise_rad: levels[1].sqrt(),
            wandering_rad_s: None,
            terms: None,
        })
        .collect()
}
