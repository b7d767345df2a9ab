//! Alternates linearisation of each recording and one structure search over all, until the set and its delays converge.

use rlg_plan::Plan;
use std::collections::BTreeSet;

use rlg_catalogue::candidates::is_delay;
use rlg_catalogue::signals::Path;
use rlg_catalogue::{Candidate, Pool, Sensed};
use rlg_inference::judgement::Judged;
use rlg_inference::search::best_of;
use rlg_inference::{
    Fit, Hypothesis, JointLikelihood, NoiseLevels, NormalEquations, Search, TooFewRows,
};

use super::delays::{joint_delay, mean_delay};
use crate::confirm::sharing::{
    Grouping, RECORDS, Shared, Sharing, in_recording, seen_by, spelt_out, with_noise_of,
};
use crate::confirm::sums::Side;
use crate::confirm::together::Together;
use crate::iteration::pass::Pass;
use crate::iteration::path::{delays, is_settled, path_of};
use crate::rows::data::Data;
use crate::rows::noise_levels::joint_drift;
use crate::search::linearisation::is_seen;
use crate::search::passes::{Begun, Rows, Settled, settle};
use crate::search::structure::Found;
use crate::settings::Scope;

/// State of one recording between two passes.
struct Recording {
    pass: Pass,
    rows: Rows,
}

/// Side of one recording.
fn side_of(pass: &Pass) -> Side<'_> {
    Side {
        candidates: &pass.candidates,
        equations: &pass.equations,
        drift: &pass.drift,
        levels: &[],
    }
}

/// Recordings with a converged set and delays.
pub(crate) struct Standing {
    recordings: Vec<Recording>,
    grouping: Grouping,
    shared: Vec<Shared>,
    fit: Fit,
    tried: usize,
}

/// Finds the best set of all recordings.
///
/// # Errors
/// Too few rows of one can be fitted.
pub(crate) fn find(
    all: &mut [Data],
    scope: Scope,
    progress: &dyn Fn(&str),
) -> Result<Together, TooFewRows> {
    let standing = stand(all, Grouping::Recordings, scope, progress)?;
    Ok(standing.judged(None, scope.plan))
}

/// Alternates linearisation of each recording and the search over all until both converge, or for the plan's passes.
///
/// # Errors
/// Too few rows of one can be fitted.
pub(crate) fn stand(
    all: &mut [Data],
    grouping: Grouping,
    scope: Scope,
    progress: &dyn Fn(&str),
) -> Result<Standing, TooFewRows> {
    let plan = scope.plan;
    let mut recordings = Vec::with_capacity(all.len());
    let mut fits = Vec::with_capacity(all.len());
    let mut tried = 0;
    for data in all.iter_mut() {
        let name = data.streams.piece.recording.clone();
        let stage = |stage: &str| progress(&format!("{name} alone: {stage}"));
        let settled = settle(data, scope, &stage)?;
        tried += settled.tried;
        fits.push(settled.fit.clone());
        recordings.push(Recording::new(settled));
    }
    join_delays(all, &mut recordings, grouping, &fits, scope);
    spell_in_all(&mut recordings, &fits);
    let mut levels: Vec<NoiseLevels> = fits.iter().flat_map(|fit| fit.levels.clone()).collect();
    let mut before: Option<Vec<Shared>> = None;
    let mut pass = 0;
    loop {
        pass += 1;
        progress(&format!("all together, pass {pass}"));
        let sides: Vec<Side> = recordings.iter().map(|one| side_of(&one.pass)).collect();
        let shared = spell(&sides, grouping, plan);
        let start = match &before {
            Some(before) => Start::Only(places_of(before, &shared)),
            None => Start::Also(found_alone(&shared, &fits)),
        };
        let (fit, looked_at) = search(&sides, &shared, start, (&levels, plan));
        tried += looked_at;
        let members = members_of(&fit, &shared);
        let is_same = before.as_ref().is_some_and(|before| {
            before.len() == members.len()
                && members
                    .iter()
                    .all(|one| before.iter().any(|other| other.is_same(one)))
        });
        let seen: Vec<Fit> = (0..recordings.len())
            .map(|recording| seen_by(&fit, &shared, recording))
            .collect();
        let stands = recordings.iter().zip(&seen).all(|(one, own)| {
            is_settled(own, &one.pass.candidates, one.path().delay_s, &plan.rates)
        });
        let nothing = members.is_empty()
            && fits.iter().all(|fit| fit.members.is_empty())
            && recordings.iter().all(|one| one.path() == Path::default());
        if nothing || (is_same && stands) || pass >= plan.judgement.passes {
            return Ok(Standing {
                recordings,
                grouping,
                shared,
                fit,
                tried,
            });
        }
        levels.clone_from(&fit.levels);
        recordings = recordings
            .into_iter()
            .zip(all.iter_mut())
            .zip(seen)
            .map(|((one, data), own)| one.linearised_about(data, own, None, scope))
            .collect();
        before = Some(members);
    }
}

