//! Normal equations of records and columns in the analysed band, and their joint fit with the noise levels.

use nalgebra::{DMatrix, DVector};
use rlg_inference::Dct;
use rlg_plan::AttitudeBandPlan;
use rlg_signal::axes::Triad;

use crate::likelihood::noise::{Along, Levels, NoiseTerms};
use crate::likelihood::octaves::Octaves;

/// Design-matrix column of one parameter.
pub struct ParameterColumn {
    /// Values on the three records; all of the same unit per unit of the parameter.
    pub values: Triad,
    /// Standard deviation of the prior.
    pub prior_std: f64,
    /// Mean of the prior, relative to the linearisation point.
    pub prior_mean: f64,
}

/// DCT of records up to a highest frequency.
pub struct Band {
    dct: Dct,
    rows: usize,
    /// Number of analysed coefficients.
    pub cut: usize,
    /// Octave bands of the analysed coefficients.
    pub octaves: Octaves,
}

impl Band {
    /// Plans the transform of records of `rows` rows, one every `period_s`.
    pub fn new(rows: usize, period_s: f64, plan: &AttitudeBandPlan) -> Self {
        let cut = (2.0 * plan.highest_hz * period_s * rows as f64) as usize;
        let cut = cut.clamp(plan.least.min(rows), rows);
        Self {
            dct: Dct::new(rows),
            octaves: Octaves::new(cut, plan),
            rows,
            cut,
        }
    }

    /// Computes the analysed coefficients of a record; empty for an empty record.
    pub fn spectrum(&self, values: &[f64]) -> Vec<f64> {
        if values.is_empty() {
            return Vec::new();
        }
        let mut spectrum = values.to_vec();
        self.dct.forward(&mut spectrum);
        // A copy: a truncated vector would keep the memory of all rows.
        spectrum[..self.cut].to_vec()
    }

    /// Divides a record by a power at every frequency.
    pub fn divided(&self, values: &[f64], powers: &[f64]) -> Vec<f64> {
        let mut spectrum = values.to_vec();
        self.dct.forward(&mut spectrum);
        for (value, power) in spectrum.iter_mut().zip(powers) {
            *value /= power;
        }
        self.dct.inverse(&mut spectrum);
        spectrum
    }

    /// Divides the octaves of a spectrum, sample by sample, by their levels.
    pub fn levelled(&self, mut spectrum: Vec<f64>, levels: &[Option<Vec<f64>>]) -> Vec<f64> {
        self.octaves.divide(&mut spectrum, levels);
        spectrum
    }

    /// Spectrum of a unit impulse in one row.
    pub fn of_row(&self, row: usize) -> Vec<f64> {
        let rows = self.rows as f64;
        let turn = std::f64::consts::PI * (row as f64 + 0.5) / rows;
        let mut spectrum: Vec<f64> = (0..self.cut)
            .map(|k| (2.0 / rows).sqrt() * (turn * k as f64).cos())
            .collect();
        spectrum[0] = rows.sqrt().recip();
        spectrum
    }
}

/// Analysed band of records, and the terms of their noise.
pub struct BandNoise {
    /// The band.
    pub band: Band,
    /// The terms.
    pub terms: NoiseTerms,
}

/// Divides the spectra of three records by the noise's levels.
fn levelled(band: &Band, spectra: &Triad, along: &Along) -> Triad {
    std::array::from_fn(|axis| band.levelled(spectra[axis].clone(), &along[axis]))
}

/// Normal equations by noise group and frequency bin.
#[derive(Default)]
pub struct Equations {
    /// Number of parameters, without the nuisance parameters of free rows.
    pub parameters: usize,
    /// Spectra of every column, those of free rows last.
    unlevelled: Vec<Triad>,
    /// Standard deviation and mean of the columns' priors.
    priors: Vec<(f64, f64)>,
    records: Triad,
    /// Spectra of the records and of every column, divided by the noise's levels; columns scaled to unit energy.
    spectra: Triad,
    columns: Vec<Triad>,
    scale: Vec<f64>,
    precision: Vec<f64>,
    centre: Vec<f64>,
    along: Along,
    /// Log-determinant term of those levels in every log likelihood.
    log_levels: f64,
    /// By noise group and bin.
    gram: Vec<Vec<DMatrix<f64>>>,
    moments: Vec<Vec<DVector<f64>>>,
    energy: Vec<Vec<f64>>,
}

