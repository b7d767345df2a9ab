//! Joins candidates of several recordings to common hypotheses; one recording is several with n = 1.

use rlg_catalogue::Candidate;
use rlg_inference::likelihood::behind;
use rlg_inference::{Bound, Fit, Hypothesis};
use rlg_plan::SeveralPlan;

/// Number of records per recording: its gyros.
pub(crate) const RECORDS: usize = 3;

/// Relation of the records of one search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Grouping {
    /// Recordings of one unit.
    Recordings,
    /// Stretches of one recording and sums over all of it: all effects but events are common.
    Stretches,
}

/// Recordings that have an effect, and its number of sizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sharing {
    /// All that can show it, with one size.
    Common,
    /// All that can show it, with a size each.
    Apart,
    /// One recording.
    Only(usize),
}

/// A candidate over several recordings.
#[derive(Debug, Clone)]
pub(crate) struct Shared {
    /// Candidate whose records count through all recordings; its columns are those of their recording.
    pub(crate) candidate: Candidate,
    /// Recordings that have it.
    pub(crate) sharing: Sharing,
    /// By recording that has it: the place of its candidate, and the parameter in `candidate` of each of its parameters.
    pub(crate) own: Vec<Option<(usize, Vec<usize>)>>,
}

impl Shared {
    /// First recording that has it.
    pub(crate) fn first_recording(&self) -> Option<usize> {
        self.own.iter().position(Option::is_some)
    }

    /// True if effect and sharing are the same, columns aside.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        let (a, b) = (&self.candidate, &other.candidate);
        a.kind == b.kind && a.variant == b.variant && self.sharing == other.sharing
    }

    /// Part of one recording, on its own records; parameters as here.
    pub(crate) fn in_recording(&self, recording: usize) -> Candidate {
        let mut own = self.candidate.clone();
        own.hypothesis = on_own_records(&own.hypothesis, recording);
        own
    }

    /// Part of one recording, with the recording's own parameters if its size is its own.
    ///
    /// # Returns
    /// The candidate, and the index of its first parameter here.
    pub(crate) fn alone_in(
        &self,
        recording: usize,
        of_recording: &[Candidate],
    ) -> (Candidate, usize) {
        match (self.sharing, &self.own[recording]) {
            (Sharing::Apart, Some((place, parameters))) => {
                let mut own = of_recording[*place].clone();
                own.hypothesis.price = self.candidate.hypothesis.price;
                (own, parameters.first().copied().unwrap_or(0))
            }
            _ => (self.in_recording(recording), 0),
        }
    }
}

/// Parts of all candidates in one recording.
pub(crate) fn in_recording(shared: &[Shared], recording: usize) -> Vec<Candidate> {
    shared
        .iter()
        .map(|one| one.in_recording(recording))
        .collect()
}

/// Hypotheses of the members on one recording's records, fixed terms as one more parameter.
pub(crate) fn set_of(members: &[usize], shared: &[Shared], recording: usize) -> Vec<Hypothesis> {
    members
        .iter()
        .map(|&place| {
            let whole = shared[place].candidate.hypothesis.with_fixed_as_parameter();
            on_own_records(&whole, recording)
        })
        .collect()
}

/// Part of a hypothesis on one recording's records, counted from the recording's first.
fn on_own_records(hypothesis: &Hypothesis, recording: usize) -> Hypothesis {
    let first = recording * RECORDS;
    let mut own = hypothesis.clone();
    let is_own = |record: usize| (first..first + RECORDS).contains(&record);
    own.terms.retain(|one| is_own(one.record));
    own.fixed.retain(|one| is_own(one.record));
    own.terms.iter_mut().for_each(|one| one.record -= first);
    own.fixed.iter_mut().for_each(|one| one.record -= first);
    own
}

