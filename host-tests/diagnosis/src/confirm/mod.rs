//! Validates each effect of the found set by cross-validation over blocks of the fitted rows and by a parametric bootstrap
//! without it; then refits the set, drift selected anew.
//!
//! One recording is several with n = 1: the rows of all recordings are one likelihood (`cross_validation`, `refit`), the
//! candidate that names a member is common to all (`headlines`), and each recording reports its `share`.

pub(crate) mod whitened;

pub mod goodness;

pub(crate) mod sharing;

pub(crate) mod together;

pub(crate) mod sums;

pub mod bootstrap;

pub(crate) mod per_axis_support;

use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::{Variant, is_delay};
use rlg_inference::{Fit, TooFewRows};
use rlg_plan::Plan;

use crate::confirm::bootstrap::{Bootstrap, Named, bootstrap};
use crate::confirm::goodness::Misfit;
use crate::confirm::sums::Recordings;
use crate::confirm::together::Together;
use crate::search::structure::Found;

mod cross_validation;

mod headlines;

mod refit;

mod share;

pub use cross_validation::Prediction;
pub use share::Share;

use cross_validation::predictions;
use headlines::{headline, settle_instants};
use refit::{Refitted, refit};

/// Members of the found set by the outcome of their validation.
pub struct ConfirmedSet {
    /// Named members, as places in [`Found::judged`].
    pub named: Vec<usize>,
    /// Candidate that names each named member, as places in [`Found::candidates`].
    pub headlines: Vec<usize>,
    /// Cross-validation of every member of the found set.
    pub predictions: Vec<Prediction>,
    /// Places in [`Found::judged`] rejected by the cross-validation.
    pub unconfirmed: Vec<usize>,
    /// Places in [`Found::judged`] rejected by the parametric bootstrap: the recording simulated without them shows them as
    /// well.
    pub reenacted_away: Vec<usize>,
    /// Kinds of an earlier search that the bootstrap rejected, left out of this one.
    pub shown_anyway: Vec<&'static str>,
    /// Places in [`Found::judged`] whose estimate on all fitted rows no unit can have.
    pub impossible: Vec<usize>,
    /// Parametric bootstrap without each named member.
    pub reenactments: Vec<Bootstrap>,
    /// Standard deviation of the instant of each named step \[rows\].
    pub instant_std_rows: Vec<Option<f64>>,
    /// Final fit of `headlines`, on all rows to fit; its blocks in the order of the members.
    pub fit: Fit,
    /// Gyros whose own data determine the parameter of each headline.
    pub supported: Vec<[bool; 3]>,
}

/// Confirmed set of all recordings.
pub(crate) struct Confirmed {
    pub(crate) set: ConfirmedSet,
    /// Octaves in which the residual of each recording, and of sums behind them, deviates from the fitted noise.
    pub(crate) misfits: Vec<Vec<Misfit>>,
}

/// Kinds rejected by the parametric bootstrap, without which another effect may explain the recording. Delays and low passes
/// are excepted: the motion was estimated along that path.
///
/// # Inputs
/// `reenacted_away`: places in [`Found::judged`].
pub(crate) fn fallen(reenacted_away: &[usize], found: &Found) -> Vec<&'static str> {
    let members = reenacted_away.iter();
    let members = members.map(|&place| &found.candidates[found.judged[place].hypothesis]);
    members
        .filter(|one| !is_delay(one.kind) && one.variant != Variant::LowPass)
        .map(|one| one.kind)
        .collect()
}

/// Repeats a search without the kinds that the parametric bootstrap rejects, until it rejects none: such a kind explains
/// nothing, as the recording simulated without it shows it as well.
///
/// # Inputs
/// `search`: searches without the given kinds; returns its result and the kinds that [`fallen`] returns of it.
///
/// # Returns
/// Result of the last search, and the kinds left out of it besides `left_out`.
pub(crate) fn until_none_falls<T, E>(
    left_out: &[&str],
    progress: &dyn Fn(&str),
    mut search: impl FnMut(&[&str]) -> Result<(T, Vec<&'static str>), E>,
) -> Result<(T, Vec<&'static str>), E> {
    let mut shown_anyway: Vec<&'static str> = Vec::new();
    loop {
        let (left, fallen) = search(&[left_out, &shown_anyway[..]].concat())?;
        if fallen.is_empty() {
            return Ok((left, shown_anyway));
        }
        progress("search without effects that a bootstrap reproduces");
        shown_anyway.extend(fallen);
    }
}

/// Removes members rejected by the cross-validation over blocks, by the parametric bootstrap or as impossible.
///
/// # Errors
/// Too few rows are left.
pub(crate) fn confirmed(
    recordings: Recordings,
    together: &mut Together,
    plan: &Plan,
) -> Result<Confirmed, TooFewRows> {
    let predictions = predictions(recordings, together, plan)?;
    let first = &together.found[0];
    let is_costly = |place: &usize| first.judged[*place].cost_without > plan.judgement.naming;
    let (mut named, unconfirmed): (Vec<usize>, Vec<usize>) = (0..first.judged.len())
        .filter(is_costly)
        .partition(|place| predictions[*place].keeps(first, *place, plan));
    let (mut reenacted_away, mut impossible) = (Vec::new(), Vec::new());
    loop {
        let candidates: Vec<Candidate> = together
            .shared
            .iter()
            .map(|one| one.candidate.clone())
            .collect();
        let first = &together.found[0];
        let mut headlines: Vec<usize> = named
            .iter()
            .map(|&place| headline(&first.judged[place], &first.reached_by[place], &candidates))
            .collect();
        let mut last = refit(recordings, together, &headlines, plan)?;
        let instant_std_rows =
            settle_instants(recordings.each, together, &mut headlines, &last.fit);
        if instant_std_rows.iter().any(Option::is_some) {
            last = refit(recordings, together, &headlines, plan)?;
        }
        let Refitted {
            fit,
            misfits,
            supported,
        } = last;
        if let Some(&place) = fit.impossible.first() {
            impossible.push(named.remove(place));
            continue;
        }
        let ratios: Vec<Named> = named
            .iter()
            .map(|&place| in_doubt(&together.found[0], place, plan))
            .collect();
        let reenactments = bootstrap(recordings.each, together, &fit, &ratios, plan);
        let Some(weakest) = weakest(&ratios, &reenactments, plan) else {
            let set = ConfirmedSet {
                named,
                headlines,
                predictions,
                unconfirmed,
                reenacted_away,
                shown_anyway: Vec::new(),
                impossible,
                reenactments,
                instant_std_rows,
                fit,
                supported,
            };
            return Ok(Confirmed { set, misfits });
        };
        reenacted_away.push(named.remove(weakest));
    }
}

/// Place of the rejected name with the largest inflation in the bootstrap; `None` if no name is rejected.
fn weakest(ratios: &[Named], reenactments: &[Bootstrap], plan: &Plan) -> Option<usize> {
    let inflation = |place: usize| reenactments[place].inflation();
    (0..ratios.len())
        .filter(|&place| ratios[place].falls(&reenactments[place], plan))
        .max_by(|&a, &b| inflation(a).total_cmp(&inflation(b)))
}

/// Log-likelihood ratio of a member, and the part of it that may be lost before its name is.
fn in_doubt(found: &Found, place: usize, plan: &Plan) -> Named {
    Named {
        log_likelihood_ratio: found.fit.log_likelihood - found.without[place].log_likelihood,
        margin: found.judged[place].cost_without - plan.judgement.naming,
    }
}
