//! `rlg inspect`: lists the content of a recording, after every check made on reading it; or that of a parameter block.

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use super::block::Block;
use crate::error::InputError;
use crate::health_check::{Crossing, Relation, SlowChannel, slow_channels};
use crate::limits_file;
use crate::recording::{Channel, Clock, Quantity, Recording, Table};
use crate::terminal::Terminal;

/// Least width of a column's name in the list.
const COLUMN_WIDTH: usize = 12;

/// Largest number of crossings of a channel that are printed; the result holds all.
const CROSSINGS_SAID: usize = 5;

/// Check a recording and list its tables, channels and segments, or list the content of a parameter block
///
/// Temperatures and the channels of the unit's health have a list of their own: rate, missing rows and range, and with --limits each
/// stretch beyond a limit with its times.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  rlg inspect recordings/bench-17 --json\n  rlg inspect flight --limits limits.toml\n  rlg inspect params.bin"
)]
pub struct Inspect {
    /// Folder with recording.toml, or a parameter block of rlg params
    recording: PathBuf,
    /// Limits of the unit's health: the file of rlg params --limits, or a parameter block that holds some
    #[arg(long, value_name = "FILE")]
    limits: Option<PathBuf>,
}

#[derive(Serialize)]
struct Inventory {
    format: u32,
    recording: String,
    version: &'static str,
    site: Option<SiteFacts>,
    tables: Vec<TableFacts>,
    segments: Vec<SegmentFacts>,
    /// Temperatures and the channels of the unit's health.
    health: Vec<HealthFacts>,
}

/// A slow channel.
#[derive(Serialize)]
struct HealthFacts {
    quantity: String,
    axis: Option<String>,
    rate_hz: f64,
    missing: f64,
    min: Option<f64>,
    max: Option<f64>,
    /// Stretches beyond a limit; absent without --limits.
    #[serde(skip_serializing_if = "Option::is_none")]
    crossings: Option<Vec<CrossingFacts>>,
}

#[derive(Serialize)]
struct CrossingFacts {
    /// Key of the limit.
    limit: &'static str,
    /// `below`, `above`, `stepped`, `reset` or `absent`.
    relation: &'static str,
    bound: f64,
    start_s: f64,
    end_s: f64,
    worst: Option<f64>,
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
        if begins_as_block(&self.recording) {
            return self.block(terminal);
        }
        let limits = self.limits.as_deref().map(limits_file::read_either);
        let limits = limits.transpose()?;
        let recording = Recording::read(&self.recording)?;
        let channels = slow_channels(&recording, limits.as_ref());
        let mut inventory = Inventory::of(&recording);
        let health = channels.iter();
        inventory.health = health
            .map(|channel| HealthFacts::of(channel, limits.is_some()))
            .collect();
        terminal.say(inventory.text());
        if !channels.is_empty() {
            terminal.say(health_text(&channels));
        }
        terminal.result(&inventory)
    }

    /// Lists the content of a parameter block.
    fn block(&self, terminal: &Terminal) -> Result<(), InputError> {
        let path = &self.recording;
        if self.limits.is_some() {
            return Err(
                InputError::new(path, "is a parameter block, which has no channels")
                    .channel("--limits")
                    .expected("a recording"),
            );
        }
        let bytes = std::fs::read(path).map_err(|error| InputError::unreadable(path, &error))?;
        let block = Block::read(path, &bytes)?;
        terminal.say(format!(
            "{}: parameter block of {} bytes, generation {}",
            path.display(),
            block.bytes,
            block.generation
        ));
        terminal.say(block.text());
        terminal.result(&block)
    }
}

/// True if `path` is a file that begins as a parameter block does.
fn begins_as_block(path: &Path) -> bool {
    let mut begin = [0; limits_file::BLOCK_MAGIC.len()];
    let file = std::fs::File::open(path);
    file.and_then(|mut file| file.read_exact(&mut begin))
        .is_ok()
        && begin == limits_file::BLOCK_MAGIC
}

/// Formats the list of slow channels.
fn health_text(channels: &[SlowChannel]) -> String {
    let mut out = "\nhealth".to_owned();
    for channel in channels {
        let name = match &channel.axis {
            Some(axis) => format!("{} {axis}", channel.quantity.name()),
            None => channel.quantity.name().to_owned(),
        };
        let range = channel.range.map_or_else(
            || "nothing measured".to_owned(),
            |[least, largest]| match channel.quantity {
                Quantity::PathLengthResets => format!("{least} to {largest}"),
                _ => format!("{least:.5} to {largest:.5}"),
            },
        );
        let unit = channel.quantity.unit().filter(|unit| *unit != "1");
        let _ = write!(
            out,
            "\n  {name:<22} {:>9.3} Hz {:>7.3} % missing   {range} {}",
            channel.rate_hz,
            100.0 * channel.missing,
            unit.unwrap_or_default()
        );
        out.truncate(out.trim_end().len());
        for crossing in channel.crossings.iter().take(CROSSINGS_SAID) {
            let _ = write!(out, "\n      {}", crossing_text(crossing));
        }
        let more = channel.crossings.len().saturating_sub(CROSSINGS_SAID);
        if more > 0 {
            let _ = write!(out, "\n      {more} more; --json lists them");
        }
    }
    out
}

fn crossing_text(crossing: &Crossing) -> String {
    let Crossing {
        limit,
        bound,
        times_s: [first_s, last_s],
        ..
    } = crossing;
    let worst = crossing.worst.unwrap_or(f64::NAN);
    let stretch = format!("from {first_s:.3} s to {last_s:.3} s");
    match crossing.relation {
        Relation::Below => format!("below {limit} = {bound} {stretch}, least {worst:.5}"),
        Relation::Above => format!("above {limit} = {bound} {stretch}, largest {worst:.5}"),
        Relation::Stepped => format!("step of {worst:.5} at {first_s:.3} s, {limit} = {bound}"),
        Relation::Reset => format!("reset at {first_s:.3} s ({worst} more), {limit} is watched"),
        Relation::Absent => format!("not measured {stretch}, {limit} is watched"),
    }
}

impl HealthFacts {
    fn of(channel: &SlowChannel, has_limits: bool) -> Self {
        let crossings = channel.crossings.iter().map(|crossing| CrossingFacts {
            limit: crossing.limit,
            relation: crossing.relation.word(),
            bound: crossing.bound,
            start_s: crossing.times_s[0],
            end_s: crossing.times_s[1],
            worst: crossing.worst,
        });
        Self {
            quantity: channel.quantity.name().to_owned(),
            axis: channel.axis.clone(),
            rate_hz: channel.rate_hz,
            missing: channel.missing,
            min: channel.range.map(|[least, _]| least),
            max: channel.range.map(|[_, largest]| largest),
            crossings: has_limits.then(|| crossings.collect()),
        }
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
            health: Vec::new(),
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
            let names = table.channels.iter().map(|channel| channel.column.len());
            let width = names.fold(COLUMN_WIDTH, usize::max);
            let _ = write!(
                out,
                "  {:<width$} {:<22} {:<4} {:<6} {:>9} {:>13} {:>13} {:>13}",
                "column", "quantity", "axis", "unit", "missing", "least", "mean", "greatest"
            );
            for channel in &table.channels {
                let number =
                    |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{v:.5e}"));
                let _ = write!(
                    out,
                    "\n  {:<width$} {:<22} {:<4} {:<6} {:>7.3} % {:>13} {:>13} {:>13}",
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
