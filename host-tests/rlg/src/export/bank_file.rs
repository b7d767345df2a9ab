//! Writes a recording as the frames of version 3 that a counter bank would have sent, one after another.
//!
//! Layout in [`trueaxis::counter_bank`], slow channels and their codes in [`trueaxis::slow_channels`]. A frame a row of the
//! gyros' table: running counts of pulses and of accelerometer codes, pickoff codes, and the slow channels in turn, each with
//! its last reading at the row's end; 255 for a channel that the recording does not have, and the code of a reading that could
//! not be taken for a row that was not measured.
//!
//! Stamps are those of `time_since_pulse` at the slow rows, interpolated: a pulse between two slow rows is placed by the later
//! stamp. Counts, pickoffs and accelerometers must be whole codes; the counts of the first row may be missing, as a bank's first
//! frame has none.

use std::path::Path;

use trueaxis::Sample;
use trueaxis::counter_bank::{AccelerometerInput, BankFrame};
use trueaxis::slow_channels::{BankService, CHANNELS, NOT_MEASURED, channel};

use crate::error::InputError;
use crate::recording::{Axis, Channel, Clock, Quantity, Recording, Table};

/// Largest distance of a value from a whole code, over that code or 1: far above rounding, far below an angle in rad without a
/// scale.
const WHOLE: f64 = 1e-9;

/// Codes of a second of a stamp.
const STAMP_CODES_S: f64 = 16e6;

/// Quantities of the slow channels: first channel of three, codes of a unit.
const SLOW: [(Quantity, u8, f64); 5] = [
    (Quantity::Temperature, channel::TEMPERATURE, 64.0),
    (Quantity::LaserIntensity, channel::INTENSITY, 16384.0),
    (Quantity::PathLengthDrive, channel::PATH_LENGTH, 32768.0),
    (Quantity::PathLengthResets, channel::PATH_LENGTH_RESETS, 1.0),
    (Quantity::DitherDrive, channel::DITHER_DRIVE, 16384.0),
];

/// True if a frame holds values of this quantity.
pub fn holds(quantity: &Quantity) -> bool {
    let own = [
        Quantity::GyroCount,
        Quantity::DitherAngle,
        Quantity::VelocityIncrement,
        Quantity::TimeSincePulse,
    ];
    own.contains(quantity) || SLOW.iter().any(|(slow, ..)| slow == quantity)
}

/// Frames of a recording, as bytes.
///
/// # Errors
/// It does not have the counts of three gyros at a uniform rate; or a value is not measured, or no whole code that a frame holds.
pub fn bytes(recording: &Recording, folder: &Path) -> Result<Vec<u8>, InputError> {
    let counts = triad(recording, &Quantity::GyroCount).ok_or_else(|| {
        InputError::new(folder, "has no counts of three gyros in one table")
            .expected("channels of gyro_count, x, y and z")
    })?;
    let table = counts[0].0;
    let Clock::Uniform { rate_hz, start_s } = table.clock else {
        return Err(InputError::new(folder.join(&table.file), "has stamps")
            .expected("rows at a uniform rate, as a bank latches them"));
    };
    let of_same_table = |quantity: &Quantity| {
        triad(recording, quantity).filter(|found| found[0].0.file == table.file)
    };
    let pickoffs = of_same_table(&Quantity::DitherAngle);
    let velocities = of_same_table(&Quantity::VelocityIncrement);
    let mut slow: Vec<Slow> = (0..CHANNELS as u8)
        .filter_map(|channel| Slow::of(recording, channel))
        .collect();
    let mut stamps = Stamps::of(recording);
    let mut frame = BankFrame::default();
    let mut bytes = Vec::with_capacity(table.rows * trueaxis::counter_bank::FRAME_BYTES);
    for row in 0..table.rows {
        let code = |of: &Option<[(&Table, &Channel); 3]>| match of {
            Some(found) => codes(found, row, folder, false),
            None => Ok([0; 3]),
        };
        let sample = Sample {
            pulse_counts: codes(&counts, row, folder, row == 0)?,
            pickoff_codes: code(&pickoffs)?,
            accelerometer_codes: match &velocities {
                Some(found) => codes(found, row, folder, row == 0)?,
                None => [0; 3],
            },
        };
        frame = frame.followed_by(&sample, AccelerometerInput::Counters);
        let end_s = start_s + (row + 1) as f64 / rate_hz;
        let turn = (row % (CHANNELS + 1)) as u8;
        let due = slow.iter_mut().find(|slow| slow.channel == turn);
        let reading = due.and_then(|slow| slow.code(end_s));
        frame.service = BankService {
            channel: reading.map_or(BankService::NO_CHANNEL, |_| turn),
            value: reading.unwrap_or(0),
            since_pulse: stamps
                .as_mut()
                .map_or(BankService::NO_PULSE, |stamps| stamps.at(end_s)),
        };
        bytes.extend_from_slice(&frame.to_bytes());
    }
    Ok(bytes)
}

/// The channels x, y, z of a quantity, if one table has all three.
fn triad<'a>(
    recording: &'a Recording,
    quantity: &Quantity,
) -> Option<[(&'a Table, &'a Channel); 3]> {
    recording.tables.iter().find_map(|table| {
        let [x, y, z] = Axis::ALL.map(|axis| table.channel(quantity, axis.label()));
        Some([(table, x?), (table, y?), (table, z?)])
    })
}

