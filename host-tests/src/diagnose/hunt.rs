//! The search as a whole: listed physics, then events and unlisted physics, each held against the other.
//!
//! Enters: a [`Workbench`] on the fitted rows. Leaves: [`Catch`]. Listed effects are chosen first; what is
//! left is searched for events in time and for products of channels. A listed effect loses its name when
//! fewer free numbers outside the catalogue explain its share better, or when its amplitude is not the same
//! in every regime (diagnosis road, steps 6, 7 and 12).

use super::declare::{FAMILY_SIGNIFICANCE, REGRESSOR_FIDELITY};
use super::empirical::{Form, Term};
use super::events;
use super::information::{Information, Solution};
use super::invariance::{self, Verdict};
use super::noise::Declared;
use super::products::{Products, Survey};
use super::select::{self, Choice, prior_width};
use super::split::Regime;
use super::workbench::{Parameters, Workbench};

/// Terms found in the data, at most; each must be significant by itself, so a recording with more than
/// this is not explained by terms.
const MOST_TERMS: usize = 6;

/// How much better (2 Δ ln L) an expression must be than a named effect to take its place.
const CLEARLY_BETTER: f64 = 20.0;

/// Chance of the scatter between regimes below which a name is vetoed.
const VETO: f64 = 1e-5;

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
    /// All fitted (parameter index, value).
    pub values: Vec<(usize, f64)>,
    /// What the products say of the whole residual.
    pub survey: Survey,
    /// Hypotheses, expressions and instants tried.
    pub trials: usize,
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
    /// Likelihood ratio 2 Δ ln L when it entered.
    pub ratio: f64,
    /// Chance, trials counted.
    pub p_value: f64,
}

/// Searches until nothing changes.
pub fn hunt(
    bench: &mut Workbench,
    parameters: &Parameters,
    candidates: &[usize],
    declared: &[Declared; 3],
    regimes: &[Regime],
    products: &Products,
    progress: &dyn Fn(&str),
) -> Result<Catch, String> {
    let mut allowed: Vec<usize> = candidates.to_vec();
    let mut vetoed: Vec<(usize, String)> = Vec::new();
    let mut entered: Vec<(f64, f64)> = Vec::new();
    let mut trials = 0;
    loop {
        progress("weighing the listed effects");
        let choice = select::select(bench, parameters, &allowed, declared);
        trials += choice.trials + 3 * products.names.len();
        let set: Vec<usize> = choice.chosen.iter().map(|one| one.effect).collect();
        let information = bench.information();
        let (indices, solution) = fit(parameters, &information, &set, bench.terms().len());
        let values: Vec<(usize, f64)> = indices
            .iter()
            .copied()
            .zip(solution.values.iter().copied())
            .collect();
        progress("searching for unlisted physics");
        let survey = products.survey(bench, &indices);
        let verdicts = invariance::test(bench, parameters, &choice.chosen, &values, regimes);

        if let Some((effect, reason)) = unworthy(
            bench,
            parameters,
            &information,
            &choice,
            &verdicts,
            &survey,
            products,
        ) {
            allowed.retain(|&kept| kept != effect);
            vetoed.push((effect, reason));
            continue;
        }
        if bench.terms().len() < MOST_TERMS {
            let explained = 2.0 * solution.log_likelihood_gain;
            if let Some((term, ratio, p_value)) =
                best_term(bench, &values, &survey, products, explained)
            {
                bench.add_term(term)?;
                entered.push((ratio, p_value));
                continue;
            }
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
                    ratio: *ratio,
                    p_value: *p_value,
                }
            })
            .collect();
        return Ok(Catch {
            choice,
            regimes: verdicts,
            terms,
            vetoed,
            values,
            survey,
            trials,
        });
    }
}

