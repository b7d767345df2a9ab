//! Which effects, if any.
//!
//! Enters: a [`Bench`] of the fitted part. Leaves: [`Choice`]: effects, their joint fit, the trials made
//! and the rivals that cannot be told from each effect.
//!
//! Forwards by evidence, backwards by likelihood ratio, then exchanges of one for one and one for two, until nothing
//! changes. "Nothing" is
//! the candidate that every other must beat: an effect enters only if its likelihood ratio would come by
//! chance in fewer recordings than its share of the family's significance. Shares go by prior odds, and each
//! hypothesis has one, however often it is weighed again: asking the same question twice of the same data is no
//! second chance, while a search over a grid is one for every point.

use nalgebra::{DMatrix, DVector};

use super::bench::Bench;
use super::declare::{CATALOGUE_SIGNIFICANCE, REGRESSOR_FIDELITY};
use super::hypotheses::CATALOGUE;
use super::information::{Information, Solution};
use super::weigh::{chance, is_close, likeliest_width, prior_width, share};
use super::workbench::Parameters;

/// Rounds of exchange; each must improve the evidence, so they end by themselves long before.
const MOST_ROUNDS: usize = 12;

/// Gauss–Newton steps after an effect enters; delays of a sample converge in three.
const NEWTON_STEPS: usize = 4;

/// An effect must be worth this much evidence, or it does not enter, however significant.
const LEAST_EVIDENCE: f64 = 3.0;

/// Less evidence than this is a tie; ties stay, so that the search ends.
const BETTER: f64 = 1.0;

/// One chosen effect.
#[derive(Clone)]
pub struct Chosen {
    /// Index into the catalogue.
    pub effect: usize,
    /// Its parameters.
    pub values: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// ln of the evidence gained by having it beside the others.
    pub log_evidence_gain: f64,
    /// Chance of such a likelihood ratio without it, trials counted.
    pub p_value: f64,
    /// Other kinds that would explain the same data as well in its place.
    pub indistinguishable_from: Vec<usize>,
    /// A product of channels outside the catalogue that explains as much, and its gyro.
    pub unlisted_rival: Option<(usize, String)>,
    /// Whether an encoder's error explains as much.
    pub harmonic_rival: bool,
    /// Those of them that gravity, as the accelerometers feel it, speaks against.
    pub gravity_speaks_against: Vec<usize>,
}

/// The outcome of the search.
pub struct Choice {
    /// The chosen effects, in the order of the catalogue.
    pub chosen: Vec<Chosen>,
    /// Hypotheses tried, all rounds counted.
    pub trials: usize,
    /// Effects this recording could have shown at their typical size, and how strongly (matched-filter SNR).
    pub reach: Vec<(usize, f64)>,
    /// Rivals that were weighed and lost: effect, ln evidence behind the winner.
    pub runners_up: Vec<(usize, f64)>,
}

impl Choice {
    /// Which were chosen.
    pub fn effects(&self) -> Vec<usize> {
        self.chosen.iter().map(|one| one.effect).collect()
    }
}

/// Searches. `candidates` are the effects whose columns are on the bench.
pub fn select<B: Bench>(
    bench: &mut B,
    parameters: &Parameters,
    candidates: &[usize],
    declared: Option<&B::Declared>,
) -> Choice {
    let mut search = Search::new(parameters, candidates);
    let mut set: Vec<usize> = Vec::new();
    bench.linearise_at_nothing();
    let mut information = bench.information();
    let rounds = if declared.is_some() { 2 } else { 1 };
    for round in 0..rounds {
        set = search.run(bench, &mut information, set);
        // The first noise model was fitted under a generous library; now only what was selected.
        if let (0, Some(declared)) = (round, declared) {
            bench.refit_noise(&set, declared);
            information = bench.information();
        }
    }
    let chosen = search.describe(&information, &set);
    let reach = candidates
        .iter()
        .map(|&effect| {
            let typical = CATALOGUE[effect].card().typical;
            let power: f64 = parameters
                .of(effect)
                .map(|index| information.fisher[(index, index)])
                .fold(0.0, f64::max);
            (effect, typical * power.sqrt())
        })
        .collect();
    let runners_up = search.runners_up(&information, &set);
    Choice {
        chosen,
        trials: search.trials,
        reach,
        runners_up,
    }
}

