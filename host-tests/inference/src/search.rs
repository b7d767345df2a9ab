//! Search for the set of hypotheses of largest log posterior by stepwise selection.

use rlg_plan::SearchPlan;
use std::collections::BTreeMap;
use std::ops::Range;

use rayon::prelude::*;

use crate::assembled::Assembled;
use crate::evaluate::{Drift, Effort, Fit, evaluate_assembled};
use crate::hypothesis::Hypothesis;
use crate::likelihood::Likelihood;
use crate::noise::NoiseLevels;
use crate::normal_equations::NormalEquations;
use crate::stepwise::{Stepwise, stepwise};

/// Prior knowledge of drift.
#[derive(Debug, Clone, PartialEq)]
pub enum DriftPrior {
    /// Possible on every record, at the plan's prices.
    Unknown,
    /// Declared by the model, record by record.
    Declared(Vec<Drift>),
}

/// A search over `hypotheses`, which may grow.
pub struct Search<'a, L = NormalEquations> {
    /// Sums of columns and records.
    pub data: &'a L,
    /// Candidates.
    pub hypotheses: &'a [Hypothesis],
    /// Number of kinds over which the prior is spread.
    pub kinds: usize,
    /// Prices.
    pub plan: &'a SearchPlan,
    /// Prior of drift.
    pub drift: &'a DriftPrior,
    /// Fits so far, by members.
    seen: BTreeMap<Vec<usize>, Fit>,
    start: Vec<NoiseLevels>,
    tried: usize,
}

impl<'a, L: Likelihood> Search<'a, L> {
    /// Starts a search, the noise from `start`.
    pub fn new(
        data: &'a L,
        hypotheses: &'a [Hypothesis],
        kinds: usize,
        plan: &'a SearchPlan,
        drift: &'a DriftPrior,
        start: Vec<NoiseLevels>,
    ) -> Self {
        Self {
            data,
            hypotheses,
            kinds,
            plan,
            drift,
            seen: BTreeMap::new(),
            start,
            tried: 0,
        }
    }

    /// Takes over fits of an earlier search, whose hypotheses were the first of these.
    pub fn with_seen(mut self, (seen, tried): (BTreeMap<Vec<usize>, Fit>, usize)) -> Self {
        self.seen = seen;
        self.tried = tried;
        self
    }

    /// All fits, and the number of evaluated sets.
    pub fn into_seen(self) -> (BTreeMap<Vec<usize>, Fit>, usize) {
        (self.seen, self.tried)
    }

    /// Number of evaluated sets.
    pub fn tried_sets(&self) -> usize {
        self.tried
    }

