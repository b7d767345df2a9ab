//! Rows lost by a recorder without a trace: a file without stamps has no gap, but one side leads the other from there on.
//!
//! Enter: increments of gyros and reference on the same rows \[rad\]. Leaves: the first [`LostRows`], if any.
//!
//! # Measure
//! In short stretches, the residual variance of the gyros after the least-squares real 3 × 3 map of the reference, at every
//! lag, by cumulative sums of products for all lags at once. The lag of a stretch is determined where the lags of less than
//! twice the least residual variance are contiguous: periodic motion, slow motion and noise determine none. The change point
//! of the lag is accepted where the lags of the stretches before agree, as do those after, and both differ by more than
//! their uncertainties. A drifting clock has no change point.

use rlg_plan::LostRowsPlan;
use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use crate::axes::Triad;
use crate::lag_scan::{Sums, left_by_lag};

/// Side with the lost rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loser {
    /// The gyros'.
    Gyros,
    /// The reference's.
    Reference,
}

/// Rows lost in one place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LostRows {
    /// Side with the lost rows.
    pub of: Loser,
    /// First row of that side after the loss.
    pub before_row: usize,
    /// Number of lost rows.
    pub rows: usize,
}

/// A stretch of determined lag.
struct Stretch {
    rows: Range<usize>,
    /// Delay of the gyros behind the reference \[rows\].
    lag: i64,
    /// Half-width of the interval of the lag \[rows\].
    within: i64,
}

/// Both sides on the same rows; zero where unmeasured.
struct Sides {
    gyros: Vec<Vector3<f64>>,
    reference: Vec<Vector3<f64>>,
}

