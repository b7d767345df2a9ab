//! Lays a table of a recording out as self-describing columns: the name holds quantity, axis and unit.

use std::io::{self, Write};

use crate::recording::{Channel, Clock, Quantity, Recording, ResultColumn, ResultTable, Table};

/// The column of stamps: the end of each row, as `rlg import` reads stamps \[s\].
pub const STAMPS: &str = "t_s";

/// A table of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Sheet {
    /// Name of the table, valid for a variable: letters, digits, `_`.
    pub name: String,
    /// Columns of equal length with their names, stamps first; missing values are NaN.
    pub columns: Vec<(String, Vec<f64>)>,
}

/// Converts each table of `recording` to a sheet.
pub fn sheets(recording: &Recording) -> Vec<Sheet> {
    recording.tables.iter().map(sheet).collect()
}

fn sheet(table: &Table) -> Sheet {
    let stamps_s = match &table.clock {
        Clock::Uniform { rate_hz, start_s } => (0..table.rows)
            .map(|row| start_s + (row + 1) as f64 / rate_hz)
            .collect(),
        Clock::Stamped { stamps_s, .. } => stamps_s.clone(),
    };
    let mut columns = vec![(STAMPS.to_owned(), stamps_s)];
    for channel in &table.channels {
        let mut name = column_name(channel);
        while columns.iter().any(|(known, _)| *known == name) {
            name.push('_');
        }
        columns.push((name, channel.values.clone()));
    }
    let stem = table
        .file
        .rsplit_once('.')
        .map_or(&*table.file, |(stem, _)| stem);
    Sheet {
        name: variable(stem),
        columns,
    }
}

/// Returns quantity, axis and unit in the names of `rlg import`.
fn column_name(channel: &Channel) -> String {
    let (stem, unit) = match &channel.quantity {
        Quantity::GyroCount => ("pulses", ""),
        Quantity::GyroIncrement => ("dtheta", "_rad"),
        Quantity::GyroRate => ("gyro", "_rad_s"),
        Quantity::DitherAngle => ("dither", "_rad"),
        Quantity::SpecificForce => ("acc", "_m_s2"),
        Quantity::VelocityIncrement => ("dvel", "_m_s"),
        Quantity::Temperature => ("temperature", "_K"),
        Quantity::MagneticField => ("mag", "_T"),
        Quantity::ReferenceIncrement => ("ref_dtheta", "_rad"),
        Quantity::ReferenceAttitude => ("ref_quat", ""),
        Quantity::TimeSincePulse => ("time_since_pulse", "_s"),
        Quantity::LaserIntensity
        | Quantity::PathLengthDrive
        | Quantity::PathLengthResets
        | Quantity::DitherDrive => (channel.quantity.name(), ""),
        Quantity::Other(_) => return variable(&channel.column),
    };
    let axis = channel.axis.as_ref();
    let axis = axis.map_or_else(String::new, |axis| format!("_{axis}"));
    format!("{stem}{axis}{unit}")
}

/// Returns a valid MATLAB name of a variable or field: letters, digits and `_`, a letter first, 63 at most.
fn variable(text: &str) -> String {
    let sign = |letter: char| match letter.is_ascii_alphanumeric() {
        true => letter,
        false => '_',
    };
    let mut name: String = text.chars().map(sign).collect();
    if !name.starts_with(|letter: char| letter.is_ascii_alphabetic()) {
        name.insert(0, 'x');
    }
    name.truncate(63);
    name
}

impl Sheet {
    /// Converts it for the writer of Parquet.
    pub fn to_table(&self) -> ResultTable {
        let measured = |value: &f64| (!value.is_nan()).then_some(*value);
        let columns = self.columns.iter().map(|(name, values)| {
            let values = values.iter().map(measured).collect();
            (name.clone(), ResultColumn::Number(values))
        });
        ResultTable(columns.collect())
    }

    /// Writes it as CSV with a header: every digit that f64 needs, an empty cell for a missing value.
    pub fn write_csv(&self, file: &mut impl Write) -> io::Result<()> {
        let names: Vec<&str> = self.columns.iter().map(|(name, _)| &**name).collect();
        writeln!(file, "{}", names.join(","))?;
        for row in 0..self.rows() {
            for (place, (_, values)) in self.columns.iter().enumerate() {
                let comma = if place > 0 { "," } else { "" };
                match values[row] {
                    value if value.is_nan() => write!(file, "{comma}")?,
                    value => write!(file, "{comma}{value:?}")?,
                }
            }
            writeln!(file)?;
        }
        Ok(())
    }

    /// Returns the number of rows of every column.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, values)| values.len())
    }
}
