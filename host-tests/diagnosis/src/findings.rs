//! Findings in the terms of `diagnosis.json`, the report and the updated model.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DMatrix;
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::entries::{self, Card, Law, STEP};
use rlg_catalogue::signals::AXES;
use rlg_catalogue::{Candidate, Column, Signals};
use rlg_inference::events::scan;
use rlg_inference::normal_equations::Transform;
use rlg_inference::{Drift, Fit, NoiseLevels};
use rlg_model::{EffectValue, ModelEffect};
use rlg_signal::partition::Use;
use statrs::distribution::{ChiSquared, ContinuousCDF, Normal};

use super::by_regime;
use super::confirm::{Confirmed, Final};
use super::data::Data;
use super::entries_of_rows::{channel, fault_entry};
use super::excess_noise::excess;
use super::goodness::Misfit;
use super::left::unexplained;
use super::locate::{self, Location};
use super::lock_in::behind_walk;
use super::noise_levels::{mean, reported};
use super::noise_spectrum::Noise;
use super::outcome::Outcome;
use super::pictures;
use super::plan::AnalysisPlan;
use super::reenact::Reenactment;
use super::regimes::{Regime, regimes_of};
use super::search::{Found, effect_rad};
use super::validate::validate;
use super::whitened::Whitener;
use rlg_findings::combinations::identifiable;
use rlg_findings::entries::noise as noise_entry;
use rlg_findings::excess::{Excess, WALK};
use rlg_findings::result::{
    Diagnosis, EffectEntry, EvidenceEntry, FitEntry, Identifiable, LocationEntry, NoiseEntry,
    ParameterEntry, RegimeEntry, RunnerUp, Verdict,
};
use rlg_findings::updated_model::switch_on;
use rlg_signal::fault::Fault;
use rlg_signal::streams::{Streams, Triad, each_axis};

/// One finding.
struct Finding<'a> {
    candidate: &'a Candidate,
    /// Its parameters in the final fit.
    block: std::ops::Range<usize>,
    squared_size: f64,
    rank: usize,
    /// Gyros of which its number is told, where all share one.
    told: [bool; 3],
    /// The one of several recordings that it is of; `None` where it is of all.
    recording: Option<&'a str>,
    /// Kinds that the recording cannot tell from it.
    alike: Vec<String>,
    /// Whether drift explains it as well.
    or_drift: bool,
    cost_without: f64,
    confirmed_gain: f64,
    reenactment: Reenactment,
    /// Standard deviation of its instant \[rows\], where it has one.
    instant_std_rows: Option<f64>,
    /// Share of the residual's power that it explains beside the others \[1\].
    share: f64,
    /// Whether it is no more than significant.
    is_slight: bool,
    /// Its size in each stretch of like motion that shows it.
    regimes: Vec<RegimeEntry>,
}

/// What is written of a set that is confirmed.
pub fn outcome(
    of: (&Data, &Found),
    confirmed: &Confirmed,
    faults: &[Fault],
    seed: u64,
    plan: &AnalysisPlan,
) -> Outcome {
    written(of, confirmed, faults, seed, plan).0
}

