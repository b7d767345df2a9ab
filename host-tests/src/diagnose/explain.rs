//! Findings in the words of the contract and of people (diagnosis road, steps 10 and 11).
//!
//! Enters: everything the stages found. Leaves: `diagnosis.json`, the sentences of the report, and the model
//! with the found effects switched on.

use std::collections::BTreeMap;

use super::clock::Clock;
use super::control::Control;
use super::cycle::Cycle;
use super::declare::FAMILY_SIGNIFICANCE;
use super::empirical::Form;
use super::excess::{Excess, NOISE_KINDS};
use super::hunt::{Catch, FoundTerm};
use super::hypotheses::{CATALOGUE, reference_harmonic};
use super::identify::identifiable;
use super::locate::Location;
use super::noise::Noise;
use super::products::Products;
use super::qualify::{FAULT_KINDS, Fault};
use super::result::*;
use super::scene::Scene;
use super::select::Chosen;
use super::self_test::SelfTest;
use super::split::Split;
use super::still_words::line_of;
use super::streams::{AXES, Streams};
use super::validate::{Figures, Validation};
use crate::model::{EffectValue, Model, ModelEffect};

/// rad/s to degrees per hour.
pub const DEG_H: f64 = 180.0 / std::f64::consts::PI * 3600.0;

/// Matched-filter SNR at which a six-parameter effect is found nine times in ten.
pub const NEEDED_SNR: f64 = 7.0;

/// Everything the stages found.
pub struct Findings<'a> {
    /// Name of the recording, or names of several.
    pub recording: &'a str,
    /// The seed, for the file.
    pub seed: u64,
    /// Channels and motion.
    pub scene: &'a Scene,
    /// How time was cut.
    pub split: &'a Split,
    /// Noise of each gyro.
    pub noise: &'a [Noise; 3],
    /// Effects and terms.
    pub catch: &'a Catch,
    /// Noise beyond the model's.
    pub excess: &'a [Excess],
    /// Faults of the data that the model does not know.
    pub faults: &'a [Fault],
    /// Where model and recording differed.
    pub locations: &'a [Location],
    /// Where they still do.
    pub left: &'a [Location],
    /// Before and after.
    pub validations: &'a [Validation],
    /// Effects that were tried.
    pub candidates: &'a [usize],
    /// What was fitted and held out of each recording, where there are several.
    pub by_recording: &'a [RecordingEntry],
    /// What the rows themselves show.
    pub rows_found: &'a RowsFound,
    /// Time slides and injections; `None` against attitudes, which have no rows to slide.
    pub self_test: Option<&'a SelfTest>,
}

/// What the rows of a unit at rest show of their own making.
#[derive(Default)]
pub struct RowsFound {
    /// The stamps against the nominal clock.
    pub clock: Option<Clock>,
    /// Cycles of the noise's power.
    pub cycles: Vec<Cycle>,
    /// The same search on shuffled rows.
    pub control: Option<Control>,
    /// Root mean square rate of the held-out rows about the model, before and after \[rad/s\].
    pub held_out_rad_s: [[f64; 3]; 2],
    /// What was dropped because the control shows as much.
    pub dropped: usize,
}

/// How a cycle stands in a model file.
pub fn cycle_expression(cycle: &Cycle) -> String {
    format!("noise_cycle({}/{})", cycle.turns, cycle.rows)
}

/// Whether the model has an unlisted effect whose expression begins so.
pub fn has_expression(model: &Model, stem: &str) -> bool {
    model.effects.iter().any(|effect| {
        matches!(effect.parameters.get("expression"), Some(EffectValue::Text(text)) if text.starts_with(stem))
    })
}

/// Says how each location goes with the motion: the product of channels that follows it best.
pub fn name_regimes(locations: &mut [Location], catch: &Catch, products: &Products) {
    let everything: Vec<usize> = catch.values.iter().map(|(index, _)| *index).collect();
    for location in locations {
        if let Some(best) = catch
            .survey
            .best(location.axis, &everything)
            .filter(|best| best.p_value < FAMILY_SIGNIFICANCE)
        {
            location.regime = format!("grows as {}", products.names[best.product]);
        }
    }
}

