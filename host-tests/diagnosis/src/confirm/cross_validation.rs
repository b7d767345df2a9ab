//! Cross-validation of the members of a found set over blocks of the fitted rows of all recordings.

use std::cell::OnceCell;
use std::ops::Range;

use rlg_catalogue::entries::STEP;
use rlg_inference::block_validation::BlockSums;
use rlg_inference::events::largest_impulse;
use rlg_inference::{Hypothesis, TooFewRows};
use rlg_plan::Plan;
use rlg_signal::partition::blocks;
use rlg_signal::streams::Triad;
use statrs::distribution::{ContinuousCDF, Normal};

use crate::confirm::sharing::{set_of, with_noise_of};
use crate::confirm::sums::Recordings;
use crate::confirm::together::Together;
use crate::confirm::whitened::{Whitener, columns_of};
use crate::rows::data::Data;
use crate::search::structure::{Found, left_by};

/// Cross-validation of a member over blocks of the fitted rows, each block predicted from the others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Gain in predictive log score by the member, summed over the blocks; of an event its log-likelihood ratio.
    pub gain: f64,
    /// Design effect: variance of the parameters between blocks over that of their likelihood, the factor that the
    /// likelihood ratio is too large by; 1 if not significant \[1\].
    pub design_effect: f64,
    /// The member is confirmed there, whatever its size: the gain is positive; a step always is, a slip or a window if no
    /// impulse remains significant.
    pub holds: bool,
}

impl Prediction {
    /// True if a member keeps its name: its cost of omission exceeds the plan's after its likelihood ratio is divided by the
    /// design effect.
    pub(super) fn keeps(&self, found: &Found, place: usize, plan: &Plan) -> bool {
        let ratio = found.fit.log_likelihood - found.without[place].log_likelihood;
        let lost = ratio * (1.0 - 1.0 / self.design_effect);
        self.holds && found.judged[place].cost_without - lost > plan.judgement.naming
    }
}

/// Sums of whitened rows over the fitted blocks, and their whitening filter.
struct Whitened {
    sums: BlockSums,
    whitener: Whitener,
}

/// Whitens rows and members' columns, and sums them over blocks.
///
/// # Inputs
/// `set`: hypotheses of the members of the found set, on the recording's own records.
fn whiten(
    data: &Data,
    found: &Found,
    set: &[Hypothesis],
    plan: &Plan,
) -> Result<Whitened, TooFewRows> {
    let whitener = Whitener::new(data, &found.fit.levels)?;
    let whitened = |gyro: usize, rows: &[f64]| whitener.rows(gyro, rows);
    let signals = &found.motion.signals;
    let values = |column: usize| found.pool.columns[column].values(signals);
    let columns = columns_of(set, signals.rows, &values, &whitened);
    let records: Vec<Vec<f64>> = (0..3)
        .map(|gyro| whitened(gyro, &found.residual_rad[gyro]))
        .collect();
    let blocks = blocks(&whitener.seen, data.streams.rate_hz, &plan.rates.blocks);
    let sums = BlockSums::new(&records, &columns, &blocks);
    Ok(Whitened { sums, whitener })
}

/// Parameters of a set, the fixed part of a member counted as one more of its parameters.
struct Parameters {
    /// Parameters of each member.
    own: Vec<Range<usize>>,
    /// Parameters that stand for the fixed part of a member.
    fixed: Vec<usize>,
}

impl Parameters {
    fn of<'a>(set: impl Iterator<Item = &'a Hypothesis>) -> Self {
        let (mut own, mut fixed) = (Vec::new(), Vec::new());
        let mut first = 0;
        for one in set {
            let whole = one.parameters + usize::from(!one.fixed.is_empty());
            if whole > one.parameters {
                fixed.push(first + one.parameters);
            }
            own.push(first..first + whole);
            first += whole;
        }
        Self { own, fixed }
    }
}