/// The same of a set that is confirmed.
///
/// # Returns
/// The outcome, and the effects that its model has more, those with a name first.
pub(super) fn written(
    (data, found): (&Data, &Found),
    confirmed: &Confirmed,
    faults: &[Fault],
    seed: u64,
    plan: &AnalysisPlan,
) -> (Outcome, Vec<ModelEffect>) {
    let streams = data.streams;
    let Final {
        fit,
        left_rad,
        misfits,
        ..
    } = &confirmed.last;
    let after_rad = &data.aside.with_unexplained(left_rad);
    let before_rad = &data.aside.with_all(&found.residual_rad);
    let regimes = regimes_of(streams);
    let findings = findings((data, found), confirmed, &regimes, plan);

    let noise: [Noise; 3] =
        std::array::from_fn(|axis| reported(fit.levels[axis], streams.rows, streams.rate_hz));
    let all_rows = data.ranges_of(&[Use::Train, Use::Confirm, Use::Test]);
    let fitted_rows = data.ranges_of(&[Use::Train, Use::Confirm]);
    let test_rows = data.ranges_of(&[Use::Test]);
    let tiles_before = locate::tiles(streams, before_rad, &noise, &regimes, &all_rows);
    let tiles_after = locate::tiles(streams, after_rad, &noise, &regimes, &all_rows);
    let mut locations = locate::join(&tiles_before, &regimes, &all_rows);
    // What is left is judged on the rows that the findings saw: test rows change no finding.
    let mut left = locate::join(
        &locate::tiles(streams, after_rad, &noise, &regimes, &fitted_rows),
        &regimes,
        &fitted_rows,
    );
    left.retain(|one| !data.lattice.hides_location(one, streams.rate_hz));
    name_regimes(&mut locations, &findings);
    let validations = validate(
        before_rad,
        after_rad,
        &noise,
        (&test_rows, streams.band_hz()),
        &locations,
        streams.rate_hz,
    );
    // Where what is left is not like noise, its level is none.
    let unlike: BTreeSet<usize> = misfits.iter().map(|one| one.gyro).collect();
    let columns_found = findings.iter().flat_map(|one| {
        let fixed = one.candidate.hypothesis.fixed.iter();
        fixed.map(|one| found.pool.columns[one.column].column)
    });
    let columns = data.known.iter().map(|(_, sensed, _)| sensed.column);
    let locks_in: BTreeSet<usize> = columns
        .chain(columns_found)
        .filter_map(|column| match column {
            Column::LockIn(gyro, ..) => Some(gyro),
            _ => None,
        })
        .collect();
    let noise_found = excess(data, fit, &found.motion, (&unlike, &locks_in), plan);

    let mut effects: Vec<EffectEntry> = findings
        .iter()
        .map(|one| entry(one, fit, (streams, &found.motion.signals)))
        .collect();
    effects.extend(noise_found.iter().map(|one| {
        let mut entry = noise_entry(one);
        let lock_in = (one.kind == WALK.kind).then(|| behind_walk(one.values, data));
        entry.what_was_left_out.extend(lock_in.flatten());
        entry
    }));
    effects.extend(unexplained(&left, streams));
    // What fits some rows and not others is not explained, whatever it is.
    let is_consistent = confirmed.unconfirmed.is_empty()
        && confirmed.impossible.is_empty()
        && left.is_empty()
        && misfits.is_empty()
        && !has_event(data, fit, left_rad, plan);
    let is_explained = !findings.is_empty() || !noise_found.is_empty() || !faults.is_empty();
    let verdict = match (is_explained, is_consistent) {
        (false, true) => Verdict::Matches,
        (false, false) => Verdict::Unexplained,
        (true, true) => Verdict::Explained,
        (true, false) => Verdict::PartlyExplained,
    };
    effects.extend(faults.iter().map(|fault| fault_entry(streams, fault)));
    let span =
        |rows: &std::ops::Range<usize>| [streams.begin_s(rows.start), streams.begin_s(rows.end)];
    let diagnosis = Diagnosis {
        format: 1,
        recording: streams.piece.recording.clone(),
        version: env!("CARGO_PKG_VERSION").to_string(),
        seed,
        verdict,
        summary: summary(verdict, &findings, confirmed, found)
            .into_iter()
            .chain(
                unlike
                    .iter()
                    .filter_map(|&gyro| unlike_noise(gyro, misfits, streams.rate_hz)),
            )
            .collect(),
        locations: locations
            .iter()
            .map(|one| location_entry(one, streams))
            .collect(),
        effects,
        fit: FitEntry {
            fitted_on: fitted_rows.iter().map(span).collect(),
            held_out: test_rows.iter().map(span).collect(),
            recordings: Vec::new(),
            whole: None,
            channels: validations.iter().map(channel).collect(),
        },
        not_excluded: not_excluded(found, streams),
        next_experiment: next_experiment(&findings),
        registration: Vec::new(),
        promises: Vec::new(),
        noise: (0..3)
            .map(|axis| NoiseEntry {
                channel: format!("gyro_{}", AXES[axis]),
                angle_random_walk_rad_sqrt_s: noise[axis].angle_random_walk_rad_sqrt_s(),
                angle_noise_rad: noise[axis].angle_noise_rad(),
                wandering_rad_s: (fit.drift[axis] != Drift::None)
                    .then(|| noise[axis].wander_rad_s(streams.span_s())),
                terms: None,
            })
            .collect(),
        accelerometer_noise: Vec::new(),
        trials: found.tried,
        runners_up: runners_up(found),
        sensitivity: Vec::new(),
        control: None,
        self_test: None,
    };
    let mut model = data.model.clone();
    let signals = &found.motion.signals;
    let of_findings = findings
        .iter()
        .map(|one| effect_of(one, fit, streams, signals));
    let of_faults = faults.iter().map(|fault| fault_effect(fault, streams));
    let added: Vec<ModelEffect> = of_findings
        .chain(noise_found.iter().map(noise_effect))
        .chain(of_faults)
        .collect();
    for effect in &added {
        switch_on(&mut model, effect.clone());
    }
    let pictures = pictures::draw(
        streams,
        before_rad,
        after_rad,
        &noise,
        (tiles_before, tiles_after),
        &test_rows,
    );
    let outcome = Outcome {
        diagnosis,
        model,
        pictures: Some(pictures),
    };
    (outcome, added)
}

