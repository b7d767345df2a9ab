//! Selects the clock of each group of columns: the caller's, a column of stamps by its name, or a stated rate.

use std::collections::BTreeMap;

use super::attitudes::EulerOrder;
use super::stamps::{Stamps, Times, at_rate};
use crate::error::InputError;
use crate::import::files::columns::{Block, Column};
use crate::import::files::date_times::origin_since_1970_s;
use crate::import::mapping::column_map::locate;
use crate::import::mapping::mapped::Mapped;
use crate::import::mapping::time_names;
use crate::recording::Quantity;
use crate::recording::units::{Dimension, Unit};

/// One `--time COLUMN:UNIT[:QUANTITY]`.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeOption {
    /// The column of stamps.
    pub column: String,
    /// Its unit, if stated by the caller.
    pub unit: Option<String>,
    /// Name of the only quantity to which it applies.
    pub target: Option<String>,
}

/// Clocks and attitudes as stated by the caller.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Said {
    /// Columns of stamps.
    pub times: Vec<TimeOption>,
    /// Rows a second of the gyros \[Hz\].
    pub rate_hz: Option<f64>,
    /// Sequence of Euler angles.
    pub euler: Option<EulerOrder>,
    /// Quantities sampled at the rows' ends.
    pub instants: Vec<Quantity>,
    /// True if stamps closer than the rows' period are accepted as the rows' ends.
    pub anyway: bool,
}

/// Columns on one clock: block, and the column of stamps.
pub type Group = (usize, Option<usize>);

impl TimeOption {
    /// Parses `COLUMN:UNIT:QUANTITY`; unit and quantity may be absent.
    pub fn parse(text: &str) -> Self {
        let mut parts = text.splitn(3, ':').map(str::trim);
        let mut next = || {
            parts
                .next()
                .filter(|part| !part.is_empty())
                .map(str::to_owned)
        };
        Self {
            column: next().unwrap_or_default(),
            unit: next(),
            target: next(),
        }
    }

    /// True if it states that there are no stamps.
    pub fn is_none(&self) -> bool {
        self.column == "none"
    }
}

/// Refuses columns of stamps that no file has.
pub fn check_times(blocks: &[Block], said: &Said) -> Result<(), InputError> {
    let mut named = said.times.iter().filter(|option| !option.is_none());
    named.try_for_each(|option| {
        let mut columns = blocks.iter().flat_map(|block| &block.columns);
        // A name that several files have stands for each of them.
        match columns.any(|column| column.name == option.column) {
            true => Ok(()),
            false => locate(blocks, &option.column, "--time").map(drop),
        }
    })
}

/// Returns the column of stamps of a mapped column, with a unit or without: as stated by the caller, else by its name. Also
/// true if the caller stated it.
pub fn stamps_in(blocks: &[Block], mapped: &Mapped, said: &Said) -> Option<(usize, bool)> {
    if said.times.iter().any(TimeOption::is_none) {
        return None;
    }
    let mut general = None;
    for option in &said.times {
        let mut columns = blocks[mapped.block].columns.iter();
        let Some(column) = columns.position(|column| column.name == option.column) else {
            continue;
        };
        match &option.target {
            Some(target) if *target == mapped.target.name() => return Some((column, true)),
            Some(_) => {}
            None => general = Some((column, true)),
        }
    }
    general.or_else(|| Some((by_name(&blocks[mapped.block], mapped)?, false)))
}

/// Returns the column of stamps of a mapped column, whose unit is known.
pub fn stamps_of(
    blocks: &[Block],
    mapped: &Mapped,
    said: &Said,
) -> Result<Option<usize>, InputError> {
    let Some((column, is_given)) = stamps_in(blocks, mapped, said) else {
        return Ok(None);
    };
    let block = &blocks[mapped.block];
    if time_unit(block, column, said)?.is_some() {
        return Ok(Some(column));
    }
    // With a rate, stamps of an unknown unit are not needed.
    if said.rate_hz.is_some() && !is_given {
        return Ok(None);
    }
    let name = &block.columns[column].name;
    Err(
        InputError::new(&block.file, "is a time whose unit stands nowhere")
            .channel(name)
            .expected(format!(
                "--time {name}:UNIT with UNIT one of {}, or --rate HZ",
                Dimension::Time.examples()
            )),
    )
}

