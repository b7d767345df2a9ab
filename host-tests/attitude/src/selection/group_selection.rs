//! Selection of registration groups and physical effects by the statistics of blocks.

use nalgebra::Vector3;
use rlg_catalogue::Candidate;
use rlg_findings::result::EvidenceEntry;
use rlg_inference::{Bound, Stepwise, stepwise};
use rlg_plan::Plan;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use crate::gyros::physics::Gyro;
use crate::gyros::scanned::{Scanned, Wave};
use crate::likelihood::block_sums::{BlockSums, Estimates, Statistic};
use crate::rows::alignment::{Alignment, COUNT, Free, GROUPS, Group, group_at, in_order, places};
use crate::rows::earth;

/// Candidate effects with their column indices, which follow those of the registration.
pub struct Candidates {
    /// In the order of the columns.
    pub effects: Vec<(Candidate, Vec<usize>)>,
}

impl Candidates {
    /// Assigns column indices to effects, after the registration's.
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

/// An accepted parameter group.
pub struct Named {
    /// Kind as named in the contract.
    pub kind: &'static str,
    /// Column indices of its parameters.
    pub places: Vec<usize>,
    /// Effect of one gyro, if a scan found it.
    pub scanned: Option<Scanned>,
    /// Number of alternatives that it was selected from.
    pub among: usize,
    /// Test statistic from the blocks.
    pub statistic: Statistic,
    /// Gain in log evidence, deflated by the design effect, less the price of the search.
    pub gain: f64,
    /// Share of the residual power that it predicts in cross-validation over blocks \[1\].
    pub share: f64,
    /// p-value of the deflated statistic, Bonferroni-corrected for the number of groups.
    pub p_value: f64,
    /// Kinds not distinguishable from it by the record.
    pub alike: Vec<&'static str>,
    /// Every other kind with its deficit in log likelihood.
    pub behind: Vec<(&'static str, f64)>,
}

impl Named {
    /// True for a step of a bias.
    pub(crate) fn is_step(&self) -> bool {
        matches!(self.scanned, Some(Scanned::Step(_)))
    }

    /// Its statistics as written in `diagnosis.json`.
    pub(crate) fn evidence(&self) -> EvidenceEntry {
        EvidenceEntry {
            label: if self.alike.is_empty() {
                "named"
            } else {
                "class"
            },
            confirmed_gain: self.gain,
            share: self.share,
            reenactments: 0,
            inflation: self.statistic.design_effect,
        }
    }

    /// Spectral line, if it is one.
    pub(crate) fn line(&self) -> Option<Wave> {
        match self.scanned {
            Some(Scanned::Line(wave)) => Some(wave),
            _ => None,
        }
    }

    /// Text of its expression, if it is one.
    pub(crate) fn expression(&self, gyro: &Gyro) -> Option<String> {
        match self.scanned {
            Some(Scanned::Expression(one)) => Some(one.expression.text(&gyro.signals)),
            _ => None,
        }
    }

    /// Kind of its registration group; empty for a physical effect.
    pub fn group(&self) -> &'static str {
        group_at(&self.places).map_or("", |group| group.kind)
    }

    /// Renames a gyro filter of negative smoothing variance to one of the reference.
    pub(crate) fn of_reference(&mut self, estimates: &Estimates, alignment: &Alignment) {
        if alignment.low_pass_s.is_some() {
            return;
        }
        // Column indices of the registration come first, in order.
        let sum: f64 = self.places.iter().map(|k| estimates.values[*k]).sum();
        if self.kind == "gyro_bandwidth" && sum < 0.0 {
            self.kind = "reference_bandwidth";
            self.alike.retain(|kind| *kind != "reference_bandwidth");
        }
    }
}

/// Registration groups other than the chosen ones.
pub(crate) fn others(chosen: &[&Group]) -> impl Iterator<Item = &'static Group> {
    let is_other = |group: &Group| chosen.iter().all(|one| one.kind != group.kind);
    GROUPS.iter().filter(move |group| is_other(group))
}

/// Column indices of registration groups and of physical effects.
fn set_of(chosen: &[&Group], physics: &[usize]) -> Vec<usize> {
    let own = chosen.iter().flat_map(|group| places(group.kind));
    own.chain(physics.iter().copied()).collect()
}

pub(crate) fn without(set: &[usize], own: &[usize]) -> Vec<usize> {
    set.iter().copied().filter(|k| !own.contains(k)).collect()
}

/// Kinds never distinguishable from a registration group by attitudes.
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
    let count = statistic.count.max(1) as f64;
    let tail = match statistic.degrees.is_finite() {
        true => {
            FisherSnedecor::new(count, statistic.degrees).map_or(1.0, |law| law.sf(squared / count))
        }
        false => ChiSquared::new(count).map_or(1.0, |law| law.sf(squared)),
    };
    (tail * groups as f64).min(1.0)
}

