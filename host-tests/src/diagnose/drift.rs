//! Whether drifting noise could stand in an effect's place.
//!
//! Enters: the bench with what was chosen, one of its effects or terms. Leaves: whether the data are nearly as
//! likely without it once the noise is fitted anew. A slow regressor resembles the first mode of a random walk,
//! which holds four fifths of its power; a likelihood ratio under a noise level known from the half dozen modes
//! that are left has the long tails of Fisher's law, not those of chi-squared (diagnosis.md, "how to be fooled":
//! white-noise statistics on drifting data). So both explanations are compared with the noise each of them needs, and
//! with a free trend: a random walk ends elsewhere than it began, that jump of the circle fills all low bins in phase,
//! and whatever resembles a ramp would take them all at once.

use super::empirical::{Form, Term};
use super::hypotheses::CATALOGUE;
use super::information::Solution;
use super::noise::{Declared, Noise};
use super::select::prior_width;
use super::workbench::{Parameters, Workbench};

/// Noise that rises less than this at the lowest frequencies holds no drift to speak of.
const DRIFTS: f64 = 1.3;

/// ln of the likelihood by which an effect must beat drift that could stand in its place: for one to three numbers,
/// picked among a hundred slow shapes, against levels known from half a dozen modes a gyro, Fisher's law gives
/// 15 to 18 for a chance in 1e6.
const AHEAD: f64 = 18.0;

/// The same for a constant, which is not picked among many and lies in one bin: no drift of any strength came this
/// far in 4000 simulated records (99.9 % stay below 7), and every second bias at a matched-filter SNR of 15 does.
const AHEAD_CONSTANT: f64 = 9.0;

/// The same for a term, which was picked among some hundred instants or expressions more.
const AHEAD_PICKED: f64 = 22.0;

/// A weak effect is its own where refitted noise takes up less than two fifths of what it explains.
const STILL_ITS_OWN: f64 = 0.6;

/// What is asked about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Suspect {
    /// An effect, by its index into the catalogue.
    Effect(usize),
    /// A found term, by its place on the bench.
    Term(usize),
}

/// S at the lowest frequencies over what it would be without drift.
pub fn inflation(noise: &Noise, seconds: f64) -> f64 {
    let steady = Noise {
        theta: [noise.theta[0], noise.theta[1], 0.0, 0.0],
        ..*noise
    };
    let lowest_hz = 2.0 / seconds;
    noise.at(lowest_hz, lowest_hz) / steady.at(lowest_hz, lowest_hz)
}

/// Whether drifting noise does nearly as well as `suspect`, one of the effects of `set` or of the bench's terms.
/// The bench is left as it was.
pub fn could_be_drift(
    bench: &mut Workbench,
    parameters: &Parameters,
    declared: &[Declared; 3],
    set: &[usize],
    suspect: Suspect,
) -> Result<bool, String> {
    let kept = bench.noise;
    let seconds = bench.portion.seconds();
    let rest: Vec<usize> = set
        .iter()
        .copied()
        .filter(|&effect| suspect != Suspect::Effect(effect))
        .collect();
    let term = match suspect {
        Suspect::Effect(_) => None,
        Suspect::Term(place) => {
            let term = bench.terms()[place].clone();
            bench.remove_term(place);
            Some((place, term))
        }
    };
    let trended = with_trend(bench)?;
    bench.refit_noise(&rest, declared, true);
    let drifts = (0..3).any(|axis| inflation(&bench.noise[axis], seconds) > DRIFTS);
    let without = drifts.then(|| likelihood(bench, parameters, &rest));
    let ahead = match suspect {
        Suspect::Effect(effect) if CATALOGUE[effect].card().kind == "gyro_bias" => AHEAD_CONSTANT,
        Suspect::Effect(_) => AHEAD,
        Suspect::Term(_) => AHEAD_PICKED,
    };
    if let Some((place, term)) = term {
        bench.insert_term(place, term)?;
    }
    let verdict = match without {
        None => false,
        Some(without) => {
            bench.refit_noise(set, declared, true);
            let with = likelihood(bench, parameters, set);
            let unchanged = with - without_under_this_noise(bench, parameters, &rest, suspect)?;
            with - without < ahead.min(STILL_ITS_OWN * unchanged)
        }
    };
    for _ in 0..trended {
        bench.remove_term(bench.terms().len() - 1);
    }
    bench.noise = kept;
    Ok(verdict)
}

/// The likelihood without the suspect under noise fitted beside it.
fn without_under_this_noise(
    bench: &mut Workbench,
    parameters: &Parameters,
    rest: &[usize],
    suspect: Suspect,
) -> Result<f64, String> {
    let Suspect::Term(place) = suspect else {
        return Ok(likelihood(bench, parameters, rest));
    };
    let term = bench.terms()[place].clone();
    bench.remove_term(place);
    let value = likelihood(bench, parameters, rest);
    bench.insert_term(place, term)?;
    Ok(value)
}

/// Puts a free trend on every gyro, behind all other terms; how many there are now that were not.
fn with_trend(bench: &mut Workbench) -> Result<usize, String> {
    let before = bench.terms().len();
    for axis in 0..3 {
        let expression = "time".to_string();
        let trend = Term {
            axis,
            form: Form::Product { expression },
        };
        if !bench.terms().contains(&trend) {
            bench.add_term(trend)?;
        }
    }
    Ok(bench.terms().len() - before)
}

/// Whittle log-likelihood of the best fit of a set and all terms under the bench's noise.
fn likelihood(bench: &Workbench, parameters: &Parameters, set: &[usize]) -> f64 {
    let information = bench.information();
    let mut indices = parameters.of_all(set);
    indices.extend(parameters.count()..parameters.count() + bench.terms().len());
    let solution: Solution = information.solve(&indices, &|index| {
        prior_width(parameters, &information, index)
    });
    let values: Vec<(usize, f64)> = indices
        .into_iter()
        .zip(solution.values.iter().copied())
        .collect();
    bench.whittle(&values)
}