/// The set that the same search ends with, and for each of it the kinds that cannot be told from it. Quicker,
/// for trials by the hundred: nothing is described, and the noise stays as it is.
pub fn names(
    bench: &mut impl Bench,
    parameters: &Parameters,
    candidates: &[usize],
) -> Vec<(usize, Vec<usize>)> {
    let mut search = Search::new(parameters, candidates);
    let mut information = bench.information();
    let set = search.run(bench, &mut information, Vec::new());
    set.iter()
        .map(|&effect| (effect, search.rivals(&information, &set, effect)))
        .collect()
}

/// Those of `others` that would explain what an effect of a set explains as well in its place.
pub fn rivals(
    parameters: &Parameters,
    information: &Information,
    others: &[usize],
    set: &[usize],
    effect: usize,
) -> Vec<usize> {
    Search::new(parameters, others).rivals(information, set, effect)
}

struct Search<'a> {
    parameters: &'a Parameters,
    candidates: &'a [usize],
    trials: usize,
    /// Sought effects that explain what another does as well as it: (sought, in the place of).
    close: Vec<(usize, usize)>,
    /// Which effects were looked for beside which sets.
    sought: Vec<(usize, Vec<usize>)>,
    /// Points of the grids they were looked for on.
    grids: Vec<(usize, usize)>,
}

/// The possible value of an effect's parameter next to one, by its index: what has no column, as an axis without a mode,
/// is nothing.
fn possible(
    information: &Information,
    (effect, parameter): (usize, usize),
    index: usize,
    value: f64,
) -> f64 {
    let [least, most] = CATALOGUE[effect].card().range(parameter);
    match information.fisher[(index, index)] == 0.0 {
        true => 0.0,
        false => value.clamp(least, most),
    }
}

/// A fit of parameters with priors of these widths, in the same order.
fn solve(information: &Information, indices: &[usize], widths: &[f64]) -> Solution {
    information.solve(indices, &|index| {
        let place = indices.iter().position(|&one| one == index);
        widths[place.expect("of the set")]
    })
}

/// What a set is worth.
struct Standing {
    log_likelihood_gain: f64,
    /// ln of it.
    evidence: f64,
}

impl<'a> Search<'a> {
    fn new(parameters: &'a Parameters, candidates: &'a [usize]) -> Self {
        Self {
            parameters,
            candidates,
            trials: 0,
            close: Vec::new(),
            sought: Vec::new(),
            grids: Vec::new(),
        }
    }

    fn run(
        &mut self,
        bench: &mut impl Bench,
        information: &mut Information,
        mut set: Vec<usize>,
    ) -> Vec<usize> {
        for _ in 0..MOST_ROUNDS {
            let before = set.clone();
            if let Some(effect) = self.best_addition(information, &set) {
                set.push(effect);
                set.sort_unstable();
                self.settle(bench, information, &set);
            }
            // A resonance looks like many small things: it is looked for before they all come in.
            if set.len() == 1
                && let Some(better) = self.best_sought(bench, information, &set)
            {
                set = better;
            }
            while let Some(effect) = self.worst(information, &set) {
                set.retain(|&kept| kept != effect);
                self.forget(bench, information, effect);
            }
            // Bounded: an effect that is weighed as if it were linear can look better than it settles, for ever.
            for _ in 0..MOST_ROUNDS {
                let Some((out, into)) = self.best_exchange(information, &set) else {
                    break;
                };
                set.retain(|&kept| kept != out);
                self.forget(bench, information, out);
                set.push(into);
                set.sort_unstable();
                self.settle(bench, information, &set);
            }
            for _ in 0..MOST_ROUNDS {
                let Some((out, into)) = self.best_merger(information, &set) else {
                    break;
                };
                set.retain(|kept| !out.contains(kept));
                out.iter()
                    .for_each(|&gone| self.forget(bench, information, gone));
                set.push(into);
                set.sort_unstable();
                self.settle(bench, information, &set);
            }
            if set == before {
                match self.best_sought(bench, information, &set) {
                    Some(better) => set = better,
                    None => break,
                }
            }
        }
        set
    }

