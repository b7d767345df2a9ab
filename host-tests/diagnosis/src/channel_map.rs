//! Puts gyros and reference on the same axes, the same way round and in the same unit, before anything is explained.
//!
//! Enters: the aligned channels. Leaves: an error with one sentence, or the reference turned into the gyros' axes and
//! what is said of it ([`PutRight`]). The measurement and the judgement are rlg-signal's; here are the rows that may be
//! looked at, what is done about it, and the effects of the model that say so.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use rlg_model::catalogue::NINE;
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_recording::error::InputError;
use rlg_signal::channel_check::{ChannelPlan, Crossing, check};
use rlg_signal::map_plan::MapPlan;
use rlg_signal::partition::{Partition, Use};

use super::Outcome;
use super::channel_words::{Lead, cause, is_unit, refusal, sentence};
use super::qualify;
use super::result::{EffectEntry, ParameterEntry, Verdict};
use super::sentences::opening;
use super::settings::Settings;
use super::streams::{AXES, Streams, Triad, add};

/// Kinds of the model that say how channels are put right.
pub const KINDS: [&str; 3] = ["channel_order", "channel_sign", "channel_factor"];

/// Puts channels right as a model says, in the order of its effects.
pub fn apply_known(streams: &mut Streams, effects: &[ModelEffect]) {
    let known = effects
        .iter()
        .filter(|effect| KINDS.contains(&effect.kind.as_str()));
    for effect in known {
        let map = Matrix3::from_fn(|gyro, axis| effect.number(NINE[3 * gyro + axis]));
        match effect.text("channel") {
            Some("dither") => {
                if let Some(pickoff_rad) = &mut streams.pickoff_rad {
                    turn(pickoff_rad, &map);
                }
            }
            _ => turn(&mut streams.case_rad, &map),
        }
    }
}

/// Turns three channels into other axes, row by row.
fn turn(channels: &mut Triad, map: &Matrix3<f64>) {
    for row in 0..channels[0].len() {
        let turned = map * Vector3::from_fn(|axis, _| channels[axis][row]);
        for (axis, channel) in channels.iter_mut().enumerate() {
            channel[row] = turned[axis];
        }
    }
}

/// What was put right.
pub struct PutRight {
    /// By what the gyros follow.
    crossings: Vec<(Lead, Crossing)>,
}

/// Checks the channels, and turns the reference where that is all there is to it.
///
/// # Returns
/// `None` where only ordinary errors are seen.
///
/// # Errors
/// The axes are reversed or exchanged, or a factor is gross, and the settings do not say to put it right.
pub fn put_right(
    settings: &Settings,
    streams: &mut Streams,
    model: &Model,
    model_file: &Path,
) -> Result<Option<PutRight>, InputError> {
    let has_reference = streams.pieces.len() == 1
        && !streams.own_motion
        && streams.at_rest.is_none()
        && !streams.pieces[0].held_out;
    if !has_reference {
        return Ok(None);
    }
    let seen = seen(settings, streams);
    let crossings = crossings(streams, model, &seen, &settings.channels);
    if crossings.is_empty() {
        return Ok(None);
    }
    let is_registration = crossings
        .iter()
        .all(|(lead, crossing)| *lead == Lead::Reference && crossing.is_registration());
    if !is_registration && !settings.anyway {
        let problem = refusal(&crossings, &streams.pieces[0].recording, streams.rate_hz);
        return Err(InputError::new(model_file, problem).expected(
            "each gyro to read once what the reference says of its own axis; --anyway puts it right and reports it",
        ));
    }
    let found = PutRight { crossings };
    found.apply(streams);
    Ok(Some(found))
}

/// Rows that are sound, those that test the findings left out.
fn seen(settings: &Settings, streams: &mut Streams) -> Vec<bool> {
    let usable = streams.usable.clone();
    qualify::qualify(streams);
    let sound = std::mem::replace(&mut streams.usable, usable);
    let segments: Vec<_> = streams.pieces[0]
        .segments
        .iter()
        .map(|segment| streams.row_at(segment.start_s)..streams.row_at(segment.end_s))
        .collect();
    let plan = &settings.plan.partition;
    Partition::new(streams.rows, streams.rate_hz, &segments, plan)
        .rows_of(&[Use::Train, Use::Confirm], &sound)
}

/// What the gyros read of the reference, and of their pickoffs, where it is no ordinary error.
fn crossings(
    streams: &Streams,
    model: &Model,
    seen: &[bool],
    plan: &ChannelPlan,
) -> Vec<(Lead, Crossing)> {
    let dither_rad: Option<Triad> = streams.pickoff_rad.as_ref().map(|pickoff| {
        [0, 1, 2].map(|axis: usize| {
            let pairs = pickoff[axis].windows(2);
            pairs.map(|pair| pair[1] - pair[0]).collect()
        })
    });
    let mut gyros = streams.sensed_rad.clone();
    let mut found = Vec::new();
    let rows = (seen, streams.rate_hz);
    if let Some(dither_rad) = &dither_rad {
        let gains = [0, 1, 2].map(|axis| model.pickoff_gain(axis));
        let crossing = check(
            each(&gyros),
            each(dither_rad),
            gains,
            rows,
            &of_pickoffs(plan),
        );
        found.extend(crossing.map(|crossing| (Lead::Pickoff, crossing)));
        for (axis, gyro) in gyros.iter_mut().enumerate() {
            add(gyro, &dither_rad[axis], -gains[axis]);
        }
    }
    let known = |axis: usize| {
        let scales = model.effects.iter().filter(|one| one.kind == "gyro_scale");
        let sum: f64 = scales.map(|one| one.number(AXES[axis])).sum();
        1.0 + sum
    };
    let expected = [0, 1, 2].map(known);
    let crossing = check(each(&gyros), each(&streams.case_rad), expected, rows, plan);
    found.extend(crossing.map(|crossing| (Lead::Reference, crossing)));
    found
}