/// Finds the first lost rows.
pub fn find(
    gyros_rad: &Triad,
    reference_rad: &Triad,
    seen: &[bool],
    rate_hz: f64,
    plan: &LostRowsPlan,
) -> Option<LostRows> {
    let full = Sides::new(gyros_rad, reference_rad, seen);
    let block = seen.len().div_ceil(plan.most_rows).max(1);
    let coarse = full.averaged(block);
    let stretches = coarse.stretches(rate_hz / block as f64, plan);
    let sides = plan.agreeing;
    let last = (stretches.len() + 1).checked_sub(2 * sides)?;
    // The stretch of the loss itself has no clear lag and may be skipped.
    let places = (0..last).flat_map(|first| [(first, 0), (first, 1)]);
    places
        .filter_map(|(first, between)| {
            let before = stretches.get(first..first + sides)?;
            let after = first + sides + between;
            Some([before, stretches.get(after..after + sides)?])
        })
        .filter(|both| may_differ(*both, plan))
        .find_map(|both| full.lost_between(both, block, plan))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// True if the lags of either side agree, and both sides differ by more than their uncertainties.
fn may_differ(both: [&[Stretch]; 2], plan: &LostRowsPlan) -> bool {
    let lags = both.map(|side| {
        let mut lags: Vec<i64> = side.iter().map(|one| one.lag).collect();
        lags.sort_unstable();
        lags[lags.len() / 2]
    });
    let apart = (lags[1] - lags[0]).abs();
    let agrees = |(side, lag): (&[Stretch], i64)| {
        side.iter().all(|one| {
            one.within < apart && (one.lag - lag).abs() as f64 <= plan.spread * apart as f64
        })
    };
    apart > 0 && both.into_iter().zip(lags).all(agrees)
}

impl Sides {
    fn new(gyros_rad: &Triad, reference_rad: &Triad, seen: &[bool]) -> Self {
        let rows = |of: &Triad| {
            let each = seen.iter().enumerate();
            each.map(|(row, seen)| match seen {
                true => Vector3::from_fn(|axis, _| of[axis][row]),
                false => Vector3::zeros(),
            })
            .collect()
        };
        Self {
            gyros: rows(gyros_rad),
            reference: rows(reference_rad),
        }
    }

    fn averaged(&self, block: usize) -> Self {
        let sums = |of: &[Vector3<f64>]| {
            let blocks = of.chunks_exact(block);
            blocks.map(|rows| rows.iter().sum()).collect()
        };
        Self {
            gyros: sums(&self.gyros),
            reference: sums(&self.reference),
        }
    }

    fn stretches(&self, rate_hz: f64, plan: &LostRowsPlan) -> Vec<Stretch> {
        /// Rounding error of a residual variance from cumulative sums, as a share of the variance.
        const ROUNDING: f64 = 1e-9;
        let rows = self.gyros.len();
        let [least, most] = plan.stretches;
        let count = (rows as f64 / rate_hz / plan.stretch_s) as usize;
        let long = rows / count.clamp(least, most);
        let reach = ((plan.reach_s * rate_hz) as usize).min(long);
        if long < plan.least_rows {
            return Vec::new();
        }
        let sums = Sums::of(&self.reference);
        (0..rows / long)
            .filter_map(|place| {
                let rows = place * long..(place + 1) * long;
                let left = left_by_lag(&self.gyros, rows.clone(), &sums, reach)?;
                let best = (0..left.len()).min_by(|a, b| left[*a].total_cmp(&left[*b]))?;
                // For a motion without noise the residual variance is rounding, or negative.
                let least = left[best].max(ROUNDING);
                let is_as_good = |at: &usize| left[*at] <= plan.other * least;
                let alike: Vec<usize> = (0..left.len()).filter(is_as_good).collect();
                let (from, to) = (alike[0], alike[alike.len() - 1]);
                let is_one = to - from + 1 == alike.len() && from > 0 && to + 1 < left.len();
                (is_one && left[best] < plan.most_left).then(|| Stretch {
                    rows,
                    lag: best as i64 - reach as i64,
                    within: (to - from) as i64 / 2,
                })
            })
            .collect()
    }

    /// Estimates the rows lost between stretches before and after, if each side has one lag.
    ///
    /// # Inputs
    /// `block`: full-rate rows per row of the stretches.
    fn lost_between(
        &self,
        sides: [&[Stretch]; 2],
        block: usize,
        plan: &LostRowsPlan,
    ) -> Option<LostRows> {
        let of_rows = |one: &Stretch| one.rows.start * block..one.rows.end * block;
        let rows = sides.map(|side| side.iter().map(of_rows).collect::<Vec<_>>());
        let fine = |side: &[Stretch]| -> Option<Vec<f64>> {
            let each = side.iter().map(|one| {
                let near = one.lag * block as i64;
                self.fine_lag(&[of_rows(one)], near, block as i64 + 1)
            });
            each.collect()
        };
        let lags = [fine(sides[0])?, fine(sides[1])?];
        let [lag, later_lag] = lags.each_ref().map(|lags| mean(lags));
        let lost = later_lag - lag;
        // A drifting clock changes the lag within the stretches of either side.
        let agrees = |lags: &Vec<f64>| {
            let about = mean(lags);
            let mut each = lags.iter();
            each.all(|one| (one - about).abs() <= 0.5 * plan.spread * lost.abs())
        };
        let rows_lost = lost.round() as i64;
        if rows_lost == 0 || !lags.iter().all(agrees) {
            return None;
        }
        let lag = lag.round() as i64;
        let later_lag = lag + rows_lost;
        let maps = (self.map(&rows[0], lag)?, self.map(&rows[1], later_lag)?);
        let span = rows[0][plan.agreeing - 1].start..rows[1][0].end;
        let (of, before_row) = self.place(span, (lag, later_lag), maps)?;
        Some(LostRows {
            of,
            before_row,
            rows: rows_lost.unsigned_abs() as usize,
        })
    }

    /// Pairs of gyro and reference rows at a lag.
    fn pairs<'a>(
        &'a self,
        rows: &'a [Range<usize>],
        lag: i64,
    ) -> impl Iterator<Item = (&'a Vector3<f64>, &'a Vector3<f64>)> {
        rows.iter()
            .cloned()
            .flatten()
            .filter_map(move |row| Some((&self.gyros[row], self.beside(row, lag)?)))
    }

    fn beside(&self, row: usize, lag: i64) -> Option<&Vector3<f64>> {
        let row = usize::try_from(row as i64 - lag).ok()?;
        self.reference.get(row)
    }

    /// Least-squares map of the reference at a lag, with the mean residual square of the gyros \[rad²\].
    fn fitted(&self, rows: &[Range<usize>], lag: i64) -> Option<(Map, f64)> {
        let (mut count, mut gyro_mean, mut mean) = (0.0, Vector3::zeros(), Vector3::zeros());
        for (gyro, reference) in self.pairs(rows, lag) {
            count += 1.0;
            gyro_mean += gyro;
            mean += reference;
        }
        (gyro_mean, mean) = (gyro_mean / count, mean / count);
        let (mut across, mut own, mut whole) = (Matrix3::zeros(), Matrix3::zeros(), 0.0);
        for (gyro, reference) in self.pairs(rows, lag) {
            let (gyro, reference) = (gyro - gyro_mean, reference - mean);
            across += gyro * reference.transpose();
            own += reference * reference.transpose();
            whole += gyro.norm_squared();
        }
        let ridge = Matrix3::identity() * (1e-9 * own.trace());
        let gyros_from_reference = across * (own + ridge).try_inverse()?;
        let left = whole - (gyros_from_reference * across.transpose()).trace();
        let map = Map {
            gyros_from_reference,
            offset_rad: gyro_mean - gyros_from_reference * mean,
        };
        Some((map, left / count))
    }

    fn map(&self, rows: &[Range<usize>], lag: i64) -> Option<Map> {
        self.fitted(rows, lag).map(|(map, _)| map)
    }

    /// Lag of the least residual, interpolated between rows by a parabola.
    fn fine_lag(&self, rows: &[Range<usize>], near: i64, reach: i64) -> Option<f64> {
        let left = |lag: i64| self.fitted(rows, lag).map(|(_, left)| left);
        let tried: Option<Vec<(i64, f64)>> = (near - reach..=near + reach)
            .map(|lag| Some((lag, left(lag)?)))
            .collect();
        let (lag, least) = tried?.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        let [before, after] = [left(lag - 1)?, left(lag + 1)?];
        let bent = before - 2.0 * least + after;
        Some(lag as f64 + 0.5 * (before - after) / bent.max(f64::MIN_POSITIVE))
    }

    /// Side and first row after the loss: the change point between two lags of the least sum of squared residuals.
    fn place(
        &self,
        span: Range<usize>,
        (lag, later_lag): (i64, i64),
        (map, later_map): (Map, Map),
    ) -> Option<(Loser, usize)> {
        let misfit = |row: usize, lag: i64, map: &Map| {
            let reference = self.beside(row, lag);
            reference.map_or(0.0, |reference| {
                let expected = map.gyros_from_reference * reference + map.offset_rad;
                (self.gyros[row] - expected).norm_squared()
            })
        };
        let cumulated = |lag: i64, map: &Map| {
            let mut sums = vec![0.0];
            for row in span.clone() {
                sums.push(sums[sums.len() - 1] + misfit(row, lag, map));
            }
            sums
        };
        let (earlier, later) = (cumulated(lag, &map), cumulated(later_lag, &later_map));
        let last = span.len();
        // Gyro rows without a reference row, if the reference lost some.
        let hidden = usize::try_from(later_lag - lag).unwrap_or(0);
        let left = |at: &usize| earlier[*at] + later[last] - later[at + hidden];
        let places = 0..=last.checked_sub(hidden)?;
        let at = places.min_by(|a, b| left(a).total_cmp(&left(b)))?;
        let row = span.start + at;
        Some(match later_lag < lag {
            true => (Loser::Gyros, row),
            false => (
                Loser::Reference,
                usize::try_from(row as i64 - lag).unwrap_or(0),
            ),
        })
    }
}