/// Whether a step or a slip stands in any row, confirming and tested ones included: those are too late for a name, but
/// the residual is then not the noise that was fitted.
fn has_event(data: &Data, fit: &Fit, after_rad: &Triad, plan: &AnalysisPlan) -> bool {
    let Some(observations) = data.observed(&data.rows_of(&[Use::Train, Use::Confirm, Use::Test]))
    else {
        return false;
    };
    let (transform, basis) = Transform::with_basis(observations, mean(&fit.levels));
    (0..3).any(|gyro| {
        let spectrum = transform.spectrum(&after_rad[gyro]);
        let events = scan(&transform, &basis, &spectrum, fit.levels[gyro]);
        events.iter().any(|event| {
            let places = 3.0 * data.streams.rows as f64;
            let chance = 2.0 * places * Normal::standard().sf(event.size.abs());
            chance < plan.unexplained && !data.lattice.hides_event(gyro, event)
        })
    })
}

fn findings<'a>(
    (data, found): (&Data, &'a Found),
    confirmed: &'a Confirmed,
    regimes: &[Regime],
    plan: &AnalysisPlan,
) -> Vec<Finding<'a>> {
    let Final { fit, left_rad, .. } = &confirmed.last;
    let whitener = Whitener::new(data, &fit.levels).filter(|_| !confirmed.named.is_empty());
    let left_sigma = whitener
        .as_ref()
        .map(|whitener| each_axis(|gyro| whitener.rows(gyro, &left_rad[gyro])));
    let of_place = |place: usize| {
        let effect_rad = effect_rad(found, fit, place);
        let mut one = finding((data, found), confirmed, (place, &effect_rad), plan);
        if let (Some(whitener), Some(left_sigma)) = (&whitener, &left_sigma) {
            one.regimes = by_regime::sizes(whitener, &effect_rad, left_sigma, regimes);
        }
        one
    };
    (0..confirmed.named.len()).map(of_place).collect()
}