/// The joint fit of a set and all found terms.
fn fit(
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

/// A chosen effect that does not deserve its name, with the reason.
fn unworthy(
    bench: &Workbench,
    parameters: &Parameters,
    information: &Information,
    choice: &Choice,
    verdicts: &[Verdict],
    survey: &Survey,
    products: &Products,
) -> Option<(usize, String)> {
    let set: Vec<usize> = choice.chosen.iter().map(|one| one.effect).collect();
    let terms = bench.terms().len();
    let full = fit(parameters, information, &set, terms).1;
    for (one, verdict) in choice.chosen.iter().zip(verdicts) {
        if verdict.p_value < VETO {
            return Some((
                one.effect,
                format!(
                    "its size differs between the regimes (chance {:.1e})",
                    verdict.p_value
                ),
            ));
        }
        let rest: Vec<usize> = set
            .iter()
            .copied()
            .filter(|&kept| kept != one.effect)
            .collect();
        let (rest_indices, without) = fit(parameters, information, &rest, terms);
        let share = 2.0 * (full.log_likelihood_gain - without.log_likelihood_gain);
        let own: Vec<usize> = parameters.of(one.effect).collect();
        let names: Vec<(f64, String)> = (0..3)
            .filter_map(|axis| survey.best(axis, &own))
            .filter(|best| best.p_value < FAMILY_SIGNIFICANCE)
            .map(|best| (best.ratio, products.names[best.product].clone()))
            .collect();
        let by_products: f64 = names.iter().map(|(ratio, _)| ratio).sum();
        if by_products > share + CLEARLY_BETTER {
            let names: Vec<String> = names.into_iter().map(|(_, name)| name).collect();
            return Some((one.effect, format!("{} explains more", names.join(", "))));
        }
        let rest_values: Vec<(usize, f64)> = rest_indices
            .into_iter()
            .zip(without.values.iter().copied())
            .collect();
        let left = bench.left_over(&rest_values);
        let event = events::steps(bench, &left)
            .into_iter()
            .chain(events::slips(bench, &left))
            .filter(|event| event.p_value < FAMILY_SIGNIFICANCE)
            .max_by(|a, b| a.ratio.total_cmp(&b.ratio));
        if let Some(event) = event.filter(|event| event.ratio > share + CLEARLY_BETTER) {
            return Some((
                one.effect,
                format!("{} explains more", event.term.equation()),
            ));
        }
    }
    None
}

/// The most telling event or product in what is left.
fn best_term(
    bench: &Workbench,
    values: &[(usize, f64)],
    survey: &Survey,
    products: &Products,
    explained: f64,
) -> Option<(Term, f64, f64)> {
    let left = bench.left_over(values);
    let events = events::steps(bench, &left)
        .into_iter()
        .chain(events::slips(bench, &left))
        .map(|event| (event.term, event.ratio, event.p_value));
    let expressions = (0..3).filter_map(|axis| {
        let best = survey.best(axis, &[])?;
        let expression = products.names[best.product].clone();
        Some((
            Term {
                axis,
                form: Form::Product { expression },
            },
            best.ratio,
            best.p_value,
        ))
    });
    // What imperfect regressors of the effects already found may leave behind.
    let allowance = REGRESSOR_FIDELITY * REGRESSOR_FIDELITY * explained;
    events
        .chain(expressions)
        .filter(|(term, ratio, p_value)| {
            *p_value < FAMILY_SIGNIFICANCE
                && *ratio > 1.0 + allowance
                && !bench.terms().contains(term)
        })
        .max_by(|a, b| a.1.total_cmp(&b.1))
}

/// Refits everything after terms were added to the bench by hand.
pub fn refit(bench: &Workbench, parameters: &Parameters, catch: &mut Catch) {
    let information = bench.information();
    let set: Vec<usize> = catch.choice.chosen.iter().map(|one| one.effect).collect();
    let (indices, solution) = fit(parameters, &information, &set, bench.terms().len());
    let place = |index: usize| {
        indices
            .iter()
            .position(|&i| i == index)
            .expect("always fitted")
    };
    for one in &mut catch.choice.chosen {
        let places: Vec<usize> = parameters.of(one.effect).map(place).collect();
        one.values
            .iter_mut()
            .zip(&places)
            .for_each(|(value, &at)| *value = solution.values[at]);
        for (a, &row) in places.iter().enumerate() {
            for (b, &column) in places.iter().enumerate() {
                one.covariance[(a, b)] = solution.covariance[(row, column)];
            }
        }
    }
    for (k, term) in bench.terms().iter().enumerate() {
        let at = place(parameters.count() + k);
        let (size, std) = (solution.values[at], solution.covariance[(at, at)].sqrt());
        match catch.terms.get_mut(k) {
            Some(found) => (found.size, found.std) = (size, std),
            None => {
                let ratio = (size / std).powi(2);
                let chance = (-0.5 * ratio).exp();
                let trials = catch.trials as f64;
                let p_value = (trials * chance).min(1.0);
                catch.terms.push(FoundTerm {
                    term: term.clone(),
                    size,
                    std,
                    ratio,
                    p_value,
                });
            }
        }
    }
    catch.values = indices
        .iter()
        .copied()
        .zip(solution.values.iter().copied())
        .collect();
}
