//! Path between the reference and the gyros that explains them best: delays, or one low pass.

use rlg_catalogue::low_pass::{LowPass, grid};
use rlg_catalogue::signals::Path;
use rlg_inference::sums::sums;
use rlg_plan::{CoarsePlan, GridPlan};
use rlg_signal::derivatives::Spectrum;
use rlg_signal::streams::{Triad, each_axis};

use super::axis_regression::{Lags, Regression, log_likelihood};
use crate::rows::data::{Data, reached};

/// Selects the delays or the low pass that explain the gyros together; the direct path if none is better than it.
pub(crate) fn path_between(
    data: &Data,
    sensed_rad: &Triad,
    seen: &[bool],
    (plan, grids): (&CoarsePlan, &GridPlan),
) -> Path {
    let streams = data.streams;
    let each = streams.rows.div_ceil(plan.most_rows);
    let summed = |triad: &Triad| each_axis(|axis| sums(&triad[axis], each));
    let search = PathSearch {
        sensed: summed(sensed_rad),
        case: summed(&data.reference_rad),
        rows: seen
            .chunks_exact(each)
            .map(|rows| rows.iter().all(|&seen| seen))
            .collect(),
        rate_hz: streams.rate_hz / each as f64,
        plan,
        grids,
    };
    let late = search.delays();
    search.low_pass_beside(late).map_or(late, of_low_pass)
}

/// Increments of gyros and reference in blocks of rows.
struct PathSearch<'a> {
    sensed: Triad,
    case: Triad,
    /// Blocks of which all rows are seen.
    rows: Vec<bool>,
    rate_hz: f64,
    plan: &'a CoarsePlan,
    grids: &'a GridPlan,
}

impl PathSearch<'_> {
    /// Seen blocks away from the record's ends, where the output of a path is not known.
    fn away_from_ends(&self, away_s: f64) -> Vec<bool> {
        let rows = reached(&self.rows, away_s * self.rate_hz);
        reached(&rows, -away_s * self.rate_hz)
    }

    /// Regressions on the reference after a path and after another, on the same blocks.
    fn compared(&self, path: Path, other: Path) -> [Explained; 2] {
        let inner = self.away_from_ends(most_away_s(&path).max(most_away_s(&other)));
        [path, other].map(|path| {
            let behind = each_axis(|axis| {
                path.along(axis, &self.case[axis], self.rate_hz)
                    .into_owned()
            });
            Explained::by_rows(&self.sensed, &behind, &inner, self.plan)
        })
    }

    /// Common delay of the gyros, then a delay of one's own for each that it explains better by far.
    fn delays(&self) -> Path {
        let plan = self.plan;
        let most = (plan.longest_delay_s * self.rate_hz) as usize;
        let lags = Lags::new(&self.sensed, &self.case, &self.rows, most);
        let delayed = |delay_s: [f64; 3]| Path {
            delay_s,
            ..Path::default()
        };
        let late = lags.best(&[0, 1, 2], plan.tie);
        let late = late.map(|lag| delayed([lag / self.rate_hz; 3]));
        let late = late.filter(|late| {
            let [by, without] = self.compared(*late, Path::default());
            by.is_better_than(&without, plan)
        });
        let late = late.unwrap_or_default();
        // One gyro may have a delay of its own.
        let apart = [0, 1, 2].map(|gyro| {
            let own = lags.best(&[gyro], plan.tie);
            own.map_or(late.delay_s[gyro], |lag| lag / self.rate_hz)
        });
        let [by_apart, by_late] = self.compared(delayed(apart), late);
        delayed(
            [0, 1, 2].map(|gyro| match by_apart.halves_of(gyro, &by_late, plan) {
                true => apart[gyro],
                false => late.delay_s[gyro],
            }),
        )
    }

    /// Low pass of the largest gain in log-likelihood over delays; `None` if none is better.
    fn low_pass_beside(&self, late: Path) -> Option<LowPass> {
        let plan = self.plan;
        let spectra = |triad: &Triad| each_axis(|axis| Spectrum::new(&triad[axis], self.rate_hz));
        let (of_sensed, of_case) = (spectra(&self.sensed), spectra(&self.case));
        let gain = |low_pass: LowPass| -> Option<f64> {
            let settled_s = plan.settled_time_constants * low_pass.time_s;
            let inner = self.away_from_ends(most_away_s(&late) + settled_s);
            // A low pass also removes noise of the reference. After four more low passes on gyros and reference alike, it
            // removes an eighth of white noise and three eighths of white angle noise: less than half.
            let smooth = |hz: f64| low_pass.whole(hz).powi(4);
            let through = |of: &[Spectrum; 3], path: Path| {
                each_axis(|axis| of[axis].through(|hz| smooth(hz) * path.response(axis, hz)))
            };
            let sensed = through(&of_sensed, Path::default());
            let by =
                |path: Path| Explained::by_rows(&sensed, &through(&of_case, path), &inner, plan);
            let (filtered, late) = (by(of_low_pass(low_pass)), by(late));
            let is_better = filtered.log_likelihood > late.log_likelihood + plan.tie
                && filtered.halves(&by(Path::default()), plan);
            is_better.then_some(filtered.log_likelihood - late.log_likelihood)
        };
        // Octaves are too coarse a grid to distinguish a low pass from a delay.
        let finer = |one: LowPass| {
            [0.0, 0.25, 0.5, 0.75].map(|octaves: f64| LowPass {
                time_s: one.time_s * octaves.exp2(),
            })
        };
        grid(2.0 / self.rate_hz, plan.longest_low_pass_s, self.grids)
            .into_iter()
            .flat_map(finer)
            .filter_map(|low_pass| Some((low_pass, gain(low_pass)?)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(low_pass, _)| low_pass)
    }
}

