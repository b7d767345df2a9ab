//! Which effects of physics stand beside the registration, and which numbers of the registration the record supports.

use rlg_catalogue::entries::{CATALOGUE, STEP};
use rlg_catalogue::{Candidate, Pool};
use rlg_signal::axes::{Triad, add_triad};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::about::{About, Gyros};
use crate::alignment::{Alignment, COUNT, Free, GROUPS, Group, group_at, in_order, places};
use crate::blocks::{Blocks, Estimates, Statistic};
use crate::equations::Band;
use crate::fitting::priced;
use crate::growth::Called;
use crate::noise::NoiseTerms;
use crate::physics::Gyro;
use crate::plan::AttitudePlan;
use crate::registration::{Registration, Steps};
use crate::steps::{self, Step};

/// What is searched: effects with the places of their numbers among all columns, behind those of the registration.
pub struct Candidates {
    /// In the order of the columns.
    pub effects: Vec<(Candidate, Vec<usize>)>,
}

impl Candidates {
    /// Places effects behind the registration.
    pub fn new(effects: Vec<Candidate>) -> Self {
        let mut first = COUNT;
        let placed = effects.into_iter().map(|candidate| {
            let own: Vec<usize> = (first..first + candidate.names.len()).collect();
            first += candidate.names.len();
            (candidate, own)
        });
        Self {
            effects: placed.collect(),
        }
    }
}

/// A group of numbers that stands.
pub struct Named {
    /// The contract's kind.
    pub kind: &'static str,
    /// Places of its numbers among all columns.
    pub places: Vec<usize>,
    /// Which step of a bias it is, if it is one.
    pub step: Option<Step>,
    /// What blocks say of it.
    pub statistic: Statistic,
    /// Gain, deflated, less the price of the search.
    pub gain: f64,
    /// Share of what blocks leave that it predicts in the others.
    pub share: f64,
    /// Chance, by its deflated size, groups counted.
    pub p_value: f64,
    /// Kinds that the record cannot tell from it.
    pub alike: Vec<&'static str>,
    /// Every other kind, and how far it is behind in log likelihood.
    pub behind: Vec<(&'static str, f64)>,
}

impl Named {
    /// The group of the registration that it is.
    pub fn group(&self) -> &'static str {
        group_at(&self.places).map_or("", |group| group.kind)
    }

    /// A filter of the gyros with a variance below zero is one of the reference.
    fn of_reference(&mut self, estimates: &Estimates, alignment: &Alignment) {
        if alignment.low_pass_s.is_some() {
            return;
        }
        // Places of the registration come first, in their order.
        let sum: f64 = self.places.iter().map(|k| estimates.values[*k]).sum();
        if self.kind == "gyro_bandwidth" && sum < 0.0 {
            self.kind = "reference_bandwidth";
            self.alike.retain(|kind| *kind != "reference_bandwidth");
        }
    }
}

/// What stands.
pub struct Found {
    /// Effects of physics, in the order in which they were accepted.
    pub physics: Vec<Named>,
    /// Groups of the registration, those that are supported.
    pub registration: Vec<Named>,
    /// All numbers of the registration and of the accepted effects, by place.
    pub set: Vec<usize>,
    /// Their estimates: what they are beyond the model, each beside all.
    pub estimates: Estimates,
    /// Numbers of what is named.
    pub named_set: Vec<usize>,
    /// Their estimates, the registration that is not named as the model has it.
    pub of_named: Estimates,
    /// Sets that were tried.
    pub tried: usize,
}

impl Found {
    /// Groups of the registration that stand, in the order of their columns.
    pub(crate) fn groups(&self) -> Free {
        in_order(self.registration.iter().map(Named::group))
    }

    /// What the named registration is beyond a place that rows are linear about.
    pub(crate) fn step_from(&self, beyond: &[f64; COUNT]) -> Steps {
        step_from(&self.named_set, &self.of_named, beyond)
    }
}

/// What the registration in a set is beyond a place that rows are linear about.
fn step_from(set: &[usize], estimates: &Estimates, beyond: &[f64; COUNT]) -> Steps {
    let own: Vec<usize> = (0..set.len()).filter(|at| set[*at] < COUNT).collect();
    let kept: Vec<usize> = own.iter().map(|at| set[*at]).collect();
    let each = own.iter().zip(&kept);
    let estimate: Vec<f64> = each
        .map(|(at, k)| estimates.values[*at] - beyond[*k])
        .collect();
    let variances = own.iter().map(|at| estimates.covariance[(*at, *at)]);
    let std: Vec<f64> = variances.map(f64::sqrt).collect();
    Steps::new(&kept, &estimate, &std)
}

