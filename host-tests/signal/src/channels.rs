//! A recording's channels, found by quantity and put on the gyros' rows.
//!
//! Enters: [`Recording`]. Leaves: the gyros' table and clock; any channel row by row on a common clock, interpolated to the
//! rows' middles otherwise, NaN where unmeasured.
//!
//! Deliberately not here: the selection and use of channels for a diagnosis (streams.rs).

use super::axes::Triad;
use rlg_model::Model;
use rlg_plan::AlignPlan;
use rlg_recording::error::InputError;
use rlg_recording::{Channel, Clock, Quantity, Recording, Table};

/// Quantity of the recorder's own times, beside a nominal clock \[s\].
const TIME_STAMP: &str = "time_stamp";

/// The gyro channels and the clock of their table.
pub(super) struct GyroTable<'a> {
    pub(super) table: &'a Table,
    pub(super) channels: [&'a Channel; 3],
    pub(super) quantity: Quantity,
    pub(super) clock: (f64, f64),
}

impl GyroTable<'_> {
    /// Requires pulse weights in the model for gyros that count pulses.
    pub(super) fn expect_pulse_weights(
        &self,
        file: &std::path::Path,
        model: &Model,
    ) -> Result<(), InputError> {
        if self.quantity != Quantity::GyroCount || model.gyro.names_pulse_weights() {
            return Ok(());
        }
        let what = "the gyros count pulses, and the model has no pulse weight";
        Err(InputError::new(file, what)
            .channel(self.channels[0].column.clone())
            .expected("gyro.pulse_weight_rad in the model"))
    }

    /// The recorder's own times \[s\], NaN in gaps.
    pub(super) fn stamps_s(&self) -> Option<&[f64]> {
        let own_times = Quantity::Other(TIME_STAMP.to_string());
        let mut channels = self.table.channels.iter();
        let found = channels.find(|channel| channel.quantity == own_times)?;
        Some(&found.values)
    }
}

/// Channels on x, y and z with their tables.
pub(super) type OfAxes<'a> = [(&'a Channel, &'a Table); 3];

/// Finds channels by quantity and axis.
pub(super) struct Finder<'a> {
    recording: &'a Recording,
}

impl<'a> Finder<'a> {
    pub(super) fn new(recording: &'a Recording) -> Self {
        Self { recording }
    }

    fn one(&self, quantity: &Quantity, axis: &str) -> Option<(&'a Channel, &'a Table)> {
        self.recording.tables.iter().find_map(|table| {
            table
                .channels
                .iter()
                .find(|channel| {
                    channel.quantity == *quantity && channel.axis.as_deref() == Some(axis)
                })
                .map(|channel| (channel, table))
        })
    }

    /// The channels of a quantity on x, y and z.
    pub(super) fn triad(&self, quantity: &Quantity) -> Option<OfAxes<'a>> {
        // One channel without an axis (a thermometer) serves all three.
        let shared = || {
            self.recording.tables.iter().find_map(|table| {
                let without =
                    |channel: &&Channel| channel.quantity == *quantity && channel.axis.is_none();
                table
                    .channels
                    .iter()
                    .find(without)
                    .map(|channel| (channel, table))
            })
        };
        let on = |axis: &str| self.one(quantity, axis).or_else(shared);
        Some([on("x")?, on("y")?, on("z")?])
    }

    /// The gyro channels, or the error of their table.
    pub(super) fn gyro(&self, file: &std::path::Path) -> Result<GyroTable<'a>, InputError> {
        let found = Quantity::GYROS
            .iter()
            .find_map(|quantity| Some((quantity, self.triad(quantity)?)));
        let Some((quantity, channels)) = found else {
            return Err(InputError::new(file, "no gyro channels on all three axes")
                .channel("gyro_count")
                .expected("gyro_count, gyro_increment or gyro_rate on x, y and z"));
        };
        let table = channels[0].1;
        let Clock::Uniform { rate_hz, start_s } = table.clock else {
            return Err(
                InputError::new(file, "the gyros' table has stamps instead of a rate")
                    .channel(table.file.clone())
                    .expected("rate_hz: gyro increments are summed over equal periods"),
            );
        };
        Ok(GyroTable {
            table,
            channels: channels.map(|(channel, _)| channel),
            quantity: quantity.clone(),
            clock: (rate_hz, start_s),
        })
    }
}

/// Tolerance of a common clock: a hundredth of a row \[rows\].
pub const SAME_ROW: f64 = 0.01;

/// The rows of the gyros' table.
pub(super) struct Grid<'a> {
    pub(super) rate_hz: f64,
    pub(super) start_s: f64,
    pub(super) rows: usize,
    pub(super) plan: &'a AlignPlan,
}

