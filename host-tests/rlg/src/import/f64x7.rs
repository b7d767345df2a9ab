//! Imports records of seven little-endian f64.
//!
//! A record of 56 bytes holds time \[s\], gyro x y z \[°/s\] and accelerometer x y z \[m/s²\]. The table written to
//! disk has `gyro_rate`, `specific_force`, and `time_stamp`, the file's own times (a quantity beyond the contract's:
//! seconds, at the row's end).
//!
//! The table's clock is the nominal one, as a simulation would assume: the whole number of hertz nearest to the stamps' mean
//! rate, or the caller's. Departures of the stamps from it are left to the diagnosis. Memory does not grow with the file.

use std::io::Read;
use std::path::Path;

use super::still::{self, Foreign, TABLE};
use crate::error::InputError;
use crate::output::OutputFolder;
use crate::recording::{Axis, Clock, Quantity, Site, TableStream};

/// Bytes of a record.
const RECORD_BYTES: usize = 56;

/// The columns in the order of the record.
const COLUMNS: [&str; 7] = ["t", "gx", "gy", "gz", "ax", "ay", "az"];

/// Largest relative distance of a mean rate from the whole number of hertz it is rounded to: oscillators are within 1e-2.
const NEAR_WHOLE: f64 = 5e-3;

/// Reads all records of `source`, `length` bytes of `file`, into `out`.
pub fn import(
    file: &Path,
    mut source: impl Read,
    length: u64,
    rate_hz: Option<f64>,
    site: Option<Site>,
    out: &mut OutputFolder,
) -> Result<Foreign, InputError> {
    let over = length % RECORD_BYTES as u64;
    if length == 0 || over != 0 {
        return Err(InputError::new(file, "is no whole number of records")
            .value(format!("{length} bytes, {over} too many"))
            .expected("records of 56 bytes: seven little-endian f64"));
    }
    let mut table = TableStream::create(out, TABLE, &COLUMNS)?;
    let mut record = [0; RECORD_BYTES];
    let (mut first_s, mut last_s) = (f64::NAN, f64::NEG_INFINITY);
    let mut steps = [Step::default(); 3];
    for row in 0..length / RECORD_BYTES as u64 {
        source
            .read_exact(&mut record)
            .map_err(|error| InputError::unreadable(file, &error).row(row))?;
        let values = decode(&record);
        if let Some(place) = values.iter().position(|value| !value.is_finite()) {
            return Err(InputError::new(file, "is not a number")
                .channel(COLUMNS[place])
                .row(row)
                .value(values[place])
                .expected("a finite f64"));
        }
        if values[0] <= last_s {
            return Err(InputError::new(file, "is a time that does not go on")
                .channel(COLUMNS[0])
                .row(row)
                .value(values[0])
                .expected(format!("a time after {last_s} s")));
        }
        if row == 0 {
            first_s = values[0];
        }
        last_s = values[0];
        for (step, value) in steps.iter_mut().zip(&values[1..4]) {
            step.see(*value);
        }
        table.push(&values)?;
    }
    let rows = table.finish()?;
    if rows < 2 {
        return Err(InputError::new(file, "holds too few records")
            .value(rows)
            .expected("at least 2"));
    }
    let stamped_rate_hz = (rows - 1) as f64 / (last_s - first_s);
    let whole = stamped_rate_hz.round();
    let nominal = if (stamped_rate_hz - whole).abs() < NEAR_WHOLE * whole {
        whole
    } else {
        stamped_rate_hz
    };
    let rate_hz = rate_hz.unwrap_or(nominal);
    let radians = std::f64::consts::PI / 180.0;
    let mut channels = vec![still::column(
        COLUMNS[0],
        Quantity::Other("time_stamp".to_owned()),
        None,
        1.0,
    )];
    for (place, axis) in Axis::ALL.into_iter().enumerate() {
        let (gyro, accelerometer) = (COLUMNS[1 + place], COLUMNS[4 + place]);
        channels.push(still::column(gyro, Quantity::GyroRate, Some(axis), radians));
        channels.push(still::column(
            accelerometer,
            Quantity::SpecificForce,
            Some(axis),
            1.0,
        ));
    }
    let clock = Clock::Uniform {
        rate_hz,
        // The first stamp is the end of row 0.
        start_s: first_s - 1.0 / rate_hz,
    };
    Ok(Foreign {
        recording: still::recording(file, site, clock, channels),
        rows,
        rate_hz,
        stamped_rate_hz: Some(stamped_rate_hz),
        resolution_rad: steps.map(|step| step.smallest() * radians / rate_hz),
    })
}

fn decode(record: &[u8; RECORD_BYTES]) -> [f64; 7] {
    let mut values = [0.0; 7];
    for (value, bytes) in values.iter_mut().zip(record.as_chunks::<8>().0) {
        *value = f64::from_le_bytes(*bytes);
    }
    values
}

/// Smallest change from row to row: the quantisation step of a channel.
#[derive(Debug, Clone, Copy, Default)]
struct Step {
    before: Option<f64>,
    smallest: Option<f64>,
}

impl Step {
    fn see(&mut self, value: f64) {
        if let Some(before) = self.before.replace(value) {
            let step = (value - before).abs();
            if step > 0.0 && self.smallest.is_none_or(|smallest| step < smallest) {
                self.smallest = Some(step);
            }
        }
    }

    /// Returns the step; a constant channel has that of an f64 near 1.
    fn smallest(self) -> f64 {
        self.smallest.unwrap_or(f64::EPSILON)
    }
}
