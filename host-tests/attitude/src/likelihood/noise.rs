//! Stationary noise of three records, as a sum of terms that are diagonal in a DCT-II.
//!
//! Attitude rotates the noise of one axis into another, so that all records share one spectrum. Sums of increments stay on
//! their axes: an encoder's noise is about its own axis, and each record has levels of its own.
//!
//! With λ = 4 sin²(π k / 2n) the increments of an attitude error contain: angle random walk of the gyros (constant), white
//! noise of the attitude (λ), and correlated attitude noise, Ornstein-Uhlenbeck processes of several time constants (λ over
//! λ plus the corner). No rate random walk: in one record of rest and motion it absorbs a bias. Noise
//! differs between rest and motion, and not by one factor at all frequencies: the levels are means over the record, and each
//! octave of the spectrum varies in time (`modulation`).

use std::f64::consts::PI;

use rlg_findings::excess::excess_square;
use rlg_model::Model;
use rlg_plan::AttitudeNoisePlan;
use rlg_signal::quantiles::median;

use crate::likelihood::modulation::Modulation;
use crate::likelihood::octaves::Octaves;

/// Exponent of the update factor in the over-relaxed step.
const LONG_STEP: f64 = 3.0;

/// Most iterations of a fit; each is a few thousand multiplications.
const MOST_STEPS: usize = 400;

/// Noise groups: axes whose records share one spectrum.
pub type Alike = &'static [&'static [usize]];

/// One noise group of all axes.
pub const ALL_ALIKE: Alike = &[&[0, 1, 2]];

/// One noise group per axis.
pub const EACH_ITS_OWN: Alike = &[&[0], &[1], &[2]];

/// Levels of the noise terms, by noise group: mean powers over the record.
#[derive(Debug, Clone)]
pub struct Levels {
    terms: Vec<Vec<f64>>,
    /// Modulation along the record, by group and octave; empty if stationary.
    modulations: Vec<Vec<Modulation>>,
}

impl Levels {
    fn new(terms: Vec<Vec<f64>>) -> Self {
        Self {
            modulations: vec![Vec::new(); terms.len()],
            terms,
        }
    }

    /// Levels shared by all records.
    pub fn of_all(levels: Vec<f64>) -> Self {
        Self::new(vec![levels])
    }

    /// Levels of one axis.
    pub fn of(&self, axis: usize) -> &[f64] {
        &self.terms[axis.min(self.terms.len() - 1)]
    }

    /// Mean level of a term over the groups.
    pub fn mean(&self, term: usize) -> f64 {
        let each = self.terms.iter().map(|levels| levels[term]);
        each.sum::<f64>() / self.terms.len() as f64
    }

    /// Number of terms.
    pub fn terms(&self) -> usize {
        self.terms[0].len()
    }

    /// Returns the same terms with another modulation, by group and octave.
    pub fn modulated(&self, modulations: Vec<Vec<Modulation>>) -> Self {
        Self {
            terms: self.terms.clone(),
            modulations,
        }
    }

    /// Modulation of the noise of one axis, by octave.
    pub fn modulation(&self, axis: usize) -> &[Modulation] {
        &self.modulations[axis.min(self.modulations.len() - 1)]
    }

    /// Largest ratio of an octave's maximum to its minimum level; 1 if stationary.
    pub fn range(&self) -> f64 {
        let each = self.modulations.iter().flatten().map(Modulation::range);
        let ratios = each.map(|[least, largest]| largest / least);
        ratios.fold(1.0, f64::max)
    }

    /// Computes the level of every sample of every octave, by axis, for rows bounded by `times_s`.
    pub fn along(&self, octaves: &Octaves, times_s: &[f64]) -> Along {
        [0, 1, 2].map(|axis| octaves.levels(self.modulation(axis), times_s))
    }

    /// Level of every row in the highest octave; `None` if constant.
    pub fn of_rows(&self, axis: usize, times_s: &[f64]) -> Option<Vec<f64>> {
        let highest = self.modulation(axis).last();
        let highest = highest.filter(|modulation| !modulation.is_none())?;
        let rows = times_s.windows(2);
        Some(
            rows.map(|row| highest.at(0.5 * (row[0] + row[1])))
                .collect(),
        )
    }
}

/// Level of every sample, by axis and octave; `None` if constant.
pub type Along = [Vec<Option<Vec<f64>>>; 3];

