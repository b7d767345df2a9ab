//! Finds the clock of each group of columns: the caller's word, a column of stamps by its name, or a stated rate.

use std::collections::BTreeMap;

use super::attitudes::EulerOrder;
use super::stamps::{Stamps, Times, at_rate};
use crate::error::InputError;
use crate::import::files::columns::Block;
use crate::import::files::units::{Dimension, Unit};
use crate::import::mapping::column_map::{Mapped, locate};
use crate::import::mapping::column_names;
use crate::import::mapping::known_forms::Form;

/// One `--time COLUMN:UNIT[:QUANTITY]`.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeOption {
    /// The column of stamps.
    pub column: String,
    /// Its unit, where the caller states it.
    pub unit: Option<String>,
    /// The only quantity that it holds for, by its name.
    pub target: Option<String>,
}

/// What the caller says of the clocks and attitudes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Said {
    /// Columns of stamps.
    pub times: Vec<TimeOption>,
    /// Rows a second of the gyros \[Hz\].
    pub rate_hz: Option<f64>,
    /// Sequence of Euler angles.
    pub euler: Option<EulerOrder>,
}

/// Columns on one clock: block, and the column of stamps.
pub type Group = (usize, Option<usize>);

impl TimeOption {
    /// Takes `COLUMN:UNIT:QUANTITY` apart; unit and quantity may be absent.
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

    /// Whether it says that there are no stamps.
    pub fn is_none(&self) -> bool {
        self.column == "none"
    }
}

/// The column of stamps that holds for a mapped column: as the caller says, else by its name.
pub fn stamps_of(
    blocks: &[Block],
    mapped: &Mapped,
    said: &Said,
) -> Result<Option<usize>, InputError> {
    if said.times.iter().any(TimeOption::is_none) {
        return Ok(None);
    }
    let mut general = None;
    for option in &said.times {
        let (block, column) = locate(blocks, &option.column, "--time")?;
        if block != mapped.block {
            continue;
        }
        match &option.target {
            Some(target) if *target == mapped.target.name() => return Ok(Some(column)),
            Some(_) => {}
            None => general = Some(column),
        }
    }
    let block = &blocks[mapped.block];
    let by_name = || {
        let mut columns = block.columns.iter();
        columns.position(|column| {
            let is_text = matches!(column.bad_cell, Some((0, _)));
            !is_text && column_names::time_unit(&column.name).is_some()
        })
    };
    let Some(column) = general.or_else(by_name) else {
        return Ok(None);
    };
    if time_unit(block, column, said)?.is_some() {
        return Ok(Some(column));
    }
    // A rate makes stamps of an unknown unit needless.
    if said.rate_hz.is_some() && general.is_none() {
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

/// The unit of a column of stamps.
fn time_unit(block: &Block, column: usize, said: &Said) -> Result<Option<Unit>, InputError> {
    let column = &block.columns[column];
    let given = said
        .times
        .iter()
        .find(|option| option.column == column.name);
    let written = given.and_then(|option| option.unit.clone());
    let in_file = || {
        column_names::time_unit(&column.name)
            .flatten()
            .or(column.unit.clone())
    };
    let by_form = || Some(Form::of(block)?.unit("time")?.to_owned());
    let Some(text) = written.or_else(in_file).or_else(by_form) else {
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

/// The clock of a group.
pub fn times(
    blocks: &[Block],
    (b, stamps): Group,
    columns: &[&Mapped],
    said: &Said,
) -> Result<Times, InputError> {
    let block = &blocks[b];
    let has_gyros = columns.iter().any(|mapped| mapped.target.is_gyro());
    let rate_hz = said.rate_hz.filter(|_| has_gyros || stamps.is_none());
    let Some(column) = stamps else {
        let rate_hz = rate_hz.or(block.rate_hz).ok_or_else(|| {
            InputError::new(&block.file, "does not say when its rows were taken")
                .expected("--time COLUMN:UNIT, or --rate HZ for even rows")
        })?;
        return Ok(at_rate(rate_hz, block.rows));
    };
    let unit_s = time_unit(block, column, said)?.map_or(1.0, |unit| unit.scale);
    let column = &block.columns[column];
    column.check(&block.file)?;
    let stamps = Stamps {
        file: &block.file,
        name: &column.name,
        stamps_s: column.values.iter().map(|value| value * unit_s).collect(),
        unit_s,
    };
    match rate_hz {
        Some(rate_hz) => stamps.at_rate(rate_hz),
        None => stamps.clock(columns.iter().any(|mapped| mapped.target.is_of_a_period())),
    }
}
