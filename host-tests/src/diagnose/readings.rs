//! Two readings of a slow residual: drifting noise, or physics.
//!
//! Enters: a bench whose noise was fitted under a generous library. Leaves: the better [`Catch`], with the
//! bench as that reading left it. Drifting noise and a slow line, step or decay can imitate each other: a
//! noise fit that takes the line for drift hides it, a library that eats the drift invents effects. So
//! where the noise fit finds drift, the search is run a second time with the declared noise, and the two
//! readings are compared by Whittle likelihood, every parameter and drifting term paid for; physics must
//! win clearly.

use super::drift::inflation;
use super::hunt::{self, Catch};
use super::noise::{Declared, Noise};
use super::products::Products;
use super::split::Regime;
use super::workbench::{Parameters, Workbench};

/// Drift is in question when it raises S at the lowest frequencies by more than this factor.
const INFLATED: f64 = 1.3;

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
    /// Likelihood ratio and chance of the terms that the bench has already.
    pub given: &'a [(f64, f64)],
}

/// The better reading.
pub fn best(bench: &mut Workbench, hunt: &Hunt, progress: &dyn Fn(&str)) -> Result<Catch, String> {
    let fitted = bench.noise;
    let seconds = bench.seconds();
    let as_noise = hunt::hunt(bench, hunt, true, progress)?;
    // A generous library may eat drift that shows again once little was chosen, and the other way round.
    let drifts = fitted
        .iter()
        .chain(&bench.noise)
        .any(|noise| inflation(noise, seconds) > INFLATED);
    let known = hunt
        .declared
        .iter()
        .all(|declared| declared.random_walk.is_some());
    // Terms that came with the bench were found in the noise as fitted.
    if !drifts || !known || !hunt.given.is_empty() {
        return Ok(as_noise);
    }
    let price = |bench: &Workbench, catch: &Catch| {
        let drifting = bench
            .noise
            .iter()
            .filter(|noise| inflation(noise, seconds) > INFLATED)
            .count();
        // A term was picked among hundreds of instants and expressions.
        let picked = PICKED * catch.terms.len() as f64;
        bench.whittle(&catch.values) - PRICE * (catch.values.len() + drifting) as f64 - picked
    };
    let noise_score = price(bench, &as_noise);
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
    let physics_score = price(bench, &as_physics);
    if physics_score > noise_score + CLEAR_WIN {
        return Ok(as_physics);
    }
    bench.restore(kept)?;
    Ok(as_noise)
}
