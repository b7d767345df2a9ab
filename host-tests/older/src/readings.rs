//! Readings of a slow residual: drifting noise, shapes in time, or physics.
//!
//! Enters: a bench whose noise was fitted under a generous library. Leaves: the best [`Catch`], with the
//! bench as that reading left it. Drifting noise and a slow line, step or decay can imitate each other: a
//! noise fit that takes the line for drift hides it, a library that eats the drift invents effects. So
//! where the noise fit finds drift, shapes are looked for that no drift has, and the search is run again beside them;
//! and it is run with the declared noise. The readings are compared by Whittle likelihood, every parameter and
//! drifting term paid for; physics must win clearly against noise.

use super::drift::{DRIFTS, inflation};
use super::empirical::{Form, Term};
use super::hunt::{self, Catch};
use super::lattice::Lattice;
use super::noise::{Declared, Noise};
use super::products::Products;
use super::shapes;
use super::split::Regime;
use super::workbench::{Parameters, Workbench};

/// What a free number costs: half the logarithm of the few hundred bins in which drift lives.
pub(super) const PRICE: f64 = 3.0;

/// ln of the number of instants or expressions a found term was picked among.
pub(super) const PICKED: f64 = 6.5;

/// ln of the odds by which physics must beat drifting noise.
const CLEAR_WIN: f64 = 3.0;

/// What a search needs besides the bench.
pub struct Hunt<'a> {
    /// Numbering of the catalogue's parameters.
    pub parameters: &'a Parameters,
    /// Effects to try.
    pub candidates: &'a [usize],
    /// Declared noise.
    pub declared: &'a [Declared; 3],
    /// Stretches of like motion.
    pub regimes: &'a [Regime],
    /// Unlisted expressions.
    pub products: &'a Products<'a>,
    /// Pulses that hide what turns by less.
    pub lattice: &'a Lattice,
    /// Likelihood ratio and chance of the terms that the bench has already.
    pub given: &'a [(f64, f64)],
}

/// The better reading.
pub fn best(bench: &mut Workbench, hunt: &Hunt, progress: &dyn Fn(&str)) -> Result<Catch, String> {
    let fitted = bench.noise;
    let seconds = bench.seconds();
    let as_noise = hunt::hunt(bench, hunt, true, progress)?;
    let any_drifts = |noise: &[Noise; 3]| noise.iter().any(|one| inflation(one, seconds) > DRIFTS);
    // A generous library may eat drift that shows again once little was chosen, and the other way round. Where neither
    // drift nor a term is left, effects were just looked for in noise that does not drift.
    let drifts = any_drifts(&bench.noise) || any_drifts(&fitted) && !as_noise.terms.is_empty();
    let known = hunt
        .declared
        .iter()
        .all(|declared| declared.random_walk.is_some());
    // Terms that came with the bench were found in the noise as fitted.
    if !hunt.given.is_empty() {
        return Ok(as_noise);
    }
    let price = |bench: &Workbench, catch: &Catch| {
        let drifting = bench
            .noise
            .iter()
            .filter(|noise| inflation(noise, seconds) > DRIFTS)
            .count();
        // A term was picked among hundreds of instants and expressions.
        let picked = PICKED * catch.terms.len() as f64;
        bench.whittle(&catch.values) - PRICE * (catch.values.len() + drifting) as f64 - picked
    };
    let mut best = as_noise;
    let mut needed = price(bench, &best) + CLEAR_WIN;
    let kept = bench.snapshot();
    progress("looking for slow shapes");
    if let Some(entered) = put_shapes(bench, hunt, &best)? {
        let beside = Hunt {
            given: &entered,
            ..*hunt
        };
        let as_shapes = hunt::hunt(bench, &beside, true, progress)?;
        // Every shape that stayed is ahead of any drift: the noise that held them is no rival any more. At rest a bias that
        // jumps and stays is told from a nudge of the case; a slow trend of a vehicle's is not.
        let at_rest = bench.scene().streams.at_rest.is_some();
        let is_jump = |found: &hunt::FoundTerm| matches!(found.term.form, Form::Step { .. });
        let slow = as_shapes.terms.iter().filter(|found| is_slow(&found.term));
        if slow.clone().next().is_some() && (!at_rest || slow.clone().all(is_jump)) {
            needed = price(bench, &as_shapes);
            best = as_shapes;
        } else {
            bench.restore(kept)?;
        }
    }
    if !drifts || !known {
        return Ok(best);
    }
    let kept = bench.snapshot();
    bench.clear_terms();
    // White noise of angle hides no drift: where it was fitted beyond the declared, it is there.
    bench.noise = [0, 1, 2].map(|axis: usize| {
        let [walk, white, _, _] = fitted[axis].theta;
        let walk = hunt.declared[axis].random_walk.unwrap_or(walk);
        Noise {
            theta: [walk, white, 0.0, 0.0],
            ..fitted[axis]
        }
    });
    let as_physics = hunt::hunt(bench, hunt, false, progress)?;
    if !as_physics.is_drift && price(bench, &as_physics) > needed {
        return Ok(as_physics);
    }
    bench.restore(kept)?;
    Ok(best)
}

/// Puts slow shapes in the place of what is slow among a reading's terms, where there are any; ratio and chance of each
/// term that the bench then has.
fn put_shapes(
    bench: &mut Workbench,
    hunt: &Hunt,
    reading: &Catch,
) -> Result<Option<Vec<(f64, f64)>>, String> {
    // Of a recording longer than memory these rows are stretches, and what is slow is in the blocks beside them.
    if bench.beside().is_some() {
        return Ok(None);
    }
    let seconds = bench.seconds();
    let chosen = reading.choice.chosen.iter();
    let set: Vec<usize> = chosen.map(|one| one.effect).collect();
    let mut entered: Vec<(f64, f64)> = reading
        .terms
        .iter()
        .map(|found| (found.ratio, found.p_value))
        .collect();
    let mut any = false;
    for axis in 0..3 {
        let own = |term: &Term| term.axis == axis && is_slow(term);
        let drifts = inflation(&bench.noise[axis], seconds) > DRIFTS;
        if !drifts && !bench.terms().iter().any(own) {
            continue;
        }
        let before = bench.terms().to_vec();
        for place in (0..before.len()).rev().filter(|&place| own(&before[place])) {
            bench.remove_term(place);
        }
        let shapes = shapes::search(bench, hunt.parameters, &set, axis)?;
        let found: Vec<(Term, (f64, f64))> = shapes
            .into_iter()
            .flat_map(|shape| {
                let entered = (2.0 * shape.ahead, shape.p_value);
                shape.terms.into_iter().map(move |term| (term, entered))
            })
            .collect();
        if found.is_empty() {
            for (place, term) in before.iter().enumerate().filter(|(_, term)| own(term)) {
                bench.insert_term(place, term.clone())?;
            }
            continue;
        }
        any = true;
        let mut places = before.iter();
        entered.retain(|_| places.next().is_some_and(|term| !own(term)));
        for (term, chance) in found {
            bench.add_term(term)?;
            entered.push(chance);
        }
    }
    if any {
        bench.refit_noise(&set, hunt.declared, true);
    }
    Ok(any.then_some(entered))
}

/// Whether drift could be mistaken for a term, or a term for another slow one.
fn is_slow(term: &Term) -> bool {
    match &term.form {
        Form::Step { .. } => true,
        Form::Product { expression } => {
            let shapes = ["window(", "decay(", "time"];
            shapes.iter().any(|shape| expression.starts_with(shape))
        }
        _ => false,
    }
}
