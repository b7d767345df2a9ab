//! Confirms common effects by cross-validation on blocks of all recordings and by parametric bootstrap.

use rlg_catalogue::candidates::PoolColumns;
use rlg_catalogue::entries::STEP;
use rlg_catalogue::{Candidate, Pool};
use rlg_inference::block_validation::BlockSums;
use rlg_inference::likelihood::behind;
use rlg_inference::search::{DriftPrior, Judged};
use rlg_inference::{Fit, Hypothesis, JointLikelihood, NoiseLevels, NormalEquations, Search};
use rlg_plan::Plan;
use rlg_signal::partition::Use;

use super::search::{Together, drift_of};
use super::shared::{RECORDS, Shared, Sharing, on_own_records, with_noise_of};
use super::sums::Sums;
use crate::confirm::{
    Final, Parameters, Prediction, gyro_of_event, headline, in_doubt, left_by, misfits_left,
    misfits_of, of_blocks, of_event, settle_instants, weakest, whiten,
};
use crate::data::Data;
use crate::goodness::Misfit;
use crate::noise_levels::drift_prior;
use crate::reenact::{Named, Reenactment, Stage, repeat, squared_size};
use crate::search::Found;
use crate::told::told;

/// Members of the found set by the result of their confirmation, as in [`crate::confirm::Confirmed`].
pub(crate) struct Confirmed {
    /// Named members, as places in [`Together::judged`].
    pub(crate) named: Vec<usize>,
    /// Reported name of each named member, as places in [`Together::shared`].
    pub(crate) headlines: Vec<usize>,
    pub(crate) predictions: Vec<Prediction>,
    pub(crate) unconfirmed: Vec<usize>,
    pub(crate) reenacted_away: Vec<usize>,
    /// Kinds rejected by the bootstrap of an earlier search and left out of this one.
    pub(crate) shown_anyway: Vec<&'static str>,
    pub(crate) impossible: Vec<usize>,
    pub(crate) reenactments: Vec<Reenactment>,
    pub(crate) instant_std_rows: Vec<Option<f64>>,
    /// Fit of the headlines.
    pub(crate) fit: Fit,
    /// Octaves in which the residual of each recording, and of sums behind them, deviates from the fitted noise.
    pub(crate) misfits: Vec<Vec<Misfit>>,
    /// Gyros whose own data determine the parameter of each headline.
    pub(crate) told: Vec<[bool; 3]>,
}

/// Divides the findings by recording: the same members, places as in [`Together::shared`], over the recording's own columns.
pub(crate) fn shares_of(together: &mut Together) -> Vec<Found> {
    let passes = std::mem::take(&mut together.passes);
    let of_pass = |(recording, pass): (usize, crate::pass::Pass)| Found {
        candidates: in_recording(&together.shared, recording),
        pool: pass.pool,
        fit: with_noise_of(&together.fit, recording),
        judged: judged_in(&together.judged, recording),
        spanned_by: together.spanned_by.clone(),
        reached_by: together.reached_by.clone(),
        without: together.without.clone(),
        empty: with_noise_of(&together.empty, recording),
        motion: pass.motion,
        residual_rad: pass.residual_rad,
        tried: together.tried,
        equations: pass.equations,
    };
    passes.into_iter().enumerate().map(of_pass).collect()
}

/// Judged members, with the drift levels of one recording's gyros.
fn judged_in(judged: &[Judged], recording: usize) -> Vec<Judged> {
    let of_one = |one: &Judged| {
        let mut all = one.drift_levels.chunks(RECORDS);
        Judged {
            drift_levels: all.nth(recording).unwrap_or_default().to_vec(),
            ..one.clone()
        }
    };
    judged.iter().map(of_one).collect()
}

pub(crate) fn in_recording(shared: &[Shared], recording: usize) -> Vec<Candidate> {
    shared
        .iter()
        .map(|one| one.in_recording(recording))
        .collect()
}