/// Angle random walk of gyros and reference as declared by a model \[rad/√s\].
pub fn declared_walk_rad_sqrt_s(model: &Model) -> Option<f64> {
    let of_gyros = model.gyro.angle_random_walk_rad_sqrt_s?;
    let squares =
        (0..3).map(|gyro| of_gyros[gyro].powi(2) + excess_square(model, "angle_random_walk", gyro));
    let square = squares.sum::<f64>() / 3.0;
    let reference = model.reference.as_ref();
    let of_reference = reference.and_then(|one| one.angle_random_walk_rad_sqrt_s);
    (square > 0.0).then(|| square.sqrt().hypot(of_reference.unwrap_or(0.0)))
}

/// Noise terms, binned over the analysed coefficients.
pub struct NoiseTerms {
    /// Edges of the bins, one more than bins.
    pub edges: Vec<usize>,
    /// Number of coefficients in each bin, of one record.
    counts: Vec<f64>,
    /// Mean power of each term in each bin.
    binned: Vec<Vec<f64>>,
    /// λ of every coefficient, as many as rows.
    pub lambda: Vec<f64>,
    return_rows: Vec<f64>,
    /// Noise groups of the records.
    pub alike: Alike,
    /// Lower bound of each axis's random-walk level \[rad²\]: the gyros' white noise, better determined by their own rows
    /// than by the few lowest frequencies of the reference.
    least_walk_rad2: [f64; 3],
    /// Declared power of the random walk \[rad²\].
    declared: Option<f64>,
    /// Weight of that power, in coefficients of three records.
    declared_weight: f64,
}

impl NoiseTerms {
    /// # Inputs
    /// `rows`, `period_s`: of the records; `cut`: number of analysed coefficients; `is_plain`: reduced model of few terms,
    /// so that a large misalignment is not fitted as correlated noise.
    pub fn new(
        rows: usize,
        period_s: f64,
        cut: usize,
        is_plain: bool,
        plan: &AttitudeNoisePlan,
    ) -> Self {
        let lambda: Vec<f64> = (0..rows)
            .map(|k| {
                // The constant is placed at half the first frequency, as each coefficient's band begins half a step lower.
                let k = if k == 0 { 0.5 } else { k as f64 };
                4.0 * (PI * k / (2 * rows) as f64).sin().powi(2)
            })
            .collect();
        let mut edges = vec![0];
        while *edges.last().expect("never empty") < cut {
            let begin = edges[edges.len() - 1];
            let wide = (begin as f64 * (1.0 + plan.bin)) as usize;
            edges.push(wide.max(begin + 1).min(cut));
        }
        let return_times_s: &[f64] = match is_plain {
            true => &[plan.plain_time_s],
            false => &plan.return_times_s,
        };
        let return_rows = return_times_s
            .iter()
            .filter(|time_s| **time_s > 0.5 * period_s)
            .map(|time_s| time_s / period_s)
            .collect();
        let mut terms = Self {
            counts: edges
                .windows(2)
                .map(|bin| (bin[1] - bin[0]) as f64)
                .collect(),
            edges,
            binned: Vec::new(),
            lambda,
            return_rows,
            alike: ALL_ALIKE,
            least_walk_rad2: [0.0; 3],
            declared: None,
            declared_weight: plan.declared_weight,
        };
        let mean = |term: usize, bin: &[usize]| {
            let sum: f64 = (bin[0]..bin[1])
                .map(|k| terms.power(term, terms.lambda[k]))
                .sum();
            sum / (bin[1] - bin[0]) as f64
        };
        let binned = (0..terms.count())
            .map(|term| terms.edges.windows(2).map(|bin| mean(term, bin)).collect())
            .collect();
        terms.binned = binned;
        terms
    }

    /// Sets the noise groups of the records.
    pub fn with_alike(mut self, alike: Alike) -> Self {
        self.alike = alike;
        self
    }

    /// Sets the prior knowledge of the random walk, for rows of `period_s`.
    ///
    /// # Inputs
    /// `declared_rad_sqrt_s`: declared by the model; `least_rad2`: lower bound of a row's variance by axis.
    pub fn with_walk(
        mut self,
        declared_rad_sqrt_s: Option<f64>,
        least_rad2: [f64; 3],
        period_s: f64,
    ) -> Self {
        self.declared = declared_rad_sqrt_s.map(|walk| walk * walk * period_s);
        self.least_walk_rad2 = least_rad2;
        self
    }

    /// Number of terms.
    pub fn count(&self) -> usize {
        2 + self.return_rows.len()
    }

    /// Power of a term at λ: random walk, white attitude noise, Ornstein-Uhlenbeck attitude noise of unit variance.
    fn power(&self, term: usize, lambda: f64) -> f64 {
        match term {
            0 => 1.0,
            1 => lambda,
            _ => {
                let kept = (-1.0 / self.return_rows[term - 2]).exp();
                lambda * (1.0 - kept * kept) / ((1.0 - kept).powi(2) + kept * lambda)
            }
        }
    }

