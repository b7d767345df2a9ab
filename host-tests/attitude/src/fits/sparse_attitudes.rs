//! Inference from few attitudes, as before and after one turn: too few rows to estimate their noise.
//!
//! Noise is declared by the model, or has a log-normal prior of typical instruments; models are compared by their evidence,
//! averaged over that noise, with priors of physical size, and no more parameters are named than the rows have values.

use rlg_plan::{FewAttitudesPlan, Plan};
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector, Vector3};
use rlg_findings::excess::excess_square;
use rlg_inference::linear::invert;
use rlg_model::Model;
use rlg_signal::axes::Triad;
use rlg_signal::still::ROTATION_RAD_S;

use crate::likelihood::equations::ParameterColumn;
use crate::likelihood::outliers::MEDIAN_CHI_SQUARED;
use crate::rows::increments::Increments;
use crate::rows::linearised_rows::Gyros;

/// Prior of a noise level: log-normal, or known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Believed {
    median: f64,
    log_std: f64,
}

impl Believed {
    /// Grid of values, even in the logarithm, with log prior probabilities.
    fn grid(self) -> impl Iterator<Item = (f64, f64)> {
        /// Half-width of the grid in standard deviations, and steps per standard deviation.
        const REACH: i32 = 3;
        const EACH: i32 = 2;
        let most = if self.log_std > 0.0 { REACH * EACH } else { 0 };
        (-most..=most).map(move |k| {
            let away = f64::from(k) / f64::from(EACH);
            (
                self.median * (away * self.log_std).exp(),
                -0.5 * away * away,
            )
        })
    }
}

/// Prior of the noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NoiseBelief {
    /// Angle random walk of gyros and reference \[rad/√s\].
    walk: Believed,
    /// White noise of the reference and of the gyros' counters and pickoffs \[rad\].
    angle: Believed,
}

impl NoiseBelief {
    /// Takes declared noise as known; else estimates the walk from the gyros' rows, and uses the plan's typical reference
    /// noise.
    pub(crate) fn new(model: &Model, gyros: &Gyros, plan: &Plan) -> Self {
        let reference = model.reference.as_ref();
        let mean_square = |of: &dyn Fn(usize) -> f64| (0..3).map(of).sum::<f64>() / 3.0;
        let declared = gyros.declared_walk_rad_sqrt_s;
        let walk = declared.unwrap_or_else(|| {
            let of_reference = reference.and_then(|one| one.angle_random_walk_rad_sqrt_s);
            own_walk_rad_sqrt_s(gyros).hypot(of_reference.unwrap_or(0.0))
        });
        let read_with_gyros = mean_square(&|gyro| {
            let pulses = model.gyro.pulse_weight_rad[gyro].powi(2);
            let pulses = pulses + excess_square(model, "pulse_quantisation", gyro);
            pulses / 12.0 + model.pickoff_white_rad2(gyro)
        });
        let declared_angle = reference.and_then(|one| one.angle_noise_rad);
        let angle = declared_angle.unwrap_or(plan.attitude.undeclared_attitude_noise_rad);
        let log_std = |is_declared: bool| match is_declared {
            true => 0.0,
            false => plan.attitude.undeclared_log_std,
        };
        Self {
            walk: Believed {
                median: walk,
                log_std: log_std(declared.is_some()),
            },
            angle: Believed {
                median: angle.hypot(read_with_gyros.sqrt()),
                log_std: log_std(declared_angle.is_some()),
            },
        }
    }
}