/// Joint fit of all columns.
pub struct Fit {
    /// Levels of the noise terms.
    pub levels: Levels,
    /// Estimate of each parameter.
    pub estimate: Vec<f64>,
    /// Standard deviation of each parameter.
    pub std: Vec<f64>,
    /// Log likelihood with the parameters integrated out.
    pub log_likelihood: f64,
    /// Profile log likelihood, at the estimates: without a penalty of the parameters' number.
    pub explained: f64,
    /// Scaled estimates of all columns, those of free rows included, and their covariance.
    solution: (DVector<f64>, DMatrix<f64>),
}

impl Equations {
    /// # Inputs
    /// `along`: the noise's levels; `columns`: of which only the analysed band is kept; `free`: rows with a nuisance parameter
    /// on each axis.
    pub fn new(
        noise: &BandNoise,
        rows_rad: &Triad,
        along: Along,
        columns: impl Iterator<Item = ParameterColumn>,
        free: &[usize],
    ) -> Self {
        let spectra = |values: &Triad| values.each_ref().map(|values| noise.band.spectrum(values));
        let (priors, mut unlevelled): (Vec<(f64, f64)>, Vec<Triad>) = columns
            .map(|one| ((one.prior_std, one.prior_mean), spectra(&one.values)))
            .unzip();
        for &row in free {
            let of_row = noise.band.of_row(row);
            unlevelled.extend((0..3).map(|axis| {
                std::array::from_fn(|own| match own == axis {
                    true => of_row.clone(),
                    false => Vec::new(),
                })
            }));
        }
        let mut equations = Self {
            parameters: priors.len(),
            priors,
            records: spectra(rows_rad),
            unlevelled,
            ..Self::default()
        };
        equations.set_levels(noise, along);
        equations
    }

    /// Replaces the levels of the noise along the record.
    pub fn set_levels(&mut self, noise: &BandNoise, along: Along) {
        let mut columns: Vec<Triad> = self
            .unlevelled
            .iter()
            .map(|column| levelled(&noise.band, column, &along))
            .collect();
        self.scale = columns
            .iter_mut()
            .map(|column| {
                let power: f64 = column.iter().flatten().map(|value| value * value).sum();
                let scale = 1.0 / power.max(f64::MIN_POSITIVE).sqrt();
                column
                    .iter_mut()
                    .flatten()
                    .for_each(|value| *value *= scale);
                scale
            })
            .collect();
        let pairs = || self.priors.iter().zip(&self.scale);
        let precision = pairs().map(|((std, _), scale)| (scale / std).powi(2));
        let centre = pairs().map(|((_, mean), scale)| mean / scale);
        let [mut precision, mut centre]: [Vec<f64>; 2] = [precision.collect(), centre.collect()];
        precision.resize(columns.len(), 0.0);
        centre.resize(columns.len(), 0.0);
        (self.precision, self.centre) = (precision, centre);
        self.columns = columns;
        let logs = along.iter().flatten().flatten().flatten();
        self.log_levels = -logs.map(|level| level.ln()).sum::<f64>();
        self.along = along;
        let of_group = |axes: &&[usize]| {
            let bins = noise.terms.edges.windows(2);
            bins.map(|bin| self.products(bin[0]..bin[1], axes))
                .collect()
        };
        self.gram = noise.terms.alike.iter().map(of_group).collect();
        self.take(noise);
    }

    /// Replaces the records on the same columns.
    pub fn set_records(&mut self, noise: &BandNoise, rows_rad: &Triad) {
        self.records = rows_rad
            .each_ref()
            .map(|values| noise.band.spectrum(values));
        self.take(noise);
    }

