//! Alternates linearisation of each recording and one structure search over all, until the set and its delays no longer
//! change.

use std::collections::BTreeSet;

use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::is_delay;
use rlg_catalogue::signals::Path;
use rlg_inference::search::{DriftPrior, Judged, best_of};
use rlg_inference::{Fit, Hypothesis, JointLikelihood, NoiseLevels, Observations, Search};

use super::shared::{Shared, Sharing, seen_by, spelt_out};
use crate::case_motion::estimate;
use crate::data::Data;
use crate::pass::Pass;
use crate::plan::AnalysisPlan;
use crate::search::{Before, Settled, delays, is_seen, is_settled, path_of, settle, share_of};

/// What the fitted rows of all recordings say.
pub(super) struct Together {
    /// Each recording's last pass.
    pub(super) passes: Vec<Pass>,
    /// Each recording's candidates, over its own columns.
    pub(super) candidates: Vec<Vec<Candidate>>,
    /// Every candidate, places as in `fit`.
    pub(super) shared: Vec<Shared>,
    /// The best set.
    pub(super) fit: Fit,
    /// Its members with cost and rivals.
    pub(super) judged: Vec<Judged>,
    /// Rivals of each member whose columns span it.
    pub(super) spanned_by: Vec<Vec<usize>>,
    /// The set without each member, fitted anew.
    pub(super) without: Vec<Fit>,
    /// Nothing but noise.
    pub(super) empty: Fit,
    /// Sets that were looked at.
    pub(super) tried: usize,
}

/// One recording between two passes.
struct Recording {
    pass: Pass,
    seen: Vec<bool>,
    looked_at: Observations,
    fitted: Observations,
    /// What its columns were made behind.
    path: Path,
}

/// Finds the best set of all recordings; `None` where too few rows of one can be fitted.
pub(super) fn find(
    all: &mut [Data],
    left_out: &[&str],
    plan: &AnalysisPlan,
    progress: &dyn Fn(&str),
) -> Option<Together> {
    let mut recordings = Vec::with_capacity(all.len());
    let mut fits = Vec::with_capacity(all.len());
    let mut tried = 0;
    for data in all.iter_mut() {
        let name = data.streams.pieces[0].recording.clone();
        let stage = |stage: &str| progress(&format!("{name} alone: {stage}"));
        let settled = settle(data, left_out, plan, &stage)?;
        tried += settled.tried;
        fits.push(settled.fit.clone());
        recordings.push(Recording::new(settled));
    }
    join_delays(all, &mut recordings, &fits, (plan, left_out));
    spell_in_all(&mut recordings, &fits);
    let mut levels: Vec<NoiseLevels> = fits.iter().flat_map(|fit| fit.levels.clone()).collect();
    let mut before: Option<Vec<Shared>> = None;
    for pass in 1..=plan.passes {
        progress(&format!("all recordings, pass {pass}"));
        let candidates: Vec<&[Candidate]> = recordings
            .iter()
            .map(|one| &one.pass.candidates[..])
            .collect();
        let shared = spelt_out(&candidates, &plan.several);
        let (fit, looked_at) = search(&recordings, &shared, (&before, &fits), (&levels, plan));
        tried += looked_at;
        let members: Vec<Shared> = fit
            .members
            .iter()
            .map(|&place| shared[place].clone())
            .collect();
        let is_same = before.as_ref().is_some_and(|before| {
            before.len() == members.len()
                && members
                    .iter()
                    .all(|one| before.iter().any(|other| other.is_same(one)))
        });
        let seen: Vec<Fit> = (0..recordings.len())
            .map(|recording| seen_by(&fit, &shared, recording))
            .collect();
        let stands = recordings
            .iter()
            .zip(&seen)
            .all(|(one, own)| is_settled(own, &one.pass.candidates, one.path.delay_s));
        let nothing = members.is_empty()
            && fits.iter().all(|fit| fit.members.is_empty())
            && recordings.iter().all(|one| one.path == Path::default());
        if nothing || (is_same && stands) || pass == plan.passes {
            let passes = recordings.into_iter().map(|one| one.pass).collect();
            return Some(judge(passes, shared, fit, plan, tried));
        }
        levels.clone_from(&fit.levels);
        recordings = recordings
            .into_iter()
            .zip(all.iter_mut())
            .zip(seen)
            .map(|((one, data), own)| one.linearised_about(data, own, None, (plan, left_out)))
            .collect();
        before = Some(members);
    }
    None
}

impl Recording {
    fn new(settled: Settled) -> Self {
        Self {
            path: settled.pass.motion.signals.path,
            pass: settled.pass,
            seen: settled.seen,
            looked_at: settled.looked_at,
            fitted: settled.fitted,
        }
    }

