//! Unlisted physics that acts in some stretches of like motion only (diagnosis road, steps 7 and 12).
//!
//! Enters: what the hunt brought home, on its [`Workbench`]. Leaves: the same, with every product of channels whose
//! size is not the same in all regimes replaced by that product within the regimes in which it acts,
//! `omega_z*window(20.0000,32.0000)`, sizes and noise fitted anew.
//!
//! A listed effect whose size differs loses its name (invariance.rs); the product that then takes its place differs as
//! much, and said of the whole recording it would be as wrong.
//!
//! The sizes by regime are fitted jointly with everything else; they scatter by chance as χ² with one degree a regime
//! less one. Deliberately not here: lines, trends and decays, which are patterns in time already.

use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::ops::Range;

use super::bench::Bench as _;
use super::declare::FAMILY_SIGNIFICANCE;
use super::drift;
use super::empirical::{Form, Term, together};
use super::hunt::{Alike, Catch, FoundTerm, IDLE, PLAINER, VETO};
use super::information::Solution;
use super::invariance::SYSTEMATIC;
use super::noise::Declared;
use super::pieces;
use super::scene::Scene;
use super::split::{Regime, intersect};
use super::weigh::prior_width;
use super::workbench::{Parameters, Workbench};

/// More regimes than this are no stretches of like motion but a long record cut in pieces.
const MOST_REGIMES: usize = 24;

/// Confines the products that do not act everywhere. `declared` is the noise that the model declares.
pub fn confine(
    bench: &mut Workbench,
    parameters: &Parameters,
    declared: &[Declared; 3],
    regimes: &[Regime],
    catch: &mut Catch,
) -> Result<(), String> {
    let set = catch.choice.effects();
    let shown = shown(bench, regimes);
    if shown.len() < 2 || shown.len() > MOST_REGIMES {
        return Ok(());
    }
    let mut confined = false;
    // From the last, so that the places before stay.
    for place in (0..bench.terms().len()).rev() {
        let term = bench.terms()[place].clone();
        if let Some(expression) = everywhere(&term) {
            let parts = acting(bench, parameters, &set, place, expression, &shown)?;
            bench.remove_term(place);
            confined |= !parts.is_empty();
            let parts = if parts.is_empty() { vec![term] } else { parts };
            for part in parts.into_iter().rev() {
                bench.insert_term(place, part)?;
            }
        }
    }
    if confined {
        // What the wrong size left behind was taken for noise.
        bench.refit_noise(&set, declared, true);
        drop_idle(bench, parameters, &set);
        renew(bench, parameters, &set, catch);
    }
    Ok(())
}

/// The regimes of which the bench has rows.
fn shown<'a>(bench: &Workbench, regimes: &'a [Regime]) -> Vec<&'a Regime> {
    let any = |regime: &&Regime| {
        let own = std::slice::from_ref(&regime.rows);
        !intersect(own, &bench.portion.ranges).is_empty()
    };
    regimes.iter().filter(any).collect()
}

/// The expression of a product of channels that is said of the whole recording.
fn everywhere(term: &Term) -> Option<&str> {
    match &term.form {
        Form::Product { expression } if !expression.contains('(') && expression != "time" => {
            Some(expression)
        }
        _ => None,
    }
}

/// The regimes in which the term at `place` acts, each as a term, where its size is not the same in all; else none.
/// The bench is left as it was.
fn acting(
    bench: &mut Workbench,
    parameters: &Parameters,
    set: &[usize],
    place: usize,
    expression: &str,
    shown: &[&Regime],
) -> Result<Vec<Term>, String> {
    let whole = bench.terms()[place].clone();
    let axis = whole.axis;
    let before = joint(bench, parameters, set).1;
    let first = before.values.len() - bench.terms().len();
    let size = before.values[first + place];
    let within = |factor: &str, regime: &Regime| Term {
        axis,
        form: Form::Product {
            expression: format!("{factor}*{}", window(bench.scene(), &regime.rows)),
        },
    };
    let parts: Vec<Term> = shown
        .iter()
        .map(|regime| within(expression, regime))
        .collect();
    let plainer: Vec<Vec<Term>> = expression
        .split_once('*')
        .into_iter()
        .flat_map(|(a, b)| [a, b])
        .map(|factor| shown.iter().map(|regime| within(factor, regime)).collect())
        .collect();
    bench.remove_term(place);
    let (fitted, _) = measured(bench, parameters, set, &parts)?;
    let spread: f64 = fitted
        .iter()
        .map(|(value, variance)| (value - size).powi(2) / (variance + (SYSTEMATIC * size).powi(2)))
        .sum();
    let degrees = shown.len() as f64 - 1.0;
    let differs = ChiSquared::new(degrees).map_or(1.0, |law| law.sf(spread)) < VETO;
    // Chance of a size like this where the product does not act, every regime counted.
    let acts = |(value, variance): &(f64, f64)| {
        let chance = ChiSquared::new(1.0).map_or(1.0, |law| law.sf(value * value / variance));
        chance * (shown.len() as f64) < FAMILY_SIGNIFICANCE
    };
    let kept: Vec<usize> = (0..shown.len())
        .filter(|&k| differs && acts(&fitted[k]))
        .collect();
    let choose = |terms: &[Term]| kept.iter().map(|&k| terms[k].clone()).collect::<Vec<_>>();
    let mut best = choose(&parts);
    if !best.is_empty() {
        let mut explained = measured(bench, parameters, set, &best)?.1;
        for terms in &plainer {
            let terms = choose(terms);
            let by_factor = measured(bench, parameters, set, &terms)?.1;
            if 2.0 * (explained - by_factor) < PLAINER {
                (best, explained) = (terms, by_factor);
            }
        }
    }
    bench.insert_term(place, whole)?;
    Ok(best)
}

