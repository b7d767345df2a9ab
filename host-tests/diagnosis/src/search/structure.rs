//! The structure search of one pass: columns, their candidates, and the best set of them.

use rlg_plan::Plan;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix3;
use rlg_catalogue::candidates::{PoolColumns, Variant};
use rlg_catalogue::entries::SLIP;
use rlg_catalogue::signals::Path;
use rlg_catalogue::{Candidate, Column, Pool, Sensed};
use rlg_inference::judgement::Judged;
use rlg_inference::search::best_of;
use rlg_inference::{Fit, Hypothesis, NoiseLevels, NormalEquations, Observations, Search};

use crate::alignment::case_motion::Motion;
use crate::candidates::families::{Alone, strongest, strongest_filters};
use crate::iteration::pass::{Begin, Pass, sizes_on, subtract, subtract_by};
use crate::iteration::path::is_of_path;
use crate::iteration::state::without_known;
use crate::rows::data::{Data, bridged};
use crate::settings::Scope;
use rlg_signal::streams::{Triad, add_triad};

/// Result of the structure search on the fitted rows.
pub struct Found {
    /// All candidates, indexed as in `fit`.
    pub candidates: Vec<Candidate>,
    /// Columns of the candidates.
    pub pool: Pool,
    /// Fit of the best set.
    pub fit: Fit,
    /// Members of the set, each with its cost in log posterior and its rivals.
    pub judged: Vec<Judged>,
    /// Rivals of each member whose columns span it.
    pub spanned_by: Vec<Vec<usize>>,
    /// Rivals in `spanned_by` that reproduce the member's effect to an insignificant residual.
    pub reached_by: Vec<Vec<usize>>,
    /// The set without each member, fitted anew.
    pub without: Vec<Fit>,
    /// Fit of the noise alone.
    pub empty: Fit,
    /// Motion estimated in the last pass.
    pub motion: Motion,
    /// Residual of the model with its effects \[rad\].
    pub residual_rad: Triad,
    /// Number of evaluated sets.
    pub tried: usize,
    /// Normal equations of the columns of all candidates on the fitted rows.
    pub equations: NormalEquations,
}

/// A recording, and the set found on it.
#[derive(Clone, Copy)]
pub struct Searched<'a> {
    /// The recording.
    pub data: &'a Data<'a>,
    /// The set.
    pub found: &'a Found,
}

/// Fits by their members, and the number of evaluated sets.
type Seen = (BTreeMap<Vec<usize>, Fit>, usize);

pub(crate) struct Run {
    pub(crate) fit: Fit,
    /// True if the set holds a single nonlinear member whose linearisation has not converged.
    pub(crate) only_nonlinear: bool,
    /// Score of the fit of the noise alone.
    pub(crate) empty_score: f64,
    pub(crate) tried: usize,
}

impl Pass {
    fn hypotheses(&self) -> Vec<Hypothesis> {
        self.candidates
            .iter()
            .map(|one| one.hypothesis.clone())
            .collect()
    }

    fn kinds(&self) -> usize {
        let kinds: BTreeSet<&str> = self.candidates.iter().map(|one| one.kind).collect();
        kinds.len().max(1)
    }

    /// Runs `of` on a search over the present candidates that reuses the fits in `seen`.
    fn searching<R>(&self, seen: &mut Seen, begin: &Begin, of: impl FnOnce(&mut Search) -> R) -> R {
        let hypotheses = self.hypotheses();
        let mut search = Search::new(
            &self.equations,
            &hypotheses,
            begin.kinds,
            &begin.plan.inference.search,
            &self.drift,
            begin.levels.to_vec(),
        )
        .with_seen(std::mem::take(seen));
        let result = of(&mut search);
        *seen = search.into_seen();
        result
    }