    pub(crate) fn members(&self, key: &[usize]) -> Vec<&'a Hypothesis> {
        key.iter().map(|&place| &self.hypotheses[place]).collect()
    }

    /// Members of a set without one, and without those that require it.
    pub fn without(&self, members: &[usize], member: usize) -> Vec<usize> {
        let stays =
            |place: &usize| *place != member && self.hypotheses[*place].requires != Some(member);
        members.iter().copied().filter(stays).collect()
    }

    /// ln prior of a set.
    pub(crate) fn log_prior(&self, key: &[usize]) -> f64 {
        let each = (self.plan.expected_effects / self.kinds as f64).ln();
        let of_member = |place: &usize| {
            let one = &self.hypotheses[*place];
            if one.requires.is_some_and(|other| !key.contains(&other)) {
                return f64::NEG_INFINITY;
            }
            each - one.price
        };
        key.iter().map(of_member).sum()
    }

    /// Price of drift.
    fn drift_price(&self, drift: &[Drift]) -> f64 {
        if matches!(self.drift, DriftPrior::Declared(_)) {
            return 0.0;
        }
        let of_sisters = |records: Range<usize>| {
            let drift = &drift[records];
            let on = drift.iter().filter(|drift| **drift != Drift::None).count();
            let odd = on.min(drift.len() - on);
            let any = if on > 0 { self.plan.drift_any } else { 0.0 };
            self.plan.drift_term * on as f64 + any + self.plan.drift_odd * odd as f64
        };
        self.data.sisters().into_iter().map(of_sisters).sum()
    }

    /// Fits a set to convergence, drift selected; from `levels` where they are given.
    pub fn fit(&mut self, key: &[usize], levels: Option<&[NoiseLevels]>) -> Fit {
        let mut key = key.to_vec();
        key.sort_unstable();
        if let Some(seen) = self.seen.get(&key) {
            return seen.clone();
        }
        let fit = self.fit_set(&key, levels.unwrap_or(&self.start));
        self.tried += 1;
        self.seen.insert(key, fit.clone());
        fit
    }

    /// Fits several sets in parallel.
    pub fn fit_all(&mut self, keys: Vec<Vec<usize>>, levels: &[NoiseLevels]) -> Vec<Fit> {
        let mut keys = keys;
        keys.iter_mut().for_each(|key| key.sort_unstable());
        let new: Vec<&Vec<usize>> = keys
            .iter()
            .filter(|key| !self.seen.contains_key(*key))
            .collect();
        let fits: Vec<(Vec<usize>, Fit)> = new
            .into_par_iter()
            .map(|key| (key.clone(), self.fit_set(key, levels)))
            .collect();
        self.tried += fits.len();
        self.seen.extend(fits);
        keys.iter().map(|key| self.seen[key].clone()).collect()
    }

    fn fit_set(&self, key: &[usize], levels: &[NoiseLevels]) -> Fit {
        let set = self.members(key);
        let records = self.data.record_count();
        let prior = self.log_prior(key);
        let assembled = Assembled::new(self.data, &set);
        let scored = |levels: &[NoiseLevels], drift: &[Drift]| {
            let of_set = (&set[..], &assembled);
            let mut fit =
                evaluate_assembled(self.data, of_set, levels, drift, Effort::FULL, self.plan);
            fit.score = fit.log_likelihood + prior - self.drift_price(drift);
            if !fit.is_possible() {
                fit.score = f64::NEG_INFINITY;
            }
            fit.members = key.to_vec();
            fit
        };
        if let DriftPrior::Declared(drift) = self.drift {
            return scored(levels, drift);
        }
        let mut fits: Vec<Fit> = Drift::ALL
            .into_iter()
            .map(|drift| scored(levels, &vec![drift; records]))
            .collect();
        fits.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut best = fits.swap_remove(0);
        let sisters = self.data.sisters();
        let together = sisters.iter().filter(|_| sisters.len() > 1).cloned();
        for records in together.chain((0..records).map(|record| record..record + 1)) {
            for drift in Drift::ALL {
                if best.drift[records.clone()].iter().all(|own| *own == drift) {
                    continue;
                }
                let mut other = best.drift.clone();
                other[records.clone()].fill(drift);
                let fit = scored(&best.levels, &other);
                if fit.score > best.score + 1e-3 {
                    best = fit;
                }
            }
        }
        best
    }

    /// Log posterior after few iterations from the noise of `current`: with its drift, and without.
    fn quick(&self, current: &Fit, key: &[usize]) -> f64 {
        let mut key = key.to_vec();
        key.sort_unstable();
        if let Some(seen) = self.seen.get(&key) {
            return seen.score;
        }
        let set = self.members(&key);
        let prior = self.log_prior(&key);
        let assembled = Assembled::new(self.data, &set);
        let score = |drift: &[Drift]| {
            let (of_set, levels) = ((&set[..], &assembled), &current.levels);
            let fit =
                evaluate_assembled(self.data, of_set, levels, drift, Effort::QUICK, self.plan);
            if !fit.is_possible() {
                return f64::NEG_INFINITY;
            }
            fit.log_likelihood + prior - self.drift_price(drift)
        };
        let kept = score(&current.drift);
        let drifts = current.drift.iter().any(|drift| *drift != Drift::None);
        if drifts && *self.drift == DriftPrior::Unknown {
            kept.max(score(&vec![Drift::None; current.drift.len()]))
        } else {
            kept
        }
    }

    /// Log posteriors of `keys` at the present noise.
    pub(crate) fn screen(&mut self, current: &Fit, keys: &[Vec<usize>]) -> Vec<f64> {
        self.tried += keys.len();
        keys.par_iter()
            .map(|key| self.quick(current, key))
            .collect()
    }

    /// Returns the best set reached by steps from `start`, of at most `most` members.
    pub fn run(&mut self, start: &[usize], most: usize) -> Fit {
        let start = self.fit(start, None);
        stepwise(&mut Bounded { of: self, most }, start)
    }

    /// Fits the best of `keys`, screened at the noise of `current`.
    fn fit_nearest(&mut self, current: &Fit, keys: Vec<Vec<usize>>) -> Vec<Fit> {
        let scores = self.screen(current, &keys);
        let mut ranked: Vec<(f64, Vec<usize>)> = scores.into_iter().zip(keys).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        let chosen: Vec<Vec<usize>> = ranked
            .into_iter()
            .take(self.plan.refitted)
            .filter(|(score, _)| *score > current.score - self.plan.screening)
            .map(|(_, key)| key)
            .collect();
        self.fit_all(chosen, &current.levels)
    }
}

/// A search for sets of at most `most` members.
struct Bounded<'s, 'a, L> {
    of: &'s mut Search<'a, L>,
    most: usize,
}

impl<L: Likelihood> Bounded<'_, '_, L> {
    /// Sets with one more member.
    fn larger(&self, members: &[usize], with: &[usize]) -> Vec<Vec<usize>> {
        (0..self.of.hypotheses.len())
            .filter(|place| !members.contains(place))
            .map(|place| [with, &[place]].concat())
            .collect()
    }
}

/// Steps raise the log posterior, by more than its rounding.
impl<L: Likelihood> Stepwise for Bounded<'_, '_, L> {
    type Set = Fit;

    fn extend(&mut self, current: &mut Fit) -> bool {
        if current.members.len() >= self.most {
            return false;
        }
        let before = current.score;
        let keys = self.larger(&current.members, &current.members);
        let fits = self.of.fit_nearest(current, keys);
        *current = best_of(fits, current.clone());
        current.score > before + 1e-9
    }

    fn reduce(&mut self, current: &mut Fit) -> bool {
        let members = current.members.iter();
        let keys: Vec<Vec<usize>> = members
            .map(|member| self.of.without(&current.members, *member))
            .collect();
        let fits = self.of.fit_all(keys, &current.levels).into_iter();
        let better = fits.filter(|fit| fit.score > current.score);
        let best = better.max_by(|a, b| a.score.total_cmp(&b.score));
        best.map(|fit| *current = fit).is_some()
    }

    fn exchange(&mut self, current: &mut Fit) -> bool {
        for member in current.members.clone() {
            let rest = self.of.without(&current.members, member);
            let keys = self.larger(&current.members, &rest);
            let fits = self.of.fit_nearest(current, keys).into_iter();
            let better = fits.filter(|fit| fit.score > current.score + 1e-6);
            if let Some(best) = better.max_by(|a, b| a.score.total_cmp(&b.score)) {
                *current = best;
                return true;
            }
        }
        false
    }
}

/// Returns the best of several fits and the present one.
pub fn best_of(fits: Vec<Fit>, current: Fit) -> Fit {
    fits.into_iter().fold(
        current,
        |best, fit| {
            if fit.score > best.score { fit } else { best }
        },
    )
}
