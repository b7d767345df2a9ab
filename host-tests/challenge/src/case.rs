//! Trial with its concealed and its diagnosed effects, and the conditions under which a name or a size is required.

use serde::{Deserialize, Serialize};

use super::answer::Answer;
use super::chance::detection;
use super::examine::{Finding, Outcome};
use super::trial::Family;

/// Least strength for a required name.
pub const NAMEABLE: f64 = 8.0;

/// Least separation from the nearest rival for a required name.
pub const SEPARATE: f64 = 6.0;

/// Least strength for a comparison of errors with the bound.
pub const STRONG: f64 = 10.0;

/// False-alarm probability per recording over all kinds, in theory: with it a six-parameter effect among a dozen is
/// detected at a matched-filter SNR of 6 in 87 % of recordings, and at 7 in 98 % (diagnosis.md, marks).
const CATALOGUE_SIGNIFICANCE: f64 = 1e-3;

/// Plan of a challenge.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Seed of all draws.
    pub seed: u64,
    /// Number of trials over all shards.
    pub trials: u64,
    /// Families, repeated in turn.
    pub families: Vec<Family>,
    /// The true kinds are taken out of the tool's catalogue.
    pub leave_one_out: bool,
}

/// Trial: truth and diagnosis.
#[derive(Clone, Copy)]
pub struct Case<'a> {
    /// Truth.
    pub answer: &'a Answer,
    /// Diagnosis.
    pub outcome: &'a Outcome,
}

impl Case<'_> {
    /// True if the tool reports any effect outside the model.
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

    /// Claims that are false.
    pub fn wrong(&self) -> impl Iterator<Item = &Finding> {
        self.claims().filter(|one| {
            // A sample that jumps and returns is two slips, injected on purpose.
            let glitch = self.answer.glitches && one.kind == "counter_slip";
            !glitch
                && !self
                    .answer
                    .effects
                    .iter()
                    .any(|effect| one.covers(&effect.kind))
        })
    }

    /// On an effect-free record: true for any reported physics, an expression too.
    pub fn is_false(&self) -> bool {
        let expressed = |one: &Finding| one.kind == "unlisted" && one.expression.is_some();
        self.wrong().next().is_some() || self.outcome.findings.iter().any(expressed)
    }

    /// True if every concealed kind is claimed and nothing else.
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

    /// True if a name is required: strong enough, and separate enough from every rival.
    pub fn is_nameable(&self) -> bool {
        let effects = &self.answer.effects;
        !effects.is_empty()
            && effects
                .iter()
                .all(|effect| effect.rho_beside >= NAMEABLE && effect.separation >= SEPARATE)
    }

    /// (estimate − truth) over the tool's standard deviation and over the bound, for every identifiable parameter of every
    /// effect with its kind found.
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

    /// Theoretical detection probability of a trial of this strength \[1\].
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

/// True if the tool gave no verdict.
pub fn unread(outcome: &Outcome) -> bool {
    !["matches", "explained", "partly_explained", "unexplained"].contains(&outcome.verdict.as_str())
}

/// Deviations of one parameter of each named trial.
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
