//! One trial with what was concealed and what was found, and when a name or a size is asked for.

use serde::{Deserialize, Serialize};

use super::answer::Answer;
use super::chance::detection;
use super::examine::{Finding, Outcome};
use super::trial::Family;

/// Strength from which on a name is required.
pub const NAMEABLE: f64 = 8.0;

/// Separation from the nearest rival from which on a name is required.
pub const SEPARATE: f64 = 6.0;

/// Strength from which on errors are compared with the bound.
pub const STRONG: f64 = 10.0;

/// Chance of a false name per recording over all kinds that theory grants: with it a six-parameter effect among a dozen
/// shows at a matched-filter SNR of 6 in 87 % of recordings, and at 7 in 98 % (diagnosis.md, marks).
const CATALOGUE_SIGNIFICANCE: f64 = 1e-3;

/// The plan of a challenge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Seed of everything.
    pub seed: u64,
    /// Trials in all, over all shards.
    pub trials: u64,
    /// Families, gone through again and again.
    pub families: Vec<Family>,
    /// Whether the true kinds were taken out of the tool's catalogue.
    pub leave_one_out: bool,
}

/// One trial: what was concealed, and what was diagnosed.
#[derive(Clone, Copy)]
pub struct Case<'a> {
    /// What was concealed.
    pub answer: &'a Answer,
    /// What was diagnosed.
    pub outcome: &'a Outcome,
}

impl Case<'_> {
    /// Whether the tool said that something is left out.
    pub fn is_detected(&self) -> bool {
        self.outcome.findings.iter().any(|one| !one.is_fault())
    }

    /// Findings with a name.
    pub fn claims(&self) -> impl Iterator<Item = &Finding> {
        self.outcome
            .findings
            .iter()
            .filter(|one| !one.is_fault() && one.kind != "unlisted")
    }

    /// Claims that are not true.
    pub fn wrong(&self) -> impl Iterator<Item = &Finding> {
        self.claims().filter(|one| {
            // A reading that jumps and comes back is two slips, and was put there.
            let glitch = self.answer.glitches && one.kind == "counter_slip";
            !glitch
                && !self
                    .answer
                    .effects
                    .iter()
                    .any(|effect| one.covers(&effect.kind))
        })
    }

    /// On an effect-free record: anything that is said to be physics, an expression too.
    pub fn is_false(&self) -> bool {
        let expressed = |one: &Finding| one.kind == "unlisted" && one.expression.is_some();
        self.wrong().next().is_some() || self.outcome.findings.iter().any(expressed)
    }

    /// Whether every concealed kind is claimed and nothing else.
    pub fn is_named(&self) -> bool {
        let claimed = |kind: &str| self.claims().any(|one| one.covers(kind));
        !self.answer.effects.is_empty()
            && self
                .answer
                .effects
                .iter()
                .all(|effect| claimed(&effect.kind))
            && self.wrong().next().is_none()
    }

    /// Whether a name is required: strong enough, and far enough from every rival.
    pub fn is_nameable(&self) -> bool {
        let effects = &self.answer.effects;
        !effects.is_empty()
            && effects
                .iter()
                .all(|effect| effect.rho_beside >= NAMEABLE && effect.separation >= SEPARATE)
    }

    /// (estimate − truth) over the tool's own spread and over the bound, for every parameter that the data fix of
    /// every effect whose very kind was found.
    pub fn deviations(&self) -> Vec<[f64; 2]> {
        let mut list = Vec::new();
        for effect in &self.answer.effects {
            let Some(found) = self
                .outcome
                .findings
                .iter()
                .find(|one| one.kind == effect.kind)
            else {
                continue;
            };
            let truth = effect.numbers();
            for (name, bound) in &effect.bound {
                let (Some(at), Some(truth)) = (found.parameters.get(name), truth.get(name)) else {
                    continue;
                };
                let error = at.value - truth;
                list.push([error / at.std, error / bound]);
            }
        }
        list
    }

    /// Chance that a trial of this strength is detected, by theory \[1\].
    pub fn theory(&self) -> f64 {
        let significance = CATALOGUE_SIGNIFICANCE / self.answer.kinds.max(1) as f64;
        let degrees = self
            .answer
            .effects
            .iter()
            .map(|effect| effect.degrees)
            .sum();
        detection(self.answer.rho, degrees, significance)
    }
}

/// Whether the tool gave no verdict at all.
pub fn unread(outcome: &Outcome) -> bool {
    !["matches", "explained", "partly_explained", "unexplained"].contains(&outcome.verdict.as_str())
}

/// The deviations of one parameter of each named trial.
pub fn one_deviation(cases: &[Case]) -> Vec<[f64; 2]> {
    cases
        .iter()
        .filter(|case| case.is_named())
        .filter_map(|case| {
            let all = case.deviations();
            let place = case.answer.noise_seed as usize % all.len().max(1);
            all.get(place).copied()
        })
        .collect()
}
