//! Reads and writes recordings: folders with `recording.toml` and tables (Parquet or CSV).
//!
//! A [`Recording`] holds every channel as f64 in the unit of its quantity (SI), NaN for unmeasured values. The meaning
//! of every name is fixed by the project's contract; unknown quantities are kept as [`Quantity::Other`] and are never
//! an error.
//!
//! Out of scope: alignment of tables of different rates, and any assessment of the data's quality. Both are the first
//! stage of an analysis.

use std::path::PathBuf;

pub mod error;

pub mod output;

pub mod toml_file;

mod about;
mod csv_table;
mod folder;
pub mod keys;
mod manifest;
mod manifest_text;
mod misspelt;
mod nearest;
mod parquet_kind;
mod parquet_table;
mod parquet_writer;
pub mod quantity;
mod range;
mod result_table;
mod sampling;
mod storage;
mod streamed;
mod table_stream;
pub mod units;

pub use about::{About, Head};
pub use manifest::MANIFEST;
pub use nearest::nearest;
pub use parquet_table::{ForeignColumn, parquet_columns};
pub use range::Extent;
pub use result_table::{ResultColumn, ResultTable};
pub use streamed::RecordingStream;
pub use table_stream::TableStream;

/// Names of the body axes, in index order.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// Site of the recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Site {
    /// Geodetic latitude \[rad\].
    pub latitude_rad: f64,
    /// Local gravity \[m/s²\].
    pub gravity_m_s2: f64,
}

/// A body axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Axis {
    /// Body x.
    X,
    /// Body y.
    Y,
    /// Body z.
    Z,
}

/// Measured quantity of a channel. The unit of each is fixed by the contract.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Quantity {
    /// Pulses counted over the row's period \[1\]; includes the dither of the block.
    GyroCount,
    /// Angle over the row's period \[rad\], free of dither.
    GyroIncrement,
    /// Mean rate over the row's period \[rad/s\].
    GyroRate,
    /// Angle of the block relative to the case \[rad\], at the row's end.
    DitherAngle,
    /// Mean specific force over the row's period \[m/s²\].
    SpecificForce,
    /// Velocity increment over the row's period \[m/s\].
    VelocityIncrement,
    /// Temperature \[K\] at the row's end.
    Temperature,
    /// Magnetic flux density \[T\] at the row's end.
    MagneticField,
    /// The case's angle over the row's period \[rad\], from a turntable or a reference gyro.
    ReferenceIncrement,
    /// One component of the unit quaternion, body to navigation frame, at the row's end.
    ReferenceAttitude,
    /// Intensity of the laser over nominal \[1\], at the row's end.
    LaserIntensity,
    /// Drive of the path-length control over its range \[1\], at the row's end.
    PathLengthDrive,
    /// Resets of the path-length control since the unit's start \[1\], at the row's end.
    PathLengthResets,
    /// Drive of the dither over nominal \[1\], at the row's end.
    DitherDrive,
    /// Time from the last pulse per second to the row's end \[s\].
    TimeSincePulse,
    /// Quantity outside the contract, by its name in the file.
    Other(String),
}

/// Times of the rows of a table. Row k covers \[start + k/rate, start + (k+1)/rate).
#[derive(Debug, Clone, PartialEq)]
pub enum Clock {
    /// Uniform rows.
    Uniform {
        /// Row rate \[Hz\].
        rate_hz: f64,
        /// Start of row 0 \[s\].
        start_s: f64,
    },
    /// Time of each row \[s\] in a column of the table, strictly increasing.
    Stamped {
        /// Name of the column.
        column: String,
        /// Time stamps \[s\], one a row.
        stamps_s: Vec<f64>,
    },
}

/// One column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Name of the column in the table.
    pub column: String,
    /// Measured quantity.
    pub quantity: Quantity,
    /// Axis as written in the file: "x", "y", "z", or "w" for attitude; `None` if not given.
    pub axis: Option<String>,
    /// Scale in value = stored · scale + offset, in the quantity's unit.
    pub scale: f64,
    /// Offset in value = stored · scale + offset.
    pub offset: f64,
    /// Scaled values; NaN = not measured.
    pub values: Vec<f64>,
}