/// Value and variance of each of `terms` beside everything on the bench, and ln L of all. The bench is left as it was.
fn measured(
    bench: &mut Workbench,
    parameters: &Parameters,
    set: &[usize],
    terms: &[Term],
) -> Result<(Vec<(f64, f64)>, f64), String> {
    for term in terms {
        bench.add_term(term.clone())?;
    }
    let (_, solution) = joint(bench, parameters, set);
    for _ in terms {
        bench.remove_term(bench.terms().len() - 1);
    }
    let first = solution.values.len() - terms.len();
    let of = |at: usize| (solution.values[at], solution.covariance[(at, at)]);
    let sizes = (first..solution.values.len()).map(of).collect();
    Ok((sizes, solution.log_likelihood_gain))
}

/// The joint fit of the set and all terms.
pub(super) fn joint(
    bench: &Workbench,
    parameters: &Parameters,
    set: &[usize],
) -> (Vec<usize>, Solution) {
    let indices = drift::indices(bench, parameters, set);
    let information = bench.information_about(&indices);
    let solution = information.solve(&indices, &|index| {
        prior_width(parameters, &information, index)
    });
    (indices, solution)
}

/// 1 within some rows of one recording, as an expression.
pub(super) fn window(scene: &Scene, rows: &Range<usize>) -> String {
    let streams = &scene.streams;
    let (recording, [start_s, end_s]) = streams.own_span(rows);
    let mut window = format!("window({start_s:.4},{end_s:.4})");
    if streams.is_joined() {
        window += &format!("*recording({})", pieces::name_in_expression(recording));
    }
    window
}

/// Takes out the terms that only stood for what the wrong size had left.
fn drop_idle(bench: &mut Workbench, parameters: &Parameters, set: &[usize]) {
    loop {
        let (_, solution) = joint(bench, parameters, set);
        let first = solution.values.len() - bench.terms().len();
        let says_something = |place: usize| {
            let at = first + place;
            solution.values[at].powi(2) >= IDLE * solution.covariance[(at, at)]
        };
        let mut places = (0..bench.terms().len()).map(|place| together(bench.terms(), place));
        let Some(idle) = places.find(|both| !both.clone().any(says_something)) else {
            return;
        };
        for _ in idle.clone() {
            bench.remove_term(idle.start);
        }
    }
}

/// Sizes of everything as the bench now has it.
fn renew(bench: &Workbench, parameters: &Parameters, set: &[usize], catch: &mut Catch) {
    let (indices, solution) = joint(bench, parameters, set);
    for one in &mut catch.choice.chosen {
        let at = |index| indices.iter().position(|&known| known == index);
        let places: Vec<usize> = parameters.of(one.effect).filter_map(at).collect();
        for (a, &from_a) in places.iter().enumerate() {
            one.values[a] = solution.values[from_a];
            for (b, &from_b) in places.iter().enumerate() {
                one.covariance[(a, b)] = solution.covariance[(from_a, from_b)];
            }
        }
    }
    let first = indices.len() - bench.terms().len();
    let chance = |ratio: f64| {
        let once = ChiSquared::new(1.0).map_or(1.0, |law| law.sf(ratio));
        -(catch.trials as f64 * (-once).ln_1p()).exp_m1()
    };
    catch.terms = bench
        .terms()
        .iter()
        .enumerate()
        .map(|(place, term)| {
            let at = first + place;
            let variance = solution.covariance[(at, at)];
            let own = solution.values[at].powi(2) / variance;
            let known = catch.terms.iter().find(|known| known.term == *term);
            FoundTerm {
                term: term.clone(),
                size: solution.values[at],
                std: variance.sqrt(),
                with_next: match at + 1 < indices.len() {
                    true => solution.covariance[(at, at + 1)],
                    false => 0.0,
                },
                alike: known.map_or_else(Alike::default, |known| known.alike.clone()),
                ratio: known.map_or(own, |known| known.ratio),
                p_value: known.map_or_else(|| chance(own), |known| known.p_value),
            }
        })
        .collect();
    let values = solution.values.iter().copied();
    catch.values = indices.into_iter().zip(values).collect();
    catch.information = bench.information();
}