fn finding<'a>(
    (data, found): (&Data, &'a Found),
    confirmed: &'a Confirmed,
    (place, effect_rad): (usize, &Triad),
    plan: &AnalysisPlan,
) -> Finding<'a> {
    let member = confirmed.named[place];
    let fit = &confirmed.last.fit;
    let judged = &found.judged[member];
    let candidate = &found.candidates[fit.members[place]];
    let alike: BTreeSet<&str> = judged
        .rivals
        .iter()
        .map(|(rival, _)| *rival)
        .chain(found.spanned_by[member].iter().copied())
        .chain([judged.hypothesis])
        .map(|rival| found.candidates[rival].kind)
        .filter(|kind| *kind != candidate.kind)
        .collect();
    let share = share(data, found, &confirmed.last, effect_rad);
    Finding {
        candidate,
        recording: confirmed.recordings[place].as_deref(),
        block: fit.blocks[place].clone(),
        // Without its fixed part the numbers of a resonance or a threshold are none: it counts by what it gains.
        squared_size: if candidate.hypothesis.fixed.is_empty() {
            fit.squared_sizes[place]
        } else {
            let without = &found.without[member];
            2.0 * (found.fit.log_likelihood - without.log_likelihood).max(0.0)
        },
        rank: fit.ranks[place],
        told: confirmed.last.told[place],
        alike: alike.into_iter().map(str::to_string).collect(),
        or_drift: judged.cost_against_drift < plan.drift_within,
        cost_without: judged.cost_without,
        confirmed_gain: confirmed.predictions[member].gain,
        reenactment: confirmed.reenactments[place],
        instant_std_rows: confirmed.instant_std_rows[place],
        share,
        is_slight: share < plan.practical_share && !turns(effect_rad, &fit.levels),
        regimes: Vec::new(),
    }
}

/// What is said of a kind.
fn card(kind: &str) -> Card {
    entries::card(kind).expect("a candidate is of the catalogue")
}

/// A parameter of a finding.
struct Number {
    name: String,
    value: f64,
    unit: &'static str,
}

/// A sentence on the gyros of which a number is not told; empty where it is told of all.
fn of_the_others(told: [bool; 3]) -> String {
    let others = (0..3).filter(|&axis| !told[axis]).map(|axis| AXES[axis]);
    let others: Vec<&str> = others.collect();
    match others[..] {
        [] => String::new(),
        [one] => format!(" Gyro {one} moves too little to show whether it does so, too."),
        _ => format!(
            " Gyros {} move too little to show whether they do so, too.",
            others.join(" and ")
        ),
    }
}

/// The parameters of a finding with their covariance.
fn numbers(one: &Finding, fit: &Fit) -> (Vec<Number>, DMatrix<f64>) {
    let at = one.block.start;
    let unit = |name: &str| {
        if name.ends_with("frequency_hz") {
            "Hz"
        } else if name.ends_with("pole_s") {
            "s"
        } else if name.ends_with("damping") {
            "1"
        } else {
            card(one.candidate.kind).unit
        }
    };
    let kind = one.candidate.kind;
    let stated = |k: usize| entries::value_of(kind, one.candidate.base[k] + fit.estimate[at + k]);
    // One value that all gyros share stands on each of them that shows it.
    let shared = (one.candidate.variant == Variant::Common
        && matches!(
            entries::find(kind).map(|entry| entry.law),
            Some(Law::Axes(_))
        ))
    .then(|| {
        (0..3)
            .filter(|&axis| one.told[axis])
            .map(|axis| (AXES[axis].to_string(), 0))
    });
    let names: Vec<(String, usize)> = match shared {
        Some(shared) => shared.collect(),
        None => one.candidate.names.iter().cloned().zip(0..).collect(),
    };
    let covariance = DMatrix::from_fn(names.len(), names.len(), |a, b| {
        let (a, b) = (names[a].1, names[b].1);
        fit.covariance[(at + a, at + b)] * stated(a).1 * stated(b).1
    });
    let numbers = names.into_iter().map(|(name, k)| Number {
        value: stated(k).0,
        unit: unit(&name),
        name,
    });
    (numbers.collect(), covariance)
}

