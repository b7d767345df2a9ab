//! Selection of kinds by evidence from few attitudes, with their indistinguishable rivals.

use nalgebra::DMatrix;
use rlg_catalogue::entries::CATALOGUE;
use rlg_inference::{Stepwise, stepwise};
use rlg_plan::{AttitudeBlockPlan, Plan};

use crate::fits::sparse_attitudes::{FewRows, Weighed};
use crate::likelihood::block_sums::{Estimates, Statistic, log_chance};
use crate::rows::alignment::{COUNT, GROUPS, places};
use crate::selection::group_selection::{Candidates, Named, always_alike, chance};
use crate::selection::search::Found;

/// A candidate kind.
struct Kind {
    name: &'static str,
    places: Vec<usize>,
    /// Log prior probability.
    price: f64,
    /// Number of alternatives.
    among: usize,
}

/// Constant rate of the case during the assumed rest: of prior probability one half, and not reported as a finding.
const TURNING: &str = "turning";

fn kinds(rows: &FewRows, candidates: &Candidates, plan: &AttitudeBlockPlan) -> Vec<Kind> {
    let kind = |name, places, among: usize| Kind {
        name,
        places,
        price: log_chance(among, plan),
        among,
    };
    let registration = GROUPS.iter().map(|group| {
        let own = places(group.kind).collect();
        kind(group.kind, own, GROUPS.len())
    });
    let effects = candidates.effects.iter();
    let physics = effects.map(|(one, own)| kind(one.kind, own.clone(), candidates.effects.len()));
    let turning = rows.turning.iter().map(|own| Kind {
        name: TURNING,
        places: own.to_vec(),
        price: 0.5_f64.ln(),
        among: 1,
    });
    registration.chain(physics).chain(turning).collect()
}

/// Result of the search on few rows.
pub(crate) struct FewFound {
    /// Findings, as of many rows.
    pub(crate) found: Found,
    /// Posterior mean of random walk \[rad/√s\] and white noise \[rad\].
    pub(crate) noise: (f64, f64),
    /// The case turned at a constant rate during the assumed rest.
    pub(crate) is_turning: bool,
}

/// Searches few rows for kinds, by forward selection and backward elimination.
pub(crate) fn search(rows: &FewRows, candidates: &Candidates, plan: &Plan) -> FewFound {
    let kinds = kinds(rows, candidates, &plan.attitude.blocks);
    let mut search = FewSearch {
        rows,
        kinds: &kinds,
        plan,
        tried: 0,
    };
    let chosen = search.choose();
    let is_turning = |kind: &&usize| kinds[**kind].name == TURNING;
    let mut named: Vec<Named> = chosen
        .iter()
        .filter(|kind| !is_turning(kind))
        .map(|kind| search.named(*kind, &chosen))
        .collect();
    let in_catalogue = |kind: &str| CATALOGUE.iter().position(|entry| entry.kind == kind);
    named.sort_by_key(|named| in_catalogue(named.kind));
    let (registration, physics): (Vec<Named>, Vec<Named>) =
        named.into_iter().partition(|named| named.places[0] < COUNT);
    let all = GROUPS.iter().map(|group| places(group.kind).collect());
    let of = |named: &[Named]| -> Vec<Vec<usize>> {
        named.iter().map(|one| one.places.clone()).collect()
    };
    let turning = chosen.iter().find(is_turning);
    let turning = turning.map(|kind| kinds[*kind].places.clone());
    let whole: Vec<Vec<usize>> = all.chain(of(&physics)).chain(turning.clone()).collect();
    let called_for = [of(&physics), of(&registration)].concat();
    let called_for: Vec<Vec<usize>> = called_for.into_iter().chain(turning.clone()).collect();
    let weighed = |groups: &[Vec<usize>]| {
        let groups: Vec<&[usize]> = groups.iter().map(Vec::as_slice).collect();
        rows.weigh(&groups)
    };
    let of_named = weighed(&called_for);
    FewFound {
        noise: (of_named.noise[0], of_named.noise[1]),
        is_turning: turning.is_some(),
        found: Found {
            estimates: estimates(&weighed(&whole)),
            of_named: estimates(&of_named),
            tested: None,
            physics,
            registration,
            set: whole.concat(),
            named_set: called_for.concat(),
            tried: search.tried,
        },
    }
}

fn estimates(weighed: &Weighed) -> Estimates {
    Estimates {
        values: weighed.mean.iter().copied().collect(),
        covariance: weighed.covariance.clone(),
    }
}

struct FewSearch<'a> {
    rows: &'a FewRows,
    kinds: &'a [Kind],
    plan: &'a Plan,
    tried: usize,
}