/// Groups of the registration that the record calls for where no physics is thought of.
pub(crate) fn called_for(
    of: (&Gyros, &Registration),
    (of_model, beyond): (&Alignment, &[f64; COUNT]),
    plan: &AttitudePlan,
) -> Called {
    let none = Candidates::new(Vec::new());
    let basis = basis(of.1);
    let about = (of_model, beyond);
    let search = Search::new(of, about, &basis, &none, std::iter::empty(), plan);
    let (chosen, nearly) = search.chosen(&[]);
    let named_set: Vec<usize> = chosen.iter().flat_map(|group| places(group.kind)).collect();
    let step = step_from(&named_set, &search.blocks.estimates(&named_set), beyond);
    Called {
        free: in_order(chosen.iter().map(|group| group.kind)),
        step,
        nearly,
    }
}

/// Frequencies and noise of a registration's rows.
fn basis(registered: &Registration) -> (Band, NoiseTerms) {
    let increments = &registered.about.increments;
    let band = Band::new(increments.rows(), increments.period_s);
    let terms = NoiseTerms::new(increments.rows(), increments.period_s, band.cut, false)
        .with_alike(increments.alike);
    (band, terms)
}

/// Searches.
pub fn search(
    of: (&Gyros, &Registration),
    (of_model, beyond): (&Alignment, &[f64; COUNT]),
    (gyro, pool, candidates): (&Gyro, &Pool, &Candidates),
    plan: &AttitudePlan,
) -> Found {
    let about = &of.1.about;
    let effects = candidates.effects.iter();
    let columns = effects.flat_map(|(candidate, _)| gyro.columns(pool, candidate, about));
    let basis = basis(of.1);
    let mut search = Search::new(of, (of_model, beyond), &basis, candidates, columns, plan);
    let mut set: Vec<usize> = (0..COUNT).collect();
    let mut physics: Vec<Named> = Vec::new();
    while physics.len() < plan.most_effects {
        let next = search.next(&set, &physics).or_else(|| {
            let known: Vec<Step> = physics.iter().filter_map(|one| one.step).collect();
            search.step((about, gyro), beyond, &set, &known)
        });
        let Some(named) = next else {
            break;
        };
        set.extend(&named.places);
        physics.push(named);
    }
    let kinds: Vec<&'static str> = physics.iter().map(|one| one.kind).collect();
    for named in physics.iter_mut().filter(|one| one.step.is_none()) {
        let beside = without(&set, &named.places);
        let statistic = search.blocks.statistic(&beside, &named.places);
        named.alike = search.rivals(&beside, &statistic, &kinds);
        named.behind = search.behind(&beside, &statistic);
    }
    let beside: Vec<usize> = set.iter().copied().filter(|k| *k >= COUNT).collect();
    let mut registration = search.registration(&beside, &kinds);
    let mut named_set = beside;
    named_set.extend(registration.iter().flat_map(|named| named.places.clone()));
    let estimates = search.blocks.estimates(&set);
    let of_named = search.blocks.estimates(&named_set);
    for named in &mut registration {
        named.of_reference(&estimates, &of.1.alignment);
        let rivals = of.1.rivals.iter();
        for (_, rival) in rivals.filter(|(kind, _)| *kind == named.kind) {
            if !named.alike.contains(rival) {
                named.alike.push(rival);
            }
        }
    }
    let in_catalogue = |kind: &str| CATALOGUE.iter().position(|entry| entry.kind == kind);
    registration.sort_by_key(|named| in_catalogue(named.kind));
    Found {
        registration,
        named_set,
        of_named,
        estimates,
        tried: search.tried,
        physics,
        set,
    }
}

/// Groups of the registration that are none of some.
fn others(chosen: &[&Group]) -> impl Iterator<Item = &'static Group> {
    let is_other = |group: &Group| chosen.iter().all(|one| one.kind != group.kind);
    GROUPS.iter().filter(move |group| is_other(group))
}

/// Places of groups of the registration, and of some physics.
fn set_of(chosen: &[&Group], physics: &[usize]) -> Vec<usize> {
    let own = chosen.iter().flat_map(|group| places(group.kind));
    own.chain(physics.iter().copied()).collect()
}

fn without(set: &[usize], own: &[usize]) -> Vec<usize> {
    set.iter().copied().filter(|k| !own.contains(k)).collect()
}

/// What attitudes never tell from a group of the registration.
pub(crate) fn always_alike(kind: &str) -> &'static [&'static str] {
    match kind {
        "gyro_scale" => &["reference_scale"],
        "reference_delay" => &["gyro_delay"],
        "reference_misalignment" => &["installation"],
        "gyro_bandwidth" => &["reference_bandwidth", "elastic_rate_by_jerk"],
        _ => &[],
    }
}