fn entry(one: &Finding, fit: &Fit, (streams, signals): (&Streams, &Signals)) -> EffectEntry {
    let card = card(one.candidate.kind);
    let (numbers, of_numbers) = numbers(one, fit);
    let std = |k: usize| of_numbers[(k, k)].max(0.0).sqrt();
    let mut parameters: Vec<ParameterEntry> = numbers
        .iter()
        .enumerate()
        .map(|(k, number)| ParameterEntry::Number {
            name: number.name.clone(),
            value: number.value,
            std: std(k),
            unit: number.unit.to_string(),
        })
        .collect();
    let mut covariance: Vec<Vec<f64>> = (0..numbers.len())
        .map(|a| (0..numbers.len()).map(|b| of_numbers[(a, b)]).collect())
        .collect();
    let text = |name: &str, value: &str| ParameterEntry::Text {
        name: name.to_string(),
        value: value.to_string(),
    };
    let mut what_was_left_out = card.meaning.to_string();
    let mut shown = None;
    if let Variant::Harmonic { axis, order } = one.candidate.variant {
        parameters.push(text("axis", AXES[axis]));
        parameters.push(ParameterEntry::Number {
            name: "order".to_string(),
            value: f64::from(order),
            std: 0.0,
            unit: "1".to_string(),
        });
        covariance.iter_mut().for_each(|row| row.push(0.0));
        covariance.push(vec![0.0; numbers.len() + 1]);
    }
    if let Variant::Expression { axis, expression } = one.candidate.variant {
        let expression = expression.text(signals);
        parameters.push(text("axis", AXES[axis]));
        parameters.push(text("expression", &expression));
        what_was_left_out = followed(AXES[axis], &expression);
        shown = Some(expression);
    }
    if let Variant::Event { axis, row } = one.candidate.variant {
        parameters.push(text("axis", AXES[axis]));
        let std = event_std_s(one, streams);
        parameters.push(ParameterEntry::Number {
            name: "time_s".to_string(),
            value: event_time_s(one.candidate.kind, row, streams),
            std,
            unit: "s".to_string(),
        });
        covariance = vec![vec![covariance[0][0], 0.0], vec![0.0, std * std]];
    }
    parameters.extend(one.recording.map(|name| text("recording", name)));
    let mut alike = one.alike.clone();
    if one.or_drift {
        alike.push(DRIFT.to_string());
    }
    let label = if alike.is_empty() { "named" } else { "class" };
    if one.or_drift {
        what_was_left_out.push_str(
            " A drifting gyro explains it as well: a longer record, or a second cycle of what drives it, would decide.",
        );
    }
    what_was_left_out.push_str(&of_the_others(one.told));
    let tail = ChiSquared::new(one.rank.max(1) as f64).map_or(1.0, |law| law.sf(one.squared_size));
    EffectEntry {
        kind: one.candidate.kind.to_string(),
        indistinguishable_from: alike,
        gravity_speaks_against: Vec::new(),
        equation: card.equation.to_string(),
        parameters,
        covariance,
        identifiable: fixed(one, fit),
        log_evidence_gain: one.cost_without,
        p_value: (tail * one.candidate.hypothesis.price.exp().max(1.0)).min(1.0),
        what_was_left_out,
        expression: shown,
        regimes: one.regimes.clone(),
        evidence: Some(EvidenceEntry {
            label,
            confirmed_gain: one.confirmed_gain,
            share: one.share,
            reenactments: one.reenactment.draws,
            inflation: one.reenactment.inflation(),
        }),
    }
}

/// What a gyro that follows an expression lacks.
fn followed(axis: &str, expression: &str) -> String {
    if expression == format!("time*alpha_{axis}") {
        format!(
            "The reference is late against gyro {axis} by a time that grows, by the coefficient in seconds a second: their clocks, or the rates of their tables, part by that share."
        )
    } else {
        format!(
            "Gyro {axis} follows {expression}, which is no effect of the catalogue: an expression in measured channels, found by search."
        )
    }
}

/// What stands in a class for a gyro that drifts.
pub const DRIFT: &str = "rate_random_walk";

fn event_time_s(kind: &str, row: usize, streams: &Streams) -> f64 {
    if kind == STEP {
        streams.begin_s(row)
    } else {
        streams.middle_s(row)
    }
}

