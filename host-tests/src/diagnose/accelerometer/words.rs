//! The accelerometers' findings in the words of the contract and of people, added to those of the gyros.
//!
//! Enters: [`Found`] and the gyros' [`Outcome`]. Leaves: the outcome with locations, effects, fit and model of both, the
//! verdict of both together, and what the accelerometers could not have shown. µg where people read.

use std::collections::BTreeMap;

use super::Found;
use crate::diagnose::Outcome;
use crate::diagnose::declare::FAMILY_SIGNIFICANCE;
use crate::diagnose::explain::{NEEDED_SNR, channel, combination, listed};
use crate::diagnose::hypotheses::{CATALOGUE, Subject};
use crate::diagnose::identify::identifiable;
use crate::diagnose::locate::Location;
use crate::diagnose::result::*;
use crate::diagnose::select::Chosen;
use crate::diagnose::sentences::opening;
use crate::diagnose::streams::AXES;
use crate::diagnose::validate::drift_chance;
use crate::model::{EffectValue, Model, ModelEffect};

/// m/s² to millionths of standard gravity.
const MICRO_G: f64 = 1e6 / 9.80665;

/// Says why no accelerometer effect was looked for.
pub(super) fn say_why_not(reason: &str, outcome: &mut Outcome) {
    let kinds = CATALOGUE
        .iter()
        .filter(|entry| entry.subject() == Subject::Accelerometers)
        .map(|entry| format!("{}: {reason}", entry.card().kind));
    outcome.diagnosis.not_excluded.extend(kinds);
}