    /// Looks for the effects that have no point to be linearised at before they are found; the set with the
    /// first that explains more than what it takes the place of.
    fn best_sought(
        &mut self,
        bench: &mut impl Bench,
        information: &mut Information,
        set: &[usize],
    ) -> Option<Vec<usize>> {
        let sought: Vec<usize> = self
            .candidates
            .iter()
            .copied()
            .filter(|effect| !CATALOGUE[*effect].stands_behind().is_empty())
            .filter(|effect| !set.contains(effect))
            .filter(|effect| !self.sought.contains(&(*effect, set.to_vec())))
            .collect();
        for effect in sought {
            self.sought.push((effect, set.to_vec()));
            let behind = CATALOGUE[effect].stands_behind();
            let (gone, rest): (Vec<usize>, Vec<usize>) = set
                .iter()
                .copied()
                .partition(|kept| behind.contains(&CATALOGUE[*kept].card().kind));
            let mut rests = vec![rest];
            if !rests[0].is_empty() {
                rests.push(Vec::new());
            }
            for rest in rests {
                let fitted = self.fit(information, &rest);
                let values: Vec<(usize, f64)> = self
                    .parameters
                    .of_all(&rest)
                    .into_iter()
                    .zip(fitted.values.iter().copied())
                    .collect();
                let Some(found) = bench.seek(effect, &values) else {
                    continue;
                };
                self.trials += found.trials;
                self.grids.push((effect, found.trials));
                let mut all = rest.clone();
                all.push(effect);
                all.sort_unstable();
                bench.relinearise(effect, &found.at);
                let mut both = all.clone();
                both.extend(set.iter().filter(|kept| !all.contains(kept)));
                let mut trial = bench.information_about(&self.indices(information, &both));
                // Where the motion does not fix a resonance, the approach runs off; it explains no less where it was found.
                let is_close_as_found =
                    found.within_reach && self.could_be(&trial, &self.standing(&trial, set), &all);
                self.approach(bench, &mut trial, &all, &both);
                let gain = self.evidence(&trial, &all) - self.evidence(&trial, set);
                let (p_value, clear) = self.significance(&trial, &rest, effect);
                let credible = self.is_credible(&trial, &all);
                if gain > BETTER && p_value < CATALOGUE_SIGNIFICANCE && clear && credible {
                    *information = bench.information();
                    return Some(all);
                }
                let is_close = || self.could_be(&trial, &self.standing(&trial, set), &all);
                if is_close_as_found || found.within_reach && is_close() {
                    self.close.extend(gone.iter().map(|&kept| (effect, kept)));
                }
                // What `information` says was said of this bench.
                bench.relinearise(effect, &vec![0.0; CATALOGUE[effect].card().count()]);
            }
        }
        None
    }

    /// How well a set explains the data.
    fn standing(&self, information: &Information, set: &[usize]) -> Standing {
        Standing {
            log_likelihood_gain: self.fit(information, set).log_likelihood_gain,
            evidence: self.evidence(information, set),
        }
    }

    /// Whether another set explains the data so nearly as well as one that stands there that it may be the truth.
    fn could_be(&self, information: &Information, best: &Standing, other: &[usize]) -> bool {
        let Standing {
            log_likelihood_gain,
            evidence,
        } = self.standing(information, other);
        let lost = 2.0 * (best.log_likelihood_gain - log_likelihood_gain);
        is_close(lost, best.evidence - evidence) && self.is_credible(information, other)
    }

    /// Puts a nonlinear effect that left the set back to being linearised at nothing.
    fn forget(&self, bench: &mut impl Bench, information: &mut Information, effect: usize) {
        if !CATALOGUE[effect].is_linear() {
            bench.relinearise(effect, &vec![0.0; CATALOGUE[effect].card().count()]);
            *information = bench.information();
        }
    }

    /// Gauss–Newton on the effects that are not linear.
    fn settle(&self, bench: &mut impl Bench, information: &mut Information, set: &[usize]) {
        if set.iter().all(|&effect| CATALOGUE[effect].is_linear()) {
            return;
        }
        let mut of_set = information.clone();
        self.approach(bench, &mut of_set, set, set);
        *information = bench.information();
    }

