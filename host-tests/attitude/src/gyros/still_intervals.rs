//! Rest of the case between turns: gyro rates at rest are the gyros' own errors.
//!
//! A constant rate alone is no rest, as a table turns constantly too; a mean rate that recurs after other motion is.

use std::ops::Range;

use nalgebra::Vector3;
use rlg_signal::still::ROTATION_RAD_S;

use crate::rows::linearised_rows::Gyros;

/// Rows with the case at rest.
pub(crate) struct Rest {
    /// Ranges of rows.
    pub(crate) stretches: Vec<Range<usize>>,
    /// Total duration \[s\].
    pub(crate) lasts_s: f64,
}

/// A stretch of constant mean rate.
struct Steady {
    rows: Range<usize>,
    mean_rad: Vector3<f64>,
    /// Variance of one row and axis \[rad²\].
    variance: f64,
}

impl Steady {
    fn new(gyros: &Gyros, rows: Range<usize>) -> Self {
        let own = &gyros.sensed_rad[rows.clone()];
        let mean_rad = own.iter().sum::<Vector3<f64>>() / own.len() as f64;
        let squares = own.iter().map(|row| (row - mean_rad).norm_squared());
        Self {
            variance: squares.sum::<f64>() / (3 * own.len()) as f64,
            mean_rad,
            rows,
        }
    }

    fn between_neighbours(&self, gyros: &Gyros) -> f64 {
        let pairs = gyros.sensed_rad[self.rows.clone()].windows(2);
        let squares = pairs.map(|pair| (pair[1] - pair[0]).norm_squared());
        squares.sum::<f64>() / (6 * (self.rows.len() - 1)) as f64
    }

    fn agrees(&self, other: &Self, (rate_hz, tolerance): (f64, f64)) -> bool {
        let of_mean = |one: &Self| one.variance / one.rows.len() as f64;
        let earth = (ROTATION_RAD_S / rate_hz).powi(2);
        let variance = of_mean(self) + of_mean(other) + earth;
        (self.mean_rad - other.mean_rad).norm_squared() < 3.0 * tolerance * tolerance * variance
    }
}

/// Finds the stretches of the mean rate that recurs for longest; `None` if none recurs.
pub(crate) fn find(gyros: &Gyros) -> Option<Rest> {
    let plan = &gyros.plan.rest;
    let length = ((plan.window_s * gyros.rate_hz) as usize).max(plan.least_rows);
    let windows: Vec<Steady> = (0..gyros.sensed_rad.len() / length)
        .map(|window| Steady::new(gyros, window * length..(window + 1) * length))
        .collect();
    let mut variances: Vec<f64> = windows.iter().map(|window| window.variance).collect();
    if variances.is_empty() {
        return None;
    }
    let tenth = variances.len() / 10;
    let quietest = *variances.select_nth_unstable_by(tenth, f64::total_cmp).1;
    let is_steady = |window: &Steady| {
        window.variance <= plan.quiet * quietest
            && window.variance <= plan.white * window.between_neighbours(gyros)
    };
    let within = (gyros.rate_hz, plan.agree);
    let mut steady: Vec<Steady> = Vec::new();
    for window in windows.into_iter().filter(is_steady) {
        match steady.last_mut() {
            Some(last) if last.rows.end == window.rows.start && last.agrees(&window, within) => {
                *last = Steady::new(gyros, last.rows.start..window.rows.end);
            }
            _ => steady.push(window),
        }
    }
    let returning = steady.iter().map(|one| {
        let alike = steady.iter().filter(|other| one.agrees(other, within));
        alike.map(|other| other.rows.clone()).collect::<Vec<_>>()
    });
    // Adjacent stretches are a drift, not a recurrence.
    let returns =
        |rows: &Vec<Range<usize>>| rows.windows(2).any(|pair| pair[0].end < pair[1].start);
    let count = |rows: &Vec<Range<usize>>| rows.iter().map(Range::len).sum::<usize>();
    let stretches = returning.filter(returns).max_by_key(count)?;
    Some(Rest {
        lasts_s: count(&stretches) as f64 / gyros.rate_hz,
        stretches,
    })
}

impl Rest {
    /// Mean over the rows at rest.
    pub(crate) fn mean(&self, of_row: impl Fn(usize) -> Vector3<f64>) -> Vector3<f64> {
        let rows = self.stretches.iter().cloned().flatten();
        let (sum, count) = rows.fold((Vector3::zeros(), 0.0), |(sum, count), row| {
            (sum + of_row(row), count + 1.0)
        });
        sum / count
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::gyro_motion::Reads;

    fn gyros(rate: impl Fn(usize) -> f64) -> Gyros {
        let mut state = 7_u64;
        let mut noise = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) as f64 / f64::from(1 << 31) - 0.5
        };
        let sensed_rad: Vec<Vector3<f64>> = (0..1000)
            .map(|row| {
                Vector3::new(rate(row) / 100.0, 1e-4, -1e-4).map(|value| value + 1e-5 * noise())
            })
            .collect();
        Gyros {
            start_s: 0.0,
            rate_hz: 100.0,
            white_noise_rad2: [0.0; 3],
            lost_before: vec![0; sensed_rad.len() + 1],
            dither: None,
            reads: Reads::Attitudes,
            plan: Default::default(),
            declared_walk_rad_sqrt_s: None,
            sensed_rad,
        }
    }

    #[test]
    fn a_reading_that_returns_is_rest_and_a_steady_turn_is_not() {
        let turn = |row: usize| if (300..600).contains(&row) { 1.0 } else { 0.01 };
        let rest = find(&gyros(turn)).expect("rests before and after");
        let rows: usize = rest.stretches.iter().map(Range::len).sum();
        assert!((600..=700).contains(&rows), "{rows} rows");
        let reading = rest.mean(|row| Vector3::new(turn(row), 0.0, 0.0));
        assert!((reading.x - 0.01).abs() < 1e-12, "{reading}");
        assert!(
            find(&gyros(|_| 0.5)).is_none(),
            "a table that turns steadily"
        );
        let ramp = |row: usize| if row < 500 { 0.5 } else { 0.8 };
        assert!(find(&gyros(ramp)).is_none(), "two speeds of a table");
    }
}
