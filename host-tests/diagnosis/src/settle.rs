//! Passes between motion, columns and structure search, until the set and its delays stand still.

use std::cell::Cell;

use nalgebra::Matrix3;
use rlg_catalogue::Candidate;
use rlg_catalogue::signals::Path;
use rlg_catalogue::turned::TURNED;
use rlg_inference::{Fit, NoiseLevels, Observations};
use rlg_signal::partition::Use;
use rlg_signal::streams::{Triad, add_triad};

use super::before::{Before, without_known};
use super::case_motion::{Motion, estimate};
use super::coarse::coarse;
use super::data::{Data, bridged};
use super::noise_levels::first_levels;
use super::pass::Pass;
use super::path::{is_alike, is_nonlinear, is_same, is_settled, path_of};
use super::plan::AnalysisPlan;
use super::search::{Found, share_of};
use super::step::Step;
use super::turned::Turned;

/// Finds the best set; `None` where too few rows can be fitted.
pub fn find(
    data: &mut Data,
    left_out: &[&str],
    plan: &AnalysisPlan,
    progress: &dyn Fn(&str),
) -> Option<Found> {
    let settled = settle(data, left_out, plan, progress)?;
    Some(settled.pass.judge(settled.fit, plan, settled.tried))
}

/// The last pass of a search, whose set and delays no longer change.
pub(super) struct Settled {
    pub(super) pass: Pass,
    /// The best set.
    pub(super) fit: Fit,
    /// Sets that were looked at.
    pub(super) tried: usize,
    pub(super) rows: Rows,
}

/// Rows that a search looks at.
pub(super) struct Rows {
    /// Which may be looked at.
    pub(super) seen: Vec<bool>,
    /// Spans of those.
    pub(super) looked_at: Observations,
    /// What is fitted of them.
    pub(super) fitted: Observations,
}

impl Rows {
    /// Those that do not only test; `None` where they are too few.
    fn of(data: &Data) -> Option<Self> {
        let seen = data.rows_of(&[Use::Train, Use::Confirm]);
        let looked_at = data.observed(&seen)?;
        let fitted = looked_at.clone().to_fast_length();
        Some(Self {
            seen,
            looked_at,
            fitted,
        })
    }
}

/// The residual of the model with its effects \[rad\]; `None` where too few rows can be fitted.
pub fn residual_of_model(data: &mut Data, plan: &AnalysisPlan) -> Option<Triad> {
    let mut left = data.residual_rad.clone();
    if data.model.effects.is_empty() {
        return Some(left);
    }
    let rows = Rows::of(data)?;
    // What the model holds is taken out before the noise of what is left means anything.
    for _ in 0..2 {
        let levels = first_levels(&left, &rows.fitted);
        let clean = bridged(&left, &rows.looked_at);
        let motion = estimate(data, &clean, &levels, &rows.seen, Path::default(), plan);
        data.set_known(&motion.signals);
        left = without_known(data, &motion.signals);
    }
    Some(left)
}

/// Alternates linearisation and structure search until set and delays no longer change; `None` where too few rows can be
/// fitted.
pub(super) fn settle(
    data: &mut Data,
    left_out: &[&str],
    plan: &AnalysisPlan,
    progress: &dyn Fn(&str),
) -> Option<Settled> {
    data.forget_found();
    let mut rows = Rows::of(data)?;
    let left = residual_of_model(data, plan)?;
    let far = coarse(data, &left, &rows.seen, &plan.coarse);
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
    // What the last pass began with whose set stood before the families were asked.
    let mut stood = None;
    let mut asks = Asks::WhereItStands;
    let mut tried = 0;
    let mut pass = 1;
    loop {
        let is_last = pass == plan.passes;
        if is_last && stood.is_none() && asks == Asks::WhereItStands {
            asks = Asks::Anyway;
        }
        progress(&format!("pass {pass}"));
        let done = begun.pass(data, &rows, asks, (plan, left_out));
        tried += done.tried;
        if done.has_ended || is_last && stood.is_none() {
            data.found_share = share_of(&done.fit, &done.pass.candidates, &done.pass.pool);
            return Some(Settled {
                pass: done.pass,
                fit: done.fit,
                tried,
                rows,
            });
        }
        if is_last {
            // What the families added never stood: the set that did stands without them.
            begun = stood.take().expect("a set stood");
            asks = Asks::Nothing;
            continue;
        }
        pass += 1;
        if let Some(step) = begun.step.filter(|step| step.is_worse(done.odds)) {
            begun = begun.nearer(step, data, &rows);
            continue;
        }
        let has_stood = done.stood;
        let next = done.next(data, &rows, &begun);
        let before = std::mem::replace(&mut begun, next);
        if has_stood {
            stood = Some(before);
        }
    }
}

/// When a pass asks the families.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Asks {
    /// Beside a set that stands.
    WhereItStands,
    /// Beside any.
    Anyway,
    /// Never.
    Nothing,
}

/// What a pass begins with.
pub(super) struct Begun {
    levels: Vec<NoiseLevels>,
    /// What is left by what was found \[rad\].
    clean_rad: Triad,
    /// What gyros sense of each axis by it.
    share: Matrix3<f64>,
    path: Path,
    path_before: Option<Path>,
    before: Before,
    /// Of numbers inside columns, from where they were before; `None` where there are none, or nothing to compare with.
    step: Option<Step>,
    /// Whether one nonlinear member is still to be settled.
    is_settling: bool,
}

