//! Passes between motion, columns and structure search, until the set and its delays stand still.

use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Matrix3;
use rlg_catalogue::candidates::{PoolColumns, SHARED, Variant, delay_sign, is_delay};
use rlg_catalogue::entries::{MOUNT, SLIP, STEP, UNLISTED};
use rlg_catalogue::expression::Expression;
use rlg_catalogue::low_pass;
use rlg_catalogue::signals::Path;
use rlg_catalogue::{Candidate, Column, Pool, Sensed, Signals};
use rlg_inference::events::{Event, EventKind, impulses, scan};
use rlg_inference::search::{Judged, best_of};
use rlg_inference::{Drift, Fit, Hypothesis, NoiseLevels, NormalEquations, Observations, Search};
use rlg_signal::partition::Use;

use super::case_motion::{Motion, estimate};
use super::coarse::{Coarse, coarse};
use super::data::{Data, bridged};
use super::families::{Alone, strongest, strongest_filters};
use super::noise_levels::{drift_prior, first_levels, mean};
use super::pass::{Begin, Pass, left_on, sizes_on, subtract};
use super::plan::AnalysisPlan;
use super::scores::size_price;
use super::windows::Edges;
use rlg_signal::streams::{Triad, add, add_triad};

/// What the fitted rows say.
pub struct Found {
    /// Every candidate, places as in `fit`.
    pub candidates: Vec<Candidate>,
    /// Columns of the candidates.
    pub pool: Pool,
    /// The best set.
    pub fit: Fit,
    /// Its members with cost and rivals.
    pub judged: Vec<Judged>,
    /// Rivals of each member whose columns span it.
    pub spanned_by: Vec<Vec<usize>>,
    /// The set without each member, fitted anew.
    pub without: Vec<Fit>,
    /// Nothing but noise.
    pub empty: Fit,
    /// The motion of the last pass.
    pub motion: Motion,
    /// Residual of the model with its effects \[rad\].
    pub residual_rad: Triad,
    /// Sets that were looked at.
    pub tried: usize,
    /// Columns of every candidate on the fitted rows.
    pub equations: NormalEquations,
}

/// Fits so far by members, and the number of sets that were looked at.
type Seen = (BTreeMap<Vec<usize>, Fit>, usize);

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
    /// Rows that may be looked at.
    pub(super) seen: Vec<bool>,
    /// Spans of those rows.
    pub(super) looked_at: Observations,
    /// What is fitted of them.
    pub(super) fitted: Observations,
}

