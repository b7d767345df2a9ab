//! The same findings in sentences: what differs, what was left out, what is not excluded, what to do next.
//!
//! Enters: [`Findings`] and the entries made from them. Leaves: one sentence a line, °/h where people read.

use super::declare::{FAMILY_SIGNIFICANCE, LONG_SPLIT_HZ};
use super::entries::parameters_of;
use super::explain::{DEG_H, Findings, NEEDED_SNR};
use super::hypotheses::{AS_NOISE, CATALOGUE};
use super::identify::identifiable;
use super::result::{EffectEntry, Verdict};
use super::select::Choice;
use super::self_test::SelfTest;
use super::streams::AXES;
use super::validate::drift_chance;
use rlg_diagnosis::data_words;
pub(super) use rlg_findings::sentences::{effect_lines, opening};
use rlg_signal::fault::Fault;

/// The verdict where nothing has a name and the noise drifts.
const BUT_FOR_DRIFT: &str = "But for slow drift, which may be noise that the model does not declare, the model explains this recording: nothing else stands above the noise in any band, stretch or gyro.";

const SPIKES: &str = "spikes";

impl Findings<'_> {
    pub(super) fn summary(&self, verdict: Verdict, effects: &[EffectEntry]) -> Vec<String> {
        let drifts = self.wandering_rad_s.iter().any(Option::is_some);
        let mut lines = vec![match verdict {
            Verdict::Matches if drifts => BUT_FOR_DRIFT.to_string(),
            _ => opening(verdict).to_string(),
        }];
        if let Some((blocks, _)) = self.whole {
            let entry = blocks.entry(&[]);
            let close_s: f64 = entry.stretches_s.iter().map(|[from, to]| to - from).sum();
            lines.push(format!(
                "Looked at: all {:.0} s in sums over blocks of {:.3} s, below {:.0} Hz; {close_s:.0} s in {} stretches row by row, above it.",
                self.scene.streams.span_s(),
                entry.blocks_per_s.recip(),
                entry.split_hz,
                entry.stretches_s.len(),
            ));
        }
        for validation in self.drifting() {
            lines.push(format!(
                "Left: gyro {} still drifts by {:.4} ± {:.4} °/h on held-out time.",
                AXES[validation.axis],
                validation.after.drift_rad_s * DEG_H,
                validation.after.drift_std_rad_s * DEG_H,
            ));
        }
        for validation in self.restless() {
            lines.push(format!(
                "Left: what gyro {} shows on held-out time is not the noise that the other time has (chance {:.0e}).",
                AXES[validation.axis], validation.after.white_p_value,
            ));
        }
        if let Some(test) = self.named_at_any_time() {
            lines.push(format!(
                "Left: a pattern that no shift in time takes away; {} of {} time slides still name something.",
                test.false_names, test.slides,
            ));
        }
        lines.extend(self.uneven().map(|kind| {
            format!(
                "Left: what {kind} fits in part is there, but is of another size in each regime."
            )
        }));
        for location in self.locations {
            let regime = if location.regime.is_empty() {
                String::new()
            } else {
                format!(", and {}", location.regime)
            };
            lines.push(format!(
                "Where: gyro {} between {}, {:.0} to {:.0} Hz, {:.3} °/h{regime}.",
                AXES[location.axis],
                self.between(&location.rows),
                location.band_hz.0,
                location.band_hz.1,
                location.size_rad_s * DEG_H,
            ));
        }
        lines.extend(self.spike_lines());
        let is_said = |effect: &&EffectEntry| effect.kind == SPIKES;
        for effect in effects.iter().filter(|effect| !is_said(effect)) {
            lines.extend(effect_lines(effect));
        }
        lines.extend(self.drift_lines());
        for validation in self.validations {
            if drift_chance(&validation.before) < FAMILY_SIGNIFICANCE {
                lines.push(format!(
                    "Proof: on held-out time the drift of gyro {} falls from {:.4} to {:.4} ± {:.4} °/h.",
                    AXES[validation.axis],
                    validation.before.drift_rad_s * DEG_H,
                    validation.after.drift_rad_s * DEG_H,
                    validation.after.drift_std_rad_s * DEG_H
                ));
            }
        }
        lines.extend(
            self.self_test
                .filter(|test| test.slides > 0)
                .map(self_test_line),
        );
        lines.extend(vetoed_lines(&self.catch.vetoed));
        lines
    }

    /// Spikes, one sentence a channel: each of them stands in `diagnosis.json`.
    fn spike_lines(&self) -> Vec<String> {
        let spikes = self.faults.iter().filter(|fault| fault.kind == SPIKES);
        let spikes: Vec<Fault> = spikes.cloned().collect();
        data_words::lines(&self.scene.streams, &spikes)
    }

    /// Noise that drifts: what it may hide, or be.
    fn drift_lines(&self) -> impl Iterator<Item = String> {
        let each = self.wandering_rad_s.iter().zip(AXES);
        each.filter_map(|(wandering_rad_s, axis)| {
            let size = (*wandering_rad_s)? * DEG_H;
            Some(format!(
                "Drift: gyro {axis} wanders by {size:.3} °/h (one standard deviation) over the recording, which the model's noise does not; slow effects of that size would hide in it."
            ))
        })
    }

    pub(super) fn not_excluded(&self) -> Vec<String> {
        let missing = CATALOGUE
            .iter()
            .enumerate()
            .filter(|(effect, _)| !self.candidates.contains(effect))
            .filter(|(effect, _)| {
                let mut found = self.catch.choice.chosen.iter();
                !found.any(|one| one.effect == *effect)
            })
            .map(|(_, entry)| {
                let streams = &self.scene.streams;
                let why = match entry.missing(self.scene) {
                    Some(missing) => missing,
                    None if self.whole.is_some() => {
                        "needs all rows for each of its frequencies, and the recording is longer than memory"
                    }
                    None if streams.at_rest.is_some() => {
                        "needs motion, and the unit stood still"
                    }
                    None => "not tried",
                };
                format!("{}: {why}", entry.card().kind)
            });
        let weak = weak_lines(&self.catch.choice);
        let as_noise = AS_NOISE
            .iter()
            .map(|kind| format!("{kind}: weighed as excess noise, in which it is the same as angle_random_walk; its dead bands are not looked for"));
        let jumps = ["gyro_bias_step", "counter_slip"]
            .into_iter()
            .filter(|_| self.scene.streams.at_rest.is_some())
            .map(|kind| {
                format!("{kind}: no reference tells it from a nudge of the case; such places are located")
            });
        let between = ["gyro_bias_step", "counter_slip", "unlisted"]
            .into_iter()
            .filter(|_| self.whole.is_some())
            .map(|kind| {
                format!("{kind}: looked for in the stretches alone, above {LONG_SPLIT_HZ:.0} Hz")
            });
        let missing = missing.chain(weak).chain(as_noise);
        missing.chain(jumps).chain(between).collect()
    }

    pub(super) fn next_experiment(&self) -> String {
        let open = experiments(&self.catch.choice);
        if !open.is_empty() {
            return open;
        }
        if !self.left.is_empty() {
            return "Repeat the located stretch with one thing changed at a time: amplitude, frequency, attitude, temperature; what the residual scales with names its cause.".to_string();
        }
        "Nothing is confused here; a motion richer in amplitude and frequency would lower what is not excluded.".to_string()
    }
}

