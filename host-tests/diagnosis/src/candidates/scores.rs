//! Score tests of additions to fits, over all rows or over sums of rows.

use nalgebra::{DMatrix, DVector};
use rlg_catalogue::candidates::PoolColumns;
use rlg_catalogue::{Candidate, Pool, Sensed, Signals};
use rlg_inference::score_test::{Gain, Projected, ScoreTest, gains, noises, spectra};
use rlg_inference::sums::{Summed, sums};
use rlg_inference::{Columns, Fit, Hypothesis, NoiseLevels, NormalEquations};
use rlg_plan::FamilyPlan;

use crate::iteration::pass::Pass;

/// Candidate over columns of its own pool, with its log evidence beyond its price.
pub(crate) struct Found {
    pub(crate) candidate: Candidate,
    pub(crate) columns: Vec<Sensed>,
    pub(crate) surplus: f64,
}

/// Recording as sums of rows, for lists of hundreds of columns.
pub(crate) struct Coarse {
    equations: NormalEquations,
    /// Rows per sum.
    pub(crate) each: usize,
}

impl Coarse {
    pub(crate) fn new(pass: &Pass, plan: &FamilyPlan) -> Self {
        let observations = pass.equations.transform.observations();
        Self::over(pass, (observations.rows() / plan.most_rows).max(1))
    }

    /// Sums of `each` rows.
    fn over(pass: &Pass, each: usize) -> Self {
        let observations = pass.equations.transform.observations();
        let records: Vec<Vec<f64>> = pass
            .residual_rad
            .iter()
            .map(|values| sums(values, each))
            .collect();
        let none = PoolColumns {
            columns: &[],
            signals: &pass.motion.signals,
        };
        let levels = pass.levels.summed(each);
        let observations = observations.summed(each).to_fast_length();
        Self {
            equations: NormalEquations::new(observations, &records, &none, levels),
            each,
        }
    }

    /// Shorter sums in which a line at a share of the row rate is far below theirs; `None` if it is in these.
    pub(crate) fn for_line(&self, pass: &Pass, share: f64) -> Option<Self> {
        /// Least number of sums in a period.
        const LEAST: f64 = 4.0;
        let each = ((LEAST * share).recip() as usize).max(1);
        (each < self.each).then(|| Self::over(pass, each))
    }

    pub(crate) fn tests(&self, pass: &Pass, fits: &[&Fit]) -> Vec<ScoreTest<'_>> {
        tests_over(&self.equations, self.each, pass, fits, &|_| true)
    }

    /// Root of the sums' noise by the levels of single rows, coefficient by coefficient \[rad\].
    pub(crate) fn roots(&self, levels: NoiseLevels) -> Vec<f64> {
        self.equations.basis.roots(levels.summed(self.each))
    }

    /// Whitened sums of rows \[σ\].
    pub(crate) fn whitened(&self, rows: &[f64], roots: &[f64]) -> Vec<f64> {
        self.equations
            .transform
            .whitened(&sums(rows, self.each), roots)
    }

    /// Largest log evidence of each hypothesis by any of `tests`, over columns of `pool`.
    pub(crate) fn worths(
        &self,
        tests: &[ScoreTest],
        groups: &[Vec<Hypothesis>],
        pool: &Pool,
        signals: &Signals,
    ) -> Vec<Vec<f64>> {
        let columns = SumsOf {
            columns: &pool.columns,
            signals,
            each: self.each,
        };
        let most = |hypothesis: &Hypothesis, gains: &[Gain]| {
            let each = gains.iter().map(|gain| worth(gain, hypothesis));
            each.fold(f64::NEG_INFINITY, f64::max)
        };
        groups
            .iter()
            .zip(gains(tests, groups, &columns))
            .map(|(group, all)| {
                let each = group.iter().zip(&all);
                each.map(|(one, gains)| most(one, gains)).collect()
            })
            .collect()
    }
}

/// Columns of a pool, summed over `each` rows.
struct SumsOf<'a> {
    columns: &'a [Sensed],
    signals: &'a Signals,
    each: usize,
}

impl Columns for SumsOf<'_> {
    fn count(&self) -> usize {
        self.columns.len()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        self.columns[place].sums(self.signals, self.each)
    }
}