impl FewSearch<'_> {
    fn groups(&self, chosen: &[usize]) -> Vec<&[usize]> {
        let groups = chosen.iter().map(|kind| &self.kinds[*kind].places[..]);
        groups.collect()
    }

    /// Number of attitude values used up by some kinds: a bias is determined at rest.
    fn taken(&self, chosen: &[usize]) -> usize {
        let is_at_rest = |kind: &&usize| {
            let name = self.kinds[**kind].name;
            name == TURNING || (self.rows.turning.is_some() && name == "gyro_bias")
        };
        let taken = chosen.iter().filter(|kind| !is_at_rest(kind));
        taken.map(|kind| self.kinds[*kind].places.len()).sum()
    }

    /// Log posterior of some kinds, up to a common constant.
    fn posterior(&mut self, chosen: &[usize]) -> f64 {
        self.tried += 1;
        self.rows.weigh(&self.groups(chosen)).log_evidence + self.price(chosen)
    }

    fn price(&self, chosen: &[usize]) -> f64 {
        chosen.iter().map(|kind| self.kinds[*kind].price).sum()
    }

    /// Selected kinds.
    fn choose(&mut self) -> Vec<usize> {
        let now = self.posterior(&[]);
        stepwise(self, (Vec::new(), now)).0
    }

    fn others(&self, chosen: &[usize]) -> Vec<usize> {
        let all = 0..self.kinds.len();
        all.filter(|kind| !chosen.contains(kind)).collect()
    }

    fn best_beside(&mut self, chosen: &[usize]) -> Option<(f64, usize)> {
        let mut best: Option<(f64, usize)> = None;
        for kind in self.others(chosen) {
            // No more parameters are named than there are values.
            if self.taken(&with(chosen, &[kind])) > self.rows.numbers {
                continue;
            }
            let posterior = self.posterior(&with(chosen, &[kind]));
            if best.is_none_or(|(highest, _)| posterior > highest) {
                best = Some((posterior, kind));
            }
        }
        best
    }

    /// Returns a chosen kind with its statistic and rivals, given the other chosen kinds.
    fn named(&self, kind: usize, chosen: &[usize]) -> Named {
        let beside: Vec<usize> = chosen.iter().copied().filter(|one| *one != kind).collect();
        let own = &self.kinds[kind];
        let (place, count) = (self.groups(&beside).concat().len(), own.places.len());
        let whole = self.rows.weigh(&self.groups(&with(&beside, &[kind])));
        let left = self.rows.weigh(&self.groups(&beside));
        let values = whole.mean.rows(place, count).into_owned();
        let covariance: DMatrix<f64> = whole
            .covariance
            .view((place, place), (count, count))
            .into_owned();
        let precision = rlg_inference::linear::invert(&covariance).0;
        let statistic = Statistic {
            squared_size: values.dot(&(precision * &values)),
            design_effect: 1.0,
            degrees: f64::INFINITY,
            count,
        };
        let gain = whole.log_evidence - left.log_evidence + own.price;
        let (alike, behind) = self.rivals(kind, &whole, &beside);
        Named {
            kind: own.name,
            places: own.places.clone(),
            scanned: None,
            among: own.among,
            gain,
            share: 1.0 - whole.share_left / left.share_left,
            p_value: chance(&statistic, own.among),
            statistic,
            alike,
            behind,
        }
    }

    /// Kinds not distinguishable from one in its place, alone or in pairs, and the deficit of each alone in log posterior.
    ///
    /// # Inputs
    /// `whole`: posterior with the kind; `beside`: the other chosen kinds.
    fn rivals(
        &self,
        kind: usize,
        whole: &Weighed,
        beside: &[usize],
    ) -> (Vec<&'static str>, Vec<(&'static str, f64)>) {
        let chosen = with(beside, &[kind]);
        let posterior = |rivals: &[usize]| {
            let set = with(beside, rivals);
            let weighed = self.rows.weigh_under(&self.groups(&set), &whole.likely);
            weighed.log_evidence + self.price(&set)
        };
        let best = whole.log_evidence + self.price(&chosen);
        let least = best - self.plan.attitude.alike_within;
        let mut alike: Vec<&'static str> = always_alike(self.kinds[kind].name).to_vec();
        let mut behind = Vec::new();
        let mut short = Vec::new();
        let others = self.others(&chosen).into_iter();
        for other in others.filter(|other| self.kinds[*other].name != TURNING) {
            let posterior = posterior(&[other]);
            behind.push((self.kinds[other].name, best - posterior));
            if posterior > least {
                alike.push(self.kinds[other].name);
            } else {
                short.push(other);
            }
        }
        for (place, first) in short.iter().enumerate() {
            for second in &short[place + 1..] {
                if posterior(&[*first, *second]) > least {
                    alike.extend([*first, *second].map(|one| self.kinds[one].name));
                }
            }
        }
        alike.sort_unstable();
        alike.dedup();
        (alike, behind)
    }
}

impl Stepwise for FewSearch<'_> {
    /// Kinds, and their log posterior.
    type Set = (Vec<usize>, f64);

    fn extend(&mut self, (chosen, now): &mut Self::Set) -> bool {
        let least = *now + self.plan.attitude.least_gain;
        let best = self.best_beside(chosen);
        let Some((posterior, kind)) = best.filter(|(posterior, _)| *posterior > least) else {
            return false;
        };
        chosen.push(kind);
        *now = posterior;
        true
    }

    fn reduce(&mut self, (chosen, now): &mut Self::Set) -> bool {
        for place in 0..chosen.len() {
            let mut others = chosen.clone();
            others.remove(place);
            let left = self.posterior(&others);
            if *now - left <= self.plan.attitude.least_gain {
                (*chosen, *now) = (others, left);
                return true;
            }
        }
        false
    }
}

fn with(chosen: &[usize], more: &[usize]) -> Vec<usize> {
    chosen.iter().chain(more).copied().collect()
}