    /// The next pass, behind what a fit leaves; its delays are `delay_s` where they are given.
    fn linearised_about(
        self,
        data: &mut Data,
        fit: Fit,
        delay_s: Option<[f64; 3]>,
        (plan, left_out): (&AnalysisPlan, &[&str]),
    ) -> Self {
        let Self {
            pass,
            seen,
            looked_at,
            fitted,
            ..
        } = self;
        let clean_rad = pass.clean_by(&fit, &looked_at);
        data.found_share = share_of(&fit, &pass.candidates, &pass.pool);
        let mut path = path_of(&fit, &pass.candidates);
        path.delay_s = delay_s.unwrap_or(path.delay_s);
        let levels = fit.levels.clone();
        let before = (fit, pass.candidates);
        drop((pass.equations, pass.motion));
        let motion = estimate(data, &clean_rad, &levels, &seen, path, plan);
        let pass = Pass::new(
            data,
            motion,
            left_out,
            &fitted,
            &levels,
            Before::Pass(&before),
        );
        Self {
            pass,
            seen,
            looked_at,
            fitted,
            path,
        }
    }
}

/// Makes delays of all recordings about one value where what each recording says alone allows one: only then can they be one
/// parameter.
fn join_delays(
    all: &mut [Data],
    recordings: &mut Vec<Recording>,
    fits: &[Fit],
    (plan, left_out): (&AnalysisPlan, &[&str]),
) {
    let each: Vec<([f64; 3], [f64; 3])> = recordings
        .iter()
        .zip(fits)
        .map(|(one, fit)| delays(fit, &one.pass.candidates))
        .collect();
    let joint_s = [0, 1, 2].map(|gyro: usize| {
        let own: Vec<(f64, f64)> = each
            .iter()
            .map(|(value_s, std_s)| (value_s[gyro], std_s[gyro]))
            .collect();
        joint_delay(&own, plan.several.same_delay)
    });
    let [Some(x), Some(y), Some(z)] = joint_s else {
        return;
    };
    if [x, y, z] == [0.0; 3] {
        return;
    }
    *recordings = std::mem::take(recordings)
        .into_iter()
        .zip(all.iter_mut())
        .zip(fits)
        .map(|((one, data), fit)| {
            one.linearised_about(data, fit.clone(), Some([x, y, z]), (plan, left_out))
        })
        .collect();
}

/// The mean of delays that may be one; 0 where there is none.
///
/// # Inputs
/// `each`: value and standard deviation \[s\], infinite where a recording has none; `same`: how far one may lie from the mean \[σ\].
fn joint_delay(each: &[(f64, f64)], same: f64) -> Option<f64> {
    let weight = |std_s: f64| if std_s > 0.0 { std_s.powi(-2) } else { 0.0 };
    let weights: f64 = each.iter().map(|(_, std_s)| weight(*std_s)).sum();
    if weights == 0.0 {
        return Some(0.0);
    }
    let sum: f64 = each
        .iter()
        .map(|(value_s, std_s)| weight(*std_s) * value_s)
        .sum();
    let mean_s = sum / weights;
    let std_of_mean_s = weights.sqrt().recip();
    // A recording that shows none may have one that is weak.
    let may_be = |(value_s, std_s): &(f64, f64)| match std_s.is_finite() {
        true => (value_s - mean_s).abs() < same * std_s,
        false => mean_s.abs() < 2.0 * same * std_of_mean_s,
    };
    each.iter().all(may_be).then_some(mean_s)
}

/// Spells out in all recordings what was found in one of them by a scan: its candidate is in no other's catalogue.
fn spell_in_all(recordings: &mut [Recording], fits: &[Fit]) {
    let mut found: Vec<(usize, Candidate)> = Vec::new();
    for (place, (one, fit)) in recordings.iter().zip(fits).enumerate() {
        let members = fit
            .members
            .iter()
            .filter_map(|&member| one.pass.candidates.get(member));
        let scanned = members
            .filter(|one| !is_delay(one.kind) && crate::confirm::gyro_of_event(one).is_none());
        found.extend(scanned.map(|one| (place, one.clone())));
    }
    for (place, recording) in recordings.iter_mut().enumerate() {
        let pass = &mut recording.pass;
        let mut new: Vec<Candidate> = Vec::new();
        for (_, one) in found.iter().filter(|(owner, _)| *owner != place) {
            let is_known = |other: &Candidate| {
                other.kind == one.kind && other.variant == one.variant && other.base == one.base
            };
            if pass.candidates.iter().chain(&new).any(is_known) {
                continue;
            }
            let about = vec![0.0; one.base.len()];
            new.extend(pass.pool.again(one, &about, &pass.motion.signals));
        }
        let first = pass.candidates.len();
        pass.extend(new);
        let (equations, mut place) = (&pass.equations, 0);
        pass.candidates.retain(|one| {
            place += 1;
            place <= first || is_seen(&one.hypothesis, equations)
        });
    }
}

