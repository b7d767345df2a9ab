//! Search for the set of hypotheses of largest log posterior: stepwise selection, forward, backward, and exchanges one for
//! one.

use rlg_plan::SearchPlan;
use std::collections::BTreeMap;
use std::ops::Range;

use nalgebra::DMatrix;
use rayon::prelude::*;

use crate::assembled::Assembled;
use crate::evaluate::{Drift, Effort, Fit, evaluate, evaluate_assembled};
use crate::hypothesis::Hypothesis;
use crate::likelihood::Likelihood;
use crate::linear::pseudo_inverse;
use crate::noise::NoiseLevels;
use crate::normal_equations::NormalEquations;

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

/// A member of the best set, with its rivals.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Place of the hypothesis.
    pub hypothesis: usize,
    /// Loss of log posterior without the member, noise and drift refitted.
    pub cost_without: f64,
    /// The same loss with drift priced by its terms only.
    pub cost_against_drift: f64,
    /// Noise levels with the best drift in its place; empty where drift is declared.
    pub drift_levels: Vec<NoiseLevels>,
    /// Hypotheses in its place whose log posterior is less by no more than `within`, best first, with the difference.
    pub rivals: Vec<(usize, f64)>,
}

/// The best set in comparison with others.
#[derive(Debug, Clone)]
pub struct JudgedSet {
    /// Its members with cost and rivals.
    pub members: Vec<Judged>,
    /// Rivals of each member whose columns span it.
    pub spanned_by: Vec<Vec<usize>>,
    /// Rivals among them of equivalent fit.
    pub reached_by: Vec<Vec<usize>>,
    /// The set without each member, refitted.
    pub without: Vec<Fit>,
    /// The empty set: noise alone.
    pub empty: Fit,
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