/// Estimates the random walk from the lower quartile of the gyros' squared second differences \[rad/√s\], at the sum length
/// of least value: quantisation dominates short sums, motion long ones.
fn own_walk_rad_sqrt_s(gyros: &Gyros) -> f64 {
    let least = gyros.plan.few.least_sums;
    let of_sums = |rows: usize| {
        let sums: Vec<Vector3<f64>> = gyros
            .sensed_rad
            .chunks_exact(rows)
            .map(|rows| rows.iter().sum())
            .collect();
        let mut squares: Vec<f64> = sums
            .windows(3)
            .map(|sums| (sums[0] - 2.0 * sums[1] + sums[2]).norm_squared())
            .collect();
        if squares.is_empty() {
            return 0.0;
        }
        let place = squares.len() / 4;
        let quarter = *squares.select_nth_unstable_by(place, f64::total_cmp).1;
        // A second difference of white noise has six times its variance.
        (quarter / MEDIAN_CHI_SQUARED / 6.0 * gyros.rate_hz / rows as f64).sqrt()
    };
    let spans = (0..).map(|k| 1 << k);
    let spans = spans.take_while(|rows| *rows == 1 || gyros.sensed_rad.len() / rows >= least);
    spans.map(of_sums).fold(f64::INFINITY, f64::min)
}

/// Re-estimates the prior width of a group, relative to its own, by empirical Bayes: its sum of squares over the effective
/// number of well-determined parameters (MacKay 1992, "Bayesian interpolation", Eq. 4.9), so that undetermined directions do
/// not hold the width at its last value.
fn best_width(weighed: &Weighed, group: Range<usize>, (own, std): (&[f64], &[f64])) -> f64 {
    let squares = group.clone().map(|k| (weighed.mean[k] / own[k]).powi(2));
    let fixed = group
        .clone()
        .map(|k| 1.0 - weighed.covariance[(k, k)] / std[k].powi(2));
    let fixed = fixed.sum::<f64>().max(f64::MIN_POSITIVE);
    (squares.sum::<f64>() / fixed).sqrt()
}

/// Normal equations of all rows under one pair of noise levels.
struct UnderNoise {
    log_weight: f64,
    gram: DMatrix<f64>,
    moments: DVector<f64>,
    energy: f64,
    walk_rad_sqrt_s: f64,
    angle_rad: f64,
}

/// Normal equations of all columns at every grid point of the noise prior.
pub(crate) struct FewRows {
    under: Vec<UnderNoise>,
    prior_std: Vec<f64>,
    /// Least posterior weight of a noise level that is kept.
    least_weight: f64,
    /// Number of values in the attitudes' rows.
    pub(crate) numbers: usize,
    /// Last three columns: constant rate of the case during the assumed rest.
    pub(crate) turning: Option<[usize; 3]>,
}

/// Mean rate measured at rest, and the columns' contributions to it \[rad/s\].
pub(crate) struct AtRest {
    pub(crate) lasts_s: f64,
    pub(crate) reading_rad_s: Vector3<f64>,
    /// Contribution of each column.
    pub(crate) columns: Vec<Vector3<f64>>,
}

/// Record and columns, a row of each axis for every increment and one for the rest.
struct Stacked<'a> {
    record: DMatrix<f64>,
    columns: Vec<DMatrix<f64>>,
    increments: &'a Increments,
    /// Duration at rest \[s\].
    rest_s: Option<f64>,
}

impl<'a> Stacked<'a> {
    fn new(increments: &'a Increments, columns: &[ParameterColumn], rest: Option<&AtRest>) -> Self {
        let rows = increments.rows() + usize::from(rest.is_some());
        let stacked = |values: &Triad, at_rest: Option<Vector3<f64>>| {
            DMatrix::from_fn(rows, 3, |row, axis| match values[axis].get(row) {
                Some(value) => *value,
                None => at_rest.map_or(0.0, |value| value[axis]),
            })
        };
        let each = columns.iter().enumerate();
        let mut all: Vec<DMatrix<f64>> = each
            .map(|(k, one)| stacked(&one.values, rest.map(|rest| rest.columns[k])))
            .collect();
        // Constant rates of the case during the rest.
        all.extend(rest.iter().flat_map(|_| 0..3).map(|axis| {
            let mut column = DMatrix::zeros(rows, 3);
            column[(increments.rows(), axis)] = 1.0;
            column
        }));
        // Rows relative to the model's values, to first order.
        let mut record = stacked(&increments.rows_rad, rest.map(|rest| rest.reading_rad_s));
        for (column, one) in all.iter().zip(columns) {
            record -= column * one.prior_mean;
        }
        Self {
            record,
            columns: all,
            increments,
            rest_s: rest.map(|rest| rest.lasts_s),
        }
    }