/// Drift of all records from that of each recording's.
pub(super) fn drift_of(each: impl Iterator<Item = DriftPrior>) -> DriftPrior {
    let mut declared = Vec::new();
    for drift in each {
        match drift {
            DriftPrior::Declared(drift) => declared.extend(drift),
            DriftPrior::Unknown => return DriftPrior::Unknown,
        }
    }
    DriftPrior::Declared(declared)
}

/// Hypotheses of candidates, and the number of their kinds.
fn hypotheses_of(shared: &[Shared]) -> (Vec<Hypothesis>, usize) {
    let kinds: BTreeSet<&str> = shared.iter().map(|one| one.candidate.kind).collect();
    let each = shared.iter().map(|one| one.candidate.hypothesis.clone());
    (each.collect(), kinds.len().max(1))
}

/// The best set, and how many were looked at: from nothing or from the set before, and first from what each recording found.
fn search(
    recordings: &[Recording],
    shared: &[Shared],
    (before, alone): (&Option<Vec<Shared>>, &[Fit]),
    (levels, plan): (&[NoiseLevels], &AnalysisPlan),
) -> (Fit, usize) {
    let equations = recordings.iter().map(|one| &one.pass.equations);
    let likelihood = JointLikelihood::new(equations.collect());
    let (hypotheses, kinds) = hypotheses_of(shared);
    let drift = drift_of(recordings.iter().map(|one| one.pass.drift.clone()));
    let mut search = Search::new(
        &likelihood,
        &hypotheses,
        kinds,
        &plan.search,
        &drift,
        levels.to_vec(),
    );
    let most = plan.search.most_members;
    let fit = match before {
        Some(before) => {
            let start: Vec<usize> = (0..shared.len())
                .filter(|&place| before.iter().any(|one| one.is_same(&shared[place])))
                .collect();
            search.run(&start, most)
        }
        None => {
            let from_nothing = search.run(&[], most);
            let start = found_alone(shared, alone);
            match start.is_empty() || start.len() > most {
                true => from_nothing,
                false => best_of(vec![search.run(&start, most)], from_nothing),
            }
        }
    };
    (fit, search.tried_sets())
}

/// What recordings found alone, as common to all where it can be.
fn found_alone(shared: &[Shared], alone: &[Fit]) -> Vec<usize> {
    let mut start = Vec::new();
    for (recording, fit) in alone.iter().enumerate() {
        for member in &fit.members {
            let has = |one: &Shared| {
                matches!(&one.own[recording], Some((own, _)) if own == member)
                    && one.sharing != Sharing::Apart
            };
            start.extend(shared.iter().position(has));
        }
    }
    start.sort_unstable();
    start.dedup();
    start
}

fn judge(
    passes: Vec<Pass>,
    shared: Vec<Shared>,
    fit: Fit,
    plan: &AnalysisPlan,
    tried: usize,
) -> Together {
    let likelihood = JointLikelihood::new(passes.iter().map(|pass| &pass.equations).collect());
    let (hypotheses, kinds) = hypotheses_of(&shared);
    let drift = drift_of(passes.iter().map(|pass| pass.drift.clone()));
    let mut search = Search::new(
        &likelihood,
        &hypotheses,
        kinds,
        &plan.search,
        &drift,
        fit.levels.clone(),
    );
    let judged = search.judge_set(&fit, plan.class_within, plan.separation);
    let tried = tried + search.tried_sets();
    drop(search);
    drop(likelihood);
    Together {
        candidates: passes.iter().map(|pass| pass.candidates.clone()).collect(),
        passes,
        shared,
        fit,
        judged: judged.members,
        spanned_by: judged.spanned_by,
        without: judged.without,
        empty: judged.empty,
        tried,
    }
}

#[cfg(test)]
mod tests {
    use super::joint_delay;

    #[test]
    fn delays_are_one_where_each_recording_alone_allows_it() {
        const NONE: (f64, f64) = (0.0, f64::INFINITY);
        assert_eq!(joint_delay(&[NONE, NONE], 5.0), Some(0.0));
        let mean_s = joint_delay(&[(4.0e-4, 1e-6), (4.02e-4, 1e-6)], 5.0);
        assert!(mean_s.is_some_and(|mean_s| (mean_s - 4.01e-4).abs() < 1e-12));
        assert_eq!(joint_delay(&[(4.0e-4, 1e-6), (4.2e-4, 1e-6)], 5.0), None);
        // Weak and strong beside a recording that shows none.
        assert!(joint_delay(&[(5e-6, 1e-6), NONE], 5.0).is_some());
        assert_eq!(joint_delay(&[(4e-4, 1e-6), NONE], 5.0), None);
    }
}