/// Rejects members that fail confirmation; `None` where too few rows are left.
///
/// # Inputs
/// `sums`: over all rows of the recording that `all` are stretches of.
pub(crate) fn confirmed(
    all: &[Data],
    sums: Option<&Sums>,
    together: &mut Together,
    found: &mut [Found],
    plan: &Plan,
) -> Option<Confirmed> {
    let predictions = predictions((all, sums), together, found, plan)?;
    let first = &found[0];
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
        let mut headlines: Vec<usize> = named
            .iter()
            .map(|&place| {
                let reached_by = &together.reached_by[place];
                headline((&together.judged[place], reached_by), &candidates)
            })
            .collect();
        let mut last = refit((all, sums), together, found, &headlines, plan)?;
        let instant_std_rows = instants(all, together, found, &mut headlines, &last.fit);
        if instant_std_rows.iter().any(Option::is_some) {
            last = refit((all, sums), together, found, &headlines, plan)?;
        }
        let Refitted { fit, misfits, told } = last;
        if let Some(&place) = fit.impossible.first() {
            impossible.push(named.remove(place));
            continue;
        }
        let ratios: Vec<Named> = named
            .iter()
            .map(|&place| in_doubt(&found[0], place, plan))
            .collect();
        let reenactments = reenact(all, (together, found), (&fit, &ratios), plan);
        let Some(weakest) = weakest(&ratios, &reenactments, plan) else {
            return Some(Confirmed {
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
                misfits,
                told,
            });
        };
        reenacted_away.push(named.remove(weakest));
    }
}

/// Cross-validates each member on blocks of all recordings.
fn predictions(
    (all, sums): (&[Data], Option<&Sums>),
    together: &Together,
    found: &[Found],
    plan: &Plan,
) -> Option<Vec<Prediction>> {
    let members = &together.fit.members;
    let hypotheses = members
        .iter()
        .map(|&place| &together.shared[place].candidate.hypothesis);
    let parameters = Parameters::of(hypotheses);
    let mut whitened = Vec::with_capacity(all.len());
    for (recording, (data, own)) in all.iter().zip(found).enumerate() {
        let set = set_of(members, &together.shared, recording);
        whitened.push(whiten(data, own, &set, plan)?);
    }
    let of_members = |place: usize| {
        let shared = &together.shared[members[place]];
        let event = match shared.sharing {
            Sharing::Only(recording) => {
                gyro_of_event(&shared.candidate).map(|axis| (recording, axis))
            }
            _ => None,
        };
        event.map(|(recording, axis)| {
            let own = &found[recording];
            let left_rad = left_by(own, &own.fit);
            of_event(own, (place, axis), &left_rad, &whitened[recording], plan)
        })
    };
    let events: Vec<Option<Prediction>> = (0..members.len()).map(of_members).collect();
    let of_sums = match sums {
        Some(sums) => {
            let set = set_of(members, &together.shared, all.len());
            let levels = with_noise_of(&together.fit, all.len()).levels;
            Some(sums.whitened(&set, &levels, plan)?)
        }
        None => None,
    };
    let sums = BlockSums::join(whitened.into_iter().map(|one| one.sums).chain(of_sums));
    let each = events.into_iter().enumerate();
    Some(
        each.map(|(place, event)| {
            event.unwrap_or_else(|| of_blocks(&found[0], place, &parameters, &sums, plan))
        })
        .collect(),
    )
}

/// Hypotheses of the members on one recording's records, fixed terms as one more parameter.
fn set_of(members: &[usize], shared: &[Shared], recording: usize) -> Vec<Hypothesis> {
    members
        .iter()
        .map(|&place| {
            let whole = shared[place].candidate.hypothesis.with_fixed_as_parameter();
            on_own_records(&whole, recording)
        })
        .collect()
}

/// Moves every step among the headlines to its mean instant; returns the standard deviation of each instant \[rows\].
fn instants(
    all: &[Data],
    together: &mut Together,
    found: &mut [Found],
    headlines: &mut [usize],
    fit: &Fit,
) -> Vec<Option<f64>> {
    let mut std_rows = vec![None; headlines.len()];
    for recording in 0..all.len() {
        let is_here =
            |one: &Shared| one.candidate.kind == STEP && one.sharing == Sharing::Only(recording);
        if !headlines
            .iter()
            .any(|&place| is_here(&together.shared[place]))
        {
            continue;
        }
        let fit = with_noise_of(fit, recording);
        let last = Final {
            left_rad: left_by(&found[recording], &fit),
            fit,
            misfits: Vec::new(),
            told: Vec::new(),
        };
        let mut own = headlines.to_vec();
        let of_own = settle_instants(&all[recording], &mut found[recording], &mut own, &last);
        for (place, (headline, std)) in own.into_iter().zip(of_own).enumerate() {
            if std.is_none() || !is_here(&together.shared[headlines[place]]) {
                continue;
            }
            let mut moved = together.shared[headlines[place]].clone();
            let step = found[recording].candidates[headline].clone();
            let mut hypothesis = step.hypothesis.clone();
            hypothesis
                .terms
                .iter_mut()
                .for_each(|term| term.record += recording * RECORDS);
            moved.candidate = Candidate { hypothesis, ..step };
            headlines[place] = together.shared.len();
            together.shared.push(moved);
            std_rows[place] = std;
        }
        for (other, own) in found.iter_mut().enumerate() {
            own.candidates = in_recording(&together.shared, other);
        }
    }
    std_rows
}