pub(crate) fn chance(statistic: &Statistic, groups: usize) -> f64 {
    let squared = statistic.squared_size / statistic.design_effect;
    let tail = ChiSquared::new(statistic.count.max(1) as f64).map_or(1.0, |law| law.sf(squared));
    (tail * groups as f64).min(1.0)
}

struct Search<'a> {
    blocks: Blocks<'a>,
    candidates: &'a Candidates,
    plan: &'a AttitudePlan,
    tried: usize,
}

impl<'a> Search<'a> {
    /// # Inputs
    /// `of_effects`: columns of the candidates.
    fn new(
        (gyros, registered): (&Gyros, &'a Registration),
        (of_model, beyond): (&Alignment, &[f64; COUNT]),
        (band, terms): &'a (Band, NoiseTerms),
        candidates: &'a Candidates,
        of_effects: impl Iterator<Item = Triad>,
        plan: &'a AttitudePlan,
    ) -> Self {
        let about = &registered.about;
        let columns = priced(
            about.columns(gyros.rate_hz),
            &registered.alignment,
            of_model,
        );
        let mut precisions: Vec<f64> = columns.iter().map(|one| one.prior_std.powi(-2)).collect();
        precisions.extend(candidates.effects.iter().flat_map(|(candidate, own)| {
            (0..own.len()).map(|k| candidate.hypothesis.bound(k).std.powi(-2))
        }));
        let increments = &about.increments;
        let mut rows_rad = increments.rows_rad.clone();
        add_triad(&mut rows_rad, &registered.corrected_rad, -1.0);
        let mut moved = beyond.to_vec();
        moved.resize(precisions.len(), 0.0);
        let of_registration = columns.into_iter().map(|column| column.values);
        let blocks = Blocks::new(
            (band, terms, &registered.levels),
            increments,
            &rows_rad,
            &mut of_registration.chain(of_effects),
            (&precisions, &moved),
        );
        Self {
            blocks,
            candidates,
            plan,
            tried: 0,
        }
    }

    /// Groups of the registration that the record calls for beside some physics: added while blocks gain by one, those left
    /// out that the others make needless. With them sets that would have done nearly as well until then.
    fn chosen(&self, physics: &[usize]) -> (Vec<&'static Group>, Vec<Free>) {
        let mut chosen: Vec<&Group> = Vec::new();
        let mut nearly: Vec<Free> = Vec::new();
        let set = |chosen: &[&Group]| set_of(chosen, physics);
        let is_called_for = |group: &Group, beside: &[usize]| {
            let own: Vec<usize> = places(group.kind).collect();
            let statistic = self.blocks.statistic(beside, &own);
            let is_seen = statistic.gain(GROUPS.len(), true) > self.plan.least_gain
                && self.blocks.share(beside, &own) > self.plan.least_share_of_registration;
            // Of two that are seen all rows decide; how far blocks disagree is too rough for that.
            (is_seen, statistic.gain(GROUPS.len(), false))
        };
        loop {
            let beside = set(&chosen);
            let tried: Vec<_> = others(&chosen)
                .map(|group| (is_called_for(group, &beside), group))
                .filter(|((is_seen, _), _)| *is_seen)
                .collect();
            let Some(best) = tried.iter().max_by(|a, b| a.0.1.total_cmp(&b.0.1)) else {
                break;
            };
            let least = self.plan.nearly * best.0.1;
            let near = tried.iter().filter(|(seen, _)| seen.1 > least);
            let near = near.map(|(_, group)| chosen.iter().chain([group]).map(|one| one.kind));
            let near: Vec<Free> = near.map(in_order).collect();
            if near.len() > 1 {
                let is_new = |free: &Free| !nearly.contains(free);
                let near: Vec<Free> = near.into_iter().filter(is_new).collect();
                nearly.extend(near);
            }
            chosen.push(best.1);
        }
        let mut place = 0;
        while place < chosen.len() {
            let beside = without(
                &set(&chosen),
                &places(chosen[place].kind).collect::<Vec<_>>(),
            );
            if is_called_for(chosen[place], &beside).0 {
                place += 1;
            } else {
                chosen.remove(place);
                place = 0;
            }
        }
        (chosen, nearly)
    }

    /// Those, with what blocks say of each.
    fn registration(&self, physics: &[usize], named: &[&'static str]) -> Vec<Named> {
        let (chosen, _) = self.chosen(physics);
        let all = set_of(&chosen, physics);
        let of_group = |group: &&Group| self.supported(group, &all, named, &chosen);
        chosen.iter().map(of_group).collect()
    }

    /// A group of the registration that is called for beside a set.
    fn supported(
        &self,
        group: &Group,
        set: &[usize],
        named: &[&'static str],
        chosen: &[&Group],
    ) -> Named {
        let own: Vec<usize> = places(group.kind).collect();
        let beside = without(set, &own);
        let statistic = self.blocks.statistic(&beside, &own);
        let gain = statistic.gain(GROUPS.len(), true);
        let mut alike = self.rivals(&beside, &statistic, named);
        alike.extend(
            others(chosen)
                .filter(|other| {
                    let own: Vec<usize> = places(other.kind).collect();
                    let rival = self.blocks.statistic(&beside, &own);
                    rival.gain_beside(&statistic, GROUPS.len()) > gain - self.plan.alike_within
                })
                .map(|other| other.kind),
        );
        for kind in always_alike(group.kind) {
            if !alike.contains(kind) {
                alike.push(kind);
            }
        }
        Named {
            kind: group.kind,
            step: None,
            share: self.blocks.share(&beside, &own),
            behind: self.behind(&beside, &statistic),
            places: own,
            statistic,
            gain,
            p_value: chance(&statistic, GROUPS.len()),
            alike,
        }
    }

    /// A step of a bias beside a set, its column added to the blocks.
    fn step(
        &mut self,
        about: (&About, &Gyro),
        beyond: &[f64; COUNT],
        set: &[usize],
        known: &[Step],
    ) -> Option<Named> {
        let sought = steps::seek(&self.blocks, about, beyond, set)?;
        let gain = sought.statistic.gain(sought.places, true);
        self.tried += sought.places;
        if gain <= self.plan.least_gain || known.contains(&sought.step) {
            return None;
        }
        let place = self.blocks.parameters();
        let blocks = self.blocks.with(std::iter::once(sought.column), beyond);
        let share = blocks.share(set, &[place]);
        if share <= self.plan.least_share {
            return None;
        }
        self.blocks = blocks;
        Some(Named {
            kind: STEP,
            places: vec![place],
            step: Some(sought.step),
            statistic: sought.statistic,
            gain,
            share,
            p_value: chance(&sought.statistic, sought.places),
            alike: Vec::new(),
            behind: Vec::new(),
        })
    }

    /// The effect that gains most beside a set and is accepted.
    fn next(&mut self, set: &[usize], named: &[Named]) -> Option<Named> {
        let effects = &self.candidates.effects;
        let groups = effects.len();
        let mut tried: Vec<(f64, usize, Statistic)> = effects
            .iter()
            .enumerate()
            .filter(|(_, (candidate, _))| named.iter().all(|one| one.kind != candidate.kind))
            .map(|(place, (_, own))| {
                let statistic = self.blocks.statistic(set, own);
                (statistic.gain(groups, false), place, statistic)
            })
            .collect();
        self.tried += tried.len();
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        tried.into_iter().find_map(|(_, place, statistic)| {
            let gain = statistic.gain(groups, true);
            if gain <= self.plan.least_gain {
                return None;
            }
            let (candidate, own) = &effects[place];
            let share = self.blocks.share(set, own);
            (share > self.plan.least_share).then(|| Named {
                kind: candidate.kind,
                places: own.clone(),
                statistic,
                gain,
                share,
                p_value: chance(&statistic, groups),
                step: None,
                alike: Vec::new(),
                behind: Vec::new(),
            })
        })
    }

    /// How far every effect is behind a winner beside the same set, in log likelihood.
    fn behind(&self, beside: &[usize], winner: &Statistic) -> Vec<(&'static str, f64)> {
        let effects = self.candidates.effects.iter();
        let of = |own: &[usize]| self.blocks.statistic(beside, own).squared_size;
        effects
            .filter(|(_, own)| own.iter().all(|k| !beside.contains(k)))
            .map(|(one, own)| (one.kind, 0.5 * (winner.squared_size - of(own))))
            .collect()
    }

    /// Kinds that explain nearly as much beside a set.
    fn rivals(&self, beside: &[usize], winner: &Statistic, named: &[&str]) -> Vec<&'static str> {
        let groups = self.candidates.effects.len();
        let least = winner.gain(groups, true) - self.plan.alike_within;
        let effects = self.candidates.effects.iter();
        effects
            .filter(|(candidate, _)| !named.contains(&candidate.kind))
            .filter(|(_, own)| {
                let rival = self.blocks.statistic(beside, own);
                rival.gain_beside(winner, groups) > least
            })
            .map(|(candidate, _)| candidate.kind)
            .collect()
    }
}