/// A pass that is done.
struct Done {
    pass: Pass,
    fit: Fit,
    tried: usize,
    is_settling: bool,
    /// Log odds of the set against nothing but noise. Scores of two passes have no common zero: what the gate hides of the set
    /// before is taken out of the record.
    odds: f64,
    /// Whether the motion is of a set that holds all of this one. Motion that holds what is new fits it better than it should.
    is_comparable: bool,
    /// Whether the set stood before the families were asked.
    stood: bool,
    /// Whether neither set nor its numbers change any more.
    has_ended: bool,
}

impl Begun {
    /// Behind what a fit leaves of a pass along `path`.
    pub(super) fn behind((pass, fit): (Pass, Fit), path: Path, data: &Data, rows: &Rows) -> Self {
        Self {
            levels: fit.levels.clone(),
            clean_rad: pass.clean_by((data, &fit), path, &rows.looked_at),
            share: share_of(&fit, &pass.candidates, &pass.pool),
            path,
            path_before: None,
            before: Before::Pass(fit, pass.candidates),
            step: None,
            is_settling: false,
        }
    }

    /// The same with half the step, and with all members of the set where none of it is left.
    fn nearer(mut self, step: Step, data: &Data, rows: &Rows) -> Self {
        let Before::Pass(fit, candidates) = &mut self.before else {
            return self;
        };
        let step = step.halved(fit, candidates);
        let path = path_of(fit, candidates);
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

    /// Motion and columns.
    pub(super) fn linearised(
        &self,
        data: &mut Data,
        rows: &Rows,
        (plan, left_out): (&AnalysisPlan, &[&str]),
    ) -> Pass {
        data.found_share = self.share;
        let motion = self.motion(data, rows, plan);
        let turned = Turned::said(data, &self.before);
        self.over((motion, &turned), data, rows, left_out)
    }

    fn motion(&self, data: &Data, rows: &Rows, plan: &AnalysisPlan) -> Motion {
        estimate(
            data,
            &self.clean_rad,
            &self.levels,
            &rows.seen,
            self.path,
            plan,
        )
    }

    /// Columns of a motion over a turned reference.
    fn over(
        &self,
        (motion, turned): (Motion, &Turned),
        data: &mut Data,
        rows: &Rows,
        left_out: &[&str],
    ) -> Pass {
        let before = (&self.before, turned);
        Pass::new(data, motion, left_out, &rows.fitted, &self.levels, before)
    }

    /// The same with a search; where a rotation of the reference would look like what was found, once with it and once
    /// without, and the better.
    fn pass(
        &self,
        data: &mut Data,
        rows: &Rows,
        asks: Asks,
        (plan, left_out): (&AnalysisPlan, &[&str]),
    ) -> Done {
        let now = self.linearised(data, rows, (plan, left_out));
        let tried = Turned::tried(data, &self.before);
        let tried = tried.filter(|tried| tried.is_seen(data, &now.motion.signals, &self.levels));
        let done = self.searched(now, data, asks, (plan, left_out));
        let Some(tried) = tried else {
            return done;
        };
        let motion = self.motion(data, rows, plan);
        let turned = self.over((motion, &tried), data, rows, left_out);
        let turned = self.searched(turned, data, asks, (plan, left_out));
        let mut members = turned.fit.members.iter();
        let holds_it = members.any(|&place| turned.pass.candidates[place].kind == TURNED);
        if holds_it && turned.fit.score > done.fit.score {
            turned
        } else {
            done
        }
    }

    /// Searches a pass.
    fn searched(
        &self,
        mut now: Pass,
        data: &Data,
        asks: Asks,
        (plan, left_out): (&AnalysisPlan, &[&str]),
    ) -> Done {
        let levels = &self.levels;
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
        // Numbers that no step makes better are what they are.
        let stand = self.step.is_some_and(|step| step.is_none());
        let is_settled = |fit: &Fit, candidates: &[Candidate]| {
            stand || is_settled(fit, candidates, self.path.delay_s)
        };
        let stood = Cell::new(false);
        // The families are of motion.
        let are_sought = asks != Asks::Nothing && data.streams.at_rest.is_none();
        let run = now.search(
            &start,
            levels,
            is_first || self.is_settling,
            (plan, left_out),
            |fit, candidates| {
                // A strong delay or mount is linearised to the end before anything is added to it.
                is_nonlinear(fit, candidates) && (is_first || !is_settled(fit, candidates))
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
        // The motion is that of a set only where what the set leaves was seen along the same path.
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
    /// What the next pass begins with.
    fn next(self, data: &Data, rows: &Rows, begun: &Begun) -> Begun {
        let path = path_of(&self.fit, &self.pass.candidates);
        let of = (self.odds, &self.fit);
        let step = self
            .is_comparable
            .then(|| Step::of(of, &self.pass.candidates));
        Begun {
            path_before: Some(begun.path),
            step: step.flatten(),
            is_settling: self.is_settling,
            ..Begun::behind((self.pass, self.fit), path, data, rows)
        }
    }
}