fn each(channels: &Triad) -> [&[f64]; 3] {
    [0, 1, 2].map(|axis| &channels[axis][..])
}

/// The plan for pickoffs: a dither has one frequency, so only a delay below half its period is none of its signs.
fn of_pickoffs(plan: &ChannelPlan) -> ChannelPlan {
    /// The largest delay of a pickoff that is sought as one \[s\].
    const LARGEST_S: f64 = 1e-3;
    ChannelPlan {
        map: MapPlan {
            most_delay_s: LARGEST_S,
            likely_delay_s: LARGEST_S,
            ..plan.map
        },
        ..*plan
    }
}

impl PutRight {
    /// Turns what the gyros follow into their axes.
    pub fn apply(&self, streams: &mut Streams) {
        for (lead, crossing) in &self.crossings {
            apply_known(streams, &effects(*lead, crossing));
        }
    }

    /// Adds it to what a diagnosis of the channels that were put right says.
    pub fn report(self, outcome: &mut Outcome) {
        let diagnosis = &mut outcome.diagnosis;
        diagnosis.verdict = match diagnosis.verdict {
            Verdict::Matches => Verdict::Explained,
            Verdict::Unexplained => Verdict::PartlyExplained,
            other => other,
        };
        let words = self
            .crossings
            .iter()
            .map(|(lead, crossing)| sentence(*lead, crossing));
        let said = std::iter::once(opening(diagnosis.verdict).to_string()).chain(words);
        let rest = diagnosis.summary.drain(..).skip(1).collect::<Vec<_>>();
        diagnosis.summary = said.chain(rest).collect();
        for (lead, crossing) in &self.crossings {
            for effect in effects(*lead, crossing) {
                diagnosis.effects.push(entry(*lead, crossing, &effect));
                outcome.model.effects.push(effect);
            }
        }
    }
}

/// What a crossing is as effects of the model: first the axes, then the factors.
fn effects(lead: Lead, crossing: &Crossing) -> Vec<ModelEffect> {
    let effect = |kind: &str, map: &Matrix3<f64>| {
        let numbers = (0..9).map(|place| {
            let value = EffectValue::Number(map[(place / 3, place % 3)]);
            (NINE[place].to_string(), value)
        });
        let mut parameters: BTreeMap<String, EffectValue> = numbers.collect();
        if lead == Lead::Pickoff {
            let channel = EffectValue::Text("dither".to_string());
            parameters.insert("channel".to_string(), channel);
        }
        ModelEffect {
            kind: kind.to_string(),
            parameters,
        }
    };
    let mut all = Vec::new();
    if crossing.is_turned() {
        let own = crossing.axes.diagonal().map(f64::abs) == Vector3::repeat(1.0);
        let kind = if own && crossing.is_improper() {
            "channel_sign"
        } else {
            "channel_order"
        };
        all.push(effect(kind, &crossing.axes));
    }
    if crossing.has_factor() {
        let factors = Vector3::from(crossing.factors.map(exact));
        all.push(effect("channel_factor", &Matrix3::from_diagonal(&factors)));
    }
    all
}

/// The factor as its cause has it, where there is one.
fn exact(factor: f64) -> f64 {
    cause(factor, f64::NAN).map_or(factor, |(exact, _)| exact)
}

/// The entry of `diagnosis.json`.
fn entry(lead: Lead, crossing: &Crossing, effect: &ModelEffect) -> EffectEntry {
    // What no unit explains is a scale error, however large.
    let is_scale = effect.kind == "channel_factor"
        && lead == Lead::Reference
        && !crossing.factors.iter().any(|factor| is_unit(*factor));
    let std = |gyro: usize, axis: usize| crossing.measured.std[(gyro, axis)];
    let number = |name: &str, value: f64, std: f64| ParameterEntry::Number {
        name: name.to_string(),
        value,
        std: if std.is_finite() { std } else { 0.0 },
        unit: "1".to_string(),
    };
    let parameters: Vec<ParameterEntry> = if is_scale {
        let of = |gyro: usize| {
            let axis = crossing.axes.row(gyro).transpose().iamax();
            let name = AXES[gyro];
            number(name, exact(crossing.factors[gyro]) - 1.0, std(gyro, axis))
        };
        (0..3).map(of).collect()
    } else {
        let of = |place: usize| {
            let (gyro, axis) = (place / 3, place % 3);
            number(NINE[place], effect.number(NINE[place]), std(gyro, axis))
        };
        (0..9).map(of).collect()
    };
    let stds: Vec<f64> = parameters
        .iter()
        .map(|one| match one {
            ParameterEntry::Number { std, .. } => *std,
            ParameterEntry::Text { .. } => 0.0,
        })
        .collect();
    let covariance = (0..stds.len())
        .map(|a| {
            let of = |b: usize| if a == b { stds[a] * stds[a] } else { 0.0 };
            (0..stds.len()).map(of).collect()
        })
        .collect();
    EffectEntry {
        kind: if is_scale { "gyro_scale" } else { &effect.kind }.to_string(),
        indistinguishable_from: if is_scale {
            vec!["channel_factor".to_string()]
        } else {
            Vec::new()
        },
        gravity_speaks_against: Vec::new(),
        equation: "gyro_i = sum_j map_ij reference_j".to_string(),
        parameters,
        covariance,
        identifiable: Vec::new(),
        log_evidence_gain: 0.0,
        p_value: 0.0,
        what_was_left_out: sentence(lead, crossing),
        expression: None,
        regimes: Vec::new(),
        evidence: None,
    }
}
