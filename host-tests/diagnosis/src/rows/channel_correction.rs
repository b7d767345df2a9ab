//! Brings gyros and reference to the same axes, signs and units before the analysis.
//!
//! Enters: the aligned channels. Leaves: an error with one sentence, or the reference rotated into the gyros' axes and its
//! report ([`ChannelCorrection`]). The measurement and the decision are rlg-signal's; here are the correction and the effects of the
//! model that describe it.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Matrix3, Vector3};
use rlg_findings::entries::{uncorrelated, unlisted};
use rlg_findings::result::{EffectEntry, ParameterEntry, Verdict};
use rlg_findings::sentences::opening;
use rlg_model::catalogue::NINE;
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_plan::ChannelCausePlan;
use rlg_recording::error::InputError;
use rlg_signal::channel_check::Crossing;
use rlg_signal::channel_map::{Lead, crossings};
use rlg_signal::known_channels;
use rlg_signal::streams::{AXES, Streams};

use super::channel_words::{apart, cause, is_unit, refusal, sentence};
use crate::outcome::Outcome;
use crate::settings::Settings;

/// Applied corrections.
pub struct ChannelCorrection {
    /// Crossing of each channel that the gyros follow.
    crossings: Vec<(Lead, Crossing)>,
    plan: ChannelCausePlan,
}

/// Reason for stopping without a diagnosis.
#[derive(Debug)]
pub enum Stopped {
    /// The axes are reversed or exchanged, or a factor is gross, and the settings do not allow the correction.
    Refused(InputError),
    /// Gyros and reference measure different motions: in words, and as an error of the recording.
    Apart(String, InputError),
}

/// Outcome of gyros and a reference with different motions, for the reason `why`.
pub fn of_two_motions(recording: &str, seed: u64, why: &str, model: &Model) -> Outcome {
    let mut outcome = Outcome::unusable(recording, seed, why, model);
    outcome.diagnosis.next_experiment = "Use the reference recorded with these gyros, on one clock: a file of another run or unit contains another motion.".to_string();
    outcome
}

impl From<Stopped> for InputError {
    fn from(stopped: Stopped) -> Self {
        match stopped {
            Stopped::Refused(error) | Stopped::Apart(_, error) => error,
        }
    }
}

/// Checks the channels, and rotates the reference where a rotation suffices.
///
/// # Returns
/// `None` if only ordinary errors are found.
///
/// # Errors
/// See [`Stopped`]. Nothing stops if the settings take the channels anyway.
pub fn correct_channels(
    settings: &Settings,
    streams: &mut Streams,
    model: &Model,
    model_file: &Path,
) -> Result<Option<ChannelCorrection>, Stopped> {
    let plan = settings.plan.judgement.channels;
    let crossings =
        crossings(streams, model, &settings.plan.signal, settings.anyway).map_err(|found| {
            let why = apart(&found, &plan);
            let error = InputError::new(&streams.piece.recording, why.clone())
                .expected("gyros and reference of one recording")
                .or_anyway("diagnoses them as they are");
            Stopped::Apart(why, error)
        })?;
    if crossings.is_empty() {
        return Ok(None);
    }
    let is_registration = crossings
        .iter()
        .all(|(lead, crossing)| *lead == Lead::Reference && crossing.is_registration());
    if !is_registration && !settings.anyway {
        let problem = refusal(&crossings, &streams.piece.recording, streams.rate_hz, &plan);
        let error = InputError::new(model_file, problem)
            .expected("each gyro to read 1 times the reference on its own axis")
            .or_anyway("corrects the channels and reports it");
        return Err(Stopped::Refused(error));
    }
    let found = ChannelCorrection { crossings, plan };
    found.apply(streams);
    Ok(Some(found))
}

impl ChannelCorrection {
    /// Rotates the channels that the gyros follow into the gyros' axes.
    pub fn apply(&self, streams: &mut Streams) {
        for (lead, crossing) in &self.crossings {
            let effects = effects(*lead, crossing, &self.plan);
            known_channels::apply(&mut streams.case_rad, &mut streams.pickoff_rad, &effects);
        }
    }