/// Joint result of the stretches, for the whole recording.
pub(crate) struct Shown {
    /// Gyro, column and size of each effect, events left out.
    pub(crate) parts: Vec<(usize, Sensed, f64)>,
    /// Path between the reference and the gyros.
    pub(crate) path: Path,
    /// Axes that move in any stretch.
    pub(crate) is_moving: [bool; 3],
    /// Candidates over the columns of `pool`, events left out.
    pub(crate) candidates: Vec<Candidate>,
    /// Their columns.
    pub(crate) pool: Pool,
    /// Noise levels of the gyros' rows, without drift.
    pub(crate) levels: Vec<NoiseLevels>,
}

impl Standing {
    /// Joint result for the recording of which these are stretches.
    pub(crate) fn shown(&self) -> Shown {
        let moves = |axis: usize| {
            let mut each = self.recordings.iter();
            each.any(|one| one.pass.motion.is_moving[axis])
        };
        let (candidates, pool) = self.candidates();
        let levels = self.fit.levels.iter().take(RECORDS);
        Shown {
            parts: self.parts(),
            path: self.recordings[0].path(),
            is_moving: [0, 1, 2].map(moves),
            candidates,
            pool,
            levels: levels.map(|levels| levels.stationary()).collect(),
        }
    }

    /// Gyro, column and size of each effect, events left out.
    fn parts(&self) -> Vec<(usize, Sensed, f64)> {
        let mut parts = Vec::new();
        for (&member, block) in self.fit.members.iter().zip(&self.fit.blocks) {
            let mut own = self.shared[member].own.iter().enumerate();
            let first = own.find_map(|(recording, own)| Some((recording, own.as_ref()?)));
            let Some((recording, (place, parameters))) = first else {
                continue;
            };
            let pass = &self.recordings[recording].pass;
            let candidate = &pass.candidates[*place];
            if candidate.event_gyro().is_some() {
                continue;
            }
            let columns = &pass.pool.columns;
            let fixed = candidate.hypothesis.fixed.iter();
            parts.extend(fixed.map(|one| (one.record, columns[one.column], one.size)));
            let terms = candidate.hypothesis.terms.iter();
            parts.extend(terms.map(|term| {
                let value = self.fit.estimate[block.start + parameters[term.parameter]];
                (term.record, columns[term.column], term.coefficient * value)
            }));
        }
        parts
    }

    /// Candidates with their columns, each from the first recording that has it; events left out.
    fn candidates(&self) -> (Vec<Candidate>, Pool) {
        let mut pool = Pool::default();
        let mut all: Vec<Candidate> = Vec::new();
        for pass in self.recordings.iter().map(|one| &one.pass) {
            for one in &pass.candidates {
                let is_known = all.iter().any(|other| other.is_made_as(one));
                if one.event_gyro().is_none() && !is_known {
                    all.push(pool.adopt(one, &pass.pool.columns));
                }
            }
        }
        (all, pool)
    }