    /// The same, with `information` kept up about the effects in `about` only, which include `set`.
    fn approach(
        &self,
        bench: &mut impl Bench,
        information: &mut Information,
        set: &[usize],
        about: &[usize],
    ) {
        for _ in 0..NEWTON_STEPS {
            let indices = self.indices(information, set);
            let solution = self.fit(information, set);
            for &effect in set.iter().filter(|&&effect| !CATALOGUE[effect].is_linear()) {
                let at: Vec<f64> = self
                    .parameters
                    .of(effect)
                    .enumerate()
                    .map(|(parameter, index)| {
                        let place = indices
                            .iter()
                            .position(|&i| i == index)
                            .expect("of the set");
                        let value = solution.values[place];
                        possible(information, (effect, parameter), index, value)
                    })
                    .collect();
                bench.relinearise(effect, &at);
            }
            *information = bench.information_about(&self.indices(information, about));
        }
    }

    /// The parameters of a set, and the sizes of the terms found so far, which belong to every set.
    fn indices(&self, information: &Information, set: &[usize]) -> Vec<usize> {
        let mut indices = self.parameters.of_all(set);
        indices.extend(self.parameters.count()..information.parameters);
        indices
    }

    fn fit(&self, information: &Information, set: &[usize]) -> Solution {
        information.solve(&self.indices(information, set), &|index| {
            prior_width(self.parameters, information, index)
        })
    }

    /// ln evidence of a set. Every strength is as likely before as any other, so each effect's prior is as wide as makes
    /// the data most likely: a weak effect is not held against its kind.
    fn evidence(&self, information: &Information, set: &[usize]) -> f64 {
        let indices = self.indices(information, set);
        let fitted = self.fit(information, set);
        let mut widths = self.widths(information, &indices);
        for &effect in set {
            let card = CATALOGUE[effect].card();
            let first = self.first_of(&indices, effect);
            // Parameters of one kind share a width; a frequency or a damping has its own.
            let alike = card.shape.count();
            widths[first..first + alike].fill(likeliest_width(&fitted, first, alike));
            for other in alike..card.count() {
                let value = fitted.values[first + other].abs();
                widths[first + other] = value.max(card.typical_of(other));
            }
        }
        let odds: f64 = set
            .iter()
            .map(|&effect| CATALOGUE[effect].card().log_prior_odds)
            .sum();
        solve(information, &indices, &widths).log_evidence + odds
    }

    /// Whether every fitted value is credible physics.
    fn is_credible(&self, information: &Information, set: &[usize]) -> bool {
        let indices = self.indices(information, set);
        let solution = self.fit(information, set);
        indices.iter().enumerate().all(|(place, &index)| {
            let value = solution.values[place];
            let spread = 3.0 * solution.covariance[(place, place)].sqrt();
            self.parameters.id(index).is_none_or(|id| {
                let [least, most] = CATALOGUE[id.effect].card().range(id.parameter);
                value + spread >= least && value - spread <= most
            })
        })
    }

    /// Likelihood-ratio chance of `effect` beside `rest`, trials counted, and whether it clears what the
    /// imperfection of the regressors could leave.
    fn significance(
        &self,
        information: &Information,
        rest: &[usize],
        effect: usize,
    ) -> (f64, bool) {
        let mut all = rest.to_vec();
        all.push(effect);
        all.sort_unstable();
        let (with, without) = (self.fit(information, &all), self.fit(information, rest));
        let ratio = 2.0 * (with.log_likelihood_gain - without.log_likelihood_gain).max(0.0);
        let degrees = (with.degrees - without.degrees).round().max(1.0);
        let indices = self.indices(information, &all);
        let own = self.parameters.of(effect);
        let pattern: Vec<(usize, f64)> = indices
            .into_iter()
            .zip(with.values.iter().copied())
            .filter(|(index, _)| own.contains(index))
            .collect();
        let chance = chance(ratio, degrees, information.noise_degrees(&pattern));
        let trials = self.points(effect) / share(self.candidates, effect);
        let p_value = -(trials * (-chance).ln_1p()).exp_m1();
        let allowance = REGRESSOR_FIDELITY * (2.0 * without.log_likelihood_gain).max(0.0).sqrt();
        (p_value, ratio > degrees + allowance * allowance)
    }

    /// Points of the grid that an effect was sought on.
    fn points(&self, effect: usize) -> f64 {
        let grids = self.grids.iter().filter(|(sought, _)| *sought == effect);
        grids.map(|(_, points)| *points).max().unwrap_or(1) as f64
    }

