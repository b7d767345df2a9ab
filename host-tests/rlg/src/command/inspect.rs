//! `rlg inspect`: lists the content of a recording, after every check made on reading it.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::error::InputError;
use crate::recording::{Channel, Clock, Recording, Table};
use crate::terminal::Terminal;

/// Check a recording and list its tables, channels and segments
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  rlg inspect recordings/bench-17 --json")]
pub struct Inspect {
    /// Folder with recording.toml
    recording: PathBuf,
}

#[derive(Serialize)]
struct Inventory {
    format: u32,
    recording: String,
    version: &'static str,
    site: Option<SiteFacts>,
    tables: Vec<TableFacts>,
    segments: Vec<SegmentFacts>,
}

#[derive(Serialize)]
struct SiteFacts {
    latitude_rad: f64,
    gravity_m_s2: f64,
}

#[derive(Serialize)]
struct TableFacts {
    file: String,
    /// Rows per second; for stamped rows the mean.
    rate_hz: f64,
    uniform: bool,
    start_s: f64,
    end_s: f64,
    rows: usize,
    channels: Vec<ChannelFacts>,
}

#[derive(Serialize)]
struct ChannelFacts {
    column: String,
    quantity: String,
    axis: Option<String>,
    unit: Option<&'static str>,
    /// Share of the rows without a value.
    missing: f64,
    /// Smallest of the measured values; absent if nothing was measured.
    min: Option<f64>,
    mean: Option<f64>,
    max: Option<f64>,
}

#[derive(Serialize)]
struct SegmentFacts {
    name: String,
    kind: String,
    start_s: f64,
    end_s: f64,
}

impl Inspect {
    /// Reads the recording and lists its content, as JSON if asked.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let recording = Recording::read(&self.recording)?;
        let inventory = Inventory::of(&recording);
        terminal.say(inventory.text());
        terminal.result(&inventory)
    }
}

impl Inventory {
    fn of(recording: &Recording) -> Self {
        Self {
            format: 1,
            recording: recording.name.clone(),
            version: env!("CARGO_PKG_VERSION"),
            site: recording.site.map(|site| SiteFacts {
                latitude_rad: site.latitude_rad,
                gravity_m_s2: site.gravity_m_s2,
            }),
            tables: recording.tables.iter().map(TableFacts::of).collect(),
            segments: recording
                .segments
                .iter()
                .map(|segment| SegmentFacts {
                    name: segment.name.clone(),
                    kind: segment.kind.clone(),
                    start_s: segment.start_s,
                    end_s: segment.end_s,
                })
                .collect(),
        }
    }

    fn text(&self) -> String {
        // Writing to a String cannot fail, so the results of write! are dropped.
        let mut out = format!("recording {}", self.recording);
        if let Some(site) = &self.site {
            let latitude_deg = site.latitude_rad.to_degrees();
            let _ = write!(
                out,
                ", latitude {latitude_deg:.4}°, gravity {} m/s²",
                site.gravity_m_s2
            );
        }
        for table in &self.tables {
            let clock = if table.uniform {
                ""
            } else {
                " on average, by stamps"
            };
            let _ = write!(
                out,
                "\n\n{}: {} rows at {:.3} Hz{clock}, {:.3} s to {:.3} s\n",
                table.file, table.rows, table.rate_hz, table.start_s, table.end_s
            );
            let _ = write!(
                out,
                "  {:<12} {:<22} {:<4} {:<6} {:>9} {:>13} {:>13} {:>13}",
                "column", "quantity", "axis", "unit", "missing", "least", "mean", "greatest"
            );
            for channel in &table.channels {
                let number =
                    |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.5e}"));
                let _ = write!(
                    out,
                    "\n  {:<12} {:<22} {:<4} {:<6} {:>7.3} % {:>13} {:>13} {:>13}",
                    channel.column,
                    channel.quantity,
                    channel.axis.as_deref().unwrap_or("-"),
                    channel.unit.unwrap_or("-"),
                    100.0 * channel.missing,
                    number(channel.min),
                    number(channel.mean),
                    number(channel.max)
                );
            }
        }
        if !self.segments.is_empty() {
            out.push_str("\n\nsegments");
        }
        for segment in &self.segments {
            let _ = write!(
                out,
                "\n  {:>9.3} s to {:>9.3} s  {} ({})",
                segment.start_s, segment.end_s, segment.name, segment.kind
            );
        }
        out
    }
}

impl TableFacts {
    fn of(table: &Table) -> Self {
        Self {
            file: table.file.clone(),
            rate_hz: 1.0 / table.clock.period_s(table.rows),
            uniform: matches!(table.clock, Clock::Uniform { .. }),
            start_s: table.start_s(),
            end_s: table.end_s(),
            rows: table.rows,
            channels: table.channels.iter().map(ChannelFacts::of).collect(),
        }
    }
}

impl ChannelFacts {
    fn of(channel: &Channel) -> Self {
        let (mut count, mut sum) = (0_usize, 0.0);
        let (mut min, mut max) = (f64::INFINITY, f64::NEG_INFINITY);
        for &value in channel.values.iter().filter(|value| !value.is_nan()) {
            count += 1;
            sum += value;
            min = min.min(value);
            max = max.max(value);
        }
        let measured = |value: f64| (count > 0).then_some(value);
        Self {
            column: channel.column.clone(),
            quantity: channel.quantity.name().to_owned(),
            axis: channel.axis.clone(),
            unit: channel.quantity.unit(),
            missing: 1.0 - count as f64 / channel.values.len().max(1) as f64,
            min: measured(min),
            mean: measured(sum / count.max(1) as f64),
            max: measured(max),
        }
    }
}
