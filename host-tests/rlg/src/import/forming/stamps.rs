//! Forms the clock of a table from a column of stamps, or from a rate.
//!
//! A stamp is the end of its row's period. Stamps that are even within their own rounding are a rate, with rows missing at
//! skips. Sums and means need even rows; attitudes may keep stamps of their own.

use std::path::Path;

use super::resample::Resampling;
use crate::error::InputError;

/// Largest error of a stamp beyond its rounding \[rows\].
const OFF_ROWS: f64 = 0.01;

/// Largest rms of stamps about an even clock that is their own jitter \[rows\]: 0.3 ms at 160 Hz. Taken as even, such rows
/// are in error by less than the resampling of uneven ones is; and most units sample by a crystal.
const JITTER_RMS_ROWS: f64 = 0.05;

/// Largest single offset of such stamps \[rows\].
const JITTER_ROWS: f64 = 0.25;

/// Offset below which it is f64 rounding \[rows\].
const EXACT_ROWS: f64 = 1e-6;

/// Longest step that counts as one row \[usual steps\].
const ONE_ROW: f64 = 1.5;

/// Shortest step that counts as a row \[usual steps\]: below it, stamps are times of arrival, not of sampling.
const SHORT_ROW: f64 = 0.5;

/// Rows within which short steps compensate a long one, the long one included.
const LOOK_AHEAD_ROWS: usize = 5;

/// Smallest share of the grid's rows that must be present.
const FEWEST: f64 = 0.5;

/// Largest drift of stamps from a rate stated by the caller \[rows\].
const RUNAWAY_ROWS: f64 = 1.0;

/// Additional drift allowed, as a share of all rows: oscillators are within 1e-2.
const RUNAWAY_SHARE: f64 = 0.02;

/// Sampling times of a table's rows.
#[derive(Debug, Clone, PartialEq)]
pub enum Times {
    /// Even rows; row `places[k]` of the table is row k of the file, and rows in between are missing.
    Even {
        /// Rows a second \[Hz\].
        rate_hz: f64,
        /// Beginning of row 0 \[s\].
        start_s: f64,
        /// Row of the table for each row of the file.
        places: Vec<usize>,
        /// Jitter of the stamps about the even clock beyond their rounding, rms \[s\].
        jitter_s: Option<f64>,
    },
    /// Even rows resampled from uneven ones.
    Resampled {
        /// The uneven rows and the even clock.
        resampling: Resampling,
        /// Unevenness of the rows, as a clause.
        note: String,
    },
    /// A time for each row \[s\].
    Stamped(Vec<f64>),
}

/// A column of stamps in seconds.
pub struct Stamps<'a> {
    /// The file.
    pub file: &'a Path,
    /// The column's name.
    pub name: &'a str,
    /// The stamps \[s\].
    pub stamps_s: Vec<f64>,
    /// Seconds in one unit of the column.
    pub unit_s: f64,
}

/// Returns rows at a rate without stamps.
pub fn at_rate(rate_hz: f64, rows: usize) -> Times {
    Times::Even {
        rate_hz,
        start_s: 0.0,
        places: (0..rows).collect(),
        jitter_s: None,
    }
}