    fn best_addition(&mut self, information: &Information, set: &[usize]) -> Option<usize> {
        let now = self.evidence(information, set);
        let mut best: Option<(usize, f64)> = None;
        for &effect in self
            .candidates
            .iter()
            .filter(|effect| !set.contains(effect))
        {
            self.trials += 1;
            let mut all = set.to_vec();
            all.push(effect);
            all.sort_unstable();
            let gain = self.evidence(information, &all) - now;
            if gain < LEAST_EVIDENCE || best.is_some_and(|(_, most)| gain <= most) {
                continue;
            }
            let (p_value, clear) = self.significance(information, set, effect);
            if p_value < CATALOGUE_SIGNIFICANCE && clear && self.is_credible(information, &all) {
                best = Some((effect, gain));
            }
        }
        best.map(|(effect, _)| effect)
    }

    fn worst(&self, information: &Information, set: &[usize]) -> Option<usize> {
        self.worst_of(information, set, set)
    }

    /// The one of `doubtful` that the set can best do without, where it can.
    fn worst_of(
        &self,
        information: &Information,
        set: &[usize],
        doubtful: &[usize],
    ) -> Option<usize> {
        let now = self.evidence(information, set);
        set.iter()
            .filter(|effect| doubtful.contains(effect))
            .map(|&effect| {
                let rest: Vec<usize> = set.iter().copied().filter(|&kept| kept != effect).collect();
                let gain = now - self.evidence(information, &rest);
                let (p_value, clear) = self.significance(information, &rest, effect);
                (
                    effect,
                    gain,
                    p_value < CATALOGUE_SIGNIFICANCE && clear && gain >= LEAST_EVIDENCE,
                )
            })
            .filter(|(_, _, keep)| !keep)
            .min_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(effect, _, _)| effect)
    }

    /// An exchange of one chosen effect for one candidate that raises the evidence.
    fn best_exchange(
        &mut self,
        information: &Information,
        set: &[usize],
    ) -> Option<(usize, usize)> {
        self.best_exchange_of(information, set, set)
    }

    /// The same where the one to go is one of `doubtful`.
    fn best_exchange_of(
        &mut self,
        information: &Information,
        set: &[usize],
        doubtful: &[usize],
    ) -> Option<(usize, usize)> {
        let now = self.evidence(information, set);
        let mut best: Option<(usize, usize, f64)> = None;
        for &out in set.iter().filter(|effect| doubtful.contains(effect)) {
            for &into in self.candidates.iter().filter(|into| !set.contains(into)) {
                self.trials += 1;
                let mut all: Vec<usize> = set.iter().copied().filter(|&kept| kept != out).collect();
                all.push(into);
                all.sort_unstable();
                let gain = self.evidence(information, &all) - now;
                if gain > best.map_or(BETTER, |(_, _, most)| most)
                    && self.is_credible(information, &all)
                {
                    best = Some((out, into, gain));
                }
            }
        }
        best.map(|(out, into, _)| (out, into))
    }

    /// One candidate in the place of two chosen effects that raises the evidence: two smooth kinds that came in one
    /// after the other can imitate a third, and neither alone is worth exchanging.
    fn best_merger(
        &mut self,
        information: &Information,
        set: &[usize],
    ) -> Option<([usize; 2], usize)> {
        let now = self.evidence(information, set);
        let mut best: Option<([usize; 2], usize, f64)> = None;
        for (place, &first) in set.iter().enumerate() {
            for &second in &set[place + 1..] {
                let rest = |kept: &usize| *kept != first && *kept != second;
                for &into in self.candidates.iter().filter(|into| !set.contains(into)) {
                    self.trials += 1;
                    let mut all: Vec<usize> = set.iter().copied().filter(rest).collect();
                    all.push(into);
                    all.sort_unstable();
                    let gain = self.evidence(information, &all) - now;
                    if gain > best.map_or(BETTER, |(_, _, most)| most)
                        && self.is_credible(information, &all)
                    {
                        best = Some(([first, second], into, gain));
                    }
                }
            }
        }
        best.map(|(out, into, _)| (out, into))
    }

    /// The values of a fit, those that these rows hardly show drawn to nothing by what the others of their effect are: they
    /// are as little known as before, and multiply what other rows may show. Strengths beside a frequency stay: one
    /// motion may show them and the frequency as one number, and then shows none of them well.
    fn foretold(
        &self,
        information: &Information,
        set: &[usize],
        fitted: &Solution,
    ) -> DVector<f64> {
        /// Times the width that the effect's numbers have: one known to its own size keeps all but a hundredth.
        const WIDE: f64 = 10.0;
        let indices = self.indices(information, set);
        let mut widths = self.widths(information, &indices);
        for &effect in set {
            let first = self.first_of(&indices, effect);
            let card = CATALOGUE[effect].card();
            let alike = card.shape.count();
            if alike < card.count() {
                continue;
            }
            let likely = WIDE * likeliest_width(fitted, first, alike);
            let own = widths[first..first + alike].iter_mut();
            own.filter(|_| likely > 0.0)
                .for_each(|width| *width = width.min(likely));
        }
        solve(information, &indices, &widths).values
    }

    /// The width of each parameter's prior in a fit.
    fn widths(&self, information: &Information, indices: &[usize]) -> Vec<f64> {
        let each = indices.iter();
        each.map(|&index| prior_width(self.parameters, information, index))
            .collect()
    }

    /// Where an effect's parameters begin.
    fn first_of(&self, indices: &[usize], effect: usize) -> usize {
        let start = self.parameters.of(effect).start;
        let place = indices.iter().position(|&index| index == start);
        place.expect("of the set")
    }

    fn describe(&self, information: &Information, set: &[usize]) -> Vec<Chosen> {
        let indices = self.indices(information, set);
        let joint = self.fit(information, set);
        let foretold = self.foretold(information, set, &joint);
        let now = self.evidence(information, set);
        set.iter()
            .map(|&effect| {
                let rest: Vec<usize> = set.iter().copied().filter(|&kept| kept != effect).collect();
                let first = self.first_of(&indices, effect);
                let places: Vec<usize> =
                    (first..first + self.parameters.of(effect).len()).collect();
                let (p_value, _) = self.significance(information, &rest, effect);
                Chosen {
                    effect,
                    values: DVector::from_fn(places.len(), |a, _| {
                        let value = foretold[places[a]];
                        match a < CATALOGUE[effect].card().shape.count() {
                            true => value,
                            // A step of the fit may leave what a frequency or a damping can be.
                            false => possible(information, (effect, a), indices[places[a]], value),
                        }
                    }),
                    covariance: DMatrix::from_fn(places.len(), places.len(), |a, b| {
                        joint.covariance[(places[a], places[b])]
                    }),
                    log_evidence_gain: now - self.evidence(information, &rest),
                    p_value,
                    indistinguishable_from: self.rivals(information, set, effect),
                    unlisted_rival: None,
                    harmonic_rival: false,
                    gravity_speaks_against: Vec::new(),
                }
            })
            .collect()
    }

    /// Kinds that would explain what `effect` explains to within [`SEPARATION`](super::declare::SEPARATION), and either as probably or
    /// without any loss that noise would show.
    fn rivals(&self, information: &Information, set: &[usize], effect: usize) -> Vec<usize> {
        let standing = self.standing(information, set);
        let rest: Vec<usize> = set.iter().copied().filter(|&kept| kept != effect).collect();
        self.candidates
            .iter()
            .copied()
            .filter(|rival| !set.contains(rival))
            .filter(|&rival| {
                let kind = CATALOGUE[rival].card().kind;
                if CATALOGUE[effect].card().special_case_of.contains(&kind)
                    || self.close.contains(&(rival, effect))
                {
                    return true;
                }
                let mut all = rest.clone();
                all.push(rival);
                all.sort_unstable();
                self.could_be(information, &standing, &all)
            })
            .collect()
    }

    fn runners_up(&self, information: &Information, set: &[usize]) -> Vec<(usize, f64)> {
        let now = self.evidence(information, set);
        let mut list: Vec<(usize, f64)> = self
            .candidates
            .iter()
            .copied()
            .filter(|rival| !set.contains(rival))
            .filter_map(|rival| {
                set.iter()
                    .map(|&out| {
                        let mut all: Vec<usize> =
                            set.iter().copied().filter(|&kept| kept != out).collect();
                        all.push(rival);
                        now - self.evidence(information, &all)
                    })
                    .min_by(f64::total_cmp)
                    .map(|behind| (rival, behind))
            })
            .collect();
        list.sort_by(|a, b| a.1.total_cmp(&b.1));
        list
    }
}