/// Names that were taken back, with the reason.
pub(super) fn vetoed_lines(vetoed: &[(usize, String)]) -> impl Iterator<Item = String> {
    vetoed.iter().map(|(effect, reason)| {
        let kind = CATALOGUE[*effect].card().kind;
        format!("Not named: {kind} fits in part, but {reason}.")
    })
}

/// Effects that would not be seen at their typical size.
pub(super) fn weak_lines(choice: &Choice) -> impl Iterator<Item = String> {
    let weak = choice.reach.iter().filter(|(_, snr)| *snr < NEEDED_SNR);
    weak.map(|(effect, snr)| {
        let card = CATALOGUE[*effect].card();
        format!(
            "{}: at {:.1e} {} it would reach a matched-filter SNR of {snr:.1} here, {NEEDED_SNR} are needed",
            card.kind, card.typical, card.unit
        )
    })
}

/// Motions that would separate what is confused; empty where nothing is.
pub(super) fn experiments(choice: &Choice) -> String {
    let open: Vec<&str> = choice
        .chosen
        .iter()
        .filter(|one| {
            let card = CATALOGUE[one.effect].card();
            one.indistinguishable_from.len() > one.gravity_speaks_against.len()
                || identifiable(card, one).len() < parameters_of(one).len()
        })
        .map(|one| CATALOGUE[one.effect].card().next_experiment)
        .collect();
    open.join(" ")
}

/// The self-test in a sentence.
fn self_test_line(test: &SelfTest) -> String {
    let shares: Vec<String> = test
        .curve
        .iter()
        .filter(|point| point.injections > 0)
        .map(|point| {
            let percent = 100.0 * point.detected as f64 / point.injections as f64;
            format!("{percent:.0} % at SNR {}", point.rho)
        })
        .collect();
    let found = if shares.is_empty() {
        String::new()
    } else {
        format!("; of injected patterns it finds {}", shares.join(", "))
    };
    format!(
        "Self-test: {} false names in {} time slides (at most {:.1} %){found}.",
        test.false_names,
        test.slides,
        100.0 * test.upper_limit
    )
}