    fn take(&mut self, BandNoise { band, terms }: &BandNoise) {
        self.spectra = levelled(band, &self.records, &self.along);
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let of_bin = |axes: &[usize], bin: std::ops::Range<usize>| {
            let of = |column: &Triad| -> f64 {
                let pairs = axes
                    .iter()
                    .map(|&axis| (&column[axis], &self.spectra[axis]));
                pairs
                    .filter(|(column, _)| !column.is_empty())
                    .map(|(column, record)| dot(&column[bin.clone()], &record[bin.clone()]))
                    .sum()
            };
            let moments = self.columns.iter().map(of);
            let moments = DVector::from_iterator(self.columns.len(), moments);
            (moments, of(&self.spectra))
        };
        let of_group = |axes: &&[usize]| -> (Vec<DVector<f64>>, Vec<f64>) {
            let bins = terms.edges.windows(2);
            bins.map(|bin| of_bin(axes, bin[0]..bin[1])).unzip()
        };
        (self.moments, self.energy) = terms.alike.iter().map(of_group).unzip();
    }

    fn products(&self, bin: std::ops::Range<usize>, axes: &[usize]) -> DMatrix<f64> {
        let count = self.columns.len();
        let mut gram = DMatrix::zeros(count, count);
        for &axis in axes {
            let present: Vec<usize> = (0..count)
                .filter(|k| !self.columns[*k][axis].is_empty())
                .collect();
            let values = DMatrix::from_fn(bin.len(), present.len(), |row, k| {
                self.columns[present[k]][axis][bin.start + row]
            });
            let product = values.tr_mul(&values);
            for (a, &column) in present.iter().enumerate() {
                for (b, &other) in present.iter().enumerate() {
                    gram[(column, other)] += product[(a, b)];
                }
            }
        }
        gram
    }

    /// Sums of squares of the records by group and bin.
    pub fn energy(&self) -> &[Vec<f64>] {
        &self.energy
    }

