//! Registration of two instruments of rate, and nothing else: its kinds, and the values of kinds without evidence in a
//! recording.

use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::Variant;
use rlg_catalogue::entries::{CATALOGUE, SCANNED, card, value_of};
use rlg_findings::result::{EffectEntry, ParameterEntry, RegistrationEntry};
use rlg_inference::{Hypothesis, Search};
use rlg_plan::Plan;

use crate::rows::data::Data;
use crate::rows::noise_levels::drift_prior;
use crate::search::structure::Found;

/// Kinds of the registration; the first stand for their equivalents at the end.
pub const KINDS: [&str; 9] = [
    "gyro_bias",
    "gyro_scale",
    "installation",
    "reference_misalignment",
    "reference_delay",
    "gyro_bandwidth",
    "reference_scale",
    "gyro_delay",
    "reference_bandwidth",
];

/// Number of kinds stated without evidence; the others are the same against the other instrument.
const STATED: usize = 6;

/// Kinds of the catalogue that are no registration.
pub fn physics() -> Vec<&'static str> {
    let listed = CATALOGUE.iter().map(|entry| entry.kind);
    let scanned = SCANNED.iter().map(|card| card.kind);
    let all = listed.chain(scanned);
    all.filter(|kind| !KINDS.contains(kind)).collect()
}

/// Estimates each kind outside the found set, jointly with the set.
///
/// # Inputs
/// `found`: with its equations.
pub fn beside(data: &Data, found: &Found, plan: &Plan) -> Vec<RegistrationEntry> {
    let hypotheses: Vec<Hypothesis> = found
        .candidates
        .iter()
        .map(|one| one.hypothesis.clone())
        .collect();
    let drift = drift_prior(&data.model.gyro);
    let levels = found.fit.levels.clone();
    let mut search = Search::new(
        &found.equations,
        &hypotheses,
        KINDS.len(),
        &plan.inference.search,
        &drift,
        levels,
    );
    let is_in_set = |kind: &str| {
        let mut members = found.fit.members.iter();
        members.any(|&place| found.candidates[place].kind == kind)
    };
    let is_whole = |one: &Candidate| one.variant == Variant::Whole;
    let stated = KINDS[..STATED].iter().filter(|kind| !is_in_set(kind));
    stated
        .filter_map(|kind| {
            let mut all = found.candidates.iter();
            let place = all
                .clone()
                .position(|one| one.kind == *kind && is_whole(one))
                .or_else(|| all.position(|one| one.kind == *kind))?;
            let candidate = &found.candidates[place];
            let set = [&found.fit.members[..], &[place]].concat();
            let fit = search.fit(&set, None);
            let member = fit.members.iter().position(|&member| member == place)?;
            let at = fit.blocks[member].start;
            let unit = card(kind).map_or("1", |card| card.unit);
            let numbers = candidate.names.iter().zip(&candidate.base).enumerate();
            let number = |(k, (name, base)): (usize, (&String, &f64))| {
                let (value, slope) = value_of(kind, base + fit.estimate[at + k]);
                let std = slope.abs() * fit.covariance[(at + k, at + k)].max(0.0).sqrt();
                ParameterEntry::number(name, value, std, unit)
            };
            Some(RegistrationEntry {
                kind: (*kind).to_string(),
                parameters: numbers.map(number).collect(),
                supported: false,
            })
        })
        .collect()
}

/// Registration: the found kinds, and those of `beside` that are distinguishable from every found one.
pub fn entries(effects: &[EffectEntry], beside: Vec<RegistrationEntry>) -> Vec<RegistrationEntry> {
    let is_found = |kind: &str| {
        effects.iter().any(|effect| {
            let mut alike = effect.indistinguishable_from.iter();
            effect.kind == kind || alike.any(|other| other == kind)
        })
    };
    let found = effects
        .iter()
        .filter(|effect| KINDS.contains(&effect.kind.as_str()));
    let mut all: Vec<RegistrationEntry> = found
        .map(|effect| RegistrationEntry {
            kind: effect.kind.clone(),
            parameters: effect.parameters.clone(),
            supported: true,
        })
        .collect();
    all.extend(beside.into_iter().filter(|one| !is_found(&one.kind)));
    all
}