/// The result of a recording from which nothing can be said.
pub fn unusable(recording: &str, seed: u64, why: &str, faults: Vec<EffectEntry>) -> Diagnosis {
    Diagnosis {
        format: 1,
        recording: recording.to_string(),
        version: env!("CARGO_PKG_VERSION").to_string(),
        seed,
        verdict: Verdict::Unusable,
        summary: vec![format!("Nothing can be said of this recording: {why}.")],
        locations: Vec::new(),
        effects: faults,
        fit: FitEntry {
            fitted_on: Vec::new(),
            held_out: Vec::new(),
            recordings: Vec::new(),
            channels: Vec::new(),
        },
        not_excluded: vec![format!("every kind: {why}")],
        next_experiment: "A longer recording with gyros, pickoffs and reference all measured."
            .to_string(),
        promises: Vec::new(),
        noise: Vec::new(),
        accelerometer_noise: Vec::new(),
        trials: 0,
        runners_up: Vec::new(),
        sensitivity: Vec::new(),
        control: None,
        self_test: None,
    }
}

impl Findings<'_> {
    /// `diagnosis.json`.
    pub fn diagnosis(&self) -> Diagnosis {
        let effects = self.effects();
        let verdict = self.verdict(&effects);
        let streams = &self.scene.streams;
        let times = |rows: &[std::ops::Range<usize>]| {
            rows.iter()
                .map(|rows| [streams.begin_s(rows.start), streams.begin_s(rows.end)])
                .collect()
        };
        Diagnosis {
            format: 1,
            recording: self.recording.to_string(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            seed: self.seed,
            verdict,
            summary: self.summary(verdict, &effects),
            locations: self
                .locations
                .iter()
                .map(|location| self.location(location))
                .collect(),
            not_excluded: self.not_excluded(),
            next_experiment: self.next_experiment(),
            promises: Vec::new(),
            fit: FitEntry {
                fitted_on: times(&self.split.fitted),
                held_out: times(&self.split.held_out),
                recordings: self.by_recording.to_vec(),
                channels: self.validations.iter().map(channel).collect(),
            },
            noise: (0..3)
                .map(|axis| NoiseEntry {
                    channel: format!("gyro_{}", AXES[axis]),
                    angle_random_walk_rad_sqrt_s: self.noise[axis].angle_random_walk_rad_sqrt_s(),
                    angle_noise_rad: self.noise[axis].angle_noise_rad(),
                })
                .collect(),
            accelerometer_noise: Vec::new(),
            trials: self.catch.trials,
            runners_up: self
                .catch
                .choice
                .runners_up
                .iter()
                .map(|(effect, behind)| RunnerUp {
                    kind: CATALOGUE[*effect].card().kind.to_string(),
                    behind: *behind,
                })
                .collect(),
            sensitivity: self
                .catch
                .choice
                .reach
                .iter()
                .map(|(effect, snr)| {
                    let card = CATALOGUE[*effect].card();
                    Sensitivity {
                        kind: card.kind.to_string(),
                        typical: card.typical,
                        unit: card.unit.to_string(),
                        snr: *snr,
                    }
                })
                .collect(),
            control: self
                .rows_found
                .control
                .as_ref()
                .map(|control| ControlEntry {
                    lines: control.lines,
                    strongest: control.strongest,
                    cycles: control.cycles.len(),
                    dropped: self.rows_found.dropped,
                }),
            self_test: self.self_test.map(self_test_entry),
            effects,
        }
    }

    /// The model with the found effects switched on.
    pub fn explained_model(&self, model: &Model) -> Model {
        let mut explained = model.clone();
        let mut add = |effect: ModelEffect| {
            // Sizes of one kind add up in one entry; events and expressions stay apart.
            let single = !FAULT_KINDS.contains(&effect.kind.as_str())
                && !matches!(
                    effect.kind.as_str(),
                    "unlisted"
                        | "gyro_bias_step"
                        | "counter_slip"
                        | "axis_flexure_mode"
                        | "isolator_mode"
                        | reference_harmonic::KIND
                );
            let noise = NOISE_KINDS.contains(&effect.kind.as_str());
            let known = explained
                .effects
                .iter_mut()
                .find(|known| single && known.kind == effect.kind);
            match known {
                None => explained.effects.push(effect),
                Some(known) => {
                    for (name, value) in effect.parameters {
                        let EffectValue::Number(more) = value else {
                            continue;
                        };
                        let slot = known
                            .parameters
                            .entry(name)
                            .or_insert(EffectValue::Number(0.0));
                        if let EffectValue::Number(sum) = slot {
                            *sum = if noise { sum.hypot(more) } else { *sum + more };
                        }
                    }
                }
            }
        };
        for one in &self.catch.choice.chosen {
            let card = CATALOGUE[one.effect].card();
            let parameters = parameters_of(one)
                .into_iter()
                .map(|k| (card.name(k), EffectValue::Number(one.values[k])))
                .collect();
            add(ModelEffect {
                kind: card.kind.to_string(),
                parameters,
            });
        }
        for halves in of_one_effect(&self.catch.terms.iter().collect::<Vec<_>>()) {
            let mut effect = halves[0]
                .term
                .to_effect(halves[0].size, &self.scene.streams);
            for other in &halves[1..] {
                effect.parameters.extend(
                    other
                        .term
                        .to_effect(other.size, &self.scene.streams)
                        .parameters,
                );
            }
            add(effect);
        }
        self.rows_effects().into_iter().for_each(&mut add);
        for fault in self.faults {
            let streams = &self.scene.streams;
            let (recording, [start_s, end_s]) = streams.own_span(&fault.rows);
            let mut parameters = BTreeMap::from([
                (
                    "channel".to_string(),
                    EffectValue::Text(fault.channel.clone()),
                ),
                ("start_s".to_string(), EffectValue::Number(start_s)),
                ("end_s".to_string(), EffectValue::Number(end_s)),
            ]);
            if streams.is_joined() {
                let name = EffectValue::Text(recording.to_string());
                parameters.insert("recording".to_string(), name);
            }
            add(ModelEffect {
                kind: fault.kind.to_string(),
                parameters,
            });
        }
        for excess in self.excess {
            let parameters: BTreeMap<String, EffectValue> = (0..3)
                .map(|axis| {
                    (
                        AXES[axis].to_string(),
                        EffectValue::Number(excess.values[axis]),
                    )
                })
                .collect();
            add(ModelEffect {
                kind: excess.kind.to_string(),
                parameters,
            });
        }
        explained
    }

    /// "3.0 and 5.0 s", with the recording's name where there are several.
    pub(super) fn between(&self, rows: &std::ops::Range<usize>) -> String {
        let streams = &self.scene.streams;
        let (recording, [start_s, end_s]) = streams.own_span(rows);
        let of = match streams.is_joined() {
            true => format!(" of {recording}"),
            false => String::new(),
        };
        format!("{start_s:.1} and {end_s:.1} s{of}")
    }

    fn location(&self, location: &Location) -> LocationEntry {
        let streams = &self.scene.streams;
        let (recording, [start_s, end_s]) = streams.own_span(&location.rows);
        LocationEntry {
            channel: format!("gyro_{}", AXES[location.axis]),
            recording: streams.is_joined().then(|| recording.to_string()),
            start_s,
            end_s,
            low_hz: location.band_hz.0,
            high_hz: location.band_hz.1,
            regime: location.regime.clone(),
            size: location.size_rad_s,
            unit: "rad/s".to_string(),
            p_value: location.p_value,
            coherent_with: location
                .companions
                .iter()
                .map(|companion| CoherentEntry {
                    channel: format!("gyro_{}", AXES[location.axis]),
                    with: companion.with.clone(),
                    lag_s: companion.lag_s,
                    coherence: companion.coherence,
                    p_value: companion.p_value,
                })
                .collect(),
        }
    }

    fn verdict(&self, effects: &[EffectEntry]) -> Verdict {
        // A constant over a stretch of time describes; it does not explain.
        let describes = |effect: &EffectEntry| {
            effect.parameters.is_empty()
                || effect
                    .expression
                    .as_deref()
                    .is_some_and(|text| text.starts_with("window("))
        };
        let explained = effects.iter().any(|effect| !describes(effect));
        let clean = self.left.is_empty() && !effects.iter().any(describes);
        match (explained, clean) {
            (false, true) => Verdict::Matches,
            (false, false) => Verdict::Unexplained,
            (true, true) => Verdict::Explained,
            (true, false) => Verdict::PartlyExplained,
        }
    }

    fn effects(&self) -> Vec<EffectEntry> {
        let named = self
            .catch
            .choice
            .chosen
            .iter()
            .zip(&self.catch.regimes)
            .map(|(one, verdict)| {
                let mut entry = listed(one);
                entry.regimes = verdict
                    .amplitudes
                    .iter()
                    .map(|a| RegimeEntry {
                        name: a.regime.clone(),
                        amplitude: a.value,
                        std: a.std,
                    })
                    .collect();
                entry
            });
        let still = self.scene.streams.at_rest.is_some();
        let unexplained: Vec<EffectEntry> = if still {
            self.unexplained_at_rest()
        } else {
            self.left
                .iter()
                .map(|location| self.unexplained(location))
                .collect()
        };
        let (lines, terms): (Vec<&FoundTerm>, Vec<&FoundTerm>) = self
            .catch
            .terms
            .iter()
            .partition(|found| still && line_of(found).is_some());
        let named: Vec<EffectEntry> = named
            .map(|entry| {
                if still {
                    self.confused_at_rest(entry)
                } else {
                    entry
                }
            })
            .collect();
        named
            .into_iter()
            .chain(self.rows_entries())
            .chain(self.line_entries(&lines))
            .chain(
                of_one_effect(&terms)
                    .into_iter()
                    .map(|halves| term(halves, &self.scene.streams)),
            )
            .chain(
                self.excess
                    .iter()
                    .map(noise)
                    .map(|entry| self.coarse_at_rest(entry)),
            )
            .chain(
                self.faults
                    .iter()
                    .map(|fault| fault_entry(&self.scene.streams, fault)),
            )
            .chain(unexplained)
            .collect()
    }

    /// Physics without a name or an expression: only its location.
    fn unexplained(&self, location: &Location) -> EffectEntry {
        let axis = AXES[location.axis];
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
                "Gyro {axis} shows more than its noise between {}, {:.1} to {:.0} Hz, and no measured channel explains it.",
                self.between(&location.rows),
                location.band_hz.0,
                location.band_hz.1
            ),
            expression: None,
            regimes: Vec::new(),
        }
    }
}

