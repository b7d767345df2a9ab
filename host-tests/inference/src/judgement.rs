//! Comparison of the best set with others: cost and rivals of each member.

use nalgebra::DMatrix;
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::assembled::Assembled;
use crate::evaluate::{Drift, Effort, Fit, evaluate};
use crate::likelihood::Likelihood;
use crate::linear::pseudo_inverse;
use crate::noise::NoiseLevels;
use crate::search::{DriftPrior, Search};

/// Chance of an effect in noise alone, for all places of its selection.
///
/// # Inputs
/// `squared_size`: twice the gain in log likelihood, χ² of `rank` degrees of freedom; `price`: logarithm of the number of
/// places.
pub fn chance_in_noise(squared_size: f64, rank: usize, price: f64) -> f64 {
    let law = ChiSquared::new(rank.max(1) as f64);
    let tail = law.map_or(1.0, |law| law.sf(squared_size.max(0.0)));
    (tail * price.exp().max(1.0)).min(1.0)
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

impl<L: Likelihood> Search<'_, L> {
    /// Price of drift's terms alone, for the comparison of a member with drift.
    fn drift_terms(&self, drift: &[Drift]) -> f64 {
        if matches!(self.drift, DriftPrior::Declared(_)) {
            return 0.0;
        }
        let on = drift.iter().filter(|drift| **drift != Drift::None).count();
        self.plan.drift_term * on as f64
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