/// Refitted headlines.
struct Refitted {
    fit: Fit,
    /// Octaves in which the residual deviates from the fitted noise, by recording.
    misfits: Vec<Vec<Misfit>>,
    /// Gyros whose own data determine the parameter of each member.
    told: Vec<[bool; 3]>,
}

/// Fits the headlines to all rows to fit.
fn refit(
    (all, sums): (&[Data], Option<&Sums>),
    together: &Together,
    found: &[Found],
    headlines: &[usize],
    plan: &Plan,
) -> Option<Refitted> {
    let mut parts: Vec<(NormalEquations, Vec<Candidate>)> = Vec::with_capacity(all.len());
    for (data, own) in all.iter().zip(found) {
        let fitted = data.rows_of(&[Use::Fit]);
        let observations = data.observed(&fitted)?.to_fast_length();
        let mut pool = Pool::default();
        let candidates: Vec<Candidate> = headlines
            .iter()
            .map(|&place| pool.adopt(&own.candidates[place], &own.pool.columns))
            .collect();
        let columns = PoolColumns {
            columns: &pool.columns,
            signals: &own.motion.signals,
        };
        let levels = NoiseLevels::mean(&own.fit.levels);
        let equations = NormalEquations::new(observations, &own.residual_rad, &columns, levels);
        parts.push((equations, candidates));
    }
    let mut levels: Vec<NoiseLevels> = found
        .iter()
        .flat_map(|own| own.fit.levels.clone())
        .collect();
    let mut drift: Vec<DriftPrior> = all
        .iter()
        .map(|data| drift_prior(&data.model.gyro))
        .collect();
    if let Some(sums) = sums {
        let of_sums = |place: &usize| together.shared[*place].in_recording(all.len());
        let own = with_noise_of(&together.fit, all.len()).levels;
        let candidates: Vec<Candidate> = headlines.iter().map(of_sums).collect();
        parts.push(sums.of(&candidates, &own)?);
        levels.extend(own);
        drift.push(sums.drift().clone());
    }
    let joined: Vec<Hypothesis> = headlines
        .iter()
        .enumerate()
        .map(|(place, &headline)| {
            let each = parts.iter().map(|(_, candidates)| &candidates[place]);
            over_all(&together.shared[headline], each)
        })
        .collect();
    let likelihood = JointLikelihood::new(parts.iter().map(|(equations, _)| equations).collect());
    let drift = drift_of(drift.into_iter());
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
    let misfits = parts.iter().enumerate();
    let misfits = misfits.map(|(recording, (equations, candidates))| {
        let own = with_noise_of(&fit, recording);
        match all.get(recording) {
            Some(data) => misfits_of(data, equations, (&own, candidates), plan),
            None => misfits_left(equations, (&own, candidates), plan),
        }
    });
    let misfits = misfits.collect();
    let members = headlines
        .iter()
        .map(|&place| &together.shared[place].candidate);
    let set: Vec<_> = joined.iter().zip(members).collect();
    let told = told(&likelihood, &set, &fit, plan);
    fit.members = headlines.to_vec();
    Some(Refitted { fit, misfits, told })
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

/// Draws parametric bootstraps of all recordings without each headline in turn; the projections of the recordings add up.
fn reenact(
    all: &[Data],
    (together, found): (&Together, &[Found]),
    (fit, named): (&Fit, &[Named]),
    plan: &Plan,
) -> Vec<Reenactment> {
    let mut shown = Reenactment::of_each(fit);
    if shown.is_empty() {
        return shown;
    }
    let fits: Vec<Fit> = (0..all.len()).map(|k| with_noise_of(fit, k)).collect();
    let stages: Vec<Stage> = (0..all.len())
        .map(|recording| {
            let set = set_of(&fit.members, &together.shared, recording);
            Stage::new(&all[recording], &found[recording], &fits[recording]).with_set(set)
        })
        .collect();
    repeat(&mut shown, named, plan, |draw, open| {
        let each = stages.iter().enumerate().map(|(recording, stage)| {
            // No two recordings have the same noise.
            stage.play((draw * all.len() + recording) as u64, open, plan)
        });
        let sum = each.reduce(|sum, own| {
            let pairs = sum.iter().zip(&own);
            pairs.map(|(sum, own)| sum.joined(own)).collect()
        });
        sum.iter().flatten().map(squared_size).collect()
    });
    shown
}