/// Score tests given each fit, members of kinds that are not `kept` left out.
pub(crate) fn tests<'a>(
    pass: &'a Pass,
    fits: &[&Fit],
    kept: &dyn Fn(&str) -> bool,
) -> Vec<ScoreTest<'a>> {
    tests_over(&pass.equations, 1, pass, fits, kept)
}

/// The same over sums of `each` rows, with their `equations`.
fn tests_over<'a>(
    equations: &'a NormalEquations,
    each: usize,
    pass: &Pass,
    fits: &[&Fit],
    kept: &dyn Fn(&str) -> bool,
) -> Vec<ScoreTest<'a>> {
    let columns = PoolColumns {
        columns: &pass.pool.columns,
        signals: &pass.motion.signals,
    };
    let columns = Summed {
        columns: &columns,
        each,
    };
    fits.iter()
        .flat_map(|fit| {
            let members = fit.members.iter().map(|&place| &pass.candidates[place]);
            let set: Vec<&Hypothesis> = members
                .filter(|one| kept(one.kind))
                .map(|one| &one.hypothesis)
                .collect();
            let columns = &columns;
            noises(fit).into_iter().map(move |levels| {
                let levels: Vec<_> = levels.iter().map(|one| one.summed(each)).collect();
                ScoreTest::new(equations, &set, columns, &levels)
            })
        })
        .collect()
}

/// Log evidence of a gain: its parameters integrated over a g-prior, less the price of the hypothesis.
pub(crate) fn worth(gain: &Gain, hypothesis: &Hypothesis) -> f64 {
    integrated(gain.log_likelihood, hypothesis.parameters) - hypothesis.price
}

/// Log evidence of a gain L by k `numbers` under a g-prior of their own size: L − k/2 (1 + ln(2L/k)).
pub fn integrated(log_likelihood: f64, numbers: usize) -> f64 {
    let count = numbers as f64;
    let each = (2.0 * log_likelihood / count).max(1.0);
    log_likelihood - 0.5 * count * (1.0 + each.ln())
}

/// Price in log posterior of a size about which columns are linearised, as of a prior of its own width.
///
/// # Inputs
/// `squared`: the size in standard deviations, squared.
pub(crate) fn size_price(squared: f64) -> f64 {
    0.5 * (1.0 + squared.max(1.0).ln())
}

/// Largest gain of the score tests at given parameters of a hypothesis, and its part orthogonal to the members there.
pub(crate) fn most_at(
    tests: &[ScoreTest],
    hypothesis: &Hypothesis,
    columns: &impl Columns,
    along: &DMatrix<f64>,
    parameters: &DVector<f64>,
) -> Option<(f64, Projected)> {
    let spectra = spectra(tests, std::slice::from_ref(hypothesis), columns);
    tests
        .iter()
        .map(|test| test.project(hypothesis, &spectra).along(along))
        .map(|projected| (projected.at(parameters), projected))
        .max_by(|a, b| a.0.total_cmp(&b.0))
}

/// Maximises the likelihood over nonlinear parameters by Gauss–Newton steps, shortened while they do not gain.
///
/// # Inputs
/// `of`: gain at a point, and the column (first) with its derivatives there; `moved`: a point moved by a step, within its
/// trust region.
pub(crate) fn follow<P: Copy>(
    begin: P,
    of: impl Fn(P) -> Option<(f64, Projected)>,
    moved: impl Fn(P, &DVector<f64>) -> P,
) -> (P, f64) {
    const STEPS: usize = 16;
    const SETTLED: f64 = 0.01;
    let Some((mut gain, mut projected)) = of(begin) else {
        return (begin, f64::NEG_INFINITY);
    };
    let mut point = begin;
    let mut share = 1.0;
    for _ in 0..STEPS {
        let next = moved(point, &(projected.beside_one() * share));
        match of(next) {
            Some((value, there)) if value > gain => {
                let grown = value - gain;
                (point, gain, projected) = (next, value, there);
                share = 1.0;
                if grown < SETTLED {
                    break;
                }
            }
            _ => share *= 0.3,
        }
    }
    (point, gain)
}