impl Found<'_> {
    pub(super) fn add_to(&self, outcome: &mut Outcome) {
        let effects = self.effects();
        let diagnosis = &mut outcome.diagnosis;
        let verdict = joined(
            diagnosis.verdict,
            !self.choice.chosen.is_empty(),
            self.left.is_empty(),
        );
        if diagnosis.verdict != verdict {
            diagnosis.verdict = verdict;
            if let Some(first) = diagnosis.summary.first_mut() {
                *first = opening(verdict).to_string();
            }
        }
        diagnosis.summary.extend(self.sentences(&effects));
        diagnosis.locations.extend(
            self.locations
                .iter()
                .map(|location| self.location(location)),
        );
        diagnosis.effects.extend(effects);
        diagnosis
            .fit
            .channels
            .extend(self.validations.iter().map(|validation| ChannelEntry {
                channel: name(validation.axis),
                unit: Some("m/s^2"),
                ..channel(validation)
            }));
        diagnosis.accelerometer_noise = self.noise();
        diagnosis.trials += self.choice.trials;
        let runners_up = self.choice.runners_up.iter();
        diagnosis
            .runners_up
            .extend(runners_up.map(|(effect, behind)| RunnerUp {
                kind: CATALOGUE[*effect].card().kind.to_string(),
                behind: *behind,
            }));
        let reach = self.choice.reach.iter();
        diagnosis.sensitivity.extend(reach.map(|(effect, snr)| {
            let card = CATALOGUE[*effect].card();
            Sensitivity {
                kind: card.kind.to_string(),
                typical: card.typical,
                unit: card.unit.to_string(),
                snr: *snr,
            }
        }));
        diagnosis.not_excluded.extend(self.not_excluded());
        let open = self.open();
        if !open.is_empty() {
            diagnosis.next_experiment = format!("{} {open}", diagnosis.next_experiment);
        }
        self.switch_on(&mut outcome.model);
    }

    fn effects(&self) -> Vec<EffectEntry> {
        let named = self
            .choice
            .chosen
            .iter()
            .zip(&self.verdicts)
            .map(|(one, verdict)| EffectEntry {
                regimes: verdict
                    .amplitudes
                    .iter()
                    .map(|amplitude| RegimeEntry {
                        name: amplitude.regime.clone(),
                        amplitude: amplitude.value,
                        std: amplitude.std,
                    })
                    .collect(),
                what_was_left_out: self.left_out(one),
                ..listed(one)
            });
        let unexplained = self.left.iter().map(|location| self.unexplained(location));
        named.chain(unexplained).collect()
    }

    /// The card's words, and where three equal sizes have another cause that no accelerometer shows.
    fn left_out(&self, one: &Chosen) -> String {
        /// Three scatters beyond which two sizes are not the same.
        const SAME: f64 = 3.0;
        let card = CATALOGUE[one.effect].card();
        let equal = (0..3).all(|a| {
            let b = (a + 1) % 3;
            let of = |i: usize, j: usize| one.covariance.get((i, j)).copied().unwrap_or(0.0);
            let variance = of(a, a) + of(b, b) - 2.0 * of(a, b);
            let sizes = one.values.get(a).zip(one.values.get(b));
            sizes.is_some_and(|(x, y)| (x - y).abs() < SAME * variance.max(0.0).sqrt())
        });
        let also = match card.kind {
            "accel_scale" if equal => {
                " All three are the same within their spread: a wrong gravity of the site would look like this too."
            }
            "accel_delay" if equal => {
                " All three are the same within their spread: a reference that is early, with gyros as early, would look like this too."
            }
            _ => "",
        };
        format!("{}{also}", card.left_out)
    }

    /// Physics without a name: only its location.
    fn unexplained(&self, location: &Location) -> EffectEntry {
        EffectEntry {
            kind: "unlisted".to_string(),
            indistinguishable_from: Vec::new(),
            equation: String::new(),
            parameters: Vec::new(),
            covariance: Vec::new(),
            identifiable: Vec::new(),
            log_evidence_gain: 0.0,
            p_value: location.p_value,
            what_was_left_out: format!(
                "Accelerometer {} shows more than its noise between {:.1} and {:.1} s, {:.1} to {:.0} Hz, and no entry of the catalogue explains it{}.",
                AXES[location.axis],
                self.streams.begin_s(location.rows.start),
                self.streams.begin_s(location.rows.end),
                location.band_hz.0,
                location.band_hz.1,
                if location.regime.is_empty() {
                    String::new()
                } else {
                    format!("; it {}", location.regime)
                }
            ),
            expression: None,
            regimes: Vec::new(),
        }
    }

    fn location(&self, location: &Location) -> LocationEntry {
        LocationEntry {
            recording: None,
            channel: name(location.axis),
            start_s: self.streams.begin_s(location.rows.start),
            end_s: self.streams.begin_s(location.rows.end),
            low_hz: location.band_hz.0,
            high_hz: location.band_hz.1,
            regime: location.regime.clone(),
            size: location.size_rad_s,
            unit: "m/s^2".to_string(),
            coherent_with: Vec::new(),
            p_value: location.p_value,
        }
    }

    fn noise(&self) -> Vec<ForceNoiseEntry> {
        let rate_hz = self.felt.rows.rate_hz;
        (0..3)
            .map(|axis| ForceNoiseEntry {
                channel: name(axis),
                noise_m_s2_sqrt_hz: (2.0 * rate_hz * self.noise[axis].theta[0]).sqrt(),
                velocity_noise_m_s: self.noise[axis].theta[1].sqrt(),
            })
            .collect()
    }

    fn sentences(&self, effects: &[EffectEntry]) -> Vec<String> {
        let mut lines = Vec::new();
        for location in &self.locations {
            lines.push(format!(
                "Where: accelerometer {} between {:.1} and {:.1} s, {:.0} to {:.0} Hz, {:.1} µg.",
                AXES[location.axis],
                self.streams.begin_s(location.rows.start),
                self.streams.begin_s(location.rows.end),
                location.band_hz.0,
                location.band_hz.1,
                location.size_rad_s * MICRO_G,
            ));
        }
        for effect in effects {
            lines.push(format!(
                "What: {} ({}). {}",
                effect.kind, effect.equation, effect.what_was_left_out
            ));
            let unit = match effect.parameters.first() {
                Some(ParameterEntry::Number { unit, .. }) => unit.as_str(),
                _ => "",
            };
            for fixed in &effect.identifiable {
                lines.push(format!(
                    "      {} = {:.3e} ± {:.1e} {unit}",
                    combination(&fixed.combination),
                    fixed.value,
                    fixed.std
                ));
            }
            if !effect.indistinguishable_from.is_empty() {
                lines.push(format!(
                    "      This recording cannot tell it from {}.",
                    effect.indistinguishable_from.join(", ")
                ));
            }
        }
        for validation in &self.validations {
            if drift_chance(&validation.before) < FAMILY_SIGNIFICANCE {
                lines.push(format!(
                    "Proof: on held-out time the mean error of accelerometer {} falls from {:.2} to {:.2} ± {:.2} µg.",
                    AXES[validation.axis],
                    validation.before.drift_rad_s * MICRO_G,
                    validation.after.drift_rad_s * MICRO_G,
                    validation.after.drift_std_rad_s * MICRO_G
                ));
            }
        }
        for (effect, reason) in &self.vetoed {
            lines.push(format!(
                "Not named: {} fits in part, but {reason}.",
                CATALOGUE[*effect].card().kind
            ));
        }
        /// A tenth more noise than declared is worth a sentence (the gyros' limit too).
        const NOISIER: f64 = 1.1;
        for (axis, letter) in AXES.iter().enumerate() {
            let fitted = self.noise[axis].theta[0];
            let known = self.declared[axis].random_walk;
            if let Some(known) = known.filter(|known| fitted > NOISIER * known) {
                lines.push(format!(
                    "Accelerometer {letter} is {:.2} times as noisy as the model says.",
                    (fitted / known).sqrt()
                ));
            }
        }
        lines
    }

    fn not_excluded(&self) -> Vec<String> {
        let weak = self.choice.reach.iter().filter(|(_, snr)| *snr < NEEDED_SNR).map(|(effect, snr)| {
            let card = CATALOGUE[*effect].card();
            format!(
                "{}: at {:.1e} {} it would reach a matched-filter SNR of {snr:.1} here, {NEEDED_SNR} are needed",
                card.kind, card.typical, card.unit
            )
        });
        let left_out = CATALOGUE
            .iter()
            .enumerate()
            .filter(|(effect, entry)| {
                entry.subject() == Subject::Accelerometers && !self.candidates.contains(effect)
            })
            .map(|(_, entry)| format!("{}: not tried", entry.card().kind));
        let shaken = (!self.shaken.is_empty()).then(|| {
            format!(
                "accelerometer effects in {}: these stretches show forces that neither gravity nor rotation predicts (the case was shaken along a line); they were left out, and what goes with such a force cannot be told from it",
                self.shaken.join(", ")
            )
        });
        weak.chain(left_out).chain(shaken).collect()
    }

    /// Motions that would separate what is confused.
    fn open(&self) -> String {
        let open: Vec<&str> = self
            .choice
            .chosen
            .iter()
            .filter(|one| {
                let card = CATALOGUE[one.effect].card();
                !one.indistinguishable_from.is_empty()
                    || identifiable(card, one).len() < card.count()
            })
            .map(|one| CATALOGUE[one.effect].card().next_experiment)
            .collect();
        open.join(" ")
    }

    /// Adds the found effects to the model; sizes of one kind add up.
    fn switch_on(&self, model: &mut Model) {
        for one in &self.choice.chosen {
            let card = CATALOGUE[one.effect].card();
            let found = (0..card.count()).map(|k| (card.name(k), one.values[k]));
            let known = model
                .effects
                .iter()
                .position(|known| known.kind == card.kind);
            let place = known.unwrap_or_else(|| {
                model.effects.push(ModelEffect {
                    kind: card.kind.to_string(),
                    parameters: BTreeMap::new(),
                });
                model.effects.len() - 1
            });
            let entry = &mut model.effects[place];
            for (name, value) in found {
                let sum = entry.number(&name) + value;
                entry.parameters.insert(name, EffectValue::Number(sum));
            }
        }
    }
}

fn name(axis: usize) -> String {
    format!("accel_{}", AXES[axis])
}

/// The gyros' verdict with what the accelerometers add.
fn joined(gyros: Verdict, found: bool, clean: bool) -> Verdict {
    let (explained, all_clean) = match gyros {
        Verdict::Matches => (false, true),
        Verdict::Explained => (true, true),
        Verdict::PartlyExplained => (true, false),
        Verdict::Unexplained => (false, false),
        Verdict::Unusable => return Verdict::Unusable,
    };
    match (explained || found, all_clean && clean) {
        (false, true) => Verdict::Matches,
        (true, true) => Verdict::Explained,
        (true, false) => Verdict::PartlyExplained,
        (false, false) => Verdict::Unexplained,
    }
}