    /// Covariance of the rows of an axis \[rad², at rest rad²/s²\].
    fn covariance(&self, walk_rad_sqrt_s: f64, angle_rad: f64) -> DMatrix<f64> {
        let (rows, at_rest) = (self.record.nrows(), self.increments.rows());
        let times_s = &self.increments.times_s;
        let lasts_s = |row: usize| times_s[row + 1] - times_s[row];
        DMatrix::from_fn(rows, rows, |a, b| match a.abs_diff(b) {
            0 if a == at_rest => {
                walk_rad_sqrt_s.powi(2) / self.rest_s.unwrap_or(1.0) + ROTATION_RAD_S.powi(2)
            }
            1 if a.max(b) == at_rest => 0.0,
            0 => walk_rad_sqrt_s.powi(2) * lasts_s(a) + 2.0 * angle_rad.powi(2),
            1 => -angle_rad.powi(2),
            _ => 0.0,
        })
    }

    /// Normal equations under noise levels of a log prior probability; `None` if their covariance is singular.
    fn under(&self, walk_rad_sqrt_s: f64, angle_rad: f64, log_prior: f64) -> Option<UnderNoise> {
        let count = 3 * self.record.nrows();
        let root = Cholesky::new(self.covariance(walk_rad_sqrt_s, angle_rad))?.l();
        let whitened = |values: &DMatrix<f64>| {
            let white = root.solve_lower_triangular(values);
            DVector::from_iterator(count, white.iter().flatten().copied())
        };
        let log_determinant: f64 = root.diagonal().iter().map(|value| value.ln()).sum();
        let record = whitened(&self.record);
        let white: Vec<DVector<f64>> = self.columns.iter().map(whitened).collect();
        let white = match white.is_empty() {
            true => DMatrix::zeros(count, 0),
            false => DMatrix::from_columns(&white),
        };
        Some(UnderNoise {
            log_weight: log_prior - 3.0 * log_determinant,
            gram: white.tr_mul(&white),
            moments: white.tr_mul(&record),
            energy: record.norm_squared(),
            walk_rad_sqrt_s,
            angle_rad,
        })
    }
}

/// Posterior of a set of columns.
pub(crate) struct Weighed {
    /// Log evidence, up to a constant common to all sets.
    pub(crate) log_evidence: f64,
    /// Posterior mean of each parameter, relative to the model.
    pub(crate) mean: DVector<f64>,
    /// Posterior covariance.
    pub(crate) covariance: DMatrix<f64>,
    /// Posterior mean of random walk \[rad/√s\] and white noise \[rad\].
    pub(crate) noise: [f64; 2],
    /// Posterior mean of the residual share of the energy \[1\].
    pub(crate) share_left: f64,
    /// Indices of the likely noise levels.
    pub(crate) likely: Vec<usize>,
}

impl FewRows {
    /// Whitens rows and columns at every grid point of the noise.
    pub(crate) fn new(
        increments: &Increments,
        columns: &[ParameterColumn],
        rest: Option<&AtRest>,
        belief: &NoiseBelief,
        plan: &FewAttitudesPlan,
    ) -> Self {
        let stacked = Stacked::new(increments, columns, rest);
        let mut under = Vec::new();
        for (walk_rad_sqrt_s, walk_weight) in belief.walk.grid() {
            for (angle_rad, angle_weight) in belief.angle.grid() {
                let prior = walk_weight + angle_weight;
                under.extend(stacked.under(walk_rad_sqrt_s, angle_rad, prior));
            }
        }
        let turning = rest.map(|_| [0, 1, 2].map(|axis| columns.len() + axis));
        Self {
            under,
            prior_std: columns
                .iter()
                .map(|one| one.prior_std)
                .chain(turning.iter().flatten().map(|_| plan.turning_std_rad_s))
                .collect(),
            turning,
            least_weight: plan.least_weight,
            numbers: 3 * increments.rows(),
        }
    }