    /// Fits all columns and the noise levels by expectation-maximisation.
    pub fn fit(&self, terms: &NoiseTerms, start: &Levels) -> Fit {
        /// Most iterations, and the change of the log likelihood at convergence.
        const MOST: usize = 12;
        const SETTLED: f64 = 0.01;
        /// Least ratio of a bin's noise to its value of the last iteration.
        const LEAST_LEFT: f64 = 0.05;
        let mut levels = start.clone();
        let mut last = f64::NEG_INFINITY;
        let mut turn = 0;
        loop {
            let powers = terms.of_bins(&levels);
            let (covariance, estimate, log_likelihood) = self.solve(terms, &powers);
            turn += 1;
            if turn >= MOST || (turn > 2 && (log_likelihood - last).abs() < SETTLED) {
                let scaled = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
                    (0..self.parameters)
                        .map(|k| of(k) * self.scale[k])
                        .collect()
                };
                let own = covariance.view((0, 0), (self.parameters, self.parameters));
                let (_, log_determinant) = rlg_inference::linear::invert(&own.into_owned());
                return Fit {
                    log_likelihood,
                    explained: log_likelihood - 0.5 * log_determinant,
                    estimate: scaled(&|k| estimate[k]),
                    std: scaled(&|k| covariance[(k, k)].max(0.0).sqrt()),
                    levels,
                    solution: (estimate, covariance),
                };
            }
            last = log_likelihood;
            let second = &covariance + &estimate * estimate.transpose();
            let least = terms.expected(&powers);
            let left_of = |group: usize, bin: usize| {
                let explained = 2.0 * self.moments[group][bin].dot(&estimate);
                let energy = self.energy[group][bin];
                let left = energy - explained + self.gram[group][bin].dot(&second);
                // The residual is a difference of large numbers if columns explain nearly all.
                left.max(LEAST_LEFT * least[group][bin])
            };
            let left: Vec<Vec<f64>> = (0..self.gram.len())
                .map(|group| {
                    let bins = 0..self.gram[group].len();
                    bins.map(|bin| left_of(group, bin)).collect()
                })
                .collect();
            levels = terms.fit(&left, &levels);
        }
    }

    /// Expected squares of the noise at each sample of every octave of an axis, relative to its mean power: squared
    /// residuals, plus the variance absorbed by the fit.
    pub fn squares(&self, noise: &BandNoise, fit: &Fit, axis: usize) -> Vec<Vec<f64>> {
        let BandNoise { band, terms } = noise;
        let powers = terms.of_coefficients(fit.levels.of(axis));
        let series = |spectrum: &[f64]| -> Vec<Vec<f64>> {
            let pairs = spectrum.iter().zip(&powers);
            let white: Vec<f64> = pairs.map(|(value, power)| value / power.sqrt()).collect();
            band.octaves.series(&white).collect()
        };
        let present: Vec<usize> = (0..self.columns.len())
            .filter(|k| !self.columns[*k][axis].is_empty())
            .collect();
        let (estimate, covariance) = &fit.solution;
        let own = covariance.select_rows(&present).select_columns(&present);
        let mut left = self.spectra[axis].clone();
        for &k in &present {
            rlg_signal::axes::add(&mut left, &self.columns[k][axis], -estimate[k]);
        }
        let columns: Vec<Vec<Vec<f64>>> = present
            .iter()
            .map(|&k| series(&self.columns[k][axis]))
            .collect();
        let of_octave = |(octave, left): (usize, Vec<f64>)| -> Vec<f64> {
            let rows =
                DMatrix::from_fn(left.len(), present.len(), |row, k| columns[k][octave][row]);
            let taken = (&rows * &own).component_mul(&rows).column_sum();
            let levels = self.along[axis].get(octave).and_then(Option::as_ref);
            let level = |sample: usize| levels.map_or(1.0, |levels| levels[sample]);
            let samples = left.iter().zip(&taken).enumerate();
            samples
                .map(|(k, (left, taken))| (left * left + taken) * level(k).powi(2))
                .collect()
        };
        series(&left)
            .into_iter()
            .enumerate()
            .map(of_octave)
            .collect()
    }

    /// Log likelihood with the parameters `here` fixed at the linearisation point, their prior included.
    pub fn log_likelihood_here(&self, terms: &NoiseTerms, start: &Levels, here: &[usize]) -> f64 {
        let kept: Vec<usize> = (0..self.precision.len())
            .filter(|k| !here.contains(k))
            .collect();
        let of = |values: &[f64]| kept.iter().map(|k| values[*k]).collect();
        let kept_of = |gram: &DMatrix<f64>| gram.select_rows(&kept).select_columns(&kept);
        let of_grams = |grams: &Vec<DMatrix<f64>>| grams.iter().map(kept_of).collect();
        let of_moments = |moments: &Vec<DVector<f64>>| {
            let each = moments.iter();
            each.map(|moments| moments.select_rows(&kept)).collect()
        };
        let others = Self {
            parameters: self.parameters - here.len(),
            scale: of(&self.scale),
            precision: of(&self.precision),
            centre: of(&self.centre),
            log_levels: self.log_levels,
            gram: self.gram.iter().map(of_grams).collect(),
            moments: self.moments.iter().map(of_moments).collect(),
            energy: self.energy.clone(),
            ..Self::default()
        };
        let believed = here
            .iter()
            .map(|&k| 0.5 * self.precision[k] * self.centre[k].powi(2));
        others.fit(terms, start).log_likelihood - believed.sum::<f64>()
    }

    /// Solves the normal equations under given powers: covariance, estimate and log likelihood.
    fn solve(&self, terms: &NoiseTerms, powers: &[Vec<f64>]) -> (DMatrix<f64>, DVector<f64>, f64) {
        let count = self.precision.len();
        let mut precision = DMatrix::from_diagonal(&DVector::from_column_slice(&self.precision));
        let mut score = DVector::from_fn(count, |k, _| self.precision[k] * self.centre[k]);
        let believed = self.precision.iter().zip(&self.centre);
        let believed: f64 = believed
            .map(|(precision, centre)| precision * centre * centre)
            .sum();
        let mut log_likelihood = terms.log_determinant(powers) + self.log_levels - 0.5 * believed;
        for (group, powers) in powers.iter().enumerate() {
            for (bin, power) in powers.iter().enumerate() {
                precision += &self.gram[group][bin] / *power;
                score += &self.moments[group][bin] / *power;
                log_likelihood -= 0.5 * self.energy[group][bin] / power;
            }
        }
        let (covariance, log_determinant) = rlg_inference::linear::invert(&precision);
        let estimate = &covariance * &score;
        log_likelihood += 0.5 * (score.dot(&estimate) - log_determinant);
        (covariance, estimate, log_likelihood)
    }
}