impl Stamps<'_> {
    /// Returns the clock of these stamps. With `needs_even` uneven ones are refused or resampled; `anyway` resamples also
    /// those that are closer than the rows' period.
    pub fn clock(&self, needs_even: bool, anyway: bool) -> Result<Times, InputError> {
        self.check()?;
        let stamps_s = &self.stamps_s;
        let (first_s, last_s) = (stamps_s[0], stamps_s[stamps_s.len() - 1]);
        let places = self.places();
        let last_place = places[places.len() - 1] as f64;
        let measured_hz = last_place / (last_s - first_s);
        let usual_s = 1.0 / measured_hz;
        let tolerance = OFF_ROWS + 0.75 * self.resolution_s() / usual_s;
        let near_whole = (measured_hz - measured_hz.round()).abs() * (last_s - first_s) < tolerance;
        let rate_hz = if near_whole {
            measured_hz.round()
        } else {
            measured_hz
        };
        let off = |row: usize| (stamps_s[row] - first_s) * rate_hz - places[row] as f64;
        let (least, greatest) = (0..places.len())
            .map(off)
            .fold((0.0_f64, 0.0_f64), |(least, greatest), off| {
                (least.min(off), greatest.max(off))
            });
        // The first stamp is rounded as all others are.
        let middle = (least + greatest) / 2.0;
        let middle = if middle.abs() < EXACT_ROWS {
            0.0
        } else {
            middle
        };
        if greatest - middle <= tolerance && stamps_s.len() as f64 > FEWEST * (last_place + 1.0) {
            return Ok(Times::Even {
                rate_hz,
                start_s: first_s + (middle - 1.0) / rate_hz,
                places,
                jitter_s: None,
            });
        }
        if !needs_even {
            return Ok(Times::Stamped(stamps_s.clone()));
        }
        if stamps_s.len() as f64 > FEWEST * (last_place + 1.0)
            && let Some(jitter) = Jitter::of(stamps_s, &places)
        {
            return Ok(Times::Even {
                rate_hz: jitter.rate_hz,
                start_s: jitter.first_s - 1.0 / jitter.rate_hz,
                places,
                jitter_s: Some(jitter.rms_s),
            });
        }
        let mut offs: Vec<f64> = (0..places.len()).map(off).collect();
        offs.sort_by(f64::total_cmp);
        let away = |row: &usize| (off(*row) - offs[offs.len() / 2]).abs();
        let worst = (0..places.len())
            .max_by(|a, b| away(a).total_cmp(&away(b)))
            .unwrap_or(0);
        let found = format!(
            "{} s, {:.2} rows from an even clock of {rate_hz:.6} Hz",
            stamps_s[worst],
            away(&worst)
        );
        let steps_s = stamps_s.windows(2).map(|pair| pair[1] - pair[0]);
        let is_sound = steps_s.clone().all(|step_s| step_s >= SHORT_ROW * usual_s);
        if stamps_s.len() as f64 <= FEWEST * (last_place + 1.0) {
            return Err(self.in_bursts(usual_s));
        }
        if !is_sound && !anyway {
            let fault = self.fault(
                worst,
                "is a stamp off an even clock, and increments need even rows",
            );
            let expected = format!(
                "stamps even to {tolerance:.2} rows, or steps of {SHORT_ROW} rows at least: shorter ones say when rows arrived \
                 and not when they were taken; --rate HZ where the unit samples evenly"
            );
            let error = fault.value(found).expected(expected);
            return Err(error.or_anyway("takes each row to end at its stamp"));
        }
        Ok(Times::Resampled {
            resampling: Resampling {
                stamps_s: stamps_s.clone(),
                usual_s,
                longest_s: ONE_ROW * usual_s,
                rate_hz: measured_hz,
                start_s: first_s - 1.0 / measured_hz,
                rows: places[places.len() - 1] + 1,
            },
            note: format!(
                "the stamps of {} are uneven (row {worst}: {found}): means and sums over rows were read off the even clock; \
                 --rate HZ if the unit samples evenly and only its stamps jitter",
                self.name
            ),
        })
    }

    /// Returns rows at the rate stated by the caller, placed by the stamps.
    pub fn at_rate(&self, rate_hz: f64) -> Result<Times, InputError> {
        self.check()?;
        let places = places(&self.stamps_s, 1.0 / rate_hz);
        if let Some(start_s) = self.start_of_bursts_s(rate_hz) {
            return Ok(Times::Even {
                rate_hz,
                start_s,
                places: (0..self.stamps_s.len()).collect(),
                jitter_s: None,
            });
        }
        for (row, (place, stamp)) in places.iter().zip(&self.stamps_s).enumerate() {
            let off = (stamp - self.stamps_s[0]) * rate_hz - *place as f64;
            if off.abs() > RUNAWAY_ROWS + RUNAWAY_SHARE * *place as f64 {
                return Err(self
                    .fault(row, "is a stamp that does not fit --rate")
                    .value(format!("{stamp} s, {off:.1} rows off"))
                    .expected(format!(
                        "about {} s, or another --rate: the stamps' usual step is {:.6} s",
                        self.stamps_s[0] + *place as f64 / rate_hz,
                        self.usual_step_s()
                    )));
            }
        }
        let all = places.last().map_or(0, |last| last + 1);
        if self.stamps_s.len() as f64 <= FEWEST * all as f64 {
            let problem = "has stamps that leave most rows out at --rate";
            return Err(InputError::new(self.file, problem)
                .channel(self.name)
                .value(format!("{} of {all} rows", self.stamps_s.len()))
                .expected(format!(
                    "another --rate: the stamps' usual step is {:.6} s",
                    self.usual_step_s()
                )));
        }
        Ok(Times::Even {
            rate_hz,
            start_s: self.stamps_s[0] - 1.0 / rate_hz,
            places,
            jitter_s: None,
        })
    }

    /// Estimates the beginning of row 0 of complete rows that arrive in bursts \[s\]; `None` if they arrive one by one, or
    /// not at this rate. A stamp is never earlier than its row: the one with the least delay determines the sampling times.
    fn start_of_bursts_s(&self, rate_hz: f64) -> Option<f64> {
        let rows = self.stamps_s.len();
        let steps_s = self.sorted_steps_s();
        let is_burst = steps_s[steps_s.len() / 2] * rate_hz < SHORT_ROW;
        let late_s = |row: usize| self.stamps_s[row] - (row + 1) as f64 / rate_hz;
        let soonest_s =
            |rows: std::ops::Range<usize>| rows.map(late_s).fold(f64::INFINITY, f64::min);
        let [early_s, later_s] = [soonest_s(0..rows.div_ceil(2)), soonest_s(rows / 2..rows)];
        let away_rows = (later_s - early_s).abs() * rate_hz;
        let is_rate = away_rows <= RUNAWAY_ROWS + RUNAWAY_SHARE * rows as f64;
        (is_burst && is_rate).then_some(early_s.min(later_s))
    }

    /// Makes the error of rows that follow each other much faster than on average.
    fn in_bursts(&self, usual_s: f64) -> InputError {
        let stamps_s = &self.stamps_s;
        let steps_s = stamps_s.windows(2).map(|pair| pair[1] - pair[0]);
        let (row, longest_s) = steps_s
            .enumerate()
            .max_by(|one, other| one.1.total_cmp(&other.1))
            .unwrap_or((0, 0.0));
        let rows = (stamps_s.len() - 1) as f64;
        let mean_hz = rows / (stamps_s[stamps_s.len() - 1] - stamps_s[0]);
        self.fault(row + 1, "comes in bursts, or with gaps for most of the time")
            .value(format!(
                "steps of {usual_s:.6} s, and one of {longest_s:.6} s before this row"
            ))
            .expected(format!(
                "a stamp for when each row was taken, or --rate HZ where the unit samples evenly ({mean_hz:.3} Hz on average)"
            ))
    }

    fn fault(&self, row: usize, problem: &str) -> InputError {
        InputError::new(self.file, problem)
            .channel(self.name)
            .row(row as u64)
    }

    /// Refuses stamps that are missing or do not increase.
    fn check(&self) -> Result<(), InputError> {
        let mut before_s = f64::NEG_INFINITY;
        for (row, stamp) in self.stamps_s.iter().enumerate() {
            if !stamp.is_finite() {
                return Err(self
                    .fault(row, "has no time")
                    .value(stamp)
                    .expected("a time in every row"));
            }
            if *stamp <= before_s {
                return Err(self
                    .fault(row, "is a time that does not go on")
                    .value(format!("{stamp} s"))
                    .expected(format!(
                        "a time after {before_s} s, or --rate HZ and --time none"
                    )));
            }
            before_s = *stamp;
        }
        match self.stamps_s.len() {
            0 | 1 => Err(InputError::new(self.file, "holds too few rows")
                .value(self.stamps_s.len())
                .expected("at least 2 rows")),
            _ => Ok(()),
        }
    }

    /// Returns the row of each stamp: consecutive if as many usual steps fill the time, whatever the jitter.
    fn places(&self) -> Vec<usize> {
        let stamps_s = &self.stamps_s;
        let rows = stamps_s.len();
        let middle_s = self.sorted_steps_s()[(rows - 1) / 2];
        let fill = (stamps_s[rows - 1] - stamps_s[0]) / middle_s;
        match (fill - (rows - 1) as f64).abs() < 0.5 {
            true => (0..rows).collect(),
            false => places(stamps_s, self.usual_step_s()),
        }
    }

    /// Returns the steps from stamp to stamp, the shortest first \[s\].
    fn sorted_steps_s(&self) -> Vec<f64> {
        let steps_s = self.stamps_s.windows(2).map(|pair| pair[1] - pair[0]);
        let mut steps_s: Vec<f64> = steps_s.collect();
        steps_s.sort_by(f64::total_cmp);
        steps_s
    }

    /// Computes the mean of the steps that span one row \[s\]: stamps of few digits have steps of several lengths.
    fn usual_step_s(&self) -> f64 {
        let steps_s = self.sorted_steps_s();
        let middle_s = steps_s[steps_s.len() / 2];
        let single = steps_s
            .partition_point(|step_s| *step_s < ONE_ROW * middle_s)
            .max(1);
        steps_s[..single].iter().sum::<f64>() / single as f64
    }

    /// Returns the resolution of the stamps, their last written digit \[s\].
    fn resolution_s(&self) -> f64 {
        let mut quantum = 1.0;
        let first_s = self.stamps_s[0];
        // f64 resolution of a stamp: since 1970 in seconds that is 2e-7 s.
        let held_s = 4.0
            * f64::EPSILON
            * first_s
                .abs()
                .max(self.stamps_s[self.stamps_s.len() - 1].abs());
        for _ in 0..12 {
            let is_whole = |stamp_s: &f64| {
                let quanta = (stamp_s - first_s) / self.unit_s / quantum;
                let held = held_s / self.unit_s / quantum;
                (quanta - quanta.round()).abs() <= 1e-9 * quanta.abs().max(1.0) + held
            };
            if self.stamps_s.iter().all(is_whole) {
                break;
            }
            quantum /= 10.0;
        }
        quantum * self.unit_s
    }
}

