//! The search as a whole: listed physics, then events and unlisted physics, each held against the other.
//!
//! Enters: a [`Workbench`] on the fitted rows. Leaves: [`Catch`]. Listed effects are chosen first; what is
//! left is searched for events in time and for products of channels. A listed effect loses its name when
//! fewer free numbers outside the catalogue explain its share better, or when its amplitude is not the same
//! in every regime (diagnosis road, steps 6, 7 and 12). What objects and what is found is said by sight.rs.

use std::ops::Range;

use super::drift::{self, Suspect};
use super::empirical::{self, Form, Term};
use super::hypotheses::reference_harmonic;
use super::information::{Information, Solution};
use super::invariance::{self, Verdict};
use super::lattice::Lattice;
use super::names::Names;
use super::products::Survey;
use super::readings::Hunt;
use super::scene::Scene;
use super::select::{self, Choice};
use super::sight::{FoundOne, Objection, Sight};
use super::weigh::prior_width;
use super::workbench::{Parameters, Workbench};

/// Terms found in the data, at most; each must be significant by itself, so a recording with more than
/// this is not explained by terms.
pub(super) const MOST_TERMS: usize = 8;

/// Where so many terms came and went again, more of them would go, too.
const MOST_LEFT: usize = 6;

/// In noise that is held without drift: where drift could stand in the place of so many, it is what is there.
const MOST_DOUBTED: usize = 4;

/// How much better (2 Δ ln L) an expression must be than a named effect to take its place.
pub(super) const CLEARLY_BETTER: f64 = 20.0;

/// A term whose size has come down to this many variances no longer says anything (a step, slip or product
/// enters with twenty or more).
pub(super) const IDLE: f64 = 9.0;

/// What a step or slip has ahead of a product of channels that explains as much (2 Δ ln L), one channel of a product of
/// two ahead of both (a force that never turns is a constant), and an effect ahead of a product nearly in its columns.
pub(super) const PLAINER: f64 = 10.0;

/// Chance of the scatter between regimes below which a name is vetoed.
pub(super) const VETO: f64 = 1e-5;

/// What the search brings home.
pub struct Catch {
    /// Listed effects.
    pub choice: Choice,
    /// Amplitudes by regime, one per chosen effect.
    pub regimes: Vec<Verdict>,
    /// Terms found in the data with size, standard deviation and chance.
    pub terms: Vec<FoundTerm>,
    /// Listed effects that fitted but lost their name, with the reason.
    pub vetoed: Vec<(usize, String)>,
    /// Those of them whose size differs between the regimes and in whose place nothing came.
    pub uneven: Vec<usize>,
    /// All fitted (parameter index, value).
    pub values: Vec<(usize, f64)>,
    /// What the fitted rows say about all parameters, at the values above.
    pub information: Information,
    /// What the products say of the whole residual.
    pub survey: Survey,
    /// Hypotheses, expressions and instants tried.
    pub trials: usize,
    /// Given up: drift, which the noise was not allowed to have, could stand in the place of too much.
    pub is_drift: bool,
}

/// A term and its size.
#[derive(Debug, Clone)]
pub struct FoundTerm {
    /// The term.
    pub term: Term,
    /// Its size in its own unit.
    pub size: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Covariance with the term after it: the other half of a harmonic.
    pub with_next: f64,
    /// What else it could be.
    pub alike: Alike,
    /// Likelihood ratio 2 Δ ln L when it entered.
    pub ratio: f64,
    /// Chance, trials counted.
    pub p_value: f64,
}

/// What else an encoder's harmonic could be; nothing of other terms.
#[derive(Debug, Clone, Default)]
pub struct Alike {
    /// Standard deviation of its order \[1\].
    pub order_std: f64,
    /// Expression outside the catalogue that explains as much.
    pub unlisted: Option<String>,
}

impl FoundTerm {
    /// Whether a counter without a dither could have made it.
    pub(super) fn is_hidden(&self, lattice: &Lattice, scene: &Scene) -> bool {
        is_hidden(&self.term, self.size, lattice, scene)
    }
}

fn is_hidden(term: &Term, size: f64, lattice: &Lattice, scene: &Scene) -> bool {
    let counts = lattice.pulse_rad[term.axis] > 0.0;
    let column = counts.then(|| term.column(scene).ok()).flatten();
    column.is_some_and(|column| lattice.hides(term.axis, &column, size))
}