/// A slip is known to its row.
fn event_std_s(one: &Finding, streams: &Streams) -> f64 {
    one.instant_std_rows.unwrap_or(0.5) / streams.rate_hz
}

fn fixed(one: &Finding, fit: &Fit) -> Vec<Identifiable> {
    let (numbers, covariance) = numbers(one, fit);
    let names: Vec<String> = numbers.iter().map(|number| number.name.clone()).collect();
    let values: Vec<f64> = numbers.iter().map(|number| number.value).collect();
    identifiable(&names, &values, &|a, b| covariance[(a, b)])
}

fn effect_of(one: &Finding, fit: &Fit, streams: &Streams, signals: &Signals) -> ModelEffect {
    let (numbers, _) = numbers(one, fit);
    let mut parameters: BTreeMap<String, EffectValue> = numbers
        .into_iter()
        .map(|number| (number.name, EffectValue::Number(number.value)))
        .collect();
    let text = |value: &str| EffectValue::Text(value.to_string());
    match one.candidate.variant {
        Variant::Harmonic { axis, order } => {
            parameters.insert("axis".to_string(), text(AXES[axis]));
            let order = EffectValue::Number(f64::from(order));
            parameters.insert("order".to_string(), order);
        }
        Variant::Expression { axis, expression } => {
            parameters.insert("axis".to_string(), text(AXES[axis]));
            parameters.insert("expression".to_string(), text(&expression.text(signals)));
        }
        Variant::Event { axis, row } => {
            let time_s = event_time_s(one.candidate.kind, row, streams);
            parameters.insert("axis".to_string(), text(AXES[axis]));
            parameters.insert("time_s".to_string(), EffectValue::Number(time_s));
        }
        _ => {}
    }
    if let Some(name) = one.recording {
        parameters.insert("recording".to_string(), text(name));
    }
    ModelEffect {
        kind: one.candidate.kind.to_string(),
        parameters,
    }
}

fn noise_effect(excess: &Excess) -> ModelEffect {
    let values = AXES.iter().zip(excess.values);
    ModelEffect {
        kind: excess.kind.to_string(),
        parameters: values
            .map(|(axis, value)| ((*axis).to_string(), EffectValue::Number(value)))
            .collect(),
    }
}

fn fault_effect(fault: &Fault, streams: &Streams) -> ModelEffect {
    let [start_s, end_s] = streams.span_of(&fault.rows);
    ModelEffect {
        kind: fault.kind.to_string(),
        parameters: BTreeMap::from([
            (
                "channel".to_string(),
                EffectValue::Text(fault.channel.clone()),
            ),
            ("start_s".to_string(), EffectValue::Number(start_s)),
            ("end_s".to_string(), EffectValue::Number(end_s)),
        ]),
    }
}

/// Every location follows the finding that acts on its gyro with the largest size.
fn name_regimes(locations: &mut [Location], findings: &[Finding]) {
    for location in locations {
        let acts = |one: &&Finding| {
            let mut terms = one.candidate.hypothesis.terms.iter();
            terms.any(|term| term.record == location.axis)
        };
        let strongest = findings
            .iter()
            .filter(acts)
            .max_by(|a, b| a.squared_size.total_cmp(&b.squared_size));
        if let Some(one) = strongest {
            location.regime = format!("follows {}", card(one.candidate.kind).equation);
        }
    }
}

pub(crate) fn location_entry(location: &Location, streams: &Streams) -> LocationEntry {
    let [start_s, end_s] = streams.span_of(&location.rows);
    LocationEntry {
        channel: format!("gyro_{}", AXES[location.axis]),
        recording: None,
        start_s,
        end_s,
        low_hz: location.band_hz.0,
        high_hz: location.band_hz.1,
        regime: location.regime.clone(),
        size: location.size_rad_s,
        unit: "rad/s".to_string(),
        p_value: location.p_value,
        coherent_with: Vec::new(),
    }
}