    /// Power in every bin, by group.
    pub fn of_bins(&self, levels: &Levels) -> Vec<Vec<f64>> {
        levels.terms.iter().map(|own| self.of_group(own)).collect()
    }

    fn of_group(&self, levels: &[f64]) -> Vec<f64> {
        (0..self.counts.len())
            .map(|bin| {
                let terms = self.binned.iter().zip(levels);
                terms.map(|(power, level)| level * power[bin]).sum()
            })
            .collect()
    }

    /// Expected sums of squares in every bin under given powers, by group.
    pub fn expected(&self, powers: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let of_group = |(axes, powers): (&&[usize], &Vec<f64>)| {
            let records = axes.len() as f64;
            let bins = powers.iter().zip(&self.counts);
            bins.map(|(power, count)| records * count * power).collect()
        };
        self.alike.iter().zip(powers).map(of_group).collect()
    }

    /// Power of every coefficient.
    pub fn of_coefficients(&self, levels: &[f64]) -> Vec<f64> {
        let of_lambda = |lambda: &f64| {
            let terms = levels.iter().enumerate();
            terms
                .map(|(term, level)| level * self.power(term, *lambda))
                .sum()
        };
        self.lambda.iter().map(of_lambda).collect()
    }

    /// Computes starting levels.
    ///
    /// # Inputs
    /// `powers`: sums of squares in each bin, by group.
    pub fn start(&self, powers: &[Vec<f64>]) -> Levels {
        let groups = self.alike.iter().zip(powers);
        Levels::new(
            groups
                .map(|(axes, powers)| self.start_of(powers, axes))
                .collect(),
        )
    }

    fn start_of(&self, powers: &[f64], axes: &[usize]) -> Vec<f64> {
        let density = self.densities(powers, axes);
        let usual = |values: &[f64]| median(values.iter().copied()).unwrap_or(0.0);
        let white = usual(&density);
        let highest = density.len().saturating_sub(20);
        let ratios: Vec<f64> = (highest..density.len())
            .map(|bin| density[bin] / self.binned[1][bin])
            .collect();
        let mut levels = vec![0.5 * white, 0.5 * usual(&ratios)];
        levels.extend((2..self.count()).map(|term| 0.05 * white / usual(&self.binned[term])));
        levels
    }

    fn densities(&self, powers: &[f64], axes: &[usize]) -> Vec<f64> {
        let records = axes.len() as f64;
        let bins = powers.iter().zip(&self.counts);
        bins.map(|(power, count)| (power / (records * count)).max(f64::MIN_POSITIVE))
            .collect()
    }

    /// Fits levels ≥ 0 by the Whittle likelihood, −½ Σ count (ln S + P/S), with multiplicative updates, which increase it
    /// from any start.
    pub fn fit(&self, powers: &[Vec<f64>], start: &Levels) -> Levels {
        let groups = self.alike.iter().zip(powers).zip(&start.terms);
        Levels {
            terms: groups
                .map(|((axes, powers), start)| self.fit_of(powers, axes, start))
                .collect(),
            modulations: start.modulations.clone(),
        }
    }

    fn fit_of(&self, powers: &[f64], axes: &[usize], start: &[f64]) -> Vec<f64> {
        let density = self.densities(powers, axes);
        let records = axes.len() as f64;
        let mut floor: Vec<f64> = self
            .binned
            .iter()
            .map(|power| {
                let ratios = density.iter().zip(power).map(|(d, p)| d / p);
                1e-4 * ratios.fold(f64::INFINITY, f64::min)
            })
            .collect();
        let least = axes.iter().map(|axis| self.least_walk_rad2[*axis]);
        floor[0] = floor[0].max(least.sum::<f64>() / records);
        let mut levels: Vec<f64> = start
            .iter()
            .zip(&floor)
            .map(|(level, floor)| level.max(*floor))
            .collect();
        let mut current = self.cost(&density, &levels, records);
        for _ in 0..MOST_STEPS {
            let factors = self.factors(&density, &levels);
            let stepped = |power: f64| -> Vec<f64> {
                let each = factors.iter().zip(&levels).zip(&floor);
                each.map(|((factor, level), floor)| (level * factor.powf(power)).max(*floor))
                    .collect()
            };
            // The plain update always increases the likelihood; the over-relaxed one mostly increases it more.
            let tried = [LONG_STEP, 1.0].map(|power| {
                let tried = stepped(power);
                (self.cost(&density, &tried, records), tried)
            });
            let [long, plain] = tried;
            let (cost, next) = if long.0 < plain.0 { long } else { plain };
            // An update that overflows also ends the iteration.
            let gained = current - cost;
            if !gained.is_finite() || gained < 1e-3 {
                break;
            }
            (levels, current) = (next, cost);
        }
        levels
    }