fn self_test_entry(test: &SelfTest) -> SelfTestEntry {
    SelfTestEntry {
        slides: test.slides,
        false_names: test.false_names,
        upper_limit_95: test.upper_limit,
        curve: test
            .curve
            .iter()
            .map(|point| SelfTestPoint {
                rho: point.rho,
                injections: point.injections,
                detected: point.detected,
                named: point.named,
                theory: point.theory,
            })
            .collect(),
        kinds: test
            .kinds
            .iter()
            .map(|kind| SelfTestKind {
                kind: CATALOGUE[kind.effect].card().kind.to_string(),
                false_names: kind.false_names,
                detected: kind
                    .by_rho
                    .iter()
                    .map(|found| found.map(|[detected, _]| detected))
                    .collect(),
                named: kind
                    .by_rho
                    .iter()
                    .map(|found| found.map(|[_, named]| named))
                    .collect(),
            })
            .collect(),
    }
}

/// A fault of the data.
pub fn fault_entry(streams: &Streams, fault: &Fault) -> EffectEntry {
    let (recording, [start_s, end_s]) = streams.own_span(&fault.rows);
    let named = streams.is_joined().then(|| ParameterEntry::Text {
        name: "recording".to_string(),
        value: recording.to_string(),
    });
    // A fault is located to the row.
    let std = 1.0 / streams.rate_hz;
    let number = |name: &str, value: f64| ParameterEntry::Number {
        name: name.to_string(),
        value,
        std,
        unit: "s".to_string(),
    };
    EffectEntry {
        kind: fault.kind.to_string(),
        indistinguishable_from: fault
            .indistinguishable_from
            .iter()
            .map(|kind| (*kind).to_string())
            .collect(),
        equation: String::new(),
        parameters: [
            ParameterEntry::Text {
                name: "channel".to_string(),
                value: fault.channel.clone(),
            },
            number("start_s", start_s),
            number("end_s", end_s),
        ]
        .into_iter()
        .chain(named)
        .collect(),
        covariance: vec![vec![std * std, 0.0], vec![0.0, std * std]],
        identifiable: Vec::new(),
        log_evidence_gain: 0.0,
        p_value: 0.0,
        what_was_left_out: format!(
            "The data of {} cannot be used between {start_s:.4} and {end_s:.4} s; those rows were left out of everything else.",
            fault.channel
        ),
        expression: None,
        regimes: Vec::new(),
    }
}

