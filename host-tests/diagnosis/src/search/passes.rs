//! Passes of motion estimation, linearisation and structure search, until the set and its delays converge.

use rlg_plan::{Plan, RatesPlan};
use std::cell::Cell;

use nalgebra::Matrix3;
use rlg_catalogue::Candidate;
use rlg_catalogue::signals::Path;
use rlg_catalogue::turned::TURNED;
use rlg_inference::{Fit, NoiseLevels, Observations, TooFewRows};
use rlg_signal::partition::Use;
use rlg_signal::streams::{Triad, add_triad};

use super::linearisation::About;
use super::step_control::Step;
use super::structure::{Found, share_of};
use crate::alignment::case_motion::{Motion, estimate};
use crate::alignment::coarse::coarse;
use crate::iteration::pass::Pass;
use crate::iteration::path::{is_alike, is_nonlinear, is_same, is_settled, path_of};
use crate::iteration::reference_rotation::Turned;
use crate::iteration::state::{Before, without_known};
use crate::rows::data::{Data, bridged};
use crate::rows::noise_levels::first_levels;
use crate::settings::Scope;

/// Finds the best set.
///
/// # Errors
/// Too few rows can be fitted.
pub fn find(data: &mut Data, scope: Scope, progress: &dyn Fn(&str)) -> Result<Found, TooFewRows> {
    let settled = settle(data, scope, progress)?;
    Ok(settled.pass.judge(settled.fit, scope.plan, settled.tried))
}

/// Last pass of a search, with a converged set and delays.
pub(crate) struct Settled {
    pub(crate) pass: Pass,
    /// Fit of the best set.
    pub(crate) fit: Fit,
    /// Number of evaluated sets.
    pub(crate) tried: usize,
    pub(crate) rows: Rows,
}

/// Rows of a search.
pub(crate) struct Rows {
    /// True for rows to fit.
    pub(crate) seen: Vec<bool>,
    /// Spans of the seen rows.
    pub(crate) looked_at: Observations,
    /// The seen rows, cut to a fast transform length.
    pub(crate) fitted: Observations,
}

impl Rows {
    /// Selects the rows to fit.
    fn of(data: &Data) -> Result<Self, TooFewRows> {
        let seen = data.rows_of(&[Use::Fit]);
        let looked_at = data.observed(&seen)?;
        let fitted = looked_at.clone().to_fast_length();
        Ok(Self {
            seen,
            looked_at,
            fitted,
        })
    }
}

/// The residual of the model with its effects \[rad\].
///
/// # Errors
/// Too few rows can be fitted.
pub fn residual_of_model(data: &mut Data, plan: &Plan) -> Result<Triad, TooFewRows> {
    let mut left = data.residual_rad.clone();
    if data.model.effects.is_empty() {
        return Ok(left);
    }
    let rows = Rows::of(data)?;
    // The known effects are subtracted before the noise levels of the residual are meaningful.
    for _ in 0..2 {
        let levels = first_levels(&left, &rows.fitted);
        let clean = bridged(&left, &rows.looked_at);
        let motion = estimate(data, &clean, &levels, &rows.seen, Path::default(), plan);
        data.set_known(&motion.signals);
        left = without_known(data, &motion.signals);
    }
    Ok(left)
}

/// Alternates linearisation and structure search until set and delays converge.
///
/// # Errors
/// Too few rows can be fitted.
pub(crate) fn settle(
    data: &mut Data,
    scope: Scope,
    progress: &dyn Fn(&str),
) -> Result<Settled, TooFewRows> {
    let plan = scope.plan;
    data.forget_found();
    let mut rows = Rows::of(data)?;
    let left = residual_of_model(data, plan)?;
    let far = coarse(data, &left, &rows.seen, plan);
    if far.path != Path::default() {
        data.late_rows += far.path.longest_delay_s() * data.streams.rate_hz;
        rows = Rows::of(data)?;
    }
    let mut begun = Begun {
        levels: first_levels(&far.clean_rad, &rows.fitted),
        clean_rad: bridged(&far.clean_rad, &rows.looked_at),
        share: Matrix3::from_fn(|gyro, axis| far.sensed[gyro][axis]),
        path: far.path,
        path_before: None,
        before: Before::Coarse(far),
        step: None,
        is_settling: false,
    };
    // Start of the last pass whose set had converged before the families were tried.
    let mut stood = None;
    let mut asks = Asks::WhereItStands;
    let mut tried = 0;
    let mut pass = 1;
    loop {
        let is_last = pass == plan.judgement.passes;
        if is_last && stood.is_none() && asks == Asks::WhereItStands {
            asks = Asks::Anyway;
        }
        progress(&format!("pass {pass}"));
        let done = begun.pass(data, &rows, asks, scope);
        tried += done.tried;
        if done.has_ended || is_last && stood.is_none() {
            data.found_share = share_of(&done.fit, &done.pass.candidates, &done.pass.pool);
            return Ok(Settled {
                pass: done.pass,
                fit: done.fit,
                tried,
                rows,
            });
        }
        if is_last {
            // The set with the families did not converge: the converged set without them is used.
            begun = stood.take().expect("a set stood");
            asks = Asks::Nothing;
            continue;
        }
        pass += 1;
        if let Some(step) = begun.step.filter(|step| step.is_worse(done.odds)) {
            begun = begun.nearer(step, data, &rows, &plan.rates);
            continue;
        }
        let has_stood = done.stood;
        let next = done.next(data, &rows, &begun, &plan.rates);
        let before = std::mem::replace(&mut begun, next);
        if has_stood {
            stood = Some(before);
        }
    }
}