/// Forms the hypotheses of effects that recordings may share.
///
/// # Inputs
/// `candidates`: of each recording, over its own columns.
pub(crate) fn spelt_out(
    candidates: &[&[Candidate]],
    grouping: Grouping,
    plan: &SeveralPlan,
) -> Vec<Shared> {
    let mut groups: Vec<Vec<Option<usize>>> = Vec::new();
    for (recording, own) in candidates.iter().enumerate() {
        for (place, one) in own.iter().enumerate() {
            let is_same = |group: &&mut Vec<Option<usize>>| {
                let known = group.iter().zip(candidates);
                let mut known = known.filter_map(|(place, own)| Some(&own[(*place)?]));
                known.all(|other| may_be_one(one, other)) && group[recording].is_none()
            };
            match groups.iter_mut().find(is_same) {
                Some(group) => group[recording] = Some(place),
                None => {
                    let mut group = vec![None; candidates.len()];
                    group[recording] = Some(place);
                    groups.push(group);
                }
            }
        }
    }
    let mut all = Vec::new();
    for group in &groups {
        let having: Vec<usize> = (0..group.len()).filter(|&k| group[k].is_some()).collect();
        if grouping == Grouping::Stretches && having.len() > 1 {
            let sharing = match has_one_base(candidates, group) {
                true => Sharing::Common,
                false => Sharing::Apart,
            };
            all.push(shared(candidates, group, sharing, 0.0));
            continue;
        }
        if having.len() > 1 {
            let common = shared(candidates, group, Sharing::Common, plan.common);
            if has_one_base(candidates, group) {
                all.push(common);
            }
            all.push(shared(candidates, group, Sharing::Apart, plan.apart));
        }
        for &one in &having {
            let mut alone = vec![None; group.len()];
            alone[one] = group[one];
            // In a single recording its own effects are not distinguishable from those of the unit in all, held-out ones
            // included; events are its own.
            let happens_once =
                group[one].is_some_and(|place| candidates[one][place].event_gyro().is_some());
            let sharing = match candidates.len() == 1 && !happens_once {
                true => Sharing::Common,
                false => Sharing::Only(one),
            };
            let price = match having.len() {
                1 => 0.0,
                count => plan.only + (count as f64).ln(),
            };
            all.push(shared(candidates, &alone, sharing, price));
        }
    }
    require(&mut all, candidates);
    all
}

/// True if candidates of two recordings may be one effect. An event belongs to one recording.
fn may_be_one(a: &Candidate, b: &Candidate) -> bool {
    let is_linear = |one: &Candidate| one.base.iter().all(|base| *base == 0.0);
    // Delays are one effect whatever they are linearised about; other nonlinear candidates need the same base.
    let is_one_column = rlg_catalogue::candidates::is_delay(a.kind)
        || (is_linear(a) && is_linear(b))
        || a.base == b.base;
    a.kind == b.kind && a.variant == b.variant && is_one_column && a.event_gyro().is_none()
}

/// True if the candidates of a group are linearised about the same values.
fn has_one_base(candidates: &[&[Candidate]], group: &[Option<usize>]) -> bool {
    let mut known: Vec<(&str, f64)> = Vec::new();
    for (own, place) in candidates.iter().zip(group) {
        let Some(one) = place.map(|place| &own[place]) else {
            continue;
        };
        for (name, base) in one.names.iter().zip(&one.base) {
            match known.iter().find(|(other, _)| other == name) {
                Some((_, other)) if other != base => return false,
                Some(_) => {}
                None => known.push((name, *base)),
            }
        }
    }
    true
}

