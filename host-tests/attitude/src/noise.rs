//! Stationary noise that three records share, as a sum of terms that are diagonal in a DCT-II.
//!
//! With λ = 4 sin²(π k / 2n) the increments of an attitude error hold: angle random walk of the gyros (constant), white
//! noise of the attitude (λ), and attitude that wanders and comes back, as an Ornstein-Uhlenbeck process of several times
//! (λ over λ plus its corner). No drift of the rate: beside rest and motion of one record it takes a bias for itself.
//! (inference.md, B3.)

use std::f64::consts::PI;

use rlg_findings::excess::excess_square;
use rlg_model::Model;

/// Times after which an attitude comes back \[s\].
const RETURN_TIMES_S: [f64; 6] = [0.1, 0.3, 1.0, 3.0, 10.0, 30.0];

/// The one that stands for all of them in a first pass.
const PLAIN_TIME_S: f64 = 1.0;

/// Width of a bin, as a share of its frequency.
const BIN_WIDTH: f64 = 0.08;

/// Power of a factor in a step that is tried first.
const LONG_STEP: f64 = 3.0;

/// Most steps of a fit; each is a few thousand multiplications.
const MOST_STEPS: usize = 400;

/// Coefficients of three records that a declared random walk counts for: it may be half or twice what is declared.
const DECLARED_COUNT: f64 = 1.5;

/// Random walk of gyros and reference that a model declares \[rad/√s\].
pub fn declared_walk_rad_sqrt_s(model: &Model) -> Option<f64> {
    let of_gyros = model.gyro.angle_random_walk_rad_sqrt_s?;
    let squares =
        (0..3).map(|gyro| of_gyros[gyro].powi(2) + excess_square(model, "angle_random_walk", gyro));
    let square = squares.sum::<f64>() / 3.0;
    let reference = model.reference.as_ref();
    let of_reference = reference.and_then(|one| one.angle_random_walk_rad_sqrt_s);
    (square > 0.0).then(|| square.sqrt().hypot(of_reference.unwrap_or(0.0)))
}

/// Terms, binned over the coefficients that are looked at.
pub struct NoiseTerms {
    /// Edges of the bins, one more than bins.
    pub edges: Vec<usize>,
    /// Coefficients of each bin of one record.
    counts: Vec<f64>,
    /// Mean power of each term in each bin.
    binned: Vec<Vec<f64>>,
    /// λ of every row's coefficient.
    pub lambda: Vec<f64>,
    return_rows: Vec<f64>,
    /// The least level of the random walk: the gyros' own white noise, which their rows show better than the few lowest
    /// frequencies of the reference do \[rad²\].
    least_walk_rad2: f64,
    /// Power of the random walk that is declared.
    declared: Option<f64>,
}