/// One table of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// File name inside the folder, `*.parquet` or `*.csv`.
    pub file: String,
    /// Times of the rows.
    pub clock: Clock,
    /// Number of rows in every channel.
    pub rows: usize,
    /// Channels in the order of `recording.toml`.
    pub channels: Vec<Channel>,
}

/// Named time interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Its name.
    pub name: String,
    /// still, coning, vibration, slew, spin, or free text.
    pub kind: String,
    /// Start \[s\].
    pub start_s: f64,
    /// End \[s\].
    pub end_s: f64,
}

/// Recording in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Its name.
    pub name: String,
    /// Folder of the recording, read or to be written, for error messages.
    pub folder: PathBuf,
    /// Site, if known.
    pub site: Option<Site>,
    /// Its tables.
    pub tables: Vec<Table>,
    /// Named time intervals.
    pub segments: Vec<Segment>,
}

impl Clock {
    /// Row period \[s\]; for stamped rows the mean over `rows` rows.
    pub fn period_s(&self, rows: usize) -> f64 {
        match self {
            Self::Uniform { rate_hz, .. } => 1.0 / rate_hz,
            Self::Stamped { stamps_s, .. } if rows > 1 => {
                (stamps_s[rows - 1] - stamps_s[0]) / (rows - 1) as f64
            }
            // One stamp does not define a period; 1 s is arbitrary.
            Self::Stamped { .. } => 1.0,
        }
    }
}

impl Table {
    /// Start of row 0 \[s\].
    pub fn start_s(&self) -> f64 {
        match &self.clock {
            Clock::Uniform { start_s, .. } => *start_s,
            Clock::Stamped { stamps_s, .. } => stamps_s.first().copied().unwrap_or(0.0),
        }
    }

    /// End of the last row \[s\]; a stamped last row has the mean row period.
    pub fn end_s(&self) -> f64 {
        match &self.clock {
            Clock::Uniform { rate_hz, start_s } => start_s + self.rows as f64 / rate_hz,
            Clock::Stamped { stamps_s, .. } => {
                stamps_s.last().copied().unwrap_or(0.0) + self.clock.period_s(self.rows)
            }
        }
    }

    /// Keeps a range of rows, limited to the existing ones, on the same clock.
    pub fn keep(&mut self, rows: std::ops::Range<usize>) {
        let end = rows.end.min(self.rows);
        let rows = rows.start.min(end)..end;
        for channel in &mut self.channels {
            channel.values = channel.values[rows.clone()].to_vec();
        }
        self.rows = rows.len();
        match &mut self.clock {
            Clock::Uniform { rate_hz, start_s } => *start_s += rows.start as f64 / *rate_hz,
            Clock::Stamped { stamps_s, .. } => *stamps_s = stamps_s[rows].to_vec(),
        }
    }

    /// Returns the channel of `quantity` about `axis` ("x", "y", "z", "w").
    pub fn channel(&self, quantity: &Quantity, axis: &str) -> Option<&Channel> {
        self.channels
            .iter()
            .find(|channel| channel.quantity == *quantity && channel.axis.as_deref() == Some(axis))
    }
}

impl Recording {
    /// Returns the first table with a channel of `quantity` about `axis`, and that channel.
    pub fn channel(&self, quantity: &Quantity, axis: &str) -> Option<(&Table, &Channel)> {
        self.tables
            .iter()
            .find_map(|table| Some((table, table.channel(quantity, axis)?)))
    }

    /// Lists the channels of all tables.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.tables.iter().flat_map(|table| &table.channels)
    }

    /// True if any channel holds one of these quantities, about whatever axis.
    pub fn holds(&self, quantities: &[Quantity]) -> bool {
        self.channels()
            .any(|channel| quantities.contains(&channel.quantity))
    }
}
