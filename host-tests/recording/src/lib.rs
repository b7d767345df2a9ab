//! Reads and writes recordings: folders with `recording.toml` beside tables (Parquet or CSV).
//!
//! A [`Recording`] holds every channel as f64 in the unit of its quantity (SI), NaN where nothing was measured. The
//! meaning of every name is fixed by the project's contract; unknown quantities are kept as [`Quantity::Other`] and are
//! never an error.
//!
//! Out of scope: alignment of tables that differ in rate, and any judgement of the data's
//! quality. That is the first stage of whoever uses the recording.

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
mod parquet_table;
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

/// Where the recording was made.
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

/// What a channel measures. The unit of each is fixed by the contract.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Quantity {
    /// Pulses counted over the row's period \[1\]; includes the block's own dither.
    GyroCount,
    /// Angle over the row's period \[rad\], no dither to strip.
    GyroIncrement,
    /// Mean rate over the row's period \[rad/s\].
    GyroRate,
    /// Block relative to case \[rad\], at the row's end.
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
    /// Any quantity the contract does not list, by its name in the file.
    Other(String),
}

/// When the rows of a table were taken. Row k covers \[start + k/rate, start + (k+1)/rate).
#[derive(Debug, Clone, PartialEq)]
pub enum Clock {
    /// Uniform rows.
    Uniform {
        /// Rows per second \[Hz\].
        rate_hz: f64,
        /// Beginning of row 0 \[s\].
        start_s: f64,
    },
    /// A column of the table holds the time of each row \[s\], strictly increasing.
    Stamped {
        /// The column's name.
        column: String,
        /// The stamps \[s\], one a row.
        stamps_s: Vec<f64>,
    },
}

/// One column of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// The column's name in the table.
    pub column: String,
    /// What it measures.
    pub quantity: Quantity,
    /// The axis as written in the file: "x", "y", "z", or "w" for attitude; `None` where not given.
    pub axis: Option<String>,
    /// Scale in stored · scale + offset = the value in the quantity's unit.
    pub scale: f64,
    /// Offset in stored · scale + offset.
    pub offset: f64,
    /// The values, already scaled; NaN = not measured.
    pub values: Vec<f64>,
}

/// One table of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// File name inside the folder, `*.parquet` or `*.csv`.
    pub file: String,
    /// When its rows were taken.
    pub clock: Clock,
    /// Rows in every channel.
    pub rows: usize,
    /// Its channels in the order of `recording.toml`.
    pub channels: Vec<Channel>,
}

/// A named interval of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Segment {
    /// Its name.
    pub name: String,
    /// still, coning, vibration, slew, spin, or free text.
    pub kind: String,
    /// Begin \[s\].
    pub start_s: f64,
    /// End \[s\].
    pub end_s: f64,
}

/// A recording in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Its name.
    pub name: String,
    /// The folder it was read from or will be written to, for error messages.
    pub folder: PathBuf,
    /// Where it was made, if known.
    pub site: Option<Site>,
    /// Its tables.
    pub tables: Vec<Table>,
    /// Its named intervals.
    pub segments: Vec<Segment>,
}

impl Clock {
    /// Time that one row covers \[s\]; of stamped rows the mean over `rows` rows.
    pub fn period_s(&self, rows: usize) -> f64 {
        match self {
            Self::Uniform { rate_hz, .. } => 1.0 / rate_hz,
            Self::Stamped { stamps_s, .. } if rows > 1 => {
                (stamps_s[rows - 1] - stamps_s[0]) / (rows - 1) as f64
            }
            // One stamp tells nothing of a period; a second is the unit.
            Self::Stamped { .. } => 1.0,
        }
    }
}

impl Table {
    /// Beginning of row 0 \[s\].
    pub fn start_s(&self) -> f64 {
        match &self.clock {
            Clock::Uniform { start_s, .. } => *start_s,
            Clock::Stamped { stamps_s, .. } => stamps_s.first().copied().unwrap_or(0.0),
        }
    }

    /// End of the last row \[s\]; a stamped last row counts as long as the mean row.
    pub fn end_s(&self) -> f64 {
        match &self.clock {
            Clock::Uniform { rate_hz, start_s } => start_s + self.rows as f64 / rate_hz,
            Clock::Stamped { stamps_s, .. } => {
                stamps_s.last().copied().unwrap_or(0.0) + self.clock.period_s(self.rows)
            }
        }
    }

    /// Keeps some rows alone, on the same clock; those beyond the last are none.
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

    /// The channel that measures `quantity` about `axis` ("x", "y", "z", "w").
    pub fn channel(&self, quantity: &Quantity, axis: &str) -> Option<&Channel> {
        self.channels
            .iter()
            .find(|channel| channel.quantity == *quantity && channel.axis.as_deref() == Some(axis))
    }
}

impl Recording {
    /// The first table with a channel of `quantity` about `axis`, and that channel.
    pub fn channel(&self, quantity: &Quantity, axis: &str) -> Option<(&Table, &Channel)> {
        self.tables
            .iter()
            .find_map(|table| Some((table, table.channel(quantity, axis)?)))
    }
}
