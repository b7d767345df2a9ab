//! The accelerometers' findings in the words of the contract and of people, added to those of the gyros.
//!
//! Enters: [`Found`] and the gyros' [`Outcome`]. Leaves: the outcome with locations, effects, fit and model of both, the
//! verdict of both together, and what the accelerometers could not have shown. µg where people read.

use super::Found;
use crate::Outcome;
use crate::declare::FAMILY_SIGNIFICANCE;
use crate::entries::{listed, regimes, unlisted};
use crate::explained_model::{effect_of, switch_on};
use crate::figures::{channel, runners_up, sensitivity};
use crate::hypotheses::{CATALOGUE, Subject};
use crate::locate::Location;
use crate::result::*;
use crate::select::Chosen;
use crate::sentences::{effect_lines, experiments, opening, vetoed_lines, weak_lines};
use crate::streams::AXES;
use crate::validate::drift_chance;

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

impl Found {
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
        diagnosis.summary.extend(self.carried_s.map(|[from_s, to_s]| {
            format!("The accelerometers are compared between {from_s:.1} and {to_s:.1} s: beyond, the reference was lost and the attitude with it.")
        }));
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
        diagnosis.runners_up.extend(runners_up(&self.choice));
        diagnosis.sensitivity.extend(sensitivity(&self.choice));
        diagnosis.not_excluded.extend(self.not_excluded());
        let open = experiments(&self.choice);
        if !open.is_empty() {
            diagnosis.next_experiment = format!("{} {open}", diagnosis.next_experiment);
        }
        for one in &self.choice.chosen {
            switch_on(&mut outcome.model, effect_of(one));
        }
    }

    fn effects(&self) -> Vec<EffectEntry> {
        let named = self
            .choice
            .chosen
            .iter()
            .zip(&self.verdicts)
            .map(|(one, verdict)| EffectEntry {
                regimes: regimes(verdict),
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
        let axis = AXES[location.axis];
        let from_s = self.streams.begin_s(location.rows.start);
        let to_s = self.streams.begin_s(location.rows.end);
        let (low_hz, high_hz) = location.band_hz;
        let grows = match location.regime.as_str() {
            "" => String::new(),
            regime => format!("; it {regime}"),
        };
        EffectEntry {
            p_value: location.p_value,
            ..unlisted(
                String::new(),
                format!(
                    "Accelerometer {axis} shows more than its noise between {from_s:.1} and {to_s:.1} s, {low_hz:.1} to {high_hz:.0} Hz, and no entry of the catalogue explains it{grows}."
                ),
            )
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
        let rate_hz = self.streams.rate_hz;
        (0..3)
            .map(|axis| ForceNoiseEntry {
                channel: name(axis),
                noise_m_s2_sqrt_hz: (2.0 * rate_hz * self.noise[axis].theta[0]).sqrt(),
                velocity_noise_m_s: self.noise[axis].theta[1].sqrt(),
                terms: None,
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
            lines.extend(effect_lines(effect));
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
        for (wandering_m_s2, letter) in self.wandering_m_s2.iter().zip(AXES) {
            if let Some(size) = wandering_m_s2 {
                lines.push(format!(
                    "Drift: accelerometer {letter} wanders by {:.2} µg (one standard deviation) over the recording, which the model's noise does not; a bias of that size would hide in it.",
                    size * MICRO_G
                ));
            }
        }
        lines.extend(vetoed_lines(&self.vetoed));
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
        let weak = weak_lines(&self.choice);
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
