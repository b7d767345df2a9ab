//! The accelerometers' samples on rows of their own.
//!
//! Enters: a recording and the gyros' rows (rate, start, number). Leaves: [`Rows`], velocity increments \[m/s\] on rows
//! within the gyros', with a mask; and [`Rows::gather`], which sums values of the gyros' rows over these.
//!
//! Rows shorter than a millisecond are summed to about one: gravity in a turning case varies no faster, the mean over a row
//! stays exact because the prediction is summed alike, and the work falls by four for a unit at 4 kHz.
//!
//! Deliberately not here: accelerometers with stamps instead of a rate, or on three different clocks.

use crate::axes::{AXES, Triad};
use rlg_plan::AccelerometerRowsPlan;
use rlg_recording::{Clock, Quantity, Recording};

/// Channel name of an accelerometer in findings.
pub fn channel_name(axis: usize) -> String {
    format!("accel_{}", AXES[axis])
}

/// Rows of the accelerometers.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// Beginning of row 0 \[s\].
    pub start_s: f64,
    /// Number of rows.
    pub count: usize,
    /// Velocity increment of each accelerometer over each row \[m/s\].
    pub sensed_m_s: Triad,
    /// Rows with all accelerometers measured and, once masked, the case's motion.
    pub usable: Vec<bool>,
    /// Gyro rows from the gyros' beginning to this table's, and gyro rows in one of these.
    first: f64,
    each: f64,
}

impl Rows {
    /// Finds the accelerometers; an error names the reason for their absence.
    pub fn new(
        recording: &Recording,
        (gyro_rate_hz, gyro_start_s, gyro_rows): (f64, f64, usize),
        plan: &AccelerometerRowsPlan,
    ) -> Result<Self, String> {
        let found = Quantity::FORCES.iter().find_map(|quantity| {
            let one = |axis: usize| recording.channel(quantity, AXES[axis]);
            Some((quantity, [one(0)?, one(1)?, one(2)?]))
        });
        let Some((quantity, channels)) = found else {
            return Err("no accelerometer channels on all three axes".to_string());
        };
        let table = channels[0].0;
        let Clock::Uniform { rate_hz, start_s } = table.clock else {
            return Err("the accelerometers' table has stamps instead of a rate".to_string());
        };
        if channels
            .iter()
            .any(|(other, _)| other.clock != table.clock || other.rows != table.rows)
        {
            return Err("the three accelerometers run on different clocks".to_string());
        }
        let together = (rate_hz / plan.fastest_hz).ceil().max(1.0) as usize;
        // Whole rows within the gyros' span, up to this rounding of the clocks.
        const SAME: f64 = 1e-6;
        let late_rows = (gyro_start_s - start_s) * rate_hz;
        let begin = (late_rows - SAME).ceil().max(0.0) as usize;
        let until = ((gyro_start_s + gyro_rows as f64 / gyro_rate_hz - start_s) * rate_hz + SAME)
            .max(0.0) as usize;
        let until = until.min(channels[0].1.values.len());
        let count = until.saturating_sub(begin) / together;
        if count < plan.least_rows {
            return Err(
                "too few rows of the accelerometers while the case's motion is known".to_string(),
            );
        }
        let unit = match quantity {
            Quantity::SpecificForce => 1.0 / rate_hz,
            _ => 1.0,
        };
        let mut usable = vec![true; count];
        let sensed_m_s = channels.map(|(_, channel)| {
            let mut last = 0.0;
            (0..count)
                .map(|row| {
                    let from = begin + row * together;
                    let sum: f64 = channel.values[from..from + together].iter().sum();
                    // Unmeasured values are held, so that filters stay finite; the mask excludes them.
                    if sum.is_finite() {
                        last = sum * unit;
                    } else {
                        usable[row] = false;
                    }
                    last
                })
                .collect()
        });
        let start_s = start_s + begin as f64 / rate_hz;
        let rate_hz = rate_hz / together as f64;
        Ok(Self {
            rate_hz,
            start_s,
            count,
            sensed_m_s,
            usable,
            first: ((start_s - gyro_start_s) * gyro_rate_hz).max(0.0),
            each: gyro_rate_hz / rate_hz,
        })
    }

    /// Sums `values` of the gyros' rows over these rows.
    pub fn gather(&self, values: &[f64]) -> Vec<f64> {
        let mut running = Vec::with_capacity(values.len() + 1);
        let mut sum = 0.0;
        running.push(0.0);
        for value in values {
            sum += value;
            running.push(sum);
        }
        let until = |place: f64| {
            let place = place.min(values.len() as f64);
            // A whole row but for rounding is that row.
            let whole = (place + 1e-6).floor() as usize;
            let share = (place - whole as f64).max(0.0);
            running[whole]
                + match values.get(whole) {
                    Some(next) => share * next,
                    None => 0.0,
                }
        };
        (0..self.count)
            .map(|row| {
                let begin = self.first + row as f64 * self.each;
                until(begin + self.each) - until(begin)
            })
            .collect()
    }

    /// Period of a row \[s\].
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// Mid-time of a row \[s\].
    pub fn middle_s(&self, row: usize) -> f64 {
        self.start_s + (row as f64 + 0.5) / self.rate_hz
    }
}