    /// Searches anew together with sums over the whole recording, if there are any, and judges the set.
    pub(crate) fn judged(mut self, sums: Option<Side>, plan: &Plan) -> Together {
        let of_sums = sums.as_ref().map(|sums| sums.candidates.to_vec());
        let mut sides: Vec<Side> = self
            .recordings
            .iter()
            .map(|one| side_of(&one.pass))
            .collect();
        if let Some(sums) = sums {
            let members = members_of(&self.fit, &self.shared);
            let mut levels = self.fit.levels.clone();
            levels.extend(sums.levels);
            sides.push(sums);
            self.shared = spell(&sides, self.grouping, plan);
            let start = Start::Also(places_of(&members, &self.shared));
            let (fit, looked_at) = search(&sides, &self.shared, start, (&levels, plan));
            self.fit = fit;
            self.tried += looked_at;
        }
        let known = (&self.fit.levels[..], plan);
        let (judged, looked_at) = searching(&sides, &self.shared, known, |search| {
            search.judge_set(
                &self.fit,
                plan.judgement.class_within,
                plan.judgement.separation,
            )
        });
        let tried = self.tried + looked_at;
        drop(sides);
        let passes = self.recordings.into_iter().map(|one| one.pass);
        let (mut candidates, mut found) = (Vec::new(), Vec::new());
        for (recording, pass) in passes.enumerate() {
            candidates.push(pass.candidates);
            found.push(Found {
                candidates: in_recording(&self.shared, recording),
                pool: pass.pool,
                fit: with_noise_of(&self.fit, recording),
                judged: judged_in(&judged.members, recording),
                spanned_by: judged.spanned_by.clone(),
                reached_by: judged.reached_by.clone(),
                without: judged.without.clone(),
                empty: with_noise_of(&judged.empty, recording),
                motion: pass.motion,
                residual_rad: pass.residual_rad,
                tried,
                equations: pass.equations,
            });
        }
        candidates.extend(of_sums);
        Together {
            shared: self.shared,
            candidates,
            fit: self.fit,
            found,
            tried,
        }
    }
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

/// Forms the shared candidates of all sides.
fn spell(sides: &[Side], grouping: Grouping, plan: &Plan) -> Vec<Shared> {
    let candidates: Vec<&[Candidate]> = sides.iter().map(|one| one.candidates).collect();
    spelt_out(&candidates, grouping, &plan.several)
}

/// Members of a set.
fn members_of(fit: &Fit, shared: &[Shared]) -> Vec<Shared> {
    let members = fit.members.iter();
    members.map(|&place| shared[place].clone()).collect()
}

/// Places of the members found before.
fn places_of(before: &[Shared], shared: &[Shared]) -> Vec<usize> {
    let is_member = |place: &usize| before.iter().any(|one| one.is_same(&shared[*place]));
    (0..shared.len()).filter(is_member).collect()
}

impl Recording {
    fn new(settled: Settled) -> Self {
        Self {
            pass: settled.pass,
            rows: settled.rows,
        }
    }

    /// Path along which its columns were formed.
    fn path(&self) -> Path {
        self.pass.motion.signals.path
    }

    /// True if a delay of the gyro is among its candidates.
    fn may_show_delay(&self, gyro: usize) -> bool {
        let delays = self.pass.candidates.iter().filter(|one| is_delay(one.kind));
        let mut terms = delays.flat_map(|one| &one.hypothesis.terms);
        terms.any(|term| term.record == gyro)
    }