    fn members(&self, key: &[usize]) -> Vec<&'a Hypothesis> {
        key.iter().map(|&place| &self.hypotheses[place]).collect()
    }

    /// Members of a set without one, and without those that require it.
    pub fn without(&self, members: &[usize], member: usize) -> Vec<usize> {
        let stays =
            |place: &usize| *place != member && self.hypotheses[*place].requires != Some(member);
        members.iter().copied().filter(stays).collect()
    }

    /// ln prior of a set.
    fn log_prior(&self, key: &[usize]) -> f64 {
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

    /// Price of drift's terms alone, for the comparison of a member with drift.
    fn drift_terms(&self, drift: &[Drift]) -> f64 {
        if matches!(self.drift, DriftPrior::Declared(_)) {
            return 0.0;
        }
        let on = drift.iter().filter(|drift| **drift != Drift::None).count();
        self.plan.drift_term * on as f64
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
    fn screen(&mut self, current: &Fit, keys: &[Vec<usize>]) -> Vec<f64> {
        self.tried += keys.len();
        keys.par_iter()
            .map(|key| self.quick(current, key))
            .collect()
    }

    /// Returns the best set reached by steps from `start`, of at most `most` members.
    pub fn run(&mut self, start: &[usize], most: usize) -> Fit {
        let mut current = self.fit(start, None);
        loop {
            let before = current.score;
            if current.members.len() < most {
                current = self.extend(current);
            }
            let smaller = self.reduce(&current);
            let was_reduced = smaller.is_some();
            current = smaller.unwrap_or(current);
            if current.score <= before + 1e-9 && !was_reduced {
                match self.exchange(&current) {
                    Some(better) => current = better,
                    None => return current,
                }
            }
        }
    }

    /// The best single addition, or the unchanged set.
    fn extend(&mut self, current: Fit) -> Fit {
        let keys: Vec<Vec<usize>> = (0..self.hypotheses.len())
            .filter(|place| !current.members.contains(place))
            .map(|place| [&current.members[..], &[place]].concat())
            .collect();
        let fits = self.fit_nearest(&current, keys);
        best_of(fits, current)
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

    /// The best improvement by the loss of one member.
    fn reduce(&mut self, current: &Fit) -> Option<Fit> {
        let keys: Vec<Vec<usize>> = current
            .members
            .iter()
            .map(|member| self.without(&current.members, *member))
            .collect();
        let fits = self.fit_all(keys, &current.levels);
        fits.into_iter()
            .filter(|fit| fit.score > current.score)
            .max_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// The first improvement by the exchange of one member.
    fn exchange(&mut self, current: &Fit) -> Option<Fit> {
        for member in current.members.clone() {
            let rest = self.without(&current.members, member);
            let keys: Vec<Vec<usize>> = (0..self.hypotheses.len())
                .filter(|place| !current.members.contains(place))
                .map(|place| [&rest[..], &[place]].concat())
                .collect();
            let better = self
                .fit_nearest(current, keys)
                .into_iter()
                .filter(|fit| fit.score > current.score + 1e-6)
                .max_by(|a, b| a.score.total_cmp(&b.score));
            if better.is_some() {
                return better;
            }
        }
        None
    }

    /// Compares the set with others.
    ///
    /// # Inputs
    /// `within`: largest deficit of a rival's log posterior; `separation`: largest residual of a spanned member outside a
    /// rival's columns \[σ\].
    pub fn judge_set(&mut self, best: &Fit, within: f64, separation: f64) -> JudgedSet {
        let members = self.judge(best, within);
        let searched = &*self;
        let spans = |&member: &usize| -> Vec<(usize, f64)> {
            let others = (0..searched.hypotheses.len()).into_par_iter();
            others
                .filter(|other| !best.members.contains(other))
                .map(|other| (other, searched.separation(best, member, other)))
                .filter(|(_, left)| *left < separation)
                .collect()
        };
        let spanned: Vec<Vec<(usize, f64)>> = best.members.iter().map(spans).collect();
        let nearer_than = |most: &dyn Fn(f64) -> f64| {
            let of_member = |(all, squared_size): (&Vec<(usize, f64)>, &f64)| {
                let near = all.iter().filter(|(_, left)| *left < most(*squared_size));
                near.map(|(other, _)| *other).collect()
            };
            spanned
                .iter()
                .zip(&best.squared_sizes)
                .map(of_member)
                .collect()
        };
        let spanned_by = nearer_than(&|_| separation);
        // For a large effect a small share remains, as columns are never identical.
        let left_of = |squared_size: f64| self.plan.left_share * squared_size;
        let reached_by =
            nearer_than(&|squared_size| left_of(squared_size).max(2.0 * within).sqrt());
        let without = best
            .members
            .iter()
            .map(|&member| {
                let rest = self.without(&best.members, member);
                self.fit(&rest, None)
            })
            .collect();
        JudgedSet {
            members,
            spanned_by,
            reached_by,
            without,
            empty: self.fit(&[], None),
        }
    }

    /// Computes cost and rivals of each member of `best`.
    pub fn judge(&mut self, best: &Fit, within: f64) -> Vec<Judged> {
        best.members
            .clone()
            .into_iter()
            .map(|member| self.judge_member(best, member, within))
            .collect()
    }

    fn judge_member(&mut self, best: &Fit, member: usize, within: f64) -> Judged {
        let rest = self.without(&best.members, member);
        let alone = self.fit(&rest, Some(&best.levels));
        let others: Vec<usize> = (0..self.hypotheses.len())
            .filter(|place| !best.members.contains(place))
            .collect();
        let keys: Vec<Vec<usize>> = others
            .iter()
            .map(|&place| [&rest[..], &[place]].concat())
            .collect();
        let scores = self.screen(best, &keys);
        let near: Vec<(usize, Vec<usize>)> = others
            .into_iter()
            .zip(keys)
            .zip(scores)
            .filter(|(_, score)| *score > best.score - within - self.plan.rival_margin)
            .map(|(near, _)| near)
            .collect();
        let fits = self.fit_all(
            near.iter().map(|(_, key)| key.clone()).collect(),
            &best.levels,
        );
        let mut rivals: Vec<(usize, f64)> = near
            .iter()
            .zip(&fits)
            .map(|((place, _), fit)| (*place, best.score - fit.score))
            .filter(|(_, behind)| *behind < within)
            .collect();
        rivals.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (cost_against_drift, drift_levels) = self.against_drift(best, &rest);
        Judged {
            hypothesis: member,
            cost_without: best.score - alone.score,
            cost_against_drift,
            drift_levels,
            rivals,
        }
    }

    /// Cost of drift in place of a member, only drift's terms priced, and the noise levels with that drift.
    fn against_drift(&self, best: &Fit, rest: &[usize]) -> (f64, Vec<NoiseLevels>) {
        if matches!(self.drift, DriftPrior::Declared(_)) {
            return (f64::INFINITY, Vec::new());
        }
        let lenient = |fit: &Fit| {
            fit.log_likelihood + self.log_prior(&fit.members) - self.drift_terms(&fit.drift)
        };
        let set = self.members(rest);
        let records = best.drift.len();
        let mut candidates: Vec<Vec<Drift>> =
            vec![vec![Drift::Flicker; records], vec![Drift::Walk; records]];
        let sisters = self.data.sisters();
        for records in sisters.iter().filter(|_| sisters.len() > 1) {
            for drift in [Drift::Flicker, Drift::Walk] {
                let mut some = best.drift.clone();
                some[records.clone()].fill(drift);
                candidates.push(some);
            }
        }
        for record in 0..records {
            for drift in [Drift::Flicker, Drift::Walk] {
                let mut one = best.drift.clone();
                one[record] = drift;
                candidates.push(one);
            }
        }
        let reached = candidates
            .into_iter()
            .map(|drift| {
                let mut fit = evaluate(
                    self.data,
                    &set,
                    &best.levels,
                    &drift,
                    Effort::FULL,
                    self.plan,
                );
                fit.members = rest.to_vec();
                (lenient(&fit), fit.levels)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        reached.map_or((f64::INFINITY, Vec::new()), |(reached, levels)| {
            (lenient(best) - reached, levels)
        })
    }

    /// Distance of a member's effect from the span of `rival` and the other members, in standard deviations.
    pub fn separation(&self, best: &Fit, member: usize, rival: usize) -> f64 {
        let place = best
            .members
            .iter()
            .position(|&other| other == member)
            .expect("a member of the set");
        let whole = self.hypotheses[member].with_fixed_as_parameter();
        // Members that require this one are excluded: their columns would stand in for it.
        let beside = self.without(&best.members, member);
        let mut set = vec![&whole];
        set.extend(self.members(&beside));
        let rival = self.hypotheses[rival].with_fixed_as_parameter();
        set.push(&rival);
        let assembled = Assembled::new(self.data, &set);
        let information = assembled.information(self.data, &best.levels);
        let own = assembled.blocks[0].clone();
        let estimated = best.blocks[place].clone().map(|k| best.estimate[k]);
        let sizes = estimated.chain([1.0]);
        let effect = nalgebra::DVector::from_iterator(
            own.len(),
            own.clone()
                .zip(sizes)
                .map(|(k, size)| size / assembled.scale[k]),
        );
        let others: Vec<usize> = (0..information.nrows())
            .filter(|k| !own.contains(k))
            .collect();
        let of_own = information
            .view((own.start, own.start), (own.len(), own.len()))
            .into_owned();
        let cross = DMatrix::from_fn(others.len(), own.len(), |i, j| {
            information[(others[i], own.start + j)]
        });
        let between = DMatrix::from_fn(others.len(), others.len(), |i, j| {
            information[(others[i], others[j])]
        });
        let seen_by_others = &cross * &effect;
        let inverse = pseudo_inverse(&between);
        let whole = effect.dot(&(&of_own * &effect));
        let spanned = seen_by_others.dot(&(&inverse * &seen_by_others));
        (whole - spanned).max(0.0).sqrt()
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