    fn cost(&self, density: &[f64], levels: &[f64], records: f64) -> f64 {
        let powers = self.of_group(levels);
        let bins = density.iter().zip(&powers).zip(&self.counts);
        let of_bins = bins.map(|((density, power), count)| (density, power, count));
        let walk = self
            .declared
            .iter()
            .map(|walk| (walk, &levels[0], &self.declared_weight));
        of_bins
            .chain(walk)
            .map(|(density, power, count)| 0.5 * records * count * (power.ln() + density / power))
            .sum()
    }

    fn factors(&self, density: &[f64], levels: &[f64]) -> Vec<f64> {
        let powers = self.of_group(levels);
        self.binned
            .iter()
            .enumerate()
            .map(|(place, term)| {
                let (mut above, mut below) = match (place, self.declared) {
                    (0, Some(walk)) => (
                        self.declared_weight * walk / levels[0].powi(2),
                        self.declared_weight / levels[0],
                    ),
                    _ => (0.0, 0.0),
                };
                for (bin, power) in powers.iter().enumerate() {
                    above += term[bin] * self.counts[bin] * density[bin] / (power * power);
                    below += term[bin] * self.counts[bin] / power;
                }
                (above / below).max(0.0)
            })
            .collect()
    }

    /// Log-determinant term of the likelihood, −½ Σ ln S over three records.
    pub fn log_determinant(&self, powers: &[Vec<f64>]) -> f64 {
        let of_group = |(axes, powers): (&&[usize], &Vec<f64>)| {
            let bins = powers.iter().zip(&self.counts);
            -0.5 * axes.len() as f64 * bins.map(|(power, count)| count * power.ln()).sum::<f64>()
        };
        self.alike.iter().zip(powers).map(of_group).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::{EACH_ITS_OWN, Levels, NoiseTerms};

    /// Terms of the reduced model, at a hundred rows a second.
    fn plain_terms() -> NoiseTerms {
        NoiseTerms::new(4000, 0.01, 4000, true, &Default::default())
    }

    #[test]
    fn levels_are_found_from_their_own_spectrum() {
        let terms = plain_terms();
        let truth = [2e-9, 5e-8, 3e-6];
        let truth = Levels::of_all(truth.to_vec());
        let powers = terms.expected(&terms.of_bins(&truth));
        let found = terms.fit(&powers, &terms.start(&powers));
        for (found, truth) in found.of(2).iter().zip(truth.of(2)) {
            assert!((found / truth - 1.0).abs() < 0.1, "{found:e} {truth:e}");
        }
    }

    #[test]
    fn records_that_are_not_alike_have_levels_of_their_own() {
        let terms = plain_terms().with_alike(EACH_ITS_OWN);
        // An encoder about z, and axes about which a table does not turn.
        let truth = Levels::new(vec![
            vec![2e-9, 1e-13, 1e-13],
            vec![3e-9, 1e-13, 1e-13],
            vec![2e-9, 5e-8, 1e-13],
        ]);
        let wanted = terms.of_bins(&truth);
        let powers = terms.expected(&wanted);
        let found = terms.of_bins(&terms.fit(&powers, &terms.start(&powers)));
        for (found, wanted) in found.iter().flatten().zip(wanted.iter().flatten()) {
            assert!((found / wanted - 1.0).abs() < 0.1, "{found:e} {wanted:e}");
        }
    }

    /// Fits the random-walk level to rows with the mean spectrum of `truth`, given the value `declared` by the model.
    fn walk_beside(truth: [f64; 3], declared: f64) -> f64 {
        let period_s: f64 = 0.01;
        let terms = plain_terms().with_walk(Some((declared / period_s).sqrt()), [0.0; 3], period_s);
        let powers = terms.expected(&terms.of_bins(&Levels::of_all(truth.to_vec())));
        terms.fit(&powers, &terms.start(&powers)).of(0)[0]
    }

    #[test]
    fn a_declared_walk_holds_where_rows_do_not_show_it_and_gives_way_where_they_do() {
        let hidden = walk_beside([0.0, 5e-8, 0.0], 1e-15);
        assert!((0.5..2.0).contains(&(hidden / 1e-15)), "{hidden:e}");
        // No Ornstein-Uhlenbeck term: it is distinguishable from a random walk at the lowest frequencies only.
        for declared in [5e-10, 8e-9] {
            let shown = walk_beside([2e-9, 5e-8, 0.0], declared);
            assert!((shown / 2e-9 - 1.0).abs() < 0.1, "{declared:e}: {shown:e}");
        }
    }
}