/// Affine map from the reference to the gyros.
struct Map {
    gyros_from_reference: Matrix3<f64>,
    offset_rad: Vector3<f64>,
}

#[cfg(test)]
mod tests {
    use super::{Loser, LostRows, find};
    use crate::axes::Triad;
    use crate::test_noise::noise;
    use rlg_plan::LostRowsPlan;

    const RATE_HZ: f64 = 100.0;

    /// A motion low-passed at `cut_hz` (second order), and samples of gyros rotated against it \[rad\].
    fn record(rows: usize, cut_hz: f64, seed: u64) -> (Triad, Triad) {
        let mut noise = noise(seed);
        let kept = (-std::f64::consts::TAU * cut_hz / RATE_HZ).exp();
        let mut reference = Triad::default();
        for axis in &mut reference {
            let (mut first, mut second) = (0.0, 0.0);
            for _ in 0..rows {
                first = kept * first + (1.0 - kept) * noise();
                second = kept * second + (1.0 - kept) * first;
                axis.push(second * 1e-2);
            }
        }
        let mut gyros = Triad::default();
        for (axis, gyro) in gyros.iter_mut().enumerate() {
            let pairs = reference[axis].iter().zip(&reference[(axis + 1) % 3]);
            gyro.extend(pairs.map(|(own, across)| own + 0.2 * across + 1e-5 * noise() + 1e-4));
        }
        (gyros, reference)
    }

