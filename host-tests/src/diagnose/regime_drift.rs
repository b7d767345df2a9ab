//! A drift that fills one stretch of like motion, told from a random walk of the rate (diagnosis road, step 12).
//!
//! Enters: what the hunt brought home, on its [`Workbench`]. Leaves: the same, with such drifts as
//! `window(20.0000,32.0000)` and with steps, where they beat the noise that would stand in their place; the noise is
//! fitted anew, so that steps are settled and places located without it.
//!
//! A noise fit that has not yet seen them takes them for a random walk, and a search under declared noise finds first
//! the slow line that resembles them and is rightly dismissed as drift. So regimes and steps, which are few, are
//! offered by themselves. Deliberately not here: slower or faster shapes; those stay noise.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::declare::FAMILY_SIGNIFICANCE;
use super::drift::{AHEAD_PICKED, DRIFTS, best_likelihood, inflation, trend};
use super::empirical::{Form, Term};
use super::events;
use super::hunt::{Catch, PLAINER};
use super::local::{MOST_REGIMES, joint, measured, renew, shown, window};
use super::noise::{Declared, Noise};
use super::split::Regime;
use super::workbench::{Parameters, Workbench};

/// More drifts and steps than this are drift.
const MOST_DRIFTS: usize = 3;

/// Takes drifts that fill a regime, and steps, out of drifting noise where they beat it: both are picked under the
/// declared noise, where a random walk of the rate and they look alike, and then each is weighed with the noise that
/// is needed with and without it, a free trend beside both.
pub fn found(
    bench: &mut Workbench,
    parameters: &Parameters,
    declared: &[Declared; 3],
    regimes: &[Regime],
    catch: &mut Catch,
) -> Result<(), String> {
    let seconds = bench.seconds();
    let set: Vec<usize> = catch.choice.chosen.iter().map(|one| one.effect).collect();
    let inflated: Vec<usize> = (0..3)
        .filter(|&axis| inflation(&bench.noise[axis], seconds) > DRIFTS)
        .filter(|&axis| declared[axis].random_walk.is_some())
        .collect();
    let shown = shown(bench, regimes);
    if inflated.is_empty() || shown.len() < 2 || shown.len() > MOST_REGIMES {
        return Ok(());
    }
    let (noise, own) = (bench.noise, bench.terms().len());
    for &axis in &inflated {
        bench.noise[axis] = Noise {
            theta: [
                declared[axis].random_walk.unwrap_or(noise[axis].theta[0]),
                declared[axis].white_angle.unwrap_or(noise[axis].theta[1]),
                0.0,
                0.0,
            ],
            ..noise[axis]
        };
    }
    while bench.terms().len() < own + MOST_DRIFTS {
        match most_telling(bench, parameters, &set, &inflated, &shown)? {
            Some(term) => bench.add_term(term)?,
            None => break,
        }
    }
    for axis in 0..3 {
        bench.add_term(trend(axis))?;
    }
    // The least likely goes first; the others then have more to explain.
    while bench.terms().len() > own + 3 {
        let with = refitted(bench, parameters, declared, &set);
        let places = own..bench.terms().len() - 3;
        let mut weakest: Option<(usize, f64)> = None;
        for place in places {
            let term = bench.terms()[place].clone();
            bench.remove_term(place);
            let ahead = with - refitted(bench, parameters, declared, &set);
            bench.insert_term(place, term)?;
            if weakest.is_none_or(|(_, least)| ahead < least) {
                weakest = Some((place, ahead));
            }
        }
        match weakest {
            Some((place, ahead)) if ahead < AHEAD_PICKED => bench.remove_term(place),
            _ => break,
        }
    }
    for _ in 0..3 {
        bench.remove_term(bench.terms().len() - 1);
    }
    bench.noise = noise;
    if bench.terms().len() > own {
        bench.refit_noise(&set, declared, true);
        renew(bench, parameters, &set, catch);
    }
    Ok(())
}

/// The drift of a regime or the step that explains most of what the fit leaves; none where chance would.
fn most_telling(
    bench: &mut Workbench,
    parameters: &Parameters,
    set: &[usize],
    axes: &[usize],
    shown: &[&Regime],
) -> Result<Option<Term>, String> {
    let (indices, solution) = joint(bench, parameters, set);
    let values: Vec<(usize, f64)> = indices
        .into_iter()
        .zip(solution.values.iter().copied())
        .collect();
    let trials = (axes.len() * shown.len()) as f64;
    let mut found: Vec<(Term, f64, f64)> = events::steps(bench, &bench.left_over(&values))
        .into_iter()
        .filter(|step| axes.contains(&step.term.axis))
        .map(|step| (step.term, step.ratio + PLAINER, step.p_value))
        .collect();
    for &axis in axes {
        for regime in shown {
            let expression = window(bench.scene(), regime);
            let term = Term {
                axis,
                form: Form::Product { expression },
            };
            if bench.terms().contains(&term) {
                continue;
            }
            let (sizes, _) = measured(bench, parameters, set, std::slice::from_ref(&term))?;
            let (value, variance) = sizes[0];
            let ratio = value * value / variance;
            let chance = ChiSquared::new(1.0).map_or(1.0, |law| law.sf(ratio));
            found.push((term, ratio, trials * chance));
        }
    }
    let best = found
        .into_iter()
        .filter(|(term, _, p_value)| {
            *p_value < FAMILY_SIGNIFICANCE && !bench.terms().contains(term)
        })
        .max_by(|a, b| a.1.total_cmp(&b.1));
    Ok(best.map(|(term, _, _)| term))
}

/// Likelihood of the best fit of the set and all terms, with noise fitted to what they leave.
fn refitted(
    bench: &mut Workbench,
    parameters: &Parameters,
    declared: &[Declared; 3],
    set: &[usize],
) -> f64 {
    bench.refit_noise(set, declared, true);
    best_likelihood(bench, parameters, set)
}