/// Whole codes of a row; 0 for a missing value where `may_lack`.
fn codes(
    channels: &[(&Table, &Channel); 3],
    row: usize,
    folder: &Path,
    may_lack: bool,
) -> Result<[i32; 3], InputError> {
    let mut codes = [0; 3];
    for (place, (table, channel)) in codes.iter_mut().zip(channels) {
        let value = channel.values[row];
        if value.is_nan() && may_lack {
            continue;
        }
        let code = (value - channel.offset) / channel.scale;
        let refused = |problem: &str| {
            Err(InputError::new(folder.join(&table.file), problem)
                .channel(&channel.column)
                .row(row as u64)
                .value(value)
                .expected(format!(
                    "a whole multiple of {}, as a bank's codes are",
                    channel.scale
                )))
        };
        if value.is_nan() {
            return refused("is not measured");
        }
        if (code - code.round()).abs() > WHOLE * code.abs().max(1.0)
            || code.abs() > f64::from(i32::MAX)
        {
            return refused("is no code of a bank");
        }
        *place = code.round() as i32;
    }
    Ok(codes)
}

/// Time \[s\] and value of each row of a channel.
fn readings(table: &Table, channel: &Channel) -> Vec<(f64, f64)> {
    let time_s = |row: usize| match &table.clock {
        Clock::Uniform { rate_hz, start_s } => start_s + (row + 1) as f64 / rate_hz,
        Clock::Stamped { stamps_s, .. } => stamps_s[row],
    };
    let values = channel.values.iter().enumerate();
    values.map(|(row, value)| (time_s(row), *value)).collect()
}

/// A channel's readings, walked through in time.
struct Walk {
    readings: Vec<(f64, f64)>,
    /// Number of readings taken so far.
    known: usize,
}

impl Walk {
    /// The last reading at a time or before, and the first after it. Times must not go back.
    fn at(&mut self, time_s: f64) -> [Option<(f64, f64)>; 2] {
        // Rounding of sums of periods.
        let now_s = time_s + 1e-9;
        while self
            .readings
            .get(self.known)
            .is_some_and(|(at_s, _)| *at_s <= now_s)
        {
            self.known += 1;
        }
        let last = self
            .known
            .checked_sub(1)
            .and_then(|last| self.readings.get(last));
        [last.copied(), self.readings.get(self.known).copied()]
    }
}

/// A slow channel of the bank.
struct Slow {
    channel: u8,
    codes_per_unit: f64,
    walk: Walk,
}

impl Slow {
    fn of(recording: &Recording, number: u8) -> Option<Self> {
        let (quantity, first, codes_per_unit) =
            SLOW.iter().rev().find(|(_, first, _)| *first <= number)?;
        let axis = Axis::ALL.get(usize::from(number - first))?;
        let (table, channel) = recording.channel(quantity, axis.label())?;
        Some(Self {
            channel: number,
            codes_per_unit: *codes_per_unit,
            walk: Walk {
                readings: readings(table, channel),
                known: 0,
            },
        })
    }

    /// Code at a time; `None` before the first reading. Counts wrap, other codes are held at their ends.
    fn code(&mut self, time_s: f64) -> Option<i16> {
        let [Some((_, value)), _] = self.walk.at(time_s) else {
            return None;
        };
        if value.is_nan() {
            return Some(NOT_MEASURED);
        }
        let code = (value * self.codes_per_unit).round();
        let resets = channel::PATH_LENGTH_RESETS..channel::DITHER_DRIVE;
        Some(match resets.contains(&self.channel) {
            true => code as i64 as i16,
            false => code.clamp(-32767.0, 32767.0) as i16,
        })
    }
}

/// Stamps of the bank.
struct Stamps(Walk);

impl Stamps {
    fn of(recording: &Recording) -> Option<Self> {
        let tables = recording.tables.iter();
        let mut found = tables.filter_map(|table| {
            let mut channels = table.channels.iter();
            let channel = channels.find(|one| one.quantity == Quantity::TimeSincePulse)?;
            Some(readings(table, channel))
        });
        found
            .next()
            .map(|readings| Self(Walk { readings, known: 0 }))
    }

    /// Stamp at a time: from the reading before it, or from the one after it where the pulse came between.
    fn at(&mut self, time_s: f64) -> u32 {
        let [before, after] = self.0.at(time_s);
        let since = |reading: Option<(f64, f64)>| {
            let (at_s, value_s) = reading?;
            let since_s = value_s + (time_s - at_s);
            (since_s >= 0.0).then_some(since_s)
        };
        let came_between = match (before, after) {
            (Some((_, before_s)), Some((_, after_s))) => before_s.is_nan() || after_s < before_s,
            _ => true,
        };
        let since_s = since(after.filter(|_| came_between)).or_else(|| since(before));
        let code = since_s.map_or(f64::INFINITY, |since_s| since_s * STAMP_CODES_S);
        // A stamp of a slow row is whole, which a sum of times may miss by its rounding.
        (code + 1e-3).floor().min(f64::from(BankService::NO_PULSE)) as u32
    }
}