/// Searches until nothing changes. The noise is refitted to what the choice leaves, or stays as it is.
pub fn hunt(
    bench: &mut Workbench,
    search: &Hunt,
    refit_noise: bool,
    progress: &dyn Fn(&str),
) -> Result<Catch, String> {
    let Hunt {
        parameters,
        candidates,
        regimes,
        products,
        given,
        lattice,
        ..
    } = *search;
    let declared = refit_noise.then_some(search.declared);
    let mut names = Names::new(candidates);
    let mut entered: Vec<(f64, f64)> = given.to_vec();
    let most_terms = MOST_TERMS + given.len();
    let mut left_idle: Vec<Term> = Vec::new();
    let mut trials = 0;
    let mut doubted = 0;
    loop {
        progress("weighing the listed effects");
        let mut choice = select::select(bench, parameters, &names.allowed, declared);
        trials += choice.trials + 3 * products.names.len();
        let set = choice.effects();
        let information = bench.information();
        let (indices, solution) = fit(parameters, &information, &set, bench.terms().len());
        let values: Vec<(usize, f64)> = indices
            .iter()
            .copied()
            .zip(solution.values.iter().copied())
            .collect();
        // Terms that the better explanation made idle leave first.
        let says_something = |place: usize| {
            let at = position(&indices, parameters.count() + place);
            let (size, term) = (solution.values[at], &bench.terms()[place]);
            size.powi(2) >= IDLE * solution.covariance[(at, at)]
                && !is_hidden(term, size, lattice, bench.scene())
        };
        // A half that the data do not bound leaves the other alone.
        let is_open = |place: usize| {
            let at = position(&indices, parameters.count() + place);
            let Form::Harmonic { order, .. } = bench.terms()[place].form else {
                return false;
            };
            solution.covariance[(at, at)].sqrt() > reference_harmonic::most_rad(order)
        };
        let idle = (0..bench.terms().len()).find_map(|place| {
            let both = empirical::together(bench.terms(), place);
            match both.clone().any(says_something) {
                false => Some(both),
                true => (!says_something(place) && is_open(place)).then(|| place..place + 1),
            }
        });
        if let Some(places) = idle {
            left_idle.extend(take_out(bench, &mut entered, places));
            continue;
        }
        progress("searching for unlisted physics");
        let survey = products.survey(bench, &indices);
        let verdicts = invariance::test(bench, parameters, &choice.chosen, &values, regimes);

        let resolution_hz = 1.0 / bench.seconds();
        let left = |term: &Term| {
            left_idle
                .iter()
                .any(|idle| alike(idle, term, resolution_hz))
        };
        let fresh = |term: &Term| !bench.terms().contains(term) && !left(term);
        // Slips are seen one by one in time, however many there are.
        let slips = bench.terms().iter().filter(|term| term.is_slip()).count();
        let room = bench.terms().len() - slips < most_terms && left_idle.len() < MOST_LEFT;
        let sight = Sight {
            bench: &*bench,
            parameters,
            survey: &survey,
            products,
            lattice,
            names: &names,
        };
        let explained = 2.0 * solution.log_likelihood_gain;
        let may_enter = |found: &[FoundOne]| room && found.iter().all(|one| fresh(&one.0));
        let several = sight.better_than_several(&information, &set);
        let objection = match several.filter(|found| may_enter(found)) {
            Some(better) => Some(Objection::Better(better)),
            None => sight.objection(&information, &choice, &verdicts),
        };
        let found = match objection {
            Some(Objection::Better(found)) if may_enter(&found) => found,
            Some(Objection::Veto(effect, reason)) => {
                names.lose(effect, reason);
                continue;
            }
            Some(Objection::Uneven(effect, chance)) => {
                names.lose_uneven(effect, chance, explained);
                continue;
            }
            _ if room => sight.refined(sight.best_term(&values, &[], explained, &fresh), &[]),
            _ => Vec::new(),
        };
        if let Some(effect) = sight.lost_effect(&found) {
            names.give_back(effect);
            continue;
        }
        if !found.is_empty() {
            for (term, ratio, p_value) in found {
                bench.add_term(term)?;
                entered.push((ratio, p_value));
            }
            continue;
        }
        progress("weighing drifting noise");
        let suspects = set.iter().map(|&effect| match names.is_back(effect) {
            true => Suspect::Returned(effect),
            false => Suspect::Effect(effect),
        });
        // Lines at rest were found over stretches, where no walk reaches.
        let at_rest = bench.scene().streams.at_rest.is_some();
        let settled = if at_rest { given.len() } else { 0 };
        let terms = (settled..bench.terms().len()).map(|place| {
            let Range { start, end } = empirical::together(bench.terms(), place);
            let count = end - start;
            (place == start).then_some(Suspect::Terms {
                first: start,
                count,
            })
        });
        let suspects: Vec<Suspect> = suspects.chain(terms.flatten()).collect();
        let drift =
            drift::first_that_could_be_drift(bench, parameters, search.declared, &set, suspects)?;
        doubted += usize::from(drift.is_some());
        let is_drift = !refit_noise && doubted == MOST_DOUBTED;
        match drift.filter(|_| !is_drift) {
            Some(Suspect::Effect(effect) | Suspect::Returned(effect)) => {
                names.lose_to_drift(effect);
                continue;
            }
            Some(Suspect::Terms { first, count }) => {
                let places = first..first + count;
                left_idle.extend(take_out(bench, &mut entered, places));
                continue;
            }
            None => {}
        }
        // What drift could have been is none of those that drift could not; it may be what they are all the same.
        for one in &mut choice.chosen {
            let more = select::rivals(parameters, &information, &names.doubted, &set, one.effect);
            one.indistinguishable_from.extend(more);
            one.indistinguishable_from.sort_unstable();
        }
        let sight = Sight {
            bench: &*bench,
            parameters,
            survey: &survey,
            products,
            lattice,
            names: &names,
        };
        let rivals = sight.unlisted_rivals(&information, &choice);
        let harmonics = sight.harmonic_rivals(&information, &choice);
        for (one, rival) in choice
            .chosen
            .iter_mut()
            .zip(rivals.into_iter().zip(harmonics))
        {
            (one.unlisted_rival, one.harmonic_rival) = rival;
        }
        let first = parameters.count();
        let terms = bench
            .terms()
            .iter()
            .zip(&entered)
            .enumerate()
            .map(|(place, (term, (ratio, p_value)))| {
                let at = indices
                    .iter()
                    .position(|&index| index == first + place)
                    .expect("always fitted");
                FoundTerm {
                    term: term.clone(),
                    size: solution.values[at],
                    std: solution.covariance[(at, at)].sqrt(),
                    with_next: if at + 1 < indices.len() {
                        solution.covariance[(at, at + 1)]
                    } else {
                        0.0
                    },
                    alike: sight.like_harmonic(&information, &set, place),
                    ratio: *ratio,
                    p_value: *p_value,
                }
            })
            .collect();
        return Ok(Catch {
            choice,
            regimes: verdicts,
            terms,
            uneven: names.unreplaced(explained),
            vetoed: names.vetoed,
            values,
            information,
            survey,
            trials,
            is_drift,
        });
    }
}

