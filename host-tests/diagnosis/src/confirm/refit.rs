//! Final fit of the named members, drift selected anew, and the goodness of its fit.

use rlg_catalogue::candidates::PoolColumns;
use rlg_catalogue::{Candidate, Pool};
use rlg_inference::likelihood::behind;
use rlg_inference::search::DriftPrior;
use rlg_inference::{
    Fit, Hypothesis, JointLikelihood, NoiseLevels, NormalEquations, Search, TooFewRows,
};
use rlg_plan::Plan;
use rlg_signal::partition::Use;

use crate::candidates::lock_in::Stops;
use crate::confirm::goodness::{Misfit, misfits};
use crate::confirm::per_axis_support::supported;
use crate::confirm::sharing::{RECORDS, Shared, with_noise_of};
use crate::confirm::sums::Recordings;
use crate::confirm::together::Together;
use crate::iteration::pass::left_on;
use crate::rows::data::Data;
use crate::rows::noise_levels::{drift_prior, joint_drift};
use crate::search::structure::Found;

/// Refitted headlines.
pub(super) struct Refitted {
    pub(super) fit: Fit,
    /// Octaves in which the residual deviates from the fitted noise, by recording; those of sums behind them.
    pub(super) misfits: Vec<Vec<Misfit>>,
    /// Gyros whose own data determine the parameter of each member.
    pub(super) supported: Vec<[bool; 3]>,
}

/// Headlines over the columns of one recording, or of sums over all of one.
struct Part {
    equations: NormalEquations,
    candidates: Vec<Candidate>,
    pool: Pool,
}

impl Part {
    /// Part of one recording.
    fn new(data: &Data, found: &Found, headlines: &[usize]) -> Result<Self, TooFewRows> {
        let fitted = data.rows_of(&[Use::Fit]);
        let observations = data.observed(&fitted)?.to_fast_length();
        let mut pool = Pool::default();
        let candidates = headlines
            .iter()
            .map(|&place| pool.adopt(&found.candidates[place], &found.pool.columns))
            .collect();
        let columns = PoolColumns {
            columns: &pool.columns,
            signals: &found.motion.signals,
        };
        let levels = NoiseLevels::mean(&found.fit.levels);
        Ok(Self {
            equations: NormalEquations::new(observations, &found.residual_rad, &columns, levels),
            candidates,
            pool,
        })
    }
}

/// Fits the headlines, places in [`Together::shared`], to all rows to fit.
///
/// # Errors
/// Too few rows of a recording are left.
pub(super) fn refit(
    recordings: Recordings,
    together: &Together,
    headlines: &[usize],
    plan: &Plan,
) -> Result<Refitted, TooFewRows> {
    let Recordings { each, sums } = recordings;
    let found = &together.found;
    let mut parts = Vec::with_capacity(each.len());
    for (data, own) in each.iter().zip(found) {
        parts.push(Part::new(data, own, headlines)?);
    }
    let levels = found.iter().flat_map(|own| own.fit.levels.clone());
    let mut levels: Vec<NoiseLevels> = levels.collect();
    let mut drift: Vec<DriftPrior> = each
        .iter()
        .map(|data| drift_prior(&data.model.gyro))
        .collect();
    if let Some(sums) = sums {
        let of_sums = |place: &usize| together.shared[*place].in_recording(each.len());
        let own = with_noise_of(&together.fit, each.len()).levels;
        let candidates: Vec<Candidate> = headlines.iter().map(of_sums).collect();
        let (equations, candidates) = sums.of(&candidates, &own)?;
        parts.push(Part {
            equations,
            candidates,
            pool: Pool::default(),
        });
        levels.extend(own);
        drift.push(sums.drift().clone());
    }
    let joined: Vec<Hypothesis> = headlines
        .iter()
        .enumerate()
        .map(|(place, &headline)| {
            let each = parts.iter().map(|part| &part.candidates[place]);
            over_all(&together.shared[headline], each)
        })
        .collect();
    let likelihood = JointLikelihood::new(parts.iter().map(|part| &part.equations).collect());
    let drift = joint_drift(drift.into_iter());
    let mut search = Search::new(
        &likelihood,
        &joined,
        joined.len().max(1),
        &plan.inference.search,
        &drift,
        levels,
    );
    // Drift is selected anew: a member without a name may have stood in for it.
    let places: Vec<usize> = (0..joined.len()).collect();
    let mut fit = search.fit(&places, None);
    let misfits = parts.iter().enumerate().map(|(recording, part)| {
        let own = with_noise_of(&fit, recording);
        match each.get(recording) {
            Some(data) => misfits_of(data, part, &own, plan),
            None => misfits_left(part, &own, plan),
        }
    });
    let misfits = misfits.collect();
    let members = headlines
        .iter()
        .map(|&place| &together.shared[place].candidate);
    let set: Vec<_> = joined.iter().zip(members).collect();
    let supported = supported(&likelihood, &set, &fit, plan);
    if let ([data], [part]) = (each, &parts[..]) {
        widen_by_stops(data, &found[0], part, &mut fit);
    }
    fit.members = headlines.to_vec();
    Ok(Refitted {
        fit,
        misfits,
        supported,
    })
}

/// Adds the variance by the stops of a dead band to the thresholds, which are of one recording.
fn widen_by_stops(data: &Data, found: &Found, part: &Part, fit: &mut Fit) {
    let stops = Stops {
        data,
        signals: &found.motion.signals,
        equations: &part.equations,
    };
    for (candidate, block) in part.candidates.iter().zip(fit.blocks.clone()) {
        stops.widen(candidate, &part.pool, fit, block.start);
    }
}

/// Octaves in which the residual of a fit departs from the fitted noise.
fn misfits_of(data: &Data, part: &Part, fit: &Fit, plan: &Plan) -> Vec<Misfit> {
    let mut misfits = misfits_left(part, fit, plan);
    // Quantisation error is not white angle noise where pulses are rare, and never exceeds a pulse.
    misfits.retain(|one| !data.lattice.hides_angle(one.gyro, one.angle_rms_rad));
    misfits
}

/// Octaves in which the residual deviates from the noise on any rows, quantisation error included.
fn misfits_left(part: &Part, fit: &Fit, plan: &Plan) -> Vec<Misfit> {
    let equations = &part.equations;
    let of_gyro = |gyro: usize| {
        let residual = left_on(equations, fit, &part.candidates, gyro);
        let basis = equations.basis_beside_gaps(fit.levels[gyro]);
        misfits(&basis, &residual, fit.levels[gyro], gyro, plan)
    };
    (0..RECORDS).flat_map(of_gyro).collect()
}

/// Hypothesis of a headline over the columns of all parts.
fn over_all<'a>(shared: &Shared, each: impl Iterator<Item = &'a Candidate>) -> Hypothesis {
    let mut whole = shared.candidate.hypothesis.clone();
    whole.requires = None;
    whole.terms.clear();
    whole.fixed.clear();
    for (recording, candidate) in each.enumerate() {
        let own = behind(&candidate.hypothesis, recording * RECORDS);
        whole.terms.extend(own.terms);
        whole.fixed.extend(own.fixed);
    }
    whole
}