/// Returns the column with a name or values of time: in the structure of the mapped column, or else the first.
fn by_name(block: &Block, mapped: &Mapped) -> Option<usize> {
    let is_time = |column: &Column| {
        let is_text = matches!(column.bad_cell, Some((0, _)));
        let is_named = time_names::time_in(block, column).is_some();
        let is_empty = column.values.iter().all(|value| value.is_nan());
        column.dates.is_some() || (!is_text && !is_empty && is_named)
    };
    // Of `imu.wb[0]` it is imu, of `avp[2]` avp.
    let structure = |name: &str| {
        let before = name.rsplit_once('.').map(|(before, _)| before);
        let before = before.or_else(|| Some(name.split_once('[')?.0));
        before.unwrap_or("").to_owned()
    };
    // The moment of the measurement, and not that of its message.
    let is_measured = |column: &Column| {
        let name: String = column.name.to_lowercase();
        let is_named = name.ends_with("header.stamp") || name.ends_with("timestamp_sample");
        is_named && is_time(column) && time_names::is_even(&column.values)
    };
    if let Some(measured) = block.columns.iter().position(is_measured) {
        return Some(measured);
    }
    let own = structure(&block.columns[mapped.column].name);
    let mut columns = block.columns.iter();
    let beside = columns.position(|column| is_time(column) && structure(&column.name) == own);
    beside.or_else(|| block.columns.iter().position(is_time))
}

/// Returns the unit of a column of stamps.
pub fn time_unit(block: &Block, column: usize, said: &Said) -> Result<Option<Unit>, InputError> {
    let column = &block.columns[column];
    if column.dates.is_some() {
        return Ok(Unit::parse("s"));
    }
    let given = said
        .times
        .iter()
        .find(|option| option.column == column.name);
    let written = given.and_then(|option| option.unit.clone());
    let in_file = || {
        time_names::time_in(block, column)
            .flatten()
            .or(column.unit.clone())
    };
    let Some(text) = written.or_else(in_file) else {
        return Ok(None);
    };
    let unit = Unit::parse(&text).filter(|unit| unit.dimension == Dimension::Time);
    unit.map(Some).ok_or_else(|| {
        InputError::new(&block.file, "is no unit of time")
            .channel(&column.name)
            .value(format!("{text:?}"))
            .expected(Dimension::Time.examples())
    })
}

/// Refuses one stated rate for tables of different length.
pub fn check_one_rate(
    blocks: &[Block],
    groups: &BTreeMap<Group, Vec<&Mapped>>,
) -> Result<(), InputError> {
    let without: Vec<&Block> = groups
        .keys()
        .filter(|(_, stamps)| stamps.is_none())
        .map(|(block, _)| &blocks[*block])
        .collect();
    match without[..] {
        [first, second, ..] => Err(InputError::new(
            &first.file,
            "has columns of two lengths and no stamps",
        )
        .value(format!(
            "{} rows ({}) and {} rows ({})",
            first.rows, first.columns[0].name, second.rows, second.columns[0].name
        ))
        .expected(
            "--time COLUMN:UNIT for each length, or --map COLUMN=none for what is not wanted",
        )),
        _ => Ok(()),
    }
}

/// Origin of all stamps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Origin {
    /// Whole second since 1970, UTC \[s\].
    pub since_1970_s: i64,
    /// True if the file states the zone; else its date-times were read as UTC.
    pub has_zone: bool,
}