/// Condition under which a pass tries the families.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Asks {
    /// Given a converged set.
    WhereItStands,
    /// Given any set.
    Anyway,
    /// Never.
    Nothing,
}

/// Starting point of a pass.
pub(crate) struct Begun {
    levels: Vec<NoiseLevels>,
    /// Residual of the found set \[rad\].
    clean_rad: Triad,
    /// Gain from each axis' increment to each gyro by the found set \[1\].
    share: Matrix3<f64>,
    path: Path,
    path_before: Option<Path>,
    before: Before,
    /// Step of the nonlinear parameters from their previous values; `None` without such parameters or a comparable pass.
    step: Option<Step>,
    /// True if a single nonlinear member has not converged yet.
    is_settling: bool,
}

/// Result of a pass.
struct Done {
    pass: Pass,
    fit: Fit,
    tried: usize,
    is_settling: bool,
    /// Log odds of the set against the noise alone. Scores of two passes have no common zero: effects of the previous set
    /// that the gate hides are subtracted from the record.
    odds: f64,
    /// True if the motion was estimated under a set that contains this one. A new effect in the motion fits it better than
    /// it should.
    is_comparable: bool,
    /// True if the set had converged before the families were tried.
    stood: bool,
    /// True if neither the set nor its parameters change any more.
    has_ended: bool,
}

impl Begun {
    /// Starting point behind a pass, with the residual of its fit along `path`.
    pub(crate) fn behind(pass: Pass, fit: Fit, path: Path, data: &Data, rows: &Rows) -> Self {
        Self {
            levels: fit.levels.clone(),
            clean_rad: pass.clean_by(data, &fit, path, &rows.looked_at),
            share: share_of(&fit, &pass.candidates, &pass.pool),
            path,
            path_before: None,
            before: Before::Pass(fit, pass.candidates),
            step: None,
            is_settling: false,
        }
    }

    /// Halves the step; after the last halving all members of the set take part.
    fn nearer(mut self, step: Step, data: &Data, rows: &Rows, plan: &RatesPlan) -> Self {
        let Before::Pass(fit, candidates) = &mut self.before else {
            return self;
        };
        let step = step.halved(fit, candidates);
        let path = path_of(fit, candidates, plan);
        add_triad(&mut self.clean_rad, &data.passed_by(self.path), 1.0);
        add_triad(&mut self.clean_rad, &data.passed_by(path), -1.0);
        Self {
            clean_rad: bridged(&self.clean_rad, &rows.looked_at),
            path,
            step: Some(step),
            is_settling: self.is_settling && !step.is_none(),
            ..self
        }
    }

    /// Estimates the motion and forms the columns.
    pub(crate) fn linearised(&self, data: &mut Data, rows: &Rows, scope: Scope) -> Pass {
        data.found_share = self.share;
        let motion = self.motion(data, rows, scope.plan);
        let turned = Turned::said(data, &self.before);
        self.over(motion, &turned, data, rows, scope)
    }

    fn motion(&self, data: &Data, rows: &Rows, plan: &Plan) -> Motion {
        estimate(
            data,
            &self.clean_rad,
            &self.levels,
            &rows.seen,
            self.path,
            plan,
        )
    }

