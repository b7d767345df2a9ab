//! Joint fit of all columns of an alignment to its rows.

use rlg_plan::{AttitudeNoisePlan, AttitudeOutlierPlan, ModulationPlan, RegistrationPlan};
use rlg_signal::axes::Triad;

use crate::likelihood::equations::{Band, BandNoise, Equations, Fit, ParameterColumn};
use crate::likelihood::modulation::{Modulation, Piece};
use crate::likelihood::noise::{Along, Levels, NoiseTerms};
use crate::likelihood::octaves::time_s;
use crate::likelihood::outliers::Weighted;
use crate::rows::alignment::{Alignment, GROUPS};
use crate::rows::increments::Increments;

/// Attaches the priors of their groups, centred on the model's values, to columns about an alignment.
pub fn priced(
    columns: Vec<Triad>,
    alignment: &Alignment,
    model: &Alignment,
    plan: &RegistrationPlan,
) -> Vec<ParameterColumn> {
    let beyond = alignment.beyond(model);
    let stds = GROUPS.iter().flat_map(|group| {
        let std = match (group.kind, alignment.low_pass_s) {
            ("gyro_bandwidth", Some(_)) => plan.low_pass_std_s,
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

/// Joint fit of columns to rows.
pub struct Fitting {
    noise: BandNoise,
    equations: Equations,
    columns: Vec<ParameterColumn>,
    plan: ModulationPlan,
    /// The fit.
    pub fit: Fit,
}

impl Fitting {
    /// Fits columns to rows, with the noise starting at `levels`.
    pub fn new(
        increments: &Increments,
        columns: Vec<ParameterColumn>,
        is_plain: bool,
        levels: Option<Levels>,
        plan: &AttitudeNoisePlan,
    ) -> Self {
        let band = Band::new(increments.rows(), increments.period_s, &plan.band);
        let (rows, period_s) = (increments.rows(), increments.period_s);
        let terms = NoiseTerms::new(rows, period_s, band.cut, is_plain, plan)
            .with_walk(
                increments.declared_walk_rad_sqrt_s,
                increments.least_walk_rad2,
                period_s,
            )
            .with_alike(increments.alike);
        let rows_rad = &increments.rows_rad;
        let known = levels.filter(|levels| levels.terms() == terms.count());
        let along = match &known {
            Some(levels) => levels.along(&band.octaves, &increments.times_s),
            None => Along::default(),
        };
        let noise = BandNoise { band, terms };
        let equations = Equations::new(&noise, rows_rad, along, &columns, &increments.free);
        let start = known.unwrap_or_else(|| noise.terms.start(equations.energy()));
        let fit = equations.fit(&noise.terms, &start);
        Self {
            noise,
            equations,
            columns,
            plan: plan.modulation,
            fit,
        }
    }

    /// Mean log likelihood per coefficient with some parameters fixed at the linearisation point, and the number of
    /// coefficients.
    pub fn here(&self, places: &[usize]) -> (f64, f64) {
        let levels = &self.fit.levels;
        let sum = self
            .equations
            .log_likelihood_here(&self.noise.terms, levels, places);
        let count = 3.0 * self.noise.band.cut as f64;
        (sum / count, count)
    }

    /// Residuals of rows after the fitted columns \[rad\].
    pub fn left_rad(&self, rows_rad: &Triad) -> Triad {
        let mut left = rows_rad.clone();
        for (column, size) in self.columns.iter().zip(&self.fit.estimate) {
            for (left, values) in left.iter_mut().zip(&column.values) {
                rlg_signal::axes::add(left, values, -size);
            }
        }
        left
    }

    /// Divides rows by the power of the noise.
    pub fn weighted(&self, left_rad: &Triad, increments: &Increments) -> Weighted {
        let (noise, levels) = (&self.noise, &self.fit.levels);
        Weighted::new(noise, levels, left_rad, &increments.times_s)
    }

    /// Estimates the noise's levels along the record from pieces of it, in every octave.
    pub fn levels_along(&self, times_s: &[f64]) -> Levels {
        let of_group = |axes: &&[usize]| -> Vec<Modulation> {
            let squares = |axis: &usize| self.equations.squares(&self.noise, &self.fit, *axis);
            let of_axes: Vec<Vec<Vec<f64>>> = axes.iter().map(squares).collect();
            let of_octave = |octave: usize| {
                let series: Vec<&[f64]> = of_axes.iter().map(|one| &one[octave][..]).collect();
                let pieces = pieces(&series, times_s, self.plan.least_values);
                Modulation::of_pieces(&pieces, &self.plan)
            };
            (0..of_axes[0].len()).map(of_octave).collect()
        };
        let groups = self.noise.terms.alike.iter();
        self.fit.levels.modulated(groups.map(of_group).collect())
    }

    /// Fits again, with the noise's levels estimated from pieces of the record.
    pub fn modulate(&mut self, times_s: &[f64]) {
        let levels = self.levels_along(times_s);
        let along = levels.along(&self.noise.band.octaves, times_s);
        self.equations.set_levels(&self.noise, along);
        self.fit = self.equations.fit(&self.noise.terms, &levels);
    }

    /// Subtracts errors of single stamps in excess of the noise, adds them to `corrected_rad`, and fits again.
    pub fn shrink_outliers(
        &mut self,
        increments: &Increments,
        corrected_rad: &mut Triad,
        plan: &AttitudeOutlierPlan,
    ) {
        let mut rows_rad = increments.rows_rad.clone();
        rlg_signal::axes::add_triad(&mut rows_rad, corrected_rad, -1.0);
        let mut left = self.left_rad(&rows_rad);
        increments.silence_free(&mut left, |_| true);
        let errors = self.weighted(&left, increments).outliers_rad(plan);
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
        self.equations.set_records(&self.noise, rows_rad);
        self.fit = self.equations.fit(&self.noise.terms, &self.fit.levels);
    }
}

/// Divides an octave of the records of one noise group into its shortest pieces.
///
/// # Inputs
/// `squares`: of each sample, by record; `times_s`: of the stamps; `least`: number of values in a piece.
fn pieces(squares: &[&[f64]], times_s: &[f64], least: usize) -> Vec<Piece> {
    let samples = squares[0].len();
    let count = samples / least.div_ceil(squares.len());
    let of_range = |range: std::ops::Range<usize>| {
        let middle = 0.5 * (range.start + range.end) as f64;
        let energies = squares
            .iter()
            .map(|one| one[range.clone()].iter().sum::<f64>());
        Piece {
            middle_s: time_s(times_s, middle, samples),
            energy: energies.sum(),
            count: (squares.len() * range.len()) as f64,
        }
    };
    let each = (0..count).map(|k| k * samples / count..(k + 1) * samples / count);
    each.map(of_range).collect()
}