/// Takes terms that stand side by side from the bench, with what they entered by; returns them.
fn take_out(
    bench: &mut Workbench,
    entered: &mut Vec<(f64, f64)>,
    places: Range<usize>,
) -> Vec<Term> {
    let terms = bench.terms()[places.clone()].to_vec();
    for _ in places.clone() {
        bench.remove_term(places.start);
    }
    entered.drain(places);
    terms
}

/// Whether two terms say the same: lines do that are less than the record's resolution apart.
fn alike(a: &Term, b: &Term, resolution_hz: f64) -> bool {
    let line = |term: &Term| {
        let Form::Product { expression } = &term.form else {
            return None;
        };
        let inside = expression.strip_suffix(')')?;
        let (shape, frequency_hz) = inside.split_once('(')?;
        Some((shape.to_owned(), frequency_hz.parse::<f64>().ok()?))
            .filter(|(shape, _)| shape == "sine" || shape == "cosine")
    };
    match (line(a), line(b)) {
        (Some((shape, at_hz)), Some((other, near_hz))) => {
            a.axis == b.axis && shape == other && (at_hz - near_hz).abs() < resolution_hz
        }
        _ => a == b,
    }
}

/// The joint fit of a set and all found terms.
pub(super) fn fit(
    parameters: &Parameters,
    information: &Information,
    set: &[usize],
    terms: usize,
) -> (Vec<usize>, Solution) {
    let mut indices = parameters.of_all(set);
    indices.extend(parameters.count()..parameters.count() + terms);
    let solution = information.solve(&indices, &|index| {
        prior_width(parameters, information, index)
    });
    (indices, solution)
}

fn position(indices: &[usize], index: usize) -> usize {
    indices
        .iter()
        .position(|&known| known == index)
        .expect("every term is fitted")
}