/// Share of the residual's power that an effect explains beside the others, on the rows that were fitted.
fn share(data: &Data, found: &Found, last: &Final, effect_rad: &Triad) -> f64 {
    let rows = data.ranges_of(&[Use::Train, Use::Confirm]);
    let sum = |of: &dyn Fn(usize, usize) -> f64| -> f64 {
        let rows = rows.iter().cloned().flatten();
        rows.map(|row| (0..3).map(|gyro| of(gyro, row)).sum::<f64>())
            .sum()
    };
    let power = sum(&|gyro, row| found.residual_rad[gyro][row].powi(2));
    let explained = sum(&|gyro, row| {
        let effect = effect_rad[gyro][row];
        effect * (effect + 2.0 * last.left_rad[gyro][row])
    });
    (explained / power.max(f64::MIN_POSITIVE)).max(0.0)
}

/// Whether an effect turns a gyro over the record further than its noise does: 1 σ.
fn turns(effect_rad: &Triad, levels: &[NoiseLevels]) -> bool {
    effect_rad.iter().zip(levels).any(|(effect, levels)| {
        let turned: f64 = effect.iter().sum();
        turned.abs() > (levels.white * effect.len() as f64).sqrt()
    })
}

fn summary(
    verdict: Verdict,
    findings: &[Finding],
    confirmed: &Confirmed,
    found: &Found,
) -> Vec<String> {
    let fit = &confirmed.last.fit;
    let kind_of = |place: usize| found.candidates[found.judged[place].hypothesis].kind;
    let mut lines = vec![rlg_findings::sentences::opening(verdict).to_string()];
    // What is of practical size first; what is not is quantified all the same.
    let mut ordered: Vec<&Finding> = findings.iter().collect();
    ordered.sort_by(|a, b| {
        (a.is_slight, b.share)
            .partial_cmp(&(b.is_slight, a.share))
            .unwrap_or(Ordering::Equal)
    });
    for one in ordered {
        let (numbers, covariance) = numbers(one, fit);
        let numbers: Vec<String> = numbers
            .iter()
            .enumerate()
            .map(|(k, number)| {
                let std = covariance[(k, k)].max(0.0).sqrt();
                let unit = match number.unit {
                    "1" => String::new(),
                    unit => format!(" {unit}"),
                };
                format!("{} {:.3e} ± {std:.1e}{unit}", number.name, number.value)
            })
            .collect();
        let kind = match one.candidate.variant {
            Variant::Expression { axis, expression } => format!(
                "gyro {} follows {}, which no effect of the catalogue does",
                AXES[axis],
                expression.text(&found.motion.signals)
            ),
            _ => one.candidate.kind.to_string(),
        };
        let alike = match (one.alike.is_empty(), one.or_drift) {
            (true, false) => String::new(),
            (true, true) => ", or drift".to_string(),
            (false, false) => format!(", or {}", one.alike.join(" or ")),
            (false, true) => format!(", or {} or drift", one.alike.join(" or ")),
        };
        let size = if one.is_slight {
            format!(
                "; {:.1e} of the residual's power, and no gyro turns further by it than by its noise",
                one.share
            )
        } else {
            String::new()
        };
        let place = one.recording.map(|name| format!(" in {name}"));
        lines.push(format!(
            "Found{}: {kind}{alike}: {}; gains {:.1} in log score in blocks of rows that the others predict{size}.",
            place.unwrap_or_default(),
            numbers.join(", "),
            one.confirmed_gain
        ));
    }
    for &place in &confirmed.unconfirmed {
        lines.push(format!(
            "Not named: {}: it does not hold in every stretch of the rows.",
            kind_of(place)
        ));
    }
    let fallen = confirmed.reenacted_away.iter();
    let fallen = fallen.map(|&place| kind_of(place));
    for kind in confirmed.shown_anyway.iter().copied().chain(fallen) {
        lines.push(format!(
            "Not named: {kind}: the recording re-enacted without it shows as much of it."
        ));
    }
    for &place in &confirmed.impossible {
        lines.push(format!(
            "Not named: {}: its size would be one that no unit can have.",
            kind_of(place)
        ));
    }
    let drifting: Vec<&str> = (0..3)
        .filter(|&axis| fit.drift[axis] != Drift::None)
        .map(|axis| AXES[axis])
        .collect();
    if !drifting.is_empty() {
        lines.push(format!(
            "Drift: gyro {} beyond white noise.",
            drifting.join(", ")
        ));
    }
    lines
}