impl Grid<'_> {
    /// Returns the channel's values on the gyros' rows, NaN where it has none: its table must have the same rate and begin a
    /// whole number of rows earlier or later.
    pub(super) fn on_rows(
        &self,
        file: &std::path::Path,
        channel: &Channel,
        table: &Table,
    ) -> Result<Vec<f64>, InputError> {
        let offset = match table.clock {
            Clock::Uniform { rate_hz, start_s } => {
                let drift = (rate_hz - self.rate_hz) * self.rows as f64 / self.rate_hz;
                let offset = (start_s - self.start_s) * self.rate_hz;
                let whole = (offset - offset.round()).abs() < SAME_ROW;
                (drift.abs() < SAME_ROW && whole).then_some(offset.round() as i64)
            }
            Clock::Stamped { .. } => None,
        };
        let Some(offset) = offset else {
            return Err(InputError::new(file, "not on the gyros' rows")
                .channel(channel.column.clone())
                .value(format!("{} rows in {}", channel.values.len(), table.file))
                .expected(format!(
                    "rows at {} Hz, a whole number of them from {} s, as the gyros have",
                    self.rate_hz, self.start_s
                )));
        };
        let value = |row: usize| {
            usize::try_from(row as i64 - offset)
                .ok()
                .and_then(|row| channel.values.get(row).copied())
        };
        Ok((0..self.rows)
            .map(|row| value(row).unwrap_or(f64::NAN))
            .collect())
    }

    /// Interpolates a slow quantity to the rows' middles, less the first `skip`: rows in a long gap are masked in `usable`,
    /// a channel with too many gaps is absent.
    pub(super) fn slow(&self, channels: OfAxes, skip: usize, usable: &mut [bool]) -> Option<Triad> {
        let mut triad =
            channels.map(|(channel, table)| self.at_middle(channel, table).split_off(skip));
        let gaps = triad.iter().flatten().filter(|value| value.is_nan());
        if gaps.count() as f64 > self.plan.most_gaps * (3 * usable.len()) as f64 {
            return None;
        }
        for values in &mut triad {
            for (usable, value) in usable.iter_mut().zip(values.iter()) {
                *usable &= !value.is_nan();
            }
            bridge_gaps(values);
        }
        Some(triad)
    }

    /// Channels of unknown quantity, less the first `skip` rows, by names valid in an expression.
    pub(super) fn others(&self, recording: &Recording, skip: usize) -> Vec<(String, Vec<f64>)> {
        recording
            .tables
            .iter()
            .flat_map(|table| table.channels.iter().map(move |channel| (channel, table)))
            .filter(|(channel, _)| {
                matches!(&channel.quantity, Quantity::Other(name) if name != TIME_STAMP)
            })
            .map(|(channel, table)| {
                let axis = channel
                    .axis
                    .as_deref()
                    .map(|axis| format!("_{axis}"))
                    .unwrap_or_default();
                let name = match &channel.quantity {
                    Quantity::Other(name) => format!("{name}{axis}"),
                    _ => unreachable!("filtered above"),
                };
                let mut values = self.at_middle(channel, table).split_off(skip);
                bridge_gaps(&mut values);
                (name, values)
            })
            .fold(
                Vec::new(),
                |mut others: Vec<(String, Vec<f64>)>, (name, values)| {
                    // Names become factors of an expression: no operators, no builtin's name, none twice.
                    let safe: String = name
                        .chars()
                        .map(|c| {
                            if c.is_alphanumeric() || c == '_' {
                                c
                            } else {
                                '_'
                            }
                        })
                        .collect();
                    let taken = |name: &str, others: &[(String, Vec<f64>)]| {
                        others.iter().any(|(n, _)| n == name)
                    };
                    let mut unique = format!("channel_{safe}");
                    while taken(&unique, &others) {
                        unique.push('_');
                    }
                    others.push((unique, values));
                    others
                },
            )
    }

    /// Interpolates the channel linearly to the middle of each gyro row; held at the ends, NaN in gaps.
    pub(super) fn at_middle(&self, channel: &Channel, table: &Table) -> Vec<f64> {
        // Means over a row belong to its middle, samples to its end.
        let at_row = match channel.quantity {
            Quantity::SpecificForce | Quantity::VelocityIncrement => 0.5,
            _ => 1.0,
        };
        let stamp = |row: usize| match &table.clock {
            Clock::Uniform { rate_hz, start_s } => start_s + (row as f64 + at_row) / rate_hz,
            Clock::Stamped { stamps_s, .. } => stamps_s[row],
        };
        let known: Vec<usize> = (0..channel.values.len())
            .filter(|&row| channel.values[row].is_finite())
            .collect();
        let gap_s = self.plan.gap_periods * table.clock.period_s(channel.values.len());
        let mut after = 0;
        (0..self.rows)
            .map(|row| {
                let time_s = self.start_s + (row as f64 + 0.5) / self.rate_hz;
                while after < known.len() && stamp(known[after]) < time_s {
                    after += 1;
                }
                match (
                    after.checked_sub(1).map(|before| known[before]),
                    known.get(after),
                ) {
                    (Some(before), Some(&after)) if stamp(after) - stamp(before) > gap_s => {
                        f64::NAN
                    }
                    (Some(before), Some(&after)) => {
                        let share = (time_s - stamp(before)) / (stamp(after) - stamp(before));
                        channel.values[before]
                            + share * (channel.values[after] - channel.values[before])
                    }
                    (Some(before), None) => channel.values[before],
                    (None, Some(&after)) => channel.values[after],
                    (None, None) => 0.0,
                }
            })
            .collect()
    }
}

/// Interpolates linearly over unmeasured rows, so that filters stay finite; the mask excludes them.
pub(super) fn bridge_gaps(values: &mut [f64]) {
    let mut row = 0;
    while row < values.len() {
        if values[row].is_finite() {
            row += 1;
            continue;
        }
        let begin = row;
        while row < values.len() && !values[row].is_finite() {
            row += 1;
        }
        let before = begin.checked_sub(1).map(|before| values[before]);
        let after = values.get(row).copied();
        let (from, to) = match (before, after) {
            (Some(from), Some(to)) => (from, to),
            (Some(only), None) | (None, Some(only)) => (only, only),
            (None, None) => (0.0, 0.0),
        };
        let steps = (row - begin + 1) as f64;
        for (step, value) in values[begin..row].iter_mut().enumerate() {
            *value = from + (to - from) * (step + 1) as f64 / steps;
        }
    }
}
