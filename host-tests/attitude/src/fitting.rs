//! All columns of an alignment fitted to its rows.

use rlg_signal::axes::Triad;

use crate::alignment::{Alignment, GROUPS, LOW_PASS_STD_S};
use crate::equations::{Band, Equations, Fit, ParameterColumn};
use crate::increments::Increments;
use crate::noise::{Levels, NoiseTerms};
use crate::outliers::Weighted;

/// Columns about an alignment with the priors of their groups, about what the model says.
pub fn priced(
    columns: Vec<Triad>,
    alignment: &Alignment,
    model: &Alignment,
) -> Vec<ParameterColumn> {
    let beyond = alignment.beyond(model);
    let stds = GROUPS.iter().flat_map(|group| {
        let std = match (group.kind, alignment.low_pass_s) {
            ("gyro_bandwidth", Some(_)) => LOW_PASS_STD_S,
            _ => group.prior_std,
        };
        group.names.iter().map(move |_| std)
    });
    columns
        .into_iter()
        .zip(stds)
        .zip(beyond)
        .map(|((values, prior_std), beyond)| ParameterColumn {
            values,
            prior_std,
            prior_mean: -beyond,
        })
        .collect()
}

/// All columns fitted to some rows.
pub struct Fitting {
    band: Band,
    terms: NoiseTerms,
    equations: Equations,
    columns: Vec<ParameterColumn>,
    /// The fit.
    pub fit: Fit,
}

impl Fitting {
    /// Fits columns to rows, the noise from `levels`.
    pub fn new(
        increments: &Increments,
        columns: Vec<ParameterColumn>,
        is_plain: bool,
        levels: Option<Levels>,
    ) -> Self {
        let band = Band::new(increments.rows(), increments.period_s);
        let (rows, period_s) = (increments.rows(), increments.period_s);
        let walk = (
            increments.declared_walk_rad_sqrt_s,
            increments.least_walk_rad2,
        );
        let terms = NoiseTerms::new(rows, period_s, band.cut, is_plain)
            .with_walk(walk, period_s)
            .with_alike(increments.alike);
        let rows_rad = &increments.rows_rad;
        let equations = Equations::new(&band, &terms, rows_rad, &columns, &increments.free);
        let start = levels
            .filter(|levels| levels.terms() == terms.count())
            .unwrap_or_else(|| terms.start(equations.energy()));
        let fit = equations.fit(&terms, &start);
        Self {
            band,
            terms,
            equations,
            columns,
            fit,
        }
    }

    /// Log likelihood of a coefficient where some parameters are what the rows are linear about, and the number of coefficients.
    pub fn here(&self, places: &[usize]) -> (f64, f64) {
        let levels = &self.fit.levels;
        let sum = self
            .equations
            .log_likelihood_here(&self.terms, levels, places);
        let count = 3.0 * self.band.cut as f64;
        (sum / count, count)
    }

    /// Rows less the fitted columns \[rad\].
    pub fn left_rad(&self, rows_rad: &Triad) -> Triad {
        let mut left = rows_rad.clone();
        for (column, size) in self.columns.iter().zip(&self.fit.estimate) {
            for (left, values) in left.iter_mut().zip(&column.values) {
                rlg_signal::axes::add(left, values, -size);
            }
        }
        left
    }

    /// Rows divided by the power of the noise.
    pub fn weighted(&self, left_rad: &Triad) -> Weighted {
        Weighted::new(&self.band, &self.terms, left_rad, &self.fit.levels)
    }

    /// Shrinks the errors of single stamps beyond what noise makes, adds them to `corrected_rad`, and fits again.
    pub fn shrink_outliers(&mut self, increments: &Increments, corrected_rad: &mut Triad) {
        let mut rows_rad = increments.rows_rad.clone();
        rlg_signal::axes::add_triad(&mut rows_rad, corrected_rad, -1.0);
        let mut left = self.left_rad(&rows_rad);
        increments.silence_free(&mut left, |_| true);
        let errors = self.weighted(&left).outliers_rad();
        for (rows, (corrected, errors)) in rows_rad
            .iter_mut()
            .zip(corrected_rad.iter_mut().zip(&errors))
        {
            for row in 0..rows.len() {
                let grown = errors[row + 1] - errors[row];
                rows[row] -= grown;
                corrected[row] += grown;
            }
        }
        self.fit_to(&rows_rad);
    }

    /// Fits again, to other rows.
    pub fn fit_to(&mut self, rows_rad: &Triad) {
        self.equations
            .set_records(&self.band, &self.terms, rows_rad);
        self.fit = self.equations.fit(&self.terms, &self.fit.levels);
    }
}