/// The residual of the model with its effects \[rad\]; `None` where too few rows can be fitted.
pub fn residual_of_model(data: &mut Data, plan: &AnalysisPlan) -> Option<Triad> {
    let mut left = data.residual_rad.clone();
    if data.model.effects.is_empty() {
        return Some(left);
    }
    let seen = data.rows_of(&[Use::Train, Use::Confirm]);
    let looked_at = data.observed(&seen)?;
    let fitted = looked_at.clone().to_fast_length();
    // What the model holds is taken out before the noise of what is left means anything.
    for _ in 0..2 {
        let levels = first_levels(&left, &fitted);
        let clean = bridged(&left, &looked_at);
        let motion = estimate(data, &clean, &levels, &seen, Path::default(), plan);
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
    let mut seen = data.rows_of(&[Use::Train, Use::Confirm]);
    let mut looked_at = data.observed(&seen)?;
    let mut fitted = looked_at.clone().to_fast_length();
    let left = residual_of_model(data, plan)?;
    let far = coarse(data, &left, &seen, &plan.coarse);
    if far.path != Path::default() {
        data.late_rows += far.path.longest_delay_s() * data.streams.rate_hz;
        seen = data.rows_of(&[Use::Train, Use::Confirm]);
        looked_at = data.observed(&seen)?;
        fitted = looked_at.clone().to_fast_length();
    }
    let rows = Rows {
        seen,
        looked_at,
        fitted,
    };
    let mut begun = Begun {
        levels: first_levels(&far.clean_rad, &rows.fitted),
        clean_rad: bridged(&far.clean_rad, &rows.looked_at),
        share: Matrix3::from_fn(|gyro, axis| far.sensed[gyro][axis]),
        path: far.path,
        path_before: None,
        best: None,
        is_settling: false,
    };
    // What the last pass began with whose set stood before the families were asked.
    let mut stood = None;
    let mut asks = Asks::WhereItStands;
    let mut tried = 0;
    let mut pass = 0;
    loop {
        let is_last = pass + 1 == plan.passes;
        progress(&format!("pass {}", pass + 1));
        let about = (&rows, &far, pass);
        let done = begun.pass(data, about, asks, (plan, left_out));
        tried += done.tried;
        if done.has_ended || asks == Asks::Nothing || is_last && stood.is_none() {
            data.found_share = share_of(&done.fit, &done.pass.candidates, &done.pass.pool);
            let Rows {
                seen,
                looked_at,
                fitted,
            } = rows;
            return Some(Settled {
                pass: done.pass,
                fit: done.fit,
                tried,
                seen,
                looked_at,
                fitted,
            });
        }
        if is_last {
            // What the families added never stood: the set that did stands without them.
            begun = stood.take().expect("a set stood");
            asks = Asks::Nothing;
            continue;
        }
        pass += 1;
        let has_stood = done.stood;
        let next = done.next(data, &rows, &begun);
        if has_stood {
            stood = Some(std::mem::replace(&mut begun, next));
        } else {
            begun = next;
        }
        if pass + 1 == plan.passes && stood.is_none() {
            asks = Asks::Anyway;
        }
    }
}

/// Rows that a search looks at, as in [`Settled`].
struct Rows {
    seen: Vec<bool>,
    looked_at: Observations,
    fitted: Observations,
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
struct Begun {
    levels: Vec<NoiseLevels>,
    /// What is left by what was found \[rad\].
    clean_rad: Triad,
    /// What gyros sense of each axis by it.
    share: Matrix3<f64>,
    path: Path,
    path_before: Option<Path>,
    /// What was found, over the candidates of the pass before.
    best: Option<(Fit, Vec<Candidate>)>,
    /// Whether one nonlinear member is still to be settled.
    is_settling: bool,
}

/// A pass that is done.
struct Done {
    pass: Pass,
    fit: Fit,
    tried: usize,
    is_settling: bool,
    /// Whether the set stood before the families were asked.
    stood: bool,
    /// Whether neither set nor its numbers change any more.
    has_ended: bool,
}

impl Begun {
    /// Motion, columns and search.
    fn pass(
        &self,
        data: &mut Data,
        (rows, far, pass): (&Rows, &Coarse, usize),
        asks: Asks,
        (plan, left_out): (&AnalysisPlan, &[&str]),
    ) -> Done {
        data.found_share = self.share;
        let levels = &self.levels;
        let motion = estimate(data, &self.clean_rad, levels, &rows.seen, self.path, plan);
        let before = self.best.as_ref().map_or(Before::Coarse(far), Before::Pass);
        let mut now = Pass::new(data, motion, left_out, &rows.fitted, levels, before);
        let members: Option<Vec<&Candidate>> = self.best.as_ref().map(|(fit, candidates)| {
            let members = fit.members.iter();
            members.map(|&place| &candidates[place]).collect()
        });
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
        let is_settled =
            |fit: &Fit, candidates: &[Candidate]| is_settled(fit, candidates, self.path.delay_s);
        let stood = Cell::new(false);
        // The families are of motion.
        let are_sought = asks != Asks::Nothing && data.streams.at_rest.is_none();
        let run = now.search(
            &start,
            levels,
            pass == 0 || self.is_settling,
            (plan, left_out),
            |fit, candidates| {
                // A strong delay or mount is linearised to the end before anything is added to it.
                is_nonlinear(fit, candidates) && !(pass > 0 && is_settled(fit, candidates))
            },
            |fit, candidates| {
                stood.set(is_as_before(fit) && is_settled(fit, candidates));
                are_sought && (asks == Asks::Anyway || stood.get())
            },
        );
        let fit = run.fit;
        let is_same = members.is_some() && is_as_before(&fit) && is_settled(&fit, &now.candidates);
        let is_nothing = fit.members.is_empty() && pass == 0 && !far.is_far();
        // The motion is that of a set only where what the set leaves was seen along the same path.
        let mut path_before = self.path_before.iter();
        let is_own = path_before.any(|before| is_alike(before, &self.path));
        Done {
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
        let Self { pass, fit, .. } = self;
        let path = path_of(&fit, &pass.candidates);
        Begun {
            levels: fit.levels.clone(),
            clean_rad: pass.clean_by((data, &fit), path, &rows.looked_at),
            share: share_of(&fit, &pass.candidates, &pass.pool),
            path,
            path_before: Some(begun.path),
            best: Some((fit, pass.candidates)),
            is_settling: self.is_settling,
        }
    }
}

/// What was found before a pass.
#[derive(Clone, Copy)]
pub(super) enum Before<'a> {
    /// By global means.
    Coarse(&'a Coarse),
    /// A set, over the candidates of the pass before.
    Pass(&'a (Fit, Vec<Candidate>)),
}

impl Before<'_> {
    /// Linear effects of it: gyro, column, size. Columns are made of motion that the gate lets through; what it hides of these
    /// effects would look like another one.
    ///
    /// # Inputs
    /// `candidates`: of this pass over `pool`, the set's members about their estimates among them.
    fn linear(
        self,
        candidates: &[Candidate],
        pool: &Pool,
        signals: &Signals,
    ) -> Vec<(usize, Sensed, f64)> {
        let mut parts = Vec::new();
        match self {
            Self::Coarse(far) => {
                for gyro in 0..3 {
                    let sensed = 1.0 / (1.0 - signals.scale_error[gyro]);
                    if far.path.delay_s[gyro] != 0.0 {
                        let late = Column::Late(gyro, far.path.delay_s[gyro]);
                        parts.push((gyro, Sensed::independent(late), sensed));
                    }
                    if let Some(low_pass) = far.path.low_pass[gyro] {
                        let passed = Column::LowPass(gyro, low_pass, low_pass::Part::Response);
                        parts.push((gyro, Sensed::independent(passed), sensed));
                    }
                    for (axis, size) in far.sensed[gyro].iter().enumerate() {
                        let sensed = Sensed::tried(Column::Increment(axis), gyro, signals);
                        parts.push((gyro, sensed, *size));
                    }
                }
            }
            Self::Pass((fit, members)) => {
                for (&place, block) in fit.members.iter().zip(&fit.blocks) {
                    let is_member = |one: &&Candidate| is_same(one, &members[place]);
                    let Some(now) = candidates.iter().find(is_member) else {
                        continue;
                    };
                    let hypothesis = &now.hypothesis;
                    parts.extend(
                        hypothesis
                            .fixed
                            .iter()
                            .map(|one| (one.record, pool.columns[one.column], one.size)),
                    );
                    let before = &members[place];
                    parts.extend(hypothesis.terms.iter().filter_map(|term| {
                        let name = &now.names[term.parameter];
                        let at = before.names.iter().position(|other| other == name)?;
                        let size = term.coefficient * fit.estimate[block.start + at];
                        Some((term.record, pool.columns[term.column], size))
                    }));
                }
            }
        }
        parts.retain(|(.., size)| *size != 0.0);
        parts
    }
}

/// What is left to explain along one motion.
#[derive(Clone)]
pub(super) struct Left {
    pub(super) residual_rad: Triad,
    /// What linear effects make of the reference's noise \[rad\]: still in the residual.
    pub(super) passed_noise_rad: Triad,
}

impl Left {
    /// Behind what the model knows.
    pub(super) fn behind_known(data: &mut Data, signals: &Signals) -> Self {
        if !data.model.effects.is_empty() {
            data.set_known(signals);
        }
        let mut residual_rad = without_known(data, signals);
        // Filters that the model knows have passed the noise already; before them it is white as ever.
        let passed_noise_rad = match data.passed_noise_rad(signals) {
            Some(noise) => {
                add_triad(&mut residual_rad, &noise, 1.0);
                noise
            }
            None => std::array::from_fn(|_| vec![0.0; signals.rows]),
        };
        Self {
            residual_rad,
            passed_noise_rad,
        }
    }

    /// Takes out what columns made of gated motion do not show of what was found: gyro, column, size.
    pub(super) fn take_out_hidden(&mut self, parts: &[(usize, Sensed, f64)], signals: &Signals) {
        for (gyro, column, size) in parts {
            if let Some([hidden, noise]) = column.hidden(signals) {
                add(&mut self.residual_rad[*gyro], &hidden, -size);
                add(&mut self.passed_noise_rad[*gyro], &noise, *size);
            }
        }
    }
}

/// What the delays on the path, about which a candidate's are estimated, cost in log posterior.
///
/// Numbers of one effect share the width of their prior: gyros that are in time would join the delay of a late one at no cost
/// otherwise.
fn price_of_base(one: &Candidate, levels: &[NoiseLevels], equations: &NormalEquations) -> f64 {
    let squared_on = |parameter: usize, base: f64| -> f64 {
        let terms = one.hypothesis.terms.iter();
        let information = terms
            .filter(|term| term.parameter == parameter)
            .map(|term| {
                let noise = levels[term.record].white + levels[term.record].angle;
                (term.coefficient / equations.scale(term.column)).powi(2) / noise
            });
        base * base * information.sum::<f64>()
    };
    let bases = one.base.iter().enumerate();
    let squared: f64 = bases.map(|(place, base)| squared_on(place, *base)).sum();
    if squared == 0.0 {
        return 0.0;
    }
    let count = one.hypothesis.parameters as f64;
    count * size_price(squared / count)
}

struct Run {
    fit: Fit,
    /// Whether one nonlinear member is still to be settled.
    only_nonlinear: bool,
    tried: usize,
}

impl Pass {
    pub(super) fn new(
        data: &mut Data,
        motion: Motion,
        left_out: &[&str],
        fitted: &Observations,
        levels: &[NoiseLevels],
        before: Before,
    ) -> Self {
        let mut left = Left::behind_known(data, &motion.signals);
        let mut pool = Pool::default();
        let mut candidates = pool.candidates(&motion.signals, motion.is_moving, left_out);
        match before {
            Before::Coarse(far) => {
                let moving = std::array::from_fn(|gyro| {
                    far.path.low_pass[gyro].filter(|_| motion.is_moving[gyro])
                });
                if moving != [None; 3] {
                    candidates.push(pool.low_pass(moving, SHARED, &motion.signals));
                }
            }
            Before::Pass((fit, members)) => {
                for (&place, block) in fit.members.iter().zip(&fit.blocks) {
                    let estimate = shown(fit, &members[place], block);
                    candidates.extend(pool.again(&members[place], &estimate, &motion.signals));
                }
            }
        }
        let parts = before.linear(&candidates, &pool, &motion.signals);
        let (of_path, others): (Vec<_>, Vec<_>) = parts
            .into_iter()
            .partition(|(_, sensed, _)| sensed.column.is_of_path());
        left.take_out_hidden(&others, &motion.signals);
        let before_path = (!of_path.is_empty()).then(|| left.clone());
        left.take_out_hidden(&of_path, &motion.signals);
        let Left {
            residual_rad,
            passed_noise_rad,
        } = left;
        let columns = PoolColumns {
            columns: &pool.columns,
            signals: &motion.signals,
        };
        let equations = NormalEquations::with_constants(
            fitted.clone(),
            &residual_rad,
            &columns,
            mean(levels),
            &data.free_constants,
        );
        // A column that the signals leave empty is no hypothesis.
        candidates.retain(|candidate| is_seen(&candidate.hypothesis, &equations));
        for one in candidates.iter_mut().filter(|one| is_delay(one.kind)) {
            one.hypothesis.price += price_of_base(one, levels, &equations);
        }
        // A lag of what has passed a low pass is that low pass: −iωτ H = H − 1.
        let low_pass = candidates
            .iter()
            .position(|one| one.variant == Variant::LowPass);
        for one in &mut candidates {
            if is_delay(one.kind) {
                one.hypothesis.requires = low_pass;
            }
        }
        Self {
            motion,
            residual_rad,
            passed_noise_rad,
            before_path,
            levels: mean(levels),
            pool,
            candidates,
            equations,
            drift: drift_prior(&data.model.gyro),
            lattice: data.lattice,
            cuts: data.cuts.clone(),
            is_at_rest: data.streams.at_rest.is_some(),
        }
    }

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

    /// Runs `of` with a search over the present candidates that knows what earlier ones have `seen`.
    fn searching<R>(&self, seen: &mut Seen, begin: &Begin, of: impl FnOnce(&mut Search) -> R) -> R {
        let hypotheses = self.hypotheses();
        let mut search = Search::new(
            &self.equations,
            &hypotheses,
            begin.kinds,
            &begin.plan.search,
            &self.drift,
            begin.levels.to_vec(),
        )
        .with_seen(std::mem::take(seen));
        let result = of(&mut search);
        *seen = search.into_seen();
        result
    }

    /// Searches, adds events until none improves the set, and goes through the families once beside a set that is standing:
    /// motion made under another set is not yet independent of what they would explain.
    fn search(
        &mut self,
        start: &[usize],
        levels: &[NoiseLevels],
        nonlinear_first: bool,
        (plan, left_out): (&AnalysisPlan, &[&str]),
        is_unsettled: impl Fn(&Fit, &[Candidate]) -> bool,
        is_standing: impl Fn(&Fit, &[Candidate]) -> bool,
    ) -> Run {
        let begin = Begin {
            kinds: self.kinds(),
            levels,
            plan,
            left_out,
        };
        let mut seen = Seen::default();
        if nonlinear_first {
            let fit = self.first(start, &mut seen, &begin);
            if is_unsettled(&fit, &self.candidates) {
                return Run {
                    fit,
                    only_nonlinear: true,
                    tried: seen.1,
                };
            }
        }
        let most = self.most(start, plan);
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
            tried: seen.1,
        }
    }

    /// The best set that one of the new `places` leads to, or `fit`.
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

    /// The best single member, a soft mount and low passes among them.
    fn first(&mut self, start: &[usize], seen: &mut Seen, begin: &Begin) -> Fit {
        let start = if start.len() <= 1 { start } else { &[] };
        let (fit, empty) = self.searching(seen, begin, |search| {
            (search.run(start, 1), search.fit(&[], None))
        });
        let filters = self.adopt(&strongest_filters(self, &empty, begin));
        self.searching(seen, begin, |search| {
            let alone = filters.iter().map(|&place| search.fit(&[place], None));
            best_of(alone.collect(), fit)
        })
    }

    /// Scans what `fits` leave; the places of events that are new.
    fn add_events(&mut self, fits: &[&Fit], begin: &Begin) -> Vec<usize> {
        const TRIED_EACH: usize = 3;
        let mut new: Vec<Candidate> = Vec::new();
        for fit in fits {
            let mut events: Vec<(usize, NoiseLevels, Event)> = Vec::new();
            for gyro in 0..3 {
                let residual = left_on(&self.equations, fit, &self.candidates, gyro);
                let mut noises = vec![fit.levels[gyro]];
                if fit.drift[gyro] != Drift::None {
                    noises.push(fit.levels[gyro].stationary());
                }
                for noise in noises {
                    let found = scan(
                        &self.equations.transform,
                        &self.equations.basis,
                        &residual,
                        noise,
                    );
                    events.extend(found.into_iter().map(|event| (gyro, noise, event)));
                }
            }
            events.retain(|(.., event)| begin.seeks(kind_of(event)));
            // At rest no reference tells a slip from a nudge.
            events.retain(|(.., event)| !self.is_at_rest || event.kind == EventKind::Step);
            events.retain(|(gyro, _, event)| {
                event.size.abs() > begin.plan.event && !self.lattice.hides_event(*gyro, event)
            });
            events.sort_by(|a, b| b.2.size.abs().total_cmp(&a.2.size.abs()));
            for (gyro, noise, event) in events.into_iter().take(TRIED_EACH) {
                let together = match event.kind {
                    EventKind::Impulse => self.swarm(fit, gyro, noise, event),
                    EventKind::Step | EventKind::Window => vec![event],
                };
                for event in together {
                    let one = self.candidate_of(gyro, &event);
                    let mut known = self.candidates.iter().chain(&new);
                    if !known.any(|other| other.kind == one.kind && other.variant == one.variant) {
                        new.push(one);
                    }
                }
            }
        }
        self.extend(new)
    }

    /// A slip with all others of its gyro that are worth their places: a counter that slips does so again.
    fn swarm(&self, fit: &Fit, gyro: usize, noise: NoiseLevels, strongest: Event) -> Vec<Event> {
        /// Where there are more, something else is not explained.
        const MOST: usize = 32;
        let rows = self.motion.signals.rows as f64;
        let least = (2.0 * (3.0 * rows).ln()).sqrt();
        let residual = left_on(&self.equations, fit, &self.candidates, gyro);
        let (transform, basis) = (&self.equations.transform, &self.equations.basis);
        let mut all = impulses(transform, basis, &residual, noise, (least, MOST));
        all.retain(|event| !self.lattice.hides_event(gyro, event));
        if all.is_empty() || all.len() == MOST {
            return vec![strongest];
        }
        all
    }

    /// What happens at a gyro's rows as a candidate.
    fn candidate_of(&mut self, gyro: usize, event: &Event) -> Candidate {
        let signals = &self.motion.signals;
        let rows = signals.rows as f64;
        // The row of a step of z standard deviations is known to n/(z²/2) rows.
        let places_of_edge = (0.5 * event.size * event.size).max(4.0);
        let pool = &mut self.pool;
        match event.kind {
            EventKind::Impulse => pool.event(SLIP, gyro, event.row, 3.0 * rows, signals),
            EventKind::Step => pool.event(STEP, gyro, event.row, 3.0 * places_of_edge, signals),
            EventKind::Window => {
                let window = event.row..event.row + event.rows;
                let edges = Edges::of(window, event.size * event.size, signals.rows);
                let ([start, end], places) = edges.placed(&self.cuts);
                let window = Expression::window(start..end, signals);
                pool.expression(gyro, window, 3.0 * places, signals)
            }
        }
    }

    /// Columns and places of candidates that are new.
    pub(super) fn extend(&mut self, new: Vec<Candidate>) -> Vec<usize> {
        let columns = PoolColumns {
            columns: &self.pool.columns[self.equations.columns()..],
            signals: &self.motion.signals,
        };
        self.equations.add(&columns);
        let first = self.candidates.len();
        self.candidates.extend(new);
        (first..self.candidates.len()).collect()
    }

    /// Each place by itself, but sine and cosine of one frequency together, for a wave of another phase needs both, and the
    /// slips of a gyro.
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

    /// Members that a set may have: slips, each in rows of its own, take nobody's place.
    fn most(&self, members: &[usize], plan: &AnalysisPlan) -> usize {
        let is_slip = |place: &&usize| self.candidates[**place].kind == SLIP;
        plan.search.most_members + members.iter().filter(is_slip).count()
    }

    /// Places of candidates over columns of their own.
    fn adopt(&mut self, found: &[Alone]) -> Vec<usize> {
        let adopted = found
            .iter()
            .map(|(candidate, columns)| self.pool.adopt(candidate, columns))
            .collect();
        self.extend(adopted)
    }

    /// What a fit leaves along the path that it describes, bridged where rows may not be looked at \[rad\].
    ///
    /// The reference's noise is in it as that path passes it, as it is in the reference along that path: noise that one has by
    /// a row later than the other would not be known for the same.
    pub(super) fn clean_by(
        &self,
        (data, fit): (&Data, &Fit),
        path: Path,
        looked_at: &Observations,
    ) -> Triad {
        let (residual_rad, passed_noise_rad) = match &self.before_path {
            Some(left) => (&left.residual_rad, &left.passed_noise_rad),
            None => (&self.residual_rad, &self.passed_noise_rad),
        };
        let mut left_rad = residual_rad.clone();
        let signals = &self.motion.signals;
        let mut others = fit.clone();
        let members = fit.members.iter().zip(&fit.blocks);
        let kept = members.filter(|(place, _)| !is_of_path(&self.candidates[**place]));
        (others.members, others.blocks) =
            kept.map(|(place, block)| (*place, block.clone())).unzip();
        subtract(
            &mut left_rad,
            &others,
            &self.candidates,
            &self.pool,
            signals,
        );
        if path != Path::default() {
            add_triad(&mut left_rad, &data.passed_by(path), -1.0);
        }
        add_triad(&mut left_rad, passed_noise_rad, -1.0);
        bridged(&left_rad, looked_at)
    }

    fn judge(self, fit: Fit, plan: &AnalysisPlan, tried: usize) -> Found {
        let hypotheses = self.hypotheses();
        let mut search = Search::new(
            &self.equations,
            &hypotheses,
            self.kinds(),
            &plan.search,
            &self.drift,
            fit.levels.clone(),
        );
        let judged = search.judge_set(&fit, plan.class_within, plan.separation);
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
            without: judged.without,
            empty: judged.empty,
            tried,
        }
    }
}

/// Whether every parameter has a column that is not empty.
pub(super) fn is_seen(hypothesis: &Hypothesis, equations: &NormalEquations) -> bool {
    (0..hypothesis.parameters).all(|parameter| {
        let mut terms = hypothesis.terms.iter();
        terms.any(|term| term.parameter == parameter && equations.scale(term.column) > 0.0)
    })
}

/// The contract's kind of an event.
fn kind_of(event: &Event) -> &'static str {
    match event.kind {
        EventKind::Impulse => SLIP,
        EventKind::Step => STEP,
        EventKind::Window => UNLISTED,
    }
}