/// "xy + xz".
pub fn combination(weights: &BTreeMap<String, f64>) -> String {
    let mut text = String::new();
    for (name, weight) in weights {
        let sign = if *weight < 0.0 { "−" } else { "+" };
        if text.is_empty() {
            text = if *weight < 0.0 {
                format!("−{name}")
            } else {
                name.clone()
            };
        } else {
            text = format!("{text} {sign} {name}");
        }
    }
    text
}

/// The parameters that stand for something.
pub(super) fn parameters_of(one: &Chosen) -> Vec<usize> {
    let hypothesis = CATALOGUE[one.effect];
    (0..hypothesis.card().count())
        .filter(|&k| hypothesis.has(one.values.as_slice(), k))
        .collect()
}

pub(super) fn listed(one: &Chosen) -> EffectEntry {
    let card = CATALOGUE[one.effect].card();
    let kept = parameters_of(one);
    EffectEntry {
        kind: card.kind.to_string(),
        indistinguishable_from: one
            .indistinguishable_from
            .iter()
            .map(|&rival| CATALOGUE[rival].card().kind.to_string())
            .chain(
                card.resembles_untested
                    .iter()
                    .map(|kind| (*kind).to_string()),
            )
            .collect(),
        equation: card.equation.to_string(),
        parameters: kept
            .iter()
            .map(|&k| ParameterEntry::Number {
                name: card.name(k),
                value: one.values[k],
                std: one.covariance[(k, k)].sqrt(),
                unit: card.unit_of(k).to_string(),
            })
            .collect(),
        covariance: kept
            .iter()
            .map(|&a| kept.iter().map(|&b| one.covariance[(a, b)]).collect())
            .collect(),
        identifiable: identifiable(card, one),
        log_evidence_gain: one.log_evidence_gain,
        p_value: one.p_value,
        what_was_left_out: card.left_out.to_string(),
        expression: None,
        regimes: Vec::new(),
    }
}