impl NoiseTerms {
    /// # Inputs
    /// `rows`, `period_s`: of the records; `cut`: coefficients that are looked at; `is_plain`: a few terms only, so that an
    /// error far off is not taken for wandering.
    pub fn new(rows: usize, period_s: f64, cut: usize, is_plain: bool) -> Self {
        let lambda: Vec<f64> = (0..rows)
            .map(|k| {
                // The constant lies a quarter below the first frequency, as all of them reach half a step down.
                let k = if k == 0 { 0.5 } else { k as f64 };
                4.0 * (PI * k / (2 * rows) as f64).sin().powi(2)
            })
            .collect();
        let mut edges = vec![0];
        while *edges.last().expect("never empty") < cut {
            let begin = edges[edges.len() - 1];
            let wide = (begin as f64 * (1.0 + BIN_WIDTH)) as usize;
            edges.push(wide.max(begin + 1).min(cut));
        }
        let return_rows = RETURN_TIMES_S
            .into_iter()
            .filter(|time_s| !is_plain || *time_s == PLAIN_TIME_S)
            .filter(|time_s| *time_s > 0.5 * period_s)
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
            least_walk_rad2: 0.0,
            declared: None,
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

    /// The same where something is known of the random walk, on rows of `period_s`.
    ///
    /// # Inputs
    /// `declared_rad_sqrt_s`: what the model says; `least_rad2`: what a row has at least.
    pub fn with_walk(
        mut self,
        (declared_rad_sqrt_s, least_rad2): (Option<f64>, f64),
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

    /// Power of a term at λ: random walk, white attitude, attitude of unit variance that comes back.
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

    /// Power in every bin.
    pub fn of_bins(&self, levels: &[f64]) -> Vec<f64> {
        (0..self.counts.len())
            .map(|bin| {
                let terms = self.binned.iter().zip(levels);
                terms.map(|(power, level)| level * power[bin]).sum()
            })
            .collect()
    }

    /// Sums of squares of three records that powers let expect in every bin.
    pub fn expected(&self, powers: &[f64]) -> Vec<f64> {
        let bins = powers.iter().zip(&self.counts);
        bins.map(|(power, count)| 3.0 * count * power).collect()
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

    /// Levels to begin with.
    ///
    /// # Inputs
    /// `powers`: sums of squares in each bin, over three records.
    pub fn start(&self, powers: &[f64]) -> Vec<f64> {
        let density = self.densities(powers);
        let mut sorted = density.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[sorted.len() / 2];
        let highest = density.len().saturating_sub(20);
        let mut ratios: Vec<f64> = (highest..density.len())
            .map(|bin| density[bin] / self.binned[1][bin])
            .collect();
        ratios.sort_by(f64::total_cmp);
        let mut levels = vec![0.5 * median, 0.5 * ratios[ratios.len() / 2]];
        levels.extend((2..self.count()).map(|term| {
            let mut powers = self.binned[term].clone();
            powers.sort_by(f64::total_cmp);
            0.05 * median / powers[powers.len() / 2]
        }));
        levels
    }

    fn densities(&self, powers: &[f64]) -> Vec<f64> {
        let bins = powers.iter().zip(&self.counts);
        bins.map(|(power, count)| (power / (3.0 * count)).max(f64::MIN_POSITIVE))
            .collect()
    }

    /// Levels ≥ 0 that maximise −½ Σ count (ln S + P/S), by steps that multiply: each gains, from anywhere.
    pub fn fit(&self, powers: &[f64], start: &[f64]) -> Vec<f64> {
        let density = self.densities(powers);
        let mut floor: Vec<f64> = self
            .binned
            .iter()
            .map(|power| {
                let ratios = density.iter().zip(power).map(|(d, p)| d / p);
                1e-4 * ratios.fold(f64::INFINITY, f64::min)
            })
            .collect();
        floor[0] = floor[0].max(self.least_walk_rad2);
        let mut levels: Vec<f64> = start
            .iter()
            .zip(&floor)
            .map(|(level, floor)| level.max(*floor))
            .collect();
        let mut current = self.cost(&density, &levels);
        for _ in 0..MOST_STEPS {
            let factors = self.factors(&density, &levels);
            let stepped = |power: f64| -> Vec<f64> {
                let each = factors.iter().zip(&levels).zip(&floor);
                each.map(|((factor, level), floor)| (level * factor.powf(power)).max(*floor))
                    .collect()
            };
            // A plain step always gains; a long one mostly gains more.
            let tried = [LONG_STEP, 1.0].map(|power| {
                let tried = stepped(power);
                (self.cost(&density, &tried), tried)
            });
            let [long, plain] = tried;
            let (cost, next) = if long.0 < plain.0 { long } else { plain };
            // So that a step beyond all numbers is none, too.
            let gained = current - cost;
            if !gained.is_finite() || gained < 1e-3 {
                break;
            }
            (levels, current) = (next, cost);
        }
        levels
    }

    fn cost(&self, density: &[f64], levels: &[f64]) -> f64 {
        let powers = self.of_bins(levels);
        let bins = density.iter().zip(&powers).zip(&self.counts);
        let of_bins = bins.map(|((density, power), count)| (density, power, count));
        let walk = self
            .declared
            .iter()
            .map(|walk| (walk, &levels[0], &DECLARED_COUNT));
        of_bins
            .chain(walk)
            .map(|(density, power, count)| 1.5 * count * (power.ln() + density / power))
            .sum()
    }

    fn factors(&self, density: &[f64], levels: &[f64]) -> Vec<f64> {
        let powers = self.of_bins(levels);
        self.binned
            .iter()
            .enumerate()
            .map(|(place, term)| {
                let (mut above, mut below) = match (place, self.declared) {
                    (0, Some(walk)) => (
                        DECLARED_COUNT * walk / levels[0].powi(2),
                        DECLARED_COUNT / levels[0],
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

    /// −½ Σ ln S over three records.
    pub fn log_determinant(&self, powers: &[f64]) -> f64 {
        let bins = powers.iter().zip(&self.counts);
        -1.5 * bins.map(|(power, count)| count * power.ln()).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::NoiseTerms;

    #[test]
    fn levels_are_found_from_their_own_spectrum() {
        let terms = NoiseTerms::new(4000, 0.01, 4000, true);
        let truth = [2e-9, 5e-8, 3e-6];
        let powers: Vec<f64> = terms
            .of_bins(&truth)
            .iter()
            .zip(&terms.counts)
            .map(|(power, count)| 3.0 * count * power)
            .collect();
        let found = terms.fit(&powers, &terms.start(&powers));
        for (found, truth) in found.iter().zip(truth) {
            assert!((found / truth - 1.0).abs() < 0.1, "{found:e} {truth:e}");
        }
    }

    /// The level of the walk, whose rows have the mean spectrum of `truth`, where `declared` is the model's.
    fn walk_beside(truth: [f64; 3], declared: f64) -> f64 {
        let period_s: f64 = 0.01;
        let terms = NoiseTerms::new(4000, period_s, 4000, true)
            .with_walk((Some((declared / period_s).sqrt()), 0.0), period_s);
        let powers = terms.expected(&terms.of_bins(&truth));
        terms.fit(&powers, &terms.start(&powers))[0]
    }

    #[test]
    fn a_declared_walk_holds_where_rows_do_not_show_it_and_gives_way_where_they_do() {
        let hidden = walk_beside([0.0, 5e-8, 0.0], 1e-15);
        assert!((0.5..2.0).contains(&(hidden / 1e-15)), "{hidden:e}");
        // Nothing that wanders beside it, which rows tell from a walk by their lowest frequencies alone.
        for declared in [5e-10, 8e-9] {
            let shown = walk_beside([2e-9, 5e-8, 0.0], declared);
            assert!((shown / 2e-9 - 1.0).abs() < 0.1, "{declared:e}: {shown:e}");
        }
    }
}