/// Forms one effect of the recordings in `group`.
fn shared(
    candidates: &[&[Candidate]],
    group: &[Option<usize>],
    sharing: Sharing,
    price: f64,
) -> Shared {
    let (mut names, mut base): (Vec<String>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut bounds: Vec<Bound> = Vec::new();
    let (mut terms, mut fixed) = (Vec::new(), Vec::new());
    let mut own = vec![None; group.len()];
    let mut own_price = f64::NEG_INFINITY;
    let mut like = None;
    for (recording, place) in group.iter().enumerate() {
        let Some(place) = *place else {
            continue;
        };
        let one = &candidates[recording][place];
        like = like.or(Some(one));
        own_price = own_price.max(one.hypothesis.price);
        let parameters: Vec<usize> = (0..one.names.len())
            .map(|parameter| {
                let is_it = |name: &String| *name == one.names[parameter];
                let known = match sharing {
                    Sharing::Apart => None,
                    _ => names.iter().position(is_it),
                };
                known.unwrap_or_else(|| {
                    names.push(one.names[parameter].clone());
                    base.push(one.base[parameter]);
                    bounds.push(one.hypothesis.bound(parameter));
                    names.len() - 1
                })
            })
            .collect();
        let moved = behind(&one.hypothesis, recording * RECORDS);
        terms.extend(moved.terms.into_iter().map(|mut term| {
            term.parameter = parameters[term.parameter];
            term
        }));
        fixed.extend(moved.fixed);
        own[recording] = Some((place, parameters));
    }
    let like = like.expect("a group has a recording");
    let candidate = Candidate {
        kind: like.kind,
        variant: like.variant,
        hypothesis: Hypothesis {
            parameters: names.len(),
            terms,
            fixed,
            requires: None,
            bounds,
            price: own_price + price,
        },
        names,
        base,
    };
    Shared {
        candidate,
        sharing,
        own,
    }
}

/// Sets the candidate that each shared candidate requires, of the same sharing if there is one.
fn require(all: &mut [Shared], candidates: &[&[Candidate]]) {
    for place in 0..all.len() {
        let of_first = all[place]
            .own
            .iter()
            .enumerate()
            .find_map(|(recording, own)| {
                let required = candidates[recording][own.as_ref()?.0].hypothesis.requires?;
                Some((recording, required))
            });
        let Some((recording, required)) = of_first else {
            continue;
        };
        let is_it =
            |one: &Shared| matches!(&one.own[recording], Some((own, _)) if *own == required);
        let sharing = all[place].sharing;
        let same = all
            .iter()
            .position(|one| is_it(one) && one.sharing == sharing);
        all[place].candidate.hypothesis.requires = same.or_else(|| all.iter().position(is_it));
    }
}

/// Restricts a fit to one recording: its own candidates and noise, other members left out.
pub(crate) fn seen_by(fit: &Fit, all: &[Shared], recording: usize) -> Fit {
    let mut own = with_noise_of(fit, recording);
    own.members.clear();
    own.blocks.clear();
    let mut parameters: Vec<usize> = Vec::new();
    let acting = fit.members.iter().zip(&fit.blocks);
    for (&member, block) in acting {
        let Some((place, of_member)) = &all[member].own[recording] else {
            continue;
        };
        let first = parameters.len();
        parameters.extend(of_member.iter().map(|parameter| block.start + parameter));
        own.members.push(*place);
        own.blocks.push(first..parameters.len());
    }
    for gap in &mut own.gaps {
        let first = parameters.len();
        parameters.extend(gap.clone());
        *gap = first..parameters.len();
    }
    own.estimate = nalgebra::DVector::from_fn(parameters.len(), |k, _| fit.estimate[parameters[k]]);
    own.covariance = nalgebra::DMatrix::from_fn(parameters.len(), parameters.len(), |i, j| {
        fit.covariance[(parameters[i], parameters[j])]
    });
    own
}

/// The same fit with the noise and the gaps of one recording.
pub(crate) fn with_noise_of(fit: &Fit, recording: usize) -> Fit {
    let records = recording * RECORDS..(recording + 1) * RECORDS;
    Fit {
        levels: fit.levels[records.clone()].to_vec(),
        drift: fit.drift[records.clone()].to_vec(),
        gaps: fit.gaps[records].to_vec(),
        ..fit.clone()
    }
}

#[cfg(test)]
mod tests {
    use rlg_catalogue::Candidate;
    use rlg_catalogue::candidates::Variant;
    use rlg_inference::{Hypothesis, Term};
    use rlg_plan::SeveralPlan;

    use super::{Grouping, Sharing, spelt_out};

    /// One parameter on each of some gyros, columns as the gyros.
    fn candidate(kind: &'static str, variant: Variant, gyros: &[usize]) -> Candidate {
        let term = |(parameter, &gyro): (usize, &usize)| Term {
            parameter,
            record: gyro,
            column: gyro,
            coefficient: 1.0,
        };
        Candidate {
            kind,
            variant,
            names: gyros
                .iter()
                .map(|&gyro| ["x", "y", "z"][gyro].to_string())
                .collect(),
            base: vec![0.0; gyros.len()],
            hypothesis: Hypothesis {
                price: 1.0,
                ..Hypothesis::of_terms(gyros.len(), gyros.iter().enumerate().map(term).collect())
            },
        }
    }

    #[test]
    fn parameters_of_one_name_are_one_where_a_size_is_common_and_several_where_it_is_not() {
        let first = [candidate("gyro_scale", Variant::Whole, &[0, 1])];
        let second = [candidate("gyro_scale", Variant::Whole, &[1, 2])];
        let plan = SeveralPlan::default();
        let all = spelt_out(&[&first, &second], Grouping::Recordings, &plan);
        let sharings: Vec<Sharing> = all.iter().map(|one| one.sharing).collect();
        let only = [Sharing::Only(0), Sharing::Only(1)];
        assert_eq!(
            sharings,
            [&[Sharing::Common, Sharing::Apart], &only[..]].concat()
        );
        let common = &all[0].candidate;
        assert_eq!(common.names, ["x", "y", "z"]);
        let places: Vec<(usize, usize)> = common
            .hypothesis
            .terms
            .iter()
            .map(|term| (term.parameter, term.record))
            .collect();
        assert_eq!(places, [(0, 0), (1, 1), (1, 4), (2, 5)]);
        assert_eq!(all[1].candidate.names, ["x", "y", "y", "z"]);
        assert_eq!(
            all[1].alone_in(1, &second),
            (
                Candidate {
                    hypothesis: Hypothesis {
                        price: 1.0 + plan.apart,
                        ..second[0].hypothesis.clone()
                    },
                    ..second[0].clone()
                },
                2
            )
        );
        assert_eq!(all[0].in_recording(1).hypothesis.terms[0].record, 1);
    }

    #[test]
    fn what_happens_once_happens_in_one_recording() {
        let step = [candidate(
            "gyro_bias_step",
            Variant::Event { axis: 0, row: 7 },
            &[0],
        )];
        for grouping in [Grouping::Recordings, Grouping::Stretches] {
            let all = spelt_out(&[&step, &step], grouping, &SeveralPlan::default());
            let sharings: Vec<Sharing> = all.iter().map(|one| one.sharing).collect();
            assert_eq!(sharings, [Sharing::Only(0), Sharing::Only(1)]);
        }
    }

    #[test]
    fn what_one_recording_shows_is_the_units_and_what_happens_once_its_own() {
        let both = [
            candidate("gyro_scale", Variant::Whole, &[0, 1, 2]),
            candidate("gyro_bias_step", Variant::Event { axis: 0, row: 7 }, &[0]),
        ];
        let all = spelt_out(&[&both], Grouping::Recordings, &SeveralPlan::default());
        let sharings: Vec<Sharing> = all.iter().map(|one| one.sharing).collect();
        assert_eq!(sharings, [Sharing::Common, Sharing::Only(0)]);
    }

    #[test]
    fn what_acts_in_a_stretch_of_a_recording_acts_in_all_of_it() {
        let scale = [candidate("gyro_scale", Variant::Whole, &[0, 1, 2])];
        let all = spelt_out(
            &[&scale, &scale],
            Grouping::Stretches,
            &SeveralPlan::default(),
        );
        let sharings: Vec<Sharing> = all.iter().map(|one| one.sharing).collect();
        assert_eq!(sharings, [Sharing::Common]);
        let own_price = scale[0].hypothesis.price;
        assert!((all[0].candidate.hypothesis.price - own_price).abs() < f64::EPSILON);
    }
}