/// Steps of a selection of registration groups.
struct GroupSteps<'a> {
    choice: &'a Choice<'a>,
    /// Column indices of physical effects.
    physics: &'a [usize],
    /// Alternative sets of nearly equal gain.
    nearly: Vec<Free>,
    removed: Vec<&'static Group>,
}

impl Stepwise for GroupSteps<'_> {
    type Set = Vec<&'static Group>;

    fn extend(&mut self, chosen: &mut Self::Set) -> bool {
        let beside = set_of(chosen, self.physics);
        let is_new = |group: &&Group| self.removed.iter().all(|one| one.kind != group.kind);
        let tried: Vec<(f64, &Group)> = others(chosen)
            .filter(is_new)
            .map(|group| (self.choice.called_for(group, &beside), group))
            .filter_map(|((is_seen, gain), group)| is_seen.then_some((gain, group)))
            .collect();
        let Some((most, best)) = tried.iter().max_by(|a, b| a.0.total_cmp(&b.0)) else {
            return false;
        };
        let near = tried
            .iter()
            .filter(|(gain, _)| *gain > self.choice.plan.attitude.nearly * most);
        let near = near.map(|(_, group)| chosen.iter().chain([group]).map(|one| one.kind));
        let near: Vec<Free> = near.map(in_order).collect();
        if near.len() > 1 {
            let is_new = |free: &Free| !self.nearly.contains(free);
            let new: Vec<Free> = near.into_iter().filter(is_new).collect();
            self.nearly.extend(new);
        }
        chosen.push(best);
        true
    }

    fn reduce(&mut self, chosen: &mut Self::Set) -> bool {
        let set = set_of(chosen, self.physics);
        let is_redundant = |group: &&Group| {
            let own: Vec<usize> = places(group.kind).collect();
            !self.choice.called_for(group, &without(&set, &own)).0
        };
        let place = chosen.iter().position(is_redundant);
        self.removed.extend(place.map(|place| chosen.remove(place)));
        place.is_some()
    }
}

/// Block sums, and the candidates for selection.
pub(crate) struct Choice<'a> {
    pub(crate) sums: &'a BlockSums,
    pub(crate) candidates: &'a Candidates,
    pub(crate) plan: &'a Plan,
}

