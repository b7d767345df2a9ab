//! Low passes and high passes of single gyros, by score tests on a grid of time constants.

use nalgebra::{DMatrix, DVector};
use rlg_catalogue::families::ExactFilter;
use rlg_catalogue::high_pass::{self, HighPass};
use rlg_catalogue::low_pass::{self, LowPass};
use rlg_catalogue::{Candidate, Pool, Signals};
use rlg_inference::score_test::ScoreTest;
use rlg_plan::OddsPlan;
use rlg_signal::streams::each_axis;

use super::scores::{Found, follow, most_at, size_price};

/// Selects the low pass on each gyro with the largest gain at its full response, of time constants up to `longest_s`.
pub(crate) fn low_pass(
    tests: &[ScoreTest],
    signals: &Signals,
    is_moving: [bool; 3],
    longest_s: f64,
) -> Option<Found> {
    let grid = low_pass::grid(signals.period_s(), longest_s, &signals.plan.grids);
    let grid: Vec<f64> = grid.iter().map(|one| one.time_s).collect();
    let exact = |gyro: usize, time_s: f64| ExactFilter::low_pass(gyro, time_s, signals);
    let found = Filters::new(tests, &grid, is_moving, exact, &signals.plan.odds)?;
    let best = found.time_s.map(|one| one.map(|time_s| LowPass { time_s }));
    let mut pool = Pool::default();
    let candidate = pool.low_pass(best, found.price.exp(), signals);
    Some(found.of(candidate, pool))
}

/// Selects the high pass on each gyro with the largest gain at its full response.
pub(crate) fn high_pass(
    tests: &[ScoreTest],
    signals: &Signals,
    is_moving: [bool; 3],
) -> Option<Found> {
    let grid = high_pass::grid(signals.period_s(), signals.rows, &signals.plan.grids);
    let grid: Vec<f64> = grid.iter().map(|one| one.time_s).collect();
    let exact = |gyro: usize, time_s: f64| ExactFilter::high_pass(gyro, time_s, signals);
    let found = Filters::new(tests, &grid, is_moving, exact, &signals.plan.odds)?;
    let best = found
        .time_s
        .map(|one| one.map(|time_s| HighPass { time_s }));
    let mut pool = Pool::default();
    let candidate = pool.high_pass(best, found.price.exp(), signals);
    Some(found.of(candidate, pool))
}

/// Filters on some gyros.
struct Filters {
    /// Time constant of each \[s\].
    time_s: [Option<f64>; 3],
    /// Gain in log-likelihood beyond the price of their sizes.
    gain: f64,
    /// Price of their sizes and of the grid.
    price: f64,
}

impl Filters {
    /// Selects the time constant of a filter on each gyro with the largest gain at its full response, from a grid.
    fn new<'a>(
        tests: &[ScoreTest],
        grid: &[f64],
        is_moving: [bool; 3],
        exact: impl Fn(usize, f64) -> ExactFilter<'a> + Sync,
        odds: &OddsPlan,
    ) -> Option<Self> {
        let places = (grid.len() as f64).ln();
        let on = |gyro: usize| -> Option<(f64, f64)> {
            if !is_moving[gyro] {
                return None;
            }
            let full = DVector::from_vec(vec![1.0, 0.0]);
            let both = DMatrix::identity(2, 2);
            let of = |time_s: f64| {
                let columns = exact(gyro, time_s);
                most_at(tests, &columns.hypothesis(), &columns, &both, &full)
            };
            let (one, response) = (DVector::from_element(1, 1.0), DMatrix::identity(1, 1));
            let gain = |time_s: f64| {
                let columns = exact(gyro, time_s);
                let found = most_at(tests, &columns.of_response(), &columns, &response, &one);
                found.map_or(f64::NEG_INFINITY, |(gain, _)| gain)
            };
            let begin = grid
                .iter()
                .map(|time_s| (*time_s, gain(*time_s)))
                .max_by(|a, b| a.1.total_cmp(&b.1))?;
            // Even with free size and time constant the gain is below the price of the grid.
            let (_, about) = of(begin.0)?;
            if about.gain().log_likelihood < places {
                return None;
            }
            Some(follow(begin.0, of, |time_s, step| {
                (time_s + step[0]).clamp(0.6 * time_s, 1.7 * time_s)
            }))
        };
        let mut of_all = Self {
            time_s: [None; 3],
            gain: 0.0,
            price: places,
        };
        for (gyro, found) in each_axis(on).into_iter().enumerate() {
            let Some((time_s, gain)) = found else {
                continue;
            };
            // Its columns are linearised about its estimate, so its size is priced here.
            let of_size = size_price(2.0 * gain);
            if gain > places + of_size {
                of_all.time_s[gyro] = Some(time_s);
                of_all.gain += gain - of_size;
                of_all.price += of_size;
            }
        }
        of_all.price += match of_all.time_s.iter().flatten().count() {
            0 => return None,
            3 => odds.shared.ln(),
            _ => odds.one_axis.ln(),
        };
        Some(of_all)
    }

    fn of(self, candidate: Candidate, pool: Pool) -> Found {
        Found {
            surplus: self.gain - candidate.hypothesis.price,
            candidate,
            columns: pool.columns,
        }
    }
}