/// Terms by effect: the two halves of a harmonic stand together.
fn of_one_effect<'a>(terms: &[&'a FoundTerm]) -> Vec<Vec<&'a FoundTerm>> {
    let mut groups: Vec<Vec<&FoundTerm>> = Vec::new();
    for &found in terms {
        let alike = |group: &&mut Vec<&FoundTerm>| match (&group[0].term.form, &found.term.form) {
            (Form::Harmonic { order: a, .. }, Form::Harmonic { order: b, .. }) => {
                a == b && group[0].term.axis == found.term.axis
            }
            _ => false,
        };
        match groups.iter_mut().find(alike) {
            Some(group) => group.push(found),
            None => groups.push(vec![found]),
        }
    }
    groups
}

fn term(halves: Vec<&FoundTerm>, streams: &Streams) -> EffectEntry {
    let found = halves[0];
    let (name, _) = found.term.size();
    let effect = found.term.to_effect(found.size, streams);
    let mut parameters: Vec<ParameterEntry> = halves
        .iter()
        .map(|half| {
            let (name, unit) = half.term.size();
            ParameterEntry::Number {
                name: name.to_string(),
                value: half.size,
                std: half.std,
                unit: unit.to_string(),
            }
        })
        .collect();
    parameters.extend(
        effect
            .parameters
            .iter()
            .filter(|(other, _)| *other != name)
            .map(|(name, value)| match value {
                EffectValue::Text(value) => ParameterEntry::Text {
                    name: name.clone(),
                    value: value.clone(),
                },
                EffectValue::Number(value) => ParameterEntry::Number {
                    name: name.clone(),
                    value: *value,
                    std: 0.0,
                    unit: if name == "order" { "1" } else { "s" }.to_string(),
                },
            }),
    );
    let expression = match effect.parameters.get("expression") {
        Some(EffectValue::Text(expression)) => Some(expression.clone()),
        _ => None,
    };
    let axis = AXES[found.term.axis];
    let what_was_left_out = match (&expression, found.term.kind()) {
        (Some(expression), _) if expression.starts_with("window(") => format!(
            "Gyro {axis} drifts in one stretch of time and no measured channel explains it; the constant in the model is a description, not physics."
        ),
        (Some(expression), _) => format!(
            "Gyro {axis} follows {expression}, which is no effect of the catalogue: an expression in measured channels, found by search."
        ),
        (None, reference_harmonic::KIND) => reference_harmonic::LEFT_OUT.to_string(),
        (None, "gyro_bias_step") => format!("The bias of gyro {axis} jumps once and stays there."),
        (None, _) => format!(
            "The angle of gyro {axis} jumps once, as when its counter loses or gains pulses."
        ),
    };
    EffectEntry {
        kind: found.term.kind().to_string(),
        indistinguishable_from: Vec::new(),
        equation: found.term.equation(),
        covariance: {
            let numbers = parameters
                .iter()
                .filter(|parameter| matches!(parameter, ParameterEntry::Number { .. }))
                .count();
            let mut covariance = vec![vec![0.0; numbers]; numbers];
            for (place, half) in halves.iter().enumerate() {
                covariance[place][place] = half.std * half.std;
            }
            if halves.len() > 1 {
                covariance[0][1] = found.with_next;
                covariance[1][0] = found.with_next;
            }
            covariance
        },
        parameters,
        identifiable: halves
            .iter()
            .map(|half| Identifiable {
                combination: BTreeMap::from([(half.term.size().0.to_string(), 1.0)]),
                value: half.size,
                std: half.std,
            })
            .collect(),
        log_evidence_gain: 0.5 * found.ratio,
        p_value: found.p_value,
        what_was_left_out,
        expression,
        regimes: Vec::new(),
    }
}