impl Choice<'_> {
    /// Selects registration groups given physical effects while blocks gain by a group. Also returns alternative sets of nearly
    /// equal gain in the forward steps.
    pub(crate) fn chosen(&self, physics: &[usize]) -> (Vec<&'static Group>, Vec<Free>) {
        let mut steps = GroupSteps {
            choice: self,
            physics,
            nearly: Vec::new(),
            removed: Vec::new(),
        };
        let chosen = stepwise(&mut steps, Vec::new());
        (chosen, steps.nearly)
    }

    /// Tests a registration group given a set: true if it is accepted, and its gain.
    pub(crate) fn called_for(&self, group: &Group, beside: &[usize]) -> (bool, f64) {
        let plan = &self.plan.attitude;
        let gain =
            |one: &Statistic, is_deflated: bool| one.gain(GROUPS.len(), is_deflated, &plan.blocks);
        let own: Vec<usize> = places(group.kind).collect();
        let is_near = |one: &Statistic| gain(one, false) > plan.least_gain;
        let statistic = self.sums.statistic_beyond(beside, &own, is_near);
        let is_seen = gain(&statistic, true) > plan.least_gain
            && self.sums.predicted(beside, &own).log_likelihood > 0.0
            && (group.kind != "earth_rate" || self.is_of_the_earth(beside, &own));
        // The undeflated gain ranks accepted groups: the design effect is too uncertain for that.
        (is_seen, gain(&statistic, false))
    }

    /// Selects registration groups, with the statistic of each.
    pub(crate) fn registration(&self, physics: &[usize], named: &[&'static str]) -> Vec<Named> {
        let (chosen, _) = self.chosen(physics);
        let all = set_of(&chosen, physics);
        let of_group = |group: &&Group| self.supported(group, &all, named, &chosen);
        chosen.iter().map(of_group).collect()
    }

    /// Returns a selected registration group with its statistic and rivals, given a set.
    pub(crate) fn supported(
        &self,
        group: &Group,
        set: &[usize],
        named: &[&'static str],
        chosen: &[&Group],
    ) -> Named {
        let plan = &self.plan.attitude;
        let own: Vec<usize> = places(group.kind).collect();
        let beside = without(set, &own);
        let statistic = self.sums.statistic(&beside, &own);
        let gain = statistic.gain(GROUPS.len(), true, &plan.blocks);
        let mut alike = self.rivals(&beside, &statistic, named);
        let least = statistic.compared(GROUPS.len(), &plan.blocks) - plan.alike_within;
        alike.extend(
            others(chosen)
                .filter(|other| {
                    let own: Vec<usize> = places(other.kind).collect();
                    let rival = self.sums.statistic(&beside, &own);
                    rival.compared_with(&statistic, GROUPS.len(), &plan.blocks) > least
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
            scanned: None,
            among: GROUPS.len(),
            share: self.sums.predicted(&beside, &own).share,
            behind: self.behind(&beside, &statistic),
            places: own,
            statistic,
            gain,
            p_value: chance(&statistic, GROUPS.len()),
            alike,
        }
    }

    /// Returns the accepted effect of largest gain given a set, other than those `named`, and the number of effects tried.
    pub(crate) fn next(&self, set: &[usize], named: &[&'static str]) -> (Option<Named>, usize) {
        let plan = &self.plan.attitude;
        let effects = &self.candidates.effects;
        let groups = effects.len();
        let gain = |one: &Statistic, is_deflated: bool| one.gain(groups, is_deflated, &plan.blocks);
        let is_seen = |one: &Statistic| gain(one, false) > plan.least_gain;
        let mut tried: Vec<(f64, usize, Statistic)> = effects
            .iter()
            .enumerate()
            .filter(|(_, (candidate, _))| !named.contains(&candidate.kind))
            .map(|(place, (_, own))| {
                let statistic = self.sums.statistic_beyond(set, own, is_seen);
                (gain(&statistic, false), place, statistic)
            })
            .collect();
        let count = tried.len();
        tried.retain(|(.., statistic)| is_seen(statistic));
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let best = tried.into_iter().find_map(|(_, place, statistic)| {
            let gain = gain(&statistic, true);
            if gain <= plan.least_gain {
                return None;
            }
            let (candidate, own) = &effects[place];
            if !self.is_possible(set, &effects[place]) {
                return None;
            }
            let predicted = self.sums.predicted(set, own);
            (predicted.log_likelihood > plan.least_predicted).then(|| Named {
                kind: candidate.kind,
                places: own.clone(),
                statistic,
                gain,
                share: predicted.share,
                p_value: chance(&statistic, groups),
                scanned: None,
                among: groups,
                alike: Vec::new(),
                behind: Vec::new(),
            })
        });
        (best, count)
    }

    /// True if an accepted effect is still called for given a set.
    pub(crate) fn stays(&self, one: &Named, set: &[usize]) -> bool {
        let plan = &self.plan.attitude;
        let statistic = self.sums.statistic(set, &one.places);
        statistic.gain(one.among, true, &plan.blocks) > plan.least_gain
            && self.sums.predicted(set, &one.places).log_likelihood > plan.least_predicted
    }

    /// Deficit of every effect in log likelihood to a winner, given the same set.
    pub(crate) fn behind(&self, beside: &[usize], winner: &Statistic) -> Vec<(&'static str, f64)> {
        let effects = self.candidates.effects.iter();
        let of = |own: &[usize]| self.sums.statistic(beside, own).squared_size;
        effects
            .filter(|(_, own)| own.iter().all(|k| !beside.contains(k)))
            .map(|(one, own)| (one.kind, 0.5 * (winner.squared_size - of(own))))
            .collect()
    }

    /// True if a rotation given a set is no longer than the Earth's.
    fn is_of_the_earth(&self, beside: &[usize], own: &[usize]) -> bool {
        let set: Vec<usize> = beside.iter().chain(own).copied().collect();
        let found = self.sums.estimates(&set);
        let first = beside.len();
        let rate = Vector3::from_fn(|axis, _| found.values[first + axis]);
        let covariance = found.covariance.fixed_view::<3, 3>(first, first);
        earth::is_possible(rate, &covariance.into_owned(), &self.plan.attitude.earth)
    }

    /// Kinds not distinguishable from a winner, given a set.
    pub(crate) fn rivals(
        &self,
        beside: &[usize],
        winner: &Statistic,
        named: &[&str],
    ) -> Vec<&'static str> {
        let plan = &self.plan.attitude;
        let groups = self.candidates.effects.len();
        let least = winner.compared(groups, &plan.blocks) - plan.alike_within;
        let effects = self.candidates.effects.iter();
        effects
            .filter(|(candidate, _)| !named.contains(&candidate.kind))
            .filter(|effect| {
                let rival = self.sums.statistic(beside, &effect.1);
                rival.compared_with(winner, groups, &plan.blocks) > least
                    && self.is_possible(beside, effect)
            })
            .map(|(candidate, _)| candidate.kind)
            .collect()
    }

    /// True if all parameters of an effect, estimated given a set, are within their physical bounds.
    fn is_possible(&self, beside: &[usize], (candidate, own): &(Candidate, Vec<usize>)) -> bool {
        let bounds = &candidate.hypothesis.bounds;
        if bounds.iter().all(|bound| bound.range == Bound::NONE.range) {
            return true;
        }
        let set: Vec<usize> = beside.iter().chain(own).copied().collect();
        let found = self.sums.estimates(&set);
        let by_chance = self.plan.inference.search.by_chance;
        bounds.iter().zip(beside.len()..).all(|(bound, k)| {
            let std = found.covariance[(k, k)].max(0.0).sqrt();
            !bound.excludes(found.values[k], std, by_chance)
        })
    }
}