    /// Linearises the next pass behind the residual of a fit, with the delays `delay_s` if given.
    fn linearised_about(
        self,
        data: &mut Data,
        fit: Fit,
        delay_s: Option<[f64; 3]>,
        scope: Scope,
    ) -> Self {
        let Self { pass, rows } = self;
        let mut path = path_of(&fit, &pass.candidates, &scope.plan.rates);
        path.delay_s = delay_s.unwrap_or(path.delay_s);
        let begun = Begun::behind(pass, fit, path, data, &rows);
        Self {
            pass: begun.linearised(data, &rows, scope),
            rows,
        }
    }
}

/// Linearises the delays of all recordings about one weighted mean if each recording's own estimate allows it: only then can
/// they share one parameter. Stretches belong to one recording, which has one delay.
fn join_delays(
    all: &mut [Data],
    recordings: &mut Vec<Recording>,
    grouping: Grouping,
    fits: &[Fit],
    scope: Scope,
) {
    let each: Vec<([f64; 3], [f64; 3])> = recordings
        .iter()
        .zip(fits)
        .map(|(one, fit)| delays(fit, &one.pass.candidates))
        .collect();
    let joint_s = [0, 1, 2].map(|gyro: usize| {
        // A recording that cannot show a delay has no weight.
        let speaks = |place: usize| {
            each[place].1[gyro].is_finite() || recordings[place].may_show_delay(gyro)
        };
        let own = (0..each.len()).map(|place| (each[place].0[gyro], each[place].1[gyro]));
        match grouping {
            Grouping::Stretches => Some(mean_delay(own).map_or(0.0, |(mean_s, _)| mean_s)),
            Grouping::Recordings => {
                let spoken = own.enumerate().filter(|(place, _)| speaks(*place));
                let spoken: Vec<(f64, f64)> = spoken.map(|(_, own)| own).collect();
                joint_delay(&spoken, scope.plan.several.same_delay)
            }
        }
    });
    let [Some(x), Some(y), Some(z)] = joint_s else {
        return;
    };
    let delay_s = [x, y, z];
    // The columns are linearised about these delays already.
    if recordings.iter().all(|one| one.path().delay_s == delay_s) {
        return;
    }
    *recordings = std::mem::take(recordings)
        .into_iter()
        .zip(all.iter_mut())
        .zip(fits)
        .map(|((one, data), fit)| one.linearised_about(data, fit.clone(), Some(delay_s), scope))
        .collect();
}

/// Adds to all recordings the candidates found in one of them by a scan: they are in no other's catalogue.
fn spell_in_all(recordings: &mut [Recording], fits: &[Fit]) {
    let mut found: Vec<(usize, Candidate)> = Vec::new();
    for (place, (one, fit)) in recordings.iter().zip(fits).enumerate() {
        let members = fit
            .members
            .iter()
            .filter_map(|&member| one.pass.candidates.get(member));
        let scanned = members.filter(|one| !is_delay(one.kind) && one.event_gyro().is_none());
        found.extend(scanned.map(|one| (place, one.clone())));
    }
    for (place, recording) in recordings.iter_mut().enumerate() {
        let pass = &mut recording.pass;
        let mut new: Vec<Candidate> = Vec::new();
        for (_, one) in found.iter().filter(|(owner, _)| *owner != place) {
            let mut known = pass.candidates.iter().chain(&new);
            if known.any(|other| other.is_made_as(one)) {
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

/// Hypotheses of candidates, and the number of their kinds.
fn hypotheses_of(shared: &[Shared]) -> (Vec<Hypothesis>, usize) {
    let kinds: BTreeSet<&str> = shared.iter().map(|one| one.candidate.kind).collect();
    let each = shared.iter().map(|one| one.candidate.hypothesis.clone());
    (each.collect(), kinds.len().max(1))
}

/// Starting set of a search.
enum Start {
    /// A set.
    Only(Vec<usize>),
    /// The empty set, and a set.
    Also(Vec<usize>),
}

/// Runs `of` on a search over all sides.
///
/// # Returns
/// Its result, and the number of evaluated sets.
fn searching<R>(
    sides: &[Side],
    shared: &[Shared],
    (levels, plan): (&[NoiseLevels], &Plan),
    of: impl FnOnce(&mut Search<JointLikelihood<NormalEquations>>) -> R,
) -> (R, usize) {
    let likelihood = JointLikelihood::new(sides.iter().map(|one| one.equations).collect());
    let (hypotheses, kinds) = hypotheses_of(shared);
    let drift = joint_drift(sides.iter().map(|one| one.drift.clone()));
    let mut search = Search::new(
        &likelihood,
        &hypotheses,
        kinds,
        &plan.inference.search,
        &drift,
        levels.to_vec(),
    );
    let result = of(&mut search);
    (result, search.tried_sets())
}

/// Returns the best set, and the number of evaluated sets.
fn search(
    sides: &[Side],
    shared: &[Shared],
    start: Start,
    known: (&[NoiseLevels], &Plan),
) -> (Fit, usize) {
    let most = known.1.inference.search.most_members;
    searching(sides, shared, known, |search| match start {
        Start::Only(start) => search.run(&start, most),
        Start::Also(start) => {
            let from_nothing = search.run(&[], most);
            match start.is_empty() || start.len() > most {
                true => from_nothing,
                false => best_of(vec![search.run(&start, most)], from_nothing),
            }
        }
    })
}

/// Places of the members found in single recordings, as common to all where possible.
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