    /// Forms the columns of a motion over a rotated reference.
    fn over(
        &self,
        motion: Motion,
        turned: &Turned,
        data: &mut Data,
        rows: &Rows,
        scope: Scope,
    ) -> Pass {
        let about = About {
            before: &self.before,
            turned,
            levels: &self.levels,
        };
        Pass::new(data, motion, &rows.fitted, about, scope)
    }

    /// Searches a pass; if a rotation of the reference would look like the found errors, searches once with it and once
    /// without, and keeps the better.
    fn pass(&self, data: &mut Data, rows: &Rows, asks: Asks, scope: Scope) -> Done {
        let now = self.linearised(data, rows, scope);
        let tried = Turned::tried(data, &self.before);
        let (signals, settled) = (&now.motion.signals, scope.plan.rates.settled);
        let tried = tried.filter(|tried| tried.is_seen(data, signals, &self.levels, settled));
        let done = self.searched(now, data, asks, scope);
        let Some(tried) = tried else {
            return done;
        };
        let motion = self.motion(data, rows, scope.plan);
        let turned = self.over(motion, &tried, data, rows, scope);
        let turned = self.searched(turned, data, asks, scope);
        let mut members = turned.fit.members.iter();
        let holds_it = members.any(|&place| turned.pass.candidates[place].kind == TURNED);
        if holds_it && turned.fit.score > done.fit.score {
            turned
        } else {
            done
        }
    }

    /// Runs the structure search of a pass.
    fn searched(&self, mut now: Pass, data: &Data, asks: Asks, scope: Scope) -> Done {
        let (levels, plan) = (&self.levels, scope.plan);
        let members: Option<Vec<&Candidate>> = match &self.before {
            Before::Coarse(_) => None,
            Before::Pass(fit, candidates) => {
                let members = fit.members.iter().map(|&place| &candidates[place]);
                Some(members.collect())
            }
        };
        let is_first = members.is_none();
        let start: Vec<usize> = members
            .iter()
            .flatten()
            .filter_map(|member| {
                let mut all = now.candidates.iter();
                all.position(|other| is_same(other, member))
            })
            .collect();
        let count_before = members.as_ref().map_or(0, Vec::len);
        let is_as_before = |fit: &Fit| {
            count_before == start.len()
                && fit.members.len() == start.len()
                && start.iter().all(|place| fit.members.contains(place))
        };
        // After the last halving the parameters count as converged.
        let stand = self.step.is_some_and(|step| step.is_none());
        let is_settled = |fit: &Fit, candidates: &[Candidate]| {
            stand || is_settled(fit, candidates, self.path.delay_s, &plan.rates)
        };
        let stood = Cell::new(false);
        // The families need motion.
        let are_sought = asks != Asks::Nothing && data.streams.at_rest.is_none();
        let run = now.search(
            &start,
            levels,
            is_first || self.is_settling,
            scope,
            |fit, candidates| {
                // A strong delay or mount is linearised to convergence before other members are added.
                is_nonlinear(fit, candidates, &plan.rates)
                    && (is_first || !is_settled(fit, candidates))
            },
            |fit, candidates| {
                stood.set(is_as_before(fit) && is_settled(fit, candidates));
                are_sought && (asks == Asks::Anyway || stood.get())
            },
        );
        let fit = run.fit;
        let is_same = !is_first && is_as_before(&fit) && is_settled(&fit, &now.candidates);
        let is_near = matches!(&self.before, Before::Coarse(far) if !far.is_far());
        let is_nothing = fit.members.is_empty() && is_near;
        // The motion belongs to a set only if the residual of the set was formed along the same path.
        let mut path_before = self.path_before.iter();
        let is_own = path_before.any(|before| is_alike(before, &self.path));
        let odds = fit.score - run.empty_score;
        Done {
            odds,
            is_comparable: !is_first && fit.members.iter().all(|place| start.contains(place)),
            has_ended: !run.only_nonlinear && (is_nothing || (is_same && is_own)),
            pass: now,
            fit,
            tried: run.tried,
            is_settling: run.only_nonlinear,
            stood: stood.get(),
        }
    }
}

impl Done {
    /// Starting point of the next pass.
    fn next(self, data: &Data, rows: &Rows, begun: &Begun, plan: &RatesPlan) -> Begun {
        let path = path_of(&self.fit, &self.pass.candidates, plan);
        let step = self
            .is_comparable
            .then(|| Step::of(self.odds, &self.fit, &self.pass.candidates));
        Begun {
            path_before: Some(begun.path),
            step: step.flatten(),
            is_settling: self.is_settling,
            ..Begun::behind(self.pass, self.fit, path, data, rows)
        }
    }
}