    /// True if the correction is a rotation of the reference that exchanges no axes.
    pub fn is_turn_alone(&self) -> bool {
        let mut crossings = self.crossings.iter();
        crossings.all(|(lead, crossing)| {
            *lead == Lead::Reference && crossing.is_registration() && crossing.order().is_none()
        })
    }

    /// Corrections as effects of a model.
    pub fn effects(&self) -> Vec<ModelEffect> {
        let crossings = self.crossings.iter();
        crossings
            .flat_map(|(lead, crossing)| effects(*lead, crossing, &self.plan))
            .collect()
    }

    /// Adds the corrections to the diagnosis of the corrected channels.
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
            .map(|(lead, crossing)| sentence(*lead, crossing, &self.plan));
        let said = std::iter::once(opening(diagnosis.verdict).to_string()).chain(words);
        let rest = diagnosis.summary.drain(..).skip(1).collect::<Vec<_>>();
        diagnosis.summary = said.chain(rest).collect();
        for (lead, crossing) in &self.crossings {
            for effect in effects(*lead, crossing, &self.plan) {
                let entry = entry(*lead, crossing, &effect, &self.plan);
                diagnosis.effects.push(entry);
                outcome.model.effects.push(effect);
            }
        }
    }
}

/// Crossing as effects of the model: first the axes, then the factors.
fn effects(lead: Lead, crossing: &Crossing, plan: &ChannelCausePlan) -> Vec<ModelEffect> {
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
        let factors = Vector3::from(crossing.factors.map(|factor| exact(factor, plan)));
        all.push(effect("channel_factor", &Matrix3::from_diagonal(&factors)));
    }
    all
}

/// Exact factor of its known cause, if there is one.
fn exact(factor: f64, plan: &ChannelCausePlan) -> f64 {
    cause(factor, f64::NAN, plan).map_or(factor, |(exact, _)| exact)
}

/// Entry of `diagnosis.json`.
fn entry(
    lead: Lead,
    crossing: &Crossing,
    effect: &ModelEffect,
    plan: &ChannelCausePlan,
) -> EffectEntry {
    // A factor that no unit explains is a scale error, however large.
    let is_scale = effect.kind == "channel_factor"
        && lead == Lead::Reference
        && !crossing.factors.iter().any(|factor| is_unit(*factor, plan));
    let std = |gyro: usize, axis: usize| match crossing.measured.std[(gyro, axis)] {
        std if std.is_finite() => std,
        _ => 0.0,
    };
    let numbers: Vec<(&str, f64, f64)> = if is_scale {
        let of = |gyro: usize| {
            let axis = crossing.axes.row(gyro).transpose().iamax();
            let error = exact(crossing.factors[gyro], plan) - 1.0;
            (AXES[gyro], error, std(gyro, axis))
        };
        (0..3).map(of).collect()
    } else {
        let of = |place: usize| {
            let (gyro, axis) = (place / 3, place % 3);
            (NINE[place], effect.number(NINE[place]), std(gyro, axis))
        };
        (0..9).map(of).collect()
    };
    let stds: Vec<f64> = numbers.iter().map(|(.., std)| *std).collect();
    let covariance = uncorrelated(&stds);
    let numbers = numbers.into_iter();
    let parameters: Vec<ParameterEntry> = numbers
        .map(|(name, value, std)| ParameterEntry::number(name, value, std, "1"))
        .collect();
    EffectEntry {
        kind: if is_scale { "gyro_scale" } else { &effect.kind }.to_string(),
        indistinguishable_from: if is_scale {
            vec!["channel_factor".to_string()]
        } else {
            Vec::new()
        },
        parameters,
        covariance,
        ..unlisted(
            "gyro_i = sum_j map_ij reference_j".to_string(),
            sentence(lead, crossing, plan),
        )
    }
}