/// Cross-validates each member of the found set over blocks of the fitted rows. A step, a slip or a window lies in few
/// blocks of one recording, and the others cannot predict it; slip and window are confirmed if no impulse remains
/// significant.
///
/// # Returns
/// Predictions in the order of the set.
///
/// # Errors
/// Too few rows are fitted.
pub(super) fn predictions(
    recordings: Recordings,
    together: &Together,
    plan: &Plan,
) -> Result<Vec<Prediction>, TooFewRows> {
    let members = &together.fit.members;
    let found = &together.found;
    let hypotheses = members
        .iter()
        .map(|&place| &together.shared[place].candidate.hypothesis);
    let parameters = Parameters::of(hypotheses);
    let mut whitened = Vec::with_capacity(found.len());
    for (recording, (data, own)) in recordings.each.iter().zip(found).enumerate() {
        let set = set_of(members, &together.shared, recording);
        whitened.push(whiten(data, own, &set, plan)?);
    }
    let left_rad: Vec<OnceCell<Triad>> = found.iter().map(|_| OnceCell::new()).collect();
    let events: Vec<Option<Prediction>> = (0..members.len())
        .map(|place| {
            let shared = &together.shared[members[place]];
            let axis = shared.candidate.event_gyro()?;
            let recording = shared.first_recording()?;
            let own = &found[recording];
            let left_rad = left_rad[recording].get_or_init(|| left_by(own, &own.fit));
            let event = EventPlace {
                member: place,
                axis,
            };
            Some(of_event(own, event, left_rad, &whitened[recording], plan))
        })
        .collect();
    let of_sums = match recordings.sums {
        Some(sums) => {
            let set = set_of(members, &together.shared, found.len());
            let levels = with_noise_of(&together.fit, found.len()).levels;
            Some(sums.whitened(&set, &levels, plan)?)
        }
        None => None,
    };
    let sums = BlockSums::join(whitened.into_iter().map(|one| one.sums).chain(of_sums));
    let each = events.into_iter().enumerate();
    Ok(each
        .map(|(place, event)| {
            event.unwrap_or_else(|| of_blocks(&found[0], place, &parameters, &sums, plan))
        })
        .collect())
}

/// A member that acts once, and its gyro.
#[derive(Clone, Copy)]
struct EventPlace {
    /// Place among the members of the fit.
    member: usize,
    axis: usize,
}

/// Cross-validates a member that acts throughout the record.
fn of_blocks(
    found: &Found,
    place: usize,
    parameters: &Parameters,
    sums: &BlockSums,
    plan: &Plan,
) -> Prediction {
    // Members that require it are left out with it.
    let members = &found.fit.members;
    let with_it = (0..members.len()).filter(|&other| {
        let hypothesis = &found.candidates[members[other]].hypothesis;
        other == place || hypothesis.requires == Some(members[place])
    });
    let own: Vec<usize> = with_it
        .flat_map(|other| parameters.own[other].clone())
        .collect();
    let said = sums.validate(&own, &parameters.fixed);
    Prediction {
        gain: said.gain,
        design_effect: said.significant_design_effect(plan.judgement.reenactment_chance),
        holds: said.gain > 0.0,
    }
}

/// Tests a member that acts once on a gyro by the largest impulse in the residual.
fn of_event(
    found: &Found,
    event: EventPlace,
    left_rad: &Triad,
    Whitened { whitener, .. }: &Whitened,
    plan: &Plan,
) -> Prediction {
    let fit = &found.fit;
    let (transform, basis) = (&whitener.transform, &whitener.basis);
    let spectrum = transform.spectrum(&left_rad[event.axis]);
    let largest = largest_impulse(
        transform,
        basis,
        &spectrum,
        fit.levels[event.axis],
        &plan.inference.events,
    );
    let rows = transform.observations().rows() as f64;
    let is_step = found.candidates[fit.members[event.member]].kind == STEP;
    Prediction {
        gain: fit.log_likelihood - found.without[event.member].log_likelihood,
        design_effect: 1.0,
        holds: is_step || 2.0 * rows * Normal::standard().sf(largest) > plan.judgement.unexplained,
    }
}