fn noise(excess: &Excess) -> EffectEntry {
    EffectEntry {
        kind: excess.kind.to_string(),
        indistinguishable_from: excess
            .indistinguishable_from
            .iter()
            .map(|kind| (*kind).to_string())
            .collect(),
        equation: excess.equation.to_string(),
        parameters: (0..3)
            .map(|axis| ParameterEntry::Number {
                name: AXES[axis].to_string(),
                value: excess.values[axis],
                std: excess.stds[axis],
                unit: excess.unit.to_string(),
            })
            .collect(),
        covariance: (0..3)
            .map(|a| {
                (0..3)
                    .map(|b| if a == b { excess.stds[a].powi(2) } else { 0.0 })
                    .collect()
            })
            .collect(),
        identifiable: Vec::new(),
        log_evidence_gain: excess.log_likelihood_gain,
        p_value: excess.p_value,
        what_was_left_out: excess.left_out.to_string(),
        expression: None,
        regimes: Vec::new(),
    }
}

pub(super) fn channel(validation: &Validation) -> ChannelEntry {
    let figures = |figures: &Figures| FiguresEntry {
        drift_rad_s: figures.drift_rad_s,
        drift_std_rad_s: figures.drift_std_rad_s,
        normalised_power: figures.normalised_power,
        normalised_power_all: figures.normalised_power_all,
        white_p_value: figures.white_p_value,
    };
    ChannelEntry {
        channel: format!("gyro_{}", AXES[validation.axis]),
        unit: None,
        band_hz: [validation.band_hz.0, validation.band_hz.1],
        held_out_before: figures(&validation.before),
        held_out_after: figures(&validation.after),
    }
}