/// The best set that has one of the groups of candidates besides, instead of a member, or alone.
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

/// What gyros sense of each axis by a set besides the model.
pub(super) fn share_of(fit: &Fit, candidates: &[Candidate], pool: &Pool) -> Matrix3<f64> {
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

/// What is estimated of a member beyond its base; of low passes that nothing shows, that they are not there: a gyro at rest
/// has one of any length.
fn shown(fit: &Fit, candidate: &Candidate, block: &std::ops::Range<usize>) -> Vec<f64> {
    const SHOWN: f64 = 3.0;
    block
        .clone()
        .zip(&candidate.base)
        .map(|(k, base)| {
            let std = fit.covariance[(k, k)].max(0.0).sqrt();
            let is_shown = base + fit.estimate[k] > SHOWN * std;
            if candidate.variant == Variant::LowPass && !is_shown {
                -base
            } else {
                fit.estimate[k]
            }
        })
        .collect()
}

/// Whether a candidate lies between the reference and the gyros.
fn is_of_path(one: &Candidate) -> bool {
    is_delay(one.kind) || one.kind == MOUNT || one.variant == Variant::LowPass
}

/// The path that a set describes: its delays, mounts and low passes.
pub(super) fn path_of(fit: &Fit, candidates: &[Candidate]) -> Path {
    let mut path = Path {
        delay_s: delays(fit, candidates).0,
        ..Path::default()
    };
    for (&place, block) in fit.members.iter().zip(&fit.blocks) {
        let candidate = &candidates[place];
        let estimate = shown(fit, candidate, block);
        if candidate.kind == MOUNT {
            path.mount = candidate.mounts(&estimate);
        } else if candidate.variant == Variant::LowPass {
            path.low_pass = candidate.low_passes(&estimate);
        }
    }
    path
}

/// Whether two candidates are the same, columns aside.
pub fn is_same(a: &Candidate, b: &Candidate) -> bool {
    // A low pass that nothing shows leaves the others as they are.
    let same_parts = a.names == b.names || a.variant == Variant::LowPass;
    a.kind == b.kind && a.variant == b.variant && same_parts
}

/// Delay of each gyro by the set \[s\], with its standard deviation; infinite where there is none.
pub(super) fn delays(fit: &Fit, candidates: &[Candidate]) -> ([f64; 3], [f64; 3]) {
    let mut delay_s = [0.0; 3];
    let mut std_s = [f64::INFINITY; 3];
    for (&place, block) in fit.members.iter().zip(&fit.blocks) {
        let candidate = &candidates[place];
        if is_delay(candidate.kind) {
            for term in &candidate.hypothesis.terms {
                let at = block.start + term.parameter;
                let value = candidate.base[term.parameter] + fit.estimate[at];
                delay_s[term.record] += delay_sign(candidate.kind) * value;
                std_s[term.record] = fit.covariance[(at, at)].sqrt();
            }
        }
    }
    (delay_s, std_s)
}

/// Whether two paths have delays, mounts and low passes on the same gyros.
fn is_alike(a: &Path, b: &Path) -> bool {
    (0..3).all(|gyro| {
        (a.delay_s[gyro] == 0.0) == (b.delay_s[gyro] == 0.0)
            && a.mount[gyro].is_some() == b.mount[gyro].is_some()
            && a.low_pass[gyro].is_some() == b.low_pass[gyro].is_some()
    })
}

/// Whether a set has numbers that columns are made about.
fn is_nonlinear(fit: &Fit, candidates: &[Candidate]) -> bool {
    let (delay_s, _) = delays(fit, candidates);
    let mut members = fit.members.iter();
    delay_s != [0.0; 3]
        || members.any(|&place| candidates[place].base.iter().any(|base| *base != 0.0))
}

/// Whether the numbers that the columns were made with are those that came out.
pub(super) fn is_settled(fit: &Fit, candidates: &[Candidate], made_with_s: [f64; 3]) -> bool {
    const SETTLED: f64 = 0.1;
    let (delay_s, std_s) = delays(fit, candidates);
    let mut numbers = fit.members.iter().zip(&fit.blocks);
    let stands = numbers.all(|(&place, block)| {
        let base = candidates[place].base.iter().zip(block.clone());
        base.filter(|(base, _)| **base != 0.0)
            .all(|(_, at)| fit.estimate[at].abs() < SETTLED * fit.covariance[(at, at)].sqrt())
    });
    stands
        && (0..3).all(|axis| {
            let change = (delay_s[axis] - made_with_s[axis]).abs();
            if std_s[axis].is_finite() {
                change < SETTLED * std_s[axis]
            } else {
                change == 0.0
            }
        })
}

/// What a member of a fit over the found candidates adds to each gyro \[rad\].
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

/// The residual without what the model's effects add \[rad\].
pub(super) fn without_known(data: &Data, signals: &Signals) -> Triad {
    let mut residual_rad = data.residual_rad.clone();
    if !data.known.is_empty() {
        add_triad(&mut residual_rad, &data.known_rad(signals), -1.0);
    }
    residual_rad
}