    /// Searches the structure, adds events until the score no longer rises, and tries the families once, given a converged
    /// set: motion estimated under another set still depends on the effects that they would explain.
    pub(crate) fn search(
        &mut self,
        start: &[usize],
        levels: &[NoiseLevels],
        nonlinear_first: bool,
        scope: Scope,
        is_unsettled: impl Fn(&Fit, &[Candidate]) -> bool,
        is_standing: impl Fn(&Fit, &[Candidate]) -> bool,
    ) -> Run {
        let begin = Begin {
            kinds: self.kinds(),
            levels,
            plan: scope.plan,
            left_out: scope.left_out,
        };
        let mut seen = Seen::default();
        if nonlinear_first {
            let (fit, empty) = self.first(start, &mut seen, &begin);
            if is_unsettled(&fit, &self.candidates) {
                return Run {
                    fit,
                    only_nonlinear: true,
                    empty_score: empty.score,
                    tried: seen.1,
                };
            }
        }
        let most = self.most(start, scope.plan);
        let (mut fit, empty) = self.searching(&mut seen, &begin, |search| {
            (search.run(start, most), search.fit(&[], None))
        });
        const ROUNDS: usize = 4;
        for round in 0..ROUNDS {
            let from_nothing = (round == 0 && !fit.members.is_empty()).then_some(&empty);
            let fits: Vec<&Fit> = [Some(&fit), from_nothing].into_iter().flatten().collect();
            let events = self.add_events(&fits, &begin);
            let before = fit.score;
            fit = self.improve(fit, &events, &mut seen, &begin);
            if fit.score <= before + 1e-9 {
                break;
            }
        }
        if is_standing(&fit, &self.candidates) {
            let from_nothing = (!fit.members.is_empty()).then_some(&empty);
            let fits: Vec<&Fit> = [Some(&fit), from_nothing].into_iter().flatten().collect();
            let strongest = strongest(self, &fits, &begin);
            let places = self.adopt(&strongest);
            fit = self.improve(fit, &places, &mut seen, &begin);
        }
        Run {
            fit,
            only_nonlinear: false,
            empty_score: empty.score,
            tried: seen.1,
        }
    }

    /// Returns the best set that contains one of the groups of the new `places`, or `fit` if none scores higher.
    fn improve(&self, fit: Fit, places: &[usize], seen: &mut Seen, begin: &Begin) -> Fit {
        if places.is_empty() {
            return fit;
        }
        let groups = self.together(places);
        self.searching(seen, begin, |search| {
            let is_small = |key: &[usize]| key.len() <= self.most(key, begin.plan);
            let better = with_one_of(search, &fit, &groups, &is_small);
            if better.score > fit.score + 1e-9 {
                search.run(&better.members, self.most(&better.members, begin.plan))
            } else {
                fit
            }
        })
    }

    /// Fits the best single member, soft mounts and low passes included, and the noise alone.
    fn first(&mut self, start: &[usize], seen: &mut Seen, begin: &Begin) -> (Fit, Fit) {
        let start = if start.len() <= 1 { start } else { &[] };
        let (fit, empty) = self.searching(seen, begin, |search| {
            (search.run(start, 1), search.fit(&[], None))
        });
        let filters = self.adopt(&strongest_filters(self, &empty, begin));
        let best = self.searching(seen, begin, |search| {
            let alone = filters.iter().map(|&place| search.fit(&[place], None));
            best_of(alone.collect(), fit)
        });
        (best, empty)
    }

    /// Adds new candidates and their columns; returns their places.
    pub(crate) fn extend(&mut self, new: Vec<Candidate>) -> Vec<usize> {
        let columns = PoolColumns {
            columns: &self.pool.columns[self.equations.columns()..],
            signals: &self.motion.signals,
        };
        self.equations.add(&columns);
        let first = self.candidates.len();
        self.candidates.extend(new);
        (first..self.candidates.len()).collect()
    }

    /// Groups places: sine and cosine of one frequency, for a wave of another phase needs both; the slips of a gyro; every
    /// other place alone.
    fn together(&self, places: &[usize]) -> Vec<Vec<usize>> {
        let wave = |place: usize| match self.candidates[place].variant {
            Variant::Expression { axis, expression } => Some((axis, expression.wave_hz()?)),
            _ => None,
        };
        let slips = |place: usize| match self.candidates[place].variant {
            Variant::Event { axis, .. } if self.candidates[place].kind == SLIP => Some(axis),
            _ => None,
        };
        let is_one = |a: &usize, b: &usize| {
            (wave(*a).is_some() && wave(*a) == wave(*b))
                || (slips(*a).is_some() && slips(*a) == slips(*b))
        };
        places.chunk_by(is_one).map(<[usize]>::to_vec).collect()
    }

    /// Largest number of members of a set: slips, each in rows of its own, do not count.
    fn most(&self, members: &[usize], plan: &Plan) -> usize {
        let is_slip = |place: &&usize| self.candidates[**place].kind == SLIP;
        plan.inference.search.most_members + members.iter().filter(is_slip).count()
    }

    /// Adds candidates over columns of their own; returns their places.
    fn adopt(&mut self, found: &[Alone]) -> Vec<usize> {
        let adopted = found
            .iter()
            .map(|(candidate, columns)| self.pool.adopt(candidate, columns))
            .collect();
        self.extend(adopted)
    }