/// Returns the whole second before all stamps that are date-times or seconds since 1970, which becomes time 0; `None` if no
/// stamps are.
///
/// # Errors
/// Some are and some count from an origin of their own: the offset between the two is unknown.
pub fn origin(
    blocks: &[Block],
    groups: &[&Group],
    said: &Said,
) -> Result<Option<Origin>, InputError> {
    let (mut origin, mut own): (Option<Origin>, _) = (None, None);
    for (b, stamps) in groups {
        let Some(stamps) = stamps else { continue };
        let (block, column) = (&blocks[*b], &blocks[*b].columns[*stamps]);
        let unit_s = time_unit(block, *stamps, said)?.map_or(1.0, |unit| unit.scale);
        let found = match column.dates {
            Some(dates) => dates.has_day.then_some(Origin {
                since_1970_s: dates.origin_s,
                has_zone: dates.has_zone,
            }),
            None => {
                let (first, last) = (column.values.first(), column.values.last());
                let ends = first.zip(last);
                let since = ends.and_then(|(a, b)| origin_since_1970_s(a * unit_s, b * unit_s));
                since.map(|since_1970_s| Origin {
                    since_1970_s,
                    has_zone: true,
                })
            }
        };
        match (found, origin) {
            (None, _) => own = Some((block, column)),
            (Some(found), None) => origin = Some(found),
            (Some(found), Some(before)) => {
                origin = Some(Origin {
                    since_1970_s: found.since_1970_s.min(before.since_1970_s),
                    has_zone: found.has_zone && before.has_zone,
                });
            }
        }
    }
    match (origin, own) {
        (Some(_), Some((block, column))) => Err(InputError::new(
            &block.file,
            "has stamps that count from a moment of their own, beside others that are dates",
        )
        .channel(&column.name)
        .value(column.values.first().copied().unwrap_or(f64::NAN))
        .expected("one clock for all tables: --time COLUMN:UNIT names another column")),
        _ => Ok(origin),
    }
}

/// Returns stamps in seconds since `origin`, or else since their own zero.
fn seconds(column: &Column, unit_s: f64, origin: Option<Origin>) -> Vec<f64> {
    let origin_s = origin.map_or(0, |origin| origin.since_1970_s);
    let values = column.values.iter();
    match column.dates {
        Some(dates) => {
            let from_origin_s = (dates.origin_s - origin_s) as f64;
            values.map(|value| value + from_origin_s).collect()
        }
        None => {
            // Subtracted before the scaling, so that whole milliseconds stay whole.
            let origin = (origin_s as f64 / unit_s).round();
            values.map(|value| (value - origin) * unit_s).collect()
        }
    }
}

/// Makes the error of rows without a time, which names a column whose text may be a time.
fn no_time(block: &Block) -> InputError {
    let is_named = |column: &&Column| time_names::time_unit(&column.name).is_some();
    let text = block.columns.iter().filter(is_named).find_map(|column| {
        let (row, text) = column.bad_cell.as_ref()?;
        Some((column, *row, text))
    });
    match text {
        Some((column, row, text)) => InputError::new(&block.file, "has times in a form that is not known")
            .channel(&column.name)
            .row(row)
            .value(format!("{text:?}"))
            .expected(
                "seconds, 2026-03-01T12:00:00.5, 2026/03/01 12:00:00.5 or 01.03.2026 12:00:00.5 (03/01/2026 is two days), or \
                 --rate HZ for even rows",
            ),
        None => InputError::new(&block.file, "does not say when its rows were taken")
            .expected("--time COLUMN:UNIT, or --rate HZ for even rows"),
    }
}

/// Returns the clock of a group.
pub fn times(
    blocks: &[Block],
    (b, stamps): Group,
    columns: &[&Mapped],
    said: &Said,
    origin: Option<Origin>,
) -> Result<Times, InputError> {
    let block = &blocks[b];
    let has_gyros = columns.iter().any(|mapped| mapped.target.is_gyro());
    let rate_hz = said.rate_hz.filter(|_| has_gyros || stamps.is_none());
    let Some(column) = stamps else {
        let rate_hz = rate_hz.or(block.rate_hz).ok_or_else(|| no_time(block))?;
        return Ok(at_rate(rate_hz, block.rows));
    };
    let unit_s = time_unit(block, column, said)?.map_or(1.0, |unit| unit.scale);
    let column = &block.columns[column];
    column.check(&block.file)?;
    let stamps = Stamps {
        file: &block.file,
        name: &column.name,
        stamps_s: seconds(column, unit_s, origin),
        unit_s,
    };
    match rate_hz {
        Some(rate_hz) => stamps.at_rate(rate_hz),
        None => stamps.clock(
            columns.iter().any(|mapped| mapped.target.is_of_a_period()),
            said.anyway,
        ),
    }
}
