//! One pass of a search: motion, its columns and their candidates; and the residual of a fit.

use rlg_plan::Plan;
use std::collections::BTreeSet;

use rlg_catalogue::{Candidate, Pool, Sensed, Signals};
use rlg_inference::search::DriftPrior;
use rlg_inference::{Fit, NoiseLevels, NormalEquations};
use rlg_signal::streams::{Triad, add};

use crate::alignment::case_motion::Motion;
use crate::rows::pulse_resolution::Lattice;

/// Settings of a search.
pub(crate) struct Begin<'a> {
    pub(crate) kinds: usize,
    pub(crate) levels: &'a [NoiseLevels],
    pub(crate) plan: &'a Plan,
    /// Kinds excluded from the catalogue.
    pub(crate) left_out: &'a [&'a str],
}

impl Begin<'_> {
    /// True if a kind is in the catalogue.
    pub(crate) fn seeks(&self, kind: &str) -> bool {
        !self.left_out.contains(&kind)
    }

    /// Log prior that a candidate without a price of its own must overcome to be fitted.
    pub(crate) fn least(&self) -> f64 {
        let each = (self.plan.inference.search.expected_effects / self.kinds as f64).ln();
        -self.plan.inference.search.screening - each
    }
}

/// Data of one pass.
pub(crate) struct Pass {
    pub(crate) motion: Motion,
    pub(crate) residual_rad: Triad,
    /// Noise under which gaps and ends were projected out.
    pub(crate) levels: NoiseLevels,
    pub(crate) pool: Pool,
    pub(crate) candidates: Vec<Candidate>,
    pub(crate) equations: NormalEquations,
    pub(crate) drift: DriftPrior,
    pub(crate) lattice: Lattice,
    /// Rows at which another kind of motion begins, the first and the end included.
    pub(crate) cuts: Vec<usize>,
    /// True if the Earth's rotation is the only motion.
    pub(crate) is_at_rest: bool,
}

/// Column sizes of a fit on one gyro.
pub fn sizes_on(fit: &Fit, candidates: &[Candidate], gyro: usize) -> Vec<(usize, f64)> {
    let mut sizes: Vec<(usize, f64)> = Vec::new();
    for (&place, block) in fit.members.iter().zip(&fit.blocks) {
        let fixed = candidates[place].hypothesis.fixed.iter();
        let on_gyro = fixed.filter(|one| one.record == gyro);
        sizes.extend(on_gyro.map(|one| (one.column, one.size)));
        for term in &candidates[place].hypothesis.terms {
            if term.record == gyro {
                let size = term.coefficient * fit.estimate[block.start + term.parameter];
                sizes.push((term.column, size));
            }
        }
    }
    sizes
}

/// Coefficients of the residual of a fit on one gyro, the nuisance parameters of gaps and free constants at their estimates.
pub fn left_on(
    equations: &NormalEquations,
    fit: &Fit,
    candidates: &[Candidate],
    gyro: usize,
) -> Vec<f64> {
    let mut sizes = sizes_on(fit, candidates, gyro);
    for (free, block) in equations.gaps().iter().zip(&fit.gaps) {
        let on_gyro = free.terms.iter().filter(|term| term.record == gyro);
        sizes.extend(on_gyro.map(|term| {
            let size = fit.estimate[block.start + term.parameter];
            (term.column, term.coefficient * size)
        }));
    }
    equations.residual_spectrum(gyro, &sizes)
}

/// Subtracts a fit's effects from `residual_rad`.
pub fn subtract(
    residual_rad: &mut Triad,
    fit: &Fit,
    candidates: &[Candidate],
    pool: &Pool,
    signals: &Signals,
) {
    let of_column = |column: Sensed| column.values(signals);
    subtract_by(residual_rad, fit, candidates, pool, of_column);
}

/// The same with column values by `values_of`.
pub(crate) fn subtract_by(
    residual_rad: &mut Triad,
    fit: &Fit,
    candidates: &[Candidate],
    pool: &Pool,
    values_of: impl Fn(Sensed) -> Vec<f64>,
) {
    let sizes: [Vec<(usize, f64)>; 3] = std::array::from_fn(|gyro| sizes_on(fit, candidates, gyro));
    let used: BTreeSet<usize> = sizes.iter().flatten().map(|(column, _)| *column).collect();
    for column in used {
        let values = values_of(pool.columns[column]);
        for (gyro, sizes) in sizes.iter().enumerate() {
            let size: f64 = sizes
                .iter()
                .filter(|(other, _)| *other == column)
                .map(|(_, size)| size)
                .sum();
            if size != 0.0 {
                add(&mut residual_rad[gyro], &values, -size);
            }
        }
    }
}

impl Pass {
    /// Residual of a fit \[rad\].
    pub(crate) fn left_by(&self, fit: &Fit) -> Triad {
        let mut left_rad = self.residual_rad.clone();
        let signals = &self.motion.signals;
        subtract(&mut left_rad, fit, &self.candidates, &self.pool, signals);
        left_rad
    }
}