    /// Residual of a fit along its own path, bridged over unseen rows \[rad\].
    ///
    /// The reference's noise in it has passed that path and the gyros' sensing matrix, as in the reference along that path:
    /// with different transfer functions the two noises could not be identified as one.
    pub(crate) fn clean_by(
        &self,
        data: &Data,
        fit: &Fit,
        path: Path,
        looked_at: &Observations,
    ) -> Triad {
        let signals = &self.motion.signals;
        let mut left_rad = without_known(data, signals);
        let mut others = fit.clone();
        let members = fit.members.iter().zip(&fit.blocks);
        let kept = members.filter(|(place, _)| !is_of_path(&self.candidates[**place]));
        (others.members, others.blocks) =
            kept.map(|(place, block)| (*place, block.clone())).unzip();
        let as_sensed = |column: Sensed| match column.column {
            Column::Increment(_) => Sensed::known(column.column).values(signals),
            _ => column.values(signals),
        };
        subtract_by(
            &mut left_rad,
            &others,
            &self.candidates,
            &self.pool,
            as_sensed,
        );
        if path != Path::default() {
            add_triad(&mut left_rad, &data.passed_by(path), -1.0);
        }
        bridged(&left_rad, looked_at)
    }

    pub(crate) fn judge(self, fit: Fit, plan: &Plan, tried: usize) -> Found {
        let hypotheses = self.hypotheses();
        let mut search = Search::new(
            &self.equations,
            &hypotheses,
            self.kinds(),
            &plan.inference.search,
            &self.drift,
            fit.levels.clone(),
        );
        let judged = search.judge_set(&fit, plan.judgement.class_within, plan.judgement.separation);
        let tried = tried + search.tried_sets();
        Found {
            candidates: self.candidates,
            pool: self.pool,
            motion: self.motion,
            residual_rad: self.residual_rad,
            equations: self.equations,
            fit,
            judged: judged.members,
            spanned_by: judged.spanned_by,
            reached_by: judged.reached_by,
            without: judged.without,
            empty: judged.empty,
            tried,
        }
    }
}

/// Returns the best set with one of the groups of candidates added, put in place of a member, or alone.
fn with_one_of(
    search: &mut Search,
    fit: &Fit,
    groups: &[Vec<usize>],
    is_small: &dyn Fn(&[usize]) -> bool,
) -> Fit {
    let with = |group: &Vec<usize>| {
        let instead = fit.members.iter().map(|member| {
            let rest = fit.members.iter().copied().filter(|other| other != member);
            rest.chain(group.iter().copied()).collect::<Vec<usize>>()
        });
        let keys = [group.clone(), [&fit.members[..], group].concat()];
        keys.into_iter().chain(instead).collect::<Vec<_>>()
    };
    let mut keys: Vec<Vec<usize>> = groups.iter().flat_map(with).collect();
    keys.retain(|key| is_small(key));
    best_of(search.fit_all(keys, &fit.levels), fit.clone())
}

/// Gain from each axis' increment to each gyro by a set, beyond the model \[1\].
pub(crate) fn share_of(fit: &Fit, candidates: &[Candidate], pool: &Pool) -> Matrix3<f64> {
    let mut share = Matrix3::zeros();
    for gyro in 0..3 {
        for (column, size) in sizes_on(fit, candidates, gyro) {
            if let Column::Increment(axis) = pool.columns[column].column {
                share[(gyro, axis)] += size;
            }
        }
    }
    share
}

/// Effect of a member of a fit over the found candidates on each gyro \[rad\].
pub fn effect_rad(found: &Found, fit: &Fit, place: usize) -> Triad {
    let signals = &found.motion.signals;
    let mut alone = fit.clone();
    alone.members = vec![fit.members[place]];
    alone.blocks = vec![fit.blocks[place].clone()];
    let mut effect_rad: Triad = std::array::from_fn(|_| vec![0.0; signals.rows]);
    subtract(
        &mut effect_rad,
        &alone,
        &found.candidates,
        &found.pool,
        signals,
    );
    for value in effect_rad.iter_mut().flatten() {
        *value = -*value;
    }
    effect_rad
}

/// Returns the residual of a fit over the found candidates \[rad\].
pub(crate) fn left_by(found: &Found, fit: &Fit) -> Triad {
    let mut left_rad = found.residual_rad.clone();
    let signals = &found.motion.signals;
    subtract(&mut left_rad, fit, &found.candidates, &found.pool, signals);
    left_rad
}