    /// Computes the posterior of groups of columns, averaged over the noise; each group's prior width is that of most
    /// evidence, its own at most.
    pub(crate) fn weigh(&self, groups: &[&[usize]]) -> Weighed {
        self.weigh_under(groups, &(0..self.under.len()).collect::<Vec<_>>())
    }

    /// Computes the posterior at selected noise levels: those likely under another set.
    pub(crate) fn weigh_under(&self, groups: &[&[usize]], noises: &[usize]) -> Weighed {
        /// Most iterations of the prior widths.
        const TURNS: usize = 4;
        /// Least relative width of a prior, that of an absent effect.
        const LEAST_WIDTH: f64 = 1e-6;
        let set: Vec<usize> = groups.concat();
        let own: Vec<f64> = set.iter().map(|k| self.prior_std[*k]).collect();
        let mut std = own.clone();
        let mut weighed = self.weigh_with((&set, &std), noises);
        for _ in 0..TURNS {
            let mut first = 0;
            for group in groups {
                let range = first..first + group.len();
                first = range.end;
                let width =
                    best_width(&weighed, range.clone(), (&own, &std)).clamp(LEAST_WIDTH, 1.0);
                for k in range {
                    std[k] = own[k] * width;
                }
            }
            let again = self.weigh_with((&set, &std), &weighed.likely);
            let gained = again.log_evidence - weighed.log_evidence;
            weighed = again;
            if gained < 0.1 {
                break;
            }
        }
        weighed
    }

    fn weigh_with(&self, (set, std): (&[usize], &[f64]), noises: &[usize]) -> Weighed {
        let count = set.len();
        let precision = DVector::from_iterator(count, std.iter().map(|std| std.powi(-2)));
        let log_prior: f64 = precision.iter().map(|value| 0.5 * value.ln()).sum();
        let each: Vec<(f64, DVector<f64>, DMatrix<f64>, f64)> = noises
            .iter()
            .map(|noise| {
                let one = &self.under[*noise];
                let gram = DMatrix::from_fn(count, count, |a, b| one.gram[(set[a], set[b])]);
                let own = DVector::from_fn(count, |a, _| one.moments[set[a]]);
                let (covariance, log_determinant) =
                    invert(&(&gram + DMatrix::from_diagonal(&precision)));
                let mean = &covariance * &own;
                let left = one.energy - 2.0 * mean.dot(&own) + mean.dot(&(&gram * &mean));
                let log_evidence = one.log_weight + log_prior
                    - 0.5 * (one.energy - own.dot(&mean))
                    - 0.5 * log_determinant;
                (log_evidence, mean, covariance, left / one.energy)
            })
            .collect();
        let highest = each.iter().map(|one| one.0).fold(f64::MIN, f64::max);
        let weights: Vec<f64> = each.iter().map(|one| (one.0 - highest).exp()).collect();
        let total: f64 = weights.iter().sum();
        let mut weighed = Weighed {
            log_evidence: highest + total.ln(),
            mean: DVector::zeros(count),
            covariance: DMatrix::zeros(count, count),
            noise: [0.0; 2],
            share_left: 0.0,
            likely: Vec::new(),
        };
        for ((weight, one), noise) in weights.iter().zip(&each).zip(noises) {
            let weight = weight / total;
            let under = &self.under[*noise];
            if weight > self.least_weight {
                weighed.likely.push(*noise);
            }
            weighed.mean += weight * &one.1;
            weighed.covariance += weight * (&one.2 + &one.1 * one.1.transpose());
            weighed.noise[0] += weight * under.walk_rad_sqrt_s;
            weighed.noise[1] += weight * under.angle_rad;
            weighed.share_left += weight * one.3;
        }
        weighed.covariance -= &weighed.mean * weighed.mean.transpose();
        weighed
    }
}