/// Largest absolute delay of a path \[s\].
fn most_away_s(path: &Path) -> f64 {
    let each = path.delay_s.iter();
    each.fold(0.0, |most, delay_s| delay_s.abs().max(most))
}

fn of_low_pass(low_pass: LowPass) -> Path {
    Path {
        low_pass: [Some(low_pass); 3],
        ..Path::default()
    }
}

/// Residuals of a regression of each gyro on the reference.
struct Explained {
    /// Mean square residual of each gyro.
    left: [f64; 3],
    /// Sums of squared residuals in each block of rows, by gyro.
    by_block: Vec<[f64; 3]>,
    /// Log-likelihood of white noise, up to a constant.
    log_likelihood: f64,
}

impl Explained {
    fn by_rows(sensed: &Triad, behind: &Triad, rows: &[bool], plan: &CoarsePlan) -> Self {
        let regressions: [Regression; 3] =
            std::array::from_fn(|gyro| Regression::new(&sensed[gyro], behind, rows));
        let count = rows.iter().filter(|&&row| row).count();
        let used: Vec<usize> = (0..rows.len()).filter(|&row| rows[row]).collect();
        let sum = |rows: &[usize], gyro: usize| {
            let left = |row: &usize| regressions[gyro].left_of(sensed[gyro][*row], behind, *row);
            rows.iter().map(|row| left(row).powi(2)).sum::<f64>()
        };
        let blocks = used.chunks(used.len().div_ceil(plan.blocks).max(1));
        Self {
            left: std::array::from_fn(|gyro| regressions[gyro].left),
            by_block: blocks
                .map(|rows| std::array::from_fn(|gyro| sum(rows, gyro)))
                .collect(),
            log_likelihood: log_likelihood(regressions.into_iter(), count as f64),
        }
    }

    /// True if its residual power on any gyro is less than half of another's.
    fn halves(&self, other: &Self, plan: &CoarsePlan) -> bool {
        (0..3).any(|gyro| self.halves_of(gyro, other, plan))
    }

    /// True if its residual power on one gyro is less than half of another's.
    fn halves_of(&self, gyro: usize, other: &Self, plan: &CoarsePlan) -> bool {
        self.left[gyro] < (1.0 - plan.explained) * other.left[gyro]
    }

    /// True if it halves another's residual power, or lowers it consistently over the blocks (t-test), whatever the noise's
    /// colour.
    fn is_better_than(&self, other: &Self, plan: &CoarsePlan) -> bool {
        let gains: Vec<f64> = self
            .by_block
            .iter()
            .zip(&other.by_block)
            .map(|(own, other)| {
                let of_gyro = |gyro: usize| {
                    (other[gyro] - own[gyro]) / self.left[gyro].max(f64::MIN_POSITIVE)
                };
                (0..3).map(of_gyro).sum()
            })
            .collect();
        let count = gains.len() as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let squares = gains.iter().map(|gain| (gain - mean).powi(2)).sum::<f64>();
        let std_of_mean = (squares / (count * (count - 1.0).max(1.0))).sqrt();
        self.halves(other, plan) || mean > plan.far_deviations * std_of_mean
    }
}
