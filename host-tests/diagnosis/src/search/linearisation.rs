//! Linearisation of a pass: columns and candidates about the effects found before, and their normal equations.

use rlg_catalogue::candidates::{PoolColumns, Variant, is_delay};
use rlg_catalogue::entries::LATE_PICKOFF;
use rlg_catalogue::{Candidate, Pool};
use rlg_inference::{Hypothesis, NoiseLevels, NormalEquations, Observations};

use crate::alignment::case_motion::Motion;
use crate::candidates::scores::size_price;
use crate::iteration::pass::Pass;
use crate::iteration::path::shown;
use crate::iteration::reference_rotation::Turned;
use crate::iteration::state::{Before, left_behind_known, take_out_hidden};
use crate::rows::data::Data;
use crate::rows::model_effects::known_by_axis;
use crate::rows::noise_levels::drift_prior;
use crate::settings::Scope;

/// Effects and noise about which the columns of a pass are formed.
#[derive(Clone, Copy)]
pub(crate) struct About<'a> {
    /// Effects found before.
    pub(crate) before: &'a Before,
    /// Rotation of the reference.
    pub(crate) turned: &'a Turned,
    /// Noise of each gyro.
    pub(crate) levels: &'a [NoiseLevels],
}

impl About<'_> {
    /// Candidates on a motion, those of the effects found before linearised about their estimates.
    fn candidates(
        self,
        pool: &mut Pool,
        data: &Data,
        motion: &Motion,
        scope: Scope,
    ) -> Vec<Candidate> {
        let signals = &motion.signals;
        let mut candidates = pool.candidates(signals, motion.is_moving, scope.left_out);
        if self
            .turned
            .is_seen(data, signals, self.levels, scope.plan.rates.settled)
        {
            self.turned.carry(&mut candidates, pool, signals);
        }
        match self.before {
            Before::Coarse(far) => {
                let moving = std::array::from_fn(|gyro| {
                    far.path.low_pass[gyro].filter(|_| motion.is_moving[gyro])
                });
                if moving != [None; 3] {
                    candidates.push(pool.low_pass(moving, signals.plan.odds.shared, signals));
                }
            }
            Before::Pass(fit, members) => {
                for (&place, block) in fit.members.iter().zip(&fit.blocks) {
                    let estimate = shown(fit, &members[place], block, &scope.plan.rates);
                    candidates.extend(pool.again(&members[place], &estimate, signals));
                }
            }
        }
        let late_s = (
            known_by_axis(LATE_PICKOFF, data.model, data.streams),
            self.before.late_pickoff_s(),
        );
        if late_s != <([f64; 3], [f64; 3])>::default() {
            for one in candidates.iter_mut().filter(|one| one.kind == LATE_PICKOFF) {
                pool.about_late_pickoff(one, late_s);
            }
        }
        candidates
    }
}

/// Keeps candidates that the rows show, and prices and links delays.
fn settle(
    candidates: &mut Vec<Candidate>,
    levels: &[NoiseLevels],
    equations: &NormalEquations,
    settled: f64,
) {
    for one in candidates.iter_mut().filter(|one| one.kind == LATE_PICKOFF) {
        if squared_fixed(&one.hypothesis, levels, equations) < settled * settled {
            one.hypothesis.fixed.clear();
        }
    }
    // Drops hypotheses with a parameter whose columns are zero.
    candidates.retain(|candidate| is_seen(&candidate.hypothesis, equations));
    for one in candidates.iter_mut().filter(|one| is_delay(one.kind)) {
        one.hypothesis.price += price_of_base(one, levels, equations);
    }
    // A delay behind a low pass H has the column of that low pass: −iωτ H = H − 1.
    let low_pass = candidates
        .iter()
        .position(|one| one.variant == Variant::LowPass);
    for one in candidates.iter_mut().filter(|one| is_delay(one.kind)) {
        one.hypothesis.requires = low_pass;
    }
}

impl Pass {
    /// Forms the columns on an estimated motion and sums over the rows to fit.
    pub(crate) fn new(
        data: &mut Data,
        motion: Motion,
        fitted: &Observations,
        about: About,
        scope: Scope,
    ) -> Self {
        let mut residual_rad = left_behind_known(data, &motion.signals);
        let mut pool = Pool::default();
        let mut candidates = about.candidates(&mut pool, data, &motion, scope);
        let parts = about.before.linear(&candidates, &pool, &motion.signals);
        take_out_hidden(&mut residual_rad, &parts, &motion.signals);
        let columns = PoolColumns {
            columns: &pool.columns,
            signals: &motion.signals,
        };
        let equations = NormalEquations::with_constants(
            fitted.clone(),
            &residual_rad,
            &columns,
            NoiseLevels::mean(about.levels),
            &data.free_constants,
        );
        settle(
            &mut candidates,
            about.levels,
            &equations,
            scope.plan.rates.settled,
        );
        Self {
            motion,
            residual_rad,
            levels: NoiseLevels::mean(about.levels),
            pool,
            candidates,
            equations,
            drift: drift_prior(&data.model.gyro),
            tried_filters: None,
            lattice: data.lattice,
            cuts: data.cuts.clone(),
            is_at_rest: data.streams.at_rest.is_some(),
        }
    }
}

/// Squared size of a column over the record's noise \[σ²\].
fn squared(size: f64, column: usize, levels: &NoiseLevels, equations: &NormalEquations) -> f64 {
    (size / equations.scale(column)).powi(2) / (levels.white + levels.angle)
}

/// Price in log posterior of the delays about which a candidate is linearised.
///
/// The parameters of one effect share the width of their prior: gyros without a delay would otherwise join the delay of a
/// late gyro at no cost.
fn price_of_base(one: &Candidate, levels: &[NoiseLevels], equations: &NormalEquations) -> f64 {
    let squared_on = |parameter: usize, base: f64| -> f64 {
        let terms = one.hypothesis.terms.iter();
        let information = terms
            .filter(|term| term.parameter == parameter)
            .map(|term| {
                squared(
                    term.coefficient,
                    term.column,
                    &levels[term.record],
                    equations,
                )
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

/// Squared size of the fixed terms of a hypothesis \[σ²\].
fn squared_fixed(one: &Hypothesis, levels: &[NoiseLevels], equations: &NormalEquations) -> f64 {
    let fixed = one.fixed.iter();
    let seen = fixed.filter(|one| equations.scale(one.column) > 0.0);
    let each = seen.map(|one| squared(one.size, one.column, &levels[one.record], equations));
    each.sum()
}

/// True if every parameter has a non-zero column.
pub(crate) fn is_seen(hypothesis: &Hypothesis, equations: &NormalEquations) -> bool {
    (0..hypothesis.parameters).all(|parameter| {
        let mut terms = hypothesis.terms.iter();
        terms.any(|term| term.parameter == parameter && equations.scale(term.column) > 0.0)
    })
}