/// Where what is left of a gyro is most beyond its noise, or below it.
pub(crate) fn unlike_noise(gyro: usize, misfits: &[Misfit], rate_hz: f64) -> Option<String> {
    let of_gyro = misfits.iter().filter(|one| one.gyro == gyro);
    let most = of_gyro.max_by(|a, b| a.ratio.total_cmp(&b.ratio))?;
    let [from, to] = most.band.map(|share| share * rate_hz);
    Some(format!(
        "Not explained: what is left of gyro {} is not like its noise; between {from:.2} and {to:.2} Hz it has {:.2} times the power that fits the rest.",
        AXES[gyro], most.ratio
    ))
}

/// The channel without which a kind cannot show, if the recording lacks it.
pub fn no_channel(kind: &str, streams: &Streams) -> Option<&'static str> {
    if kind.contains("temperature") && streams.temperature_k.is_none() {
        Some("no temperature channel")
    } else if kind.contains("magnetic") && streams.magnetic_t.is_none() {
        Some("no magnetic field channel")
    } else if kind.starts_with("dither") && streams.pickoff_rad.is_none() {
        Some("no dither")
    } else if (kind.contains("force") || kind.contains("_g")) && streams.force_m_s2.is_none() {
        Some("no specific force channel")
    } else {
        None
    }
}

/// Kinds of the catalogue that had no candidate, with the reason.
fn not_excluded(found: &Found, streams: &Streams) -> Vec<String> {
    let tried: BTreeSet<&str> = found.candidates.iter().map(|one| one.kind).collect();
    let reason = |kind: &str| {
        let unseen = match streams.at_rest {
            Some(_) => "needs motion, and the unit stood still",
            None => "the motion does not stand out of the reference's noise",
        };
        no_channel(kind, streams).unwrap_or(unseen)
    };
    entries::CATALOGUE
        .iter()
        .filter(|entry| !tried.contains(entry.kind))
        .map(|entry| format!("{}: {}", entry.kind, reason(entry.kind)))
        .collect()
}

fn next_experiment(findings: &[Finding]) -> String {
    let confused = findings
        .iter()
        .find(|one| !one.alike.is_empty() || one.or_drift);
    match confused.or(findings.first()) {
        Some(one) => card(one.candidate.kind).experiment.to_string(),
        None => "None needed for this recording; a motion that excites what is not excluded would show more.".to_string(),
    }
}

fn runners_up(found: &Found) -> Vec<RunnerUp> {
    let mut nearest: BTreeMap<&str, f64> = BTreeMap::new();
    for judged in &found.judged {
        for (rival, behind) in &judged.rivals {
            let kind = found.candidates[*rival].kind;
            let entry = nearest.entry(kind).or_insert(*behind);
            *entry = entry.min(*behind);
        }
    }
    nearest
        .into_iter()
        .map(|(kind, behind)| RunnerUp {
            kind: kind.to_string(),
            behind,
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::card;

    #[test]
    fn every_kind_of_the_catalogue_has_its_sentences() {
        let listed = rlg_catalogue::CATALOGUE.iter().map(|entry| entry.kind);
        let scanned = rlg_catalogue::entries::SCANNED.iter().map(|card| card.kind);
        for kind in listed.chain(scanned) {
            let card = card(kind);
            let texts = [card.equation, card.unit, card.meaning, card.experiment];
            assert!(texts.iter().all(|text| !text.is_empty()));
        }
    }
}