    fn without(of: &Triad, from: usize, rows: usize) -> Triad {
        of.each_ref().map(|axis| {
            let kept = (0..axis.len()).filter(|row| !(from..from + rows).contains(row));
            kept.map(|row| axis[row]).collect()
        })
    }

    fn found(gyros: &Triad, reference: &Triad) -> Option<LostRows> {
        let rows = gyros[0].len().min(reference[0].len());
        let cut = |of: &Triad| of.each_ref().map(|axis| axis[..rows].to_vec());
        let plan = LostRowsPlan::default();
        find(
            &cut(gyros),
            &cut(reference),
            &vec![true; rows],
            RATE_HZ,
            &plan,
        )
    }

    #[test]
    fn lost_rows_are_found_with_their_place_and_number() {
        for (seed, from, rows) in [(1, 1500, 50), (2, 900, 3), (3, 1700, 130), (4, 777, 9)] {
            let (gyros, reference) = record(3000, 1.0, seed);
            let lost = found(&without(&gyros, from, rows), &reference).expect("rows are lost");
            assert_eq!((lost.of, lost.rows), (Loser::Gyros, rows));
            assert!(lost.before_row.abs_diff(from) <= 2, "{lost:?} {from}");
            let lost = found(&gyros, &without(&reference, from, rows)).expect("rows are lost");
            assert_eq!((lost.of, lost.rows), (Loser::Reference, rows));
            assert!(lost.before_row.abs_diff(from) <= 2, "{lost:?} {from}");
        }
    }

    #[test]
    fn whole_records_and_clocks_that_drift_lose_nothing() {
        for seed in 10..13 {
            let (gyros, reference) = record(6000, 1.0, seed);
            assert_eq!(found(&gyros, &reference), None);
            // Drift from a row to twelve by the end.
            for share in [1.7e-4, 5e-4, 1e-3, 2e-3] {
                let slow = reference.each_ref().map(|axis| {
                    let at = |row: usize| {
                        let place = row as f64 * (1.0 - share);
                        let (before, part) = (place as usize, place.fract());
                        let after = axis[(before + 1).min(axis.len() - 1)];
                        axis[before] + part * (after - axis[before])
                    };
                    (0..axis.len()).map(at).collect::<Vec<f64>>()
                });
                assert_eq!(found(&gyros, &slow), None, "{share}");
            }
        }
    }

    #[test]
    fn a_tone_tells_no_lag() {
        let rows = 3000;
        let tone = |phase: f64| -> Vec<f64> {
            (0..rows)
                .map(|row| 1e-3 * (0.3 * f64::from(row) + phase).sin())
                .collect()
        };
        let reference: Triad = [tone(0.0), tone(1.0), tone(2.0)];
        let lost = without(&reference, 1500, 40);
        assert_eq!(found(&lost, &reference), None);
    }
}