/// Even clock about which stamps jitter.
struct Jitter {
    /// Rows a second \[Hz\].
    rate_hz: f64,
    /// End of row 0 \[s\].
    first_s: f64,
    /// Rms of the stamps about it \[s\].
    rms_s: f64,
}

impl Jitter {
    /// Fits a line through the stamps over their rows; `None` if they jitter by more than stamps alone.
    fn of(stamps_s: &[f64], places: &[usize]) -> Option<Self> {
        let count = stamps_s.len() as f64;
        let from_s = stamps_s[0];
        let pairs = || {
            let rows = places.iter().map(|place| *place as f64);
            rows.zip(stamps_s.iter().map(|stamp_s| stamp_s - from_s))
        };
        let mean_row = pairs().map(|(row, _)| row).sum::<f64>() / count;
        let mean_s = pairs().map(|(_, stamp_s)| stamp_s).sum::<f64>() / count;
        let squares = pairs()
            .map(|(row, _)| (row - mean_row).powi(2))
            .sum::<f64>();
        let products = pairs().map(|(row, stamp_s)| (row - mean_row) * (stamp_s - mean_s));
        let period_s = products.sum::<f64>() / squares;
        let off = || pairs().map(|(row, stamp_s)| stamp_s - mean_s - (row - mean_row) * period_s);
        let rms_s = (off().map(|off_s| off_s * off_s).sum::<f64>() / count).sqrt();
        let greatest_s = off().fold(0.0_f64, |greatest, off_s| greatest.max(off_s.abs()));
        let is_jitter = rms_s <= JITTER_RMS_ROWS * period_s && greatest_s <= JITTER_ROWS * period_s;
        is_jitter.then(|| Self {
            rate_hz: 1.0 / period_s,
            first_s: from_s + mean_s - mean_row * period_s,
            rms_s,
        })
    }
}

/// Returns the row of each stamp, counted from one to the next in steps of `step_s`. A long step compensated by short ones
/// is a late stamp and no gap.
fn places(stamps_s: &[f64], step_s: f64) -> Vec<usize> {
    let mut places = Vec::with_capacity(stamps_s.len());
    places.push(0);
    let mut place = 0;
    for row in 1..stamps_s.len() {
        let before_s = stamps_s[row - 1];
        let ahead = stamps_s[row..].iter().take(LOOK_AHEAD_ROWS).enumerate();
        let rows =
            ahead.map(|(later, stamp_s)| ((stamp_s - before_s) / step_s).round() - later as f64);
        // At least one, for a row is there.
        place += rows.fold(f64::INFINITY, f64::min).max(1.0) as usize;
        places.push(place);
    }
    places
}
