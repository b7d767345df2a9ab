//! Assembles mapped columns of foreign files: one table a clock, channels in SI, derived quantities formed.

use std::collections::BTreeMap;
use std::path::Path;

use super::attitudes::increments_of_angle;
use super::clocks::{Group, Origin, Said, check_one_rate, origin, stamps_of, times};
use super::column_stems::stem;
use super::sense::other_sense;
use super::stamps::Times;
use crate::error::InputError;
use crate::import::files::columns::Block;
use crate::import::mapping::mapped::{Mapped, Plan};
use crate::import::mapping::targets::Target;
use crate::recording::{Channel, Clock, Quantity, Table};

/// A channel with the description of its origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Taken {
    /// The table's file.
    pub table: String,
    /// The column in the recording.
    pub column: String,
    /// The quantity's name.
    pub quantity: String,
    /// The axis.
    pub axis: Option<String>,
    /// Origin: columns and unit.
    pub origin: String,
}

/// Tables of a recording, and the origin of each channel.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Assembled {
    /// The tables.
    pub tables: Vec<Table>,
    /// The channels' origins.
    pub taken: Vec<Taken>,
    /// Angle of a pulse \[rad\] of gyro x, y, z, for gyros that count.
    pub pulse_weight_rad: [f64; 3],
    /// Origin of the stamps, if they are dates.
    pub origin: Option<Origin>,
    /// Columns of stamps that became clocks.
    pub stamps: Vec<String>,
    /// Notes for the user, as clauses.
    pub notes: Vec<String>,
}

/// Quantities that are sums over a row, not means.
const SUMS: [Quantity; 3] = [
    Quantity::GyroIncrement,
    Quantity::VelocityIncrement,
    Quantity::ReferenceIncrement,
];

/// Use of the blocks' values after an assembly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Values {
    /// Kept for another assembly.
    Kept,
    /// Moved into the channels, or freed: a long file is in memory once.
    Moved,
}

/// Assembles the tables.
pub fn assemble(
    blocks: &mut [Block],
    plan: &Plan,
    said: &Said,
    values: Values,
) -> Result<Assembled, InputError> {
    let mut groups: BTreeMap<Group, Vec<&Mapped>> = BTreeMap::new();
    for mapped in &plan.mapped {
        let stamps = stamps_of(blocks, mapped, said)?;
        groups
            .entry((mapped.block, stamps))
            .or_default()
            .push(mapped);
    }
    check_one_rate(blocks, &groups)?;
    let has_gyros = |columns: &[&Mapped]| columns.iter().any(|mapped| mapped.target.is_gyro());
    let mut groups: Vec<(Group, Vec<&Mapped>)> = groups.into_iter().collect();
    groups.sort_by_key(|(_, columns)| !has_gyros(columns));
    let of_all: Vec<&Group> = groups.iter().map(|(group, _)| group).collect();
    let origin = origin(blocks, &of_all, said)?;
    let mut assembled = Assembled {
        origin,
        ..Assembled::default()
    };
    let mut parts = Vec::new();
    for (group, columns) in groups {
        let name_of = |column: usize| blocks[group.0].columns[column].name.clone();
        assembled.stamps.extend(group.1.map(name_of));
        let times = times(blocks, group, &columns, said, origin)?;
        check_instants(&blocks[group.0], &times, &columns, said)?;
        parts.extend(apart(times, columns));
    }
    if values == Values::Moved {
        free_unmapped(blocks, plan);
    }
    for (place, (times, columns)) in parts.into_iter().enumerate() {
        let name = match place {
            0 => "samples.parquet".to_owned(),
            1 => "reference.parquet".to_owned(),
            more => format!("table-{more}.parquet"),
        };
        let mut builder = Builder {
            blocks: &mut *blocks,
            plan,
            moved: values == Values::Moved,
            name,
            times,
            channels: Vec::new(),
            assembled: &mut assembled,
        };
        builder.stored(&columns)?;
        builder.increments(&columns)?;
        builder.attitudes(&columns, said)?;
        builder.finish();
    }
    check_one_clock(&blocks[0].file, &assembled.tables)?;
    Ok(assembled)
}

/// Frees the values of columns that are not mapped; clocks are formed already.
fn free_unmapped(blocks: &mut [Block], plan: &Plan) {
    for (place, block) in blocks.iter_mut().enumerate() {
        for (at, column) in block.columns.iter_mut().enumerate() {
            let mut mapped = plan.mapped.iter();
            if !mapped.any(|mapped| (mapped.block, mapped.column) == (place, at)) {
                column.values = Vec::new();
            }
        }
    }
}

/// Refuses tables that share no time with the gyros': two clocks, or two recordings.
fn check_one_clock(file: &Path, tables: &[Table]) -> Result<(), InputError> {
    let Some((gyros, others)) = tables.split_first() else {
        return Ok(());
    };
    let apart = others
        .iter()
        .find(|other| other.end_s() <= gyros.start_s() || other.start_s() >= gyros.end_s());
    match apart {
        Some(other) => Err(InputError::new(file, "shares no time with the gyros")
            .channel(&other.file)
            .value(format!("{:.3} to {:.3} s", other.start_s(), other.end_s()))
            .expected(format!(
                "rows between {:.3} and {:.3} s, by one clock (--time COLUMN:UNIT)",
                gyros.start_s(),
                gyros.end_s()
            ))),
        None => Ok(()),
    }
}

/// Refuses instants with jittering stamps: means over uneven rows can be resampled on an even clock, instants cannot.
fn check_instants(
    block: &Block,
    times: &Times,
    columns: &[&Mapped],
    said: &Said,
) -> Result<(), InputError> {
    let Times::Resampled { note, .. } = times else {
        return Ok(());
    };
    let is_instant = |mapped: &&&Mapped| match &mapped.target {
        Target::Stored(quantity) => said.instants.contains(quantity),
        Target::ReferenceRate => said.instants.contains(&Quantity::ReferenceIncrement),
        _ => false,
    };
    match columns.iter().find(is_instant) {
        Some(mapped) => Err(InputError::new(
            &block.file,
            "is sampled at an instant by uneven stamps",
        )
        .channel(&block.columns[mapped.column].name)
        .value(note)
        .expected("--rate HZ if the unit samples evenly, or --sampling mean")),
        None => Ok(()),
    }
}

/// Separates attitudes from resampled rows: they keep their stamps, in a table of their own.
fn apart(times: Times, columns: Vec<&Mapped>) -> Vec<(Times, Vec<&Mapped>)> {
    let Times::Resampled { resampling, .. } = &times else {
        return vec![(times, columns)];
    };
    let stamped = Times::Stamped(resampling.stamps_s.clone());
    let is_attitude = |mapped: &&Mapped| mapped.target.is_attitude();
    let (attitudes, others): (Vec<_>, Vec<_>) = columns.into_iter().partition(is_attitude);
    let mut parts = vec![(times, others)];
    if !attitudes.is_empty() {
        parts.push((stamped, attitudes));
    }
    parts
}

/// A table under construction.
pub(super) struct Builder<'a> {
    pub(super) blocks: &'a mut [Block],
    plan: &'a Plan,
    moved: bool,
    name: String,
    times: Times,
    channels: Vec<Channel>,
    pub(super) assembled: &'a mut Assembled,
}

impl Builder<'_> {
    pub(super) fn file(&self, mapped: &Mapped) -> &Path {
        &self.blocks[mapped.block].file
    }

    pub(super) fn source(&self, mapped: &Mapped) -> &str {
        &self.blocks[mapped.block].columns[mapped.column].name
    }

    /// Returns the values of a column in SI on the table's rows.
    pub(super) fn values(&mut self, mapped: &Mapped) -> Vec<f64> {
        let mut values = self.stored_values(mapped);
        values
            .iter_mut()
            .for_each(|value| *value = mapped.unit.to_si(*value));
        match &self.times {
            Times::Stamped(_) => values,
            Times::Resampled { resampling, .. } => match &mapped.target {
                Target::Stored(quantity) if SUMS.contains(quantity) => resampling.sums(&values),
                Target::ReferenceAngle => resampling.steps(&increments_of_angle(&values)),
                target if target.is_of_a_period() => resampling.means(&values),
                _ => resampling.latest(&values),
            },
            Times::Even { places, .. } => {
                let rows = places.last().map_or(0, |last| last + 1);
                if rows == values.len() {
                    // Places ascend, so none is missing.
                    return values;
                }
                let mut filled = vec![f64::NAN; rows];
                for (place, value) in places.iter().zip(values) {
                    filled[*place] = value;
                }
                filled
            }
        }
    }

    /// Takes the values of a column as stored, or copies those that are used again.
    fn stored_values(&mut self, mapped: &Mapped) -> Vec<f64> {
        let place = (mapped.block, mapped.column);
        let all = self.plan.mapped.iter();
        let uses = all.filter(|one| (one.block, one.column) == place).count();
        let values = &mut self.blocks[place.0].columns[place.1].values;
        match self.moved && uses == 1 {
            true => std::mem::take(values),
            false => values.clone(),
        }
    }

    /// Adds a channel and its origin.
    pub(super) fn add(
        &mut self,
        quantity: Quantity,
        axis: Option<&str>,
        scaling: (f64, f64),
        values: Vec<f64>,
        origin: String,
    ) {
        let column = match (&quantity, axis) {
            (Quantity::Other(_), _) => origin.split(" [").next().unwrap_or_default().to_owned(),
            (Quantity::Temperature, Some(axis)) => format!("temperature_{axis}"),
            (quantity, axis) => format!("{}{}", stem(quantity), axis.unwrap_or_default()),
        };
        self.assembled.taken.push(Taken {
            table: self.name.clone(),
            column: column.clone(),
            quantity: quantity.name().to_owned(),
            axis: axis.map(str::to_owned),
            origin,
        });
        self.channels.push(Channel {
            column,
            quantity,
            axis: axis.map(str::to_owned),
            scale: scaling.0,
            offset: scaling.1,
            values,
        });
    }

    fn origin(&self, mapped: &Mapped) -> String {
        format!("{} [{}]", self.source(mapped), mapped.unit_text)
    }

    /// Adds channels that only change their unit.
    fn stored(&mut self, columns: &[&Mapped]) -> Result<(), InputError> {
        for mapped in columns {
            let Target::Stored(quantity) = &mapped.target else {
                continue;
            };
            let origin = self.origin(mapped);
            let axis = mapped.axis.as_deref();
            let mut scaling = (mapped.unit.scale, mapped.unit.offset);
            if *quantity == Quantity::ReferenceAttitude {
                continue;
            }
            if *quantity == Quantity::GyroCount {
                self.check_counts(mapped)?;
            }
            let mut values = self.values(mapped);
            if *quantity == Quantity::GyroCount {
                let place = axis.and_then(|axis| "xyz".find(axis)).unwrap_or(0);
                self.assembled.pulse_weight_rad[place] = mapped.unit.scale.abs();
                // The model holds the weight; a negative one is a gyro that counts backwards.
                let sign = mapped.unit.scale.signum();
                values
                    .iter_mut()
                    .for_each(|value| *value = (*value / mapped.unit.scale).round() * sign);
                scaling = (1.0, 0.0);
            }
            self.add(quantity.clone(), axis, scaling, values, origin);
        }
        Ok(())
    }

    /// Refuses counts that are not whole, or with uneven rows.
    fn check_counts(&self, mapped: &Mapped) -> Result<(), InputError> {
        let raw = &self.blocks[mapped.block].columns[mapped.column].values;
        let fault = |problem: &str| {
            InputError::new(self.file(mapped), problem).channel(self.source(mapped))
        };
        if let Some(row) = raw.iter().position(|count| count.fract().abs() > 0.0) {
            return Err(fault("is not a whole number of pulses")
                .row(row as u64)
                .value(raw[row])
                .expected("pulses counted over the row; for angles map it to gyro_increment"));
        }
        match &self.times {
            Times::Resampled { note, .. } => Err(fault("counts pulses over uneven rows")
                .value(note)
                .expected("even stamps, or --map to gyro_increment")),
            _ => Ok(()),
        }
    }

    /// Forms `reference_increment` from rates and from an encoder's angles.
    fn increments(&mut self, columns: &[&Mapped]) -> Result<(), InputError> {
        let mut encoders = Vec::new();
        for mapped in columns {
            if !matches!(
                mapped.target,
                Target::ReferenceRate | Target::ReferenceAngle
            ) {
                continue;
            }
            let axis = mapped.axis.as_deref();
            let values = self.values(mapped);
            let values = match mapped.target {
                Target::ReferenceRate => {
                    let period_s = self.period_s();
                    values
                        .iter()
                        .map(|rate_rad_s| rate_rad_s * period_s)
                        .collect()
                }
                _ => {
                    encoders.push(axis.unwrap_or_default().to_owned());
                    match self.times {
                        // Differenced before they were resampled.
                        Times::Resampled { .. } => values,
                        _ => increments_of_angle(&values),
                    }
                }
            };
            let how = match mapped.target {
                Target::ReferenceRate => "times the period",
                _ => "differenced over whole turns",
            };
            let origin = format!("{} {how}", self.origin(mapped));
            self.add(
                Quantity::ReferenceIncrement,
                axis,
                (1.0, 0.0),
                values,
                origin,
            );
        }
        self.still_axes(&encoders);
        Ok(())
    }

    /// Adds zeros for the axes about which a table with one encoder does not rotate.
    fn still_axes(&mut self, encoders: &[String]) {
        let [encoder] = encoders else {
            return;
        };
        let known = |axis: &str| {
            let mut channels = self.channels.iter();
            channels.any(|channel| {
                channel.quantity == Quantity::ReferenceIncrement
                    && channel.axis.as_deref() == Some(axis)
            })
        };
        let still: Vec<&str> = ["x", "y", "z"]
            .into_iter()
            .filter(|axis| !known(axis))
            .collect();
        let Some(rows) = self.channels.last().map(|channel| channel.values.len()) else {
            return;
        };
        for axis in &still {
            let origin = format!("zero: the table turns about {encoder} alone");
            self.add(
                Quantity::ReferenceIncrement,
                Some(axis),
                (1.0, 0.0),
                vec![0.0; rows],
                origin,
            );
        }
        if !still.is_empty() {
            self.assembled.notes.push(format!(
                "only one encoder, about {encoder}: the reference is taken to stand still about {}",
                still.join(" and ")
            ));
        }
    }

    fn period_s(&self) -> f64 {
        match &self.times {
            Times::Even { rate_hz, .. } => 1.0 / rate_hz,
            Times::Resampled { resampling, .. } => 1.0 / resampling.rate_hz,
            Times::Stamped(_) => f64::NAN,
        }
    }

    /// Returns the finished table.
    fn finish(self) {
        let rows = self
            .channels
            .first()
            .map_or(0, |channel| channel.values.len());
        let clock = match self.times {
            Times::Even {
                rate_hz,
                start_s,
                places,
                jitter_s,
            } => {
                if let Some(jitter_s) = jitter_s {
                    let note = format!(
                        "{}: the stamps jitter by {:.3} ms (rms) about an even clock of {rate_hz:.3} Hz, which the rows are \
                         taken to follow",
                        self.name,
                        1e3 * jitter_s
                    );
                    self.assembled.notes.push(note);
                }
                let missing = rows - places.len();
                if missing > 0 {
                    let note = format!(
                        "{}: {missing} of {rows} rows are missing between the stamps",
                        self.name
                    );
                    self.assembled.notes.push(note);
                }
                Clock::Uniform { rate_hz, start_s }
            }
            Times::Resampled { resampling, note } => {
                self.assembled.notes.push(note);
                Clock::Uniform {
                    rate_hz: resampling.rate_hz,
                    start_s: resampling.start_s,
                }
            }
            Times::Stamped(stamps_s) => Clock::Stamped {
                column: "t".to_owned(),
                stamps_s,
            },
        };
        let table = Table {
            file: self.name,
            clock,
            rows,
            channels: self.channels,
        };
        self.assembled.notes.extend(other_sense(&table));
        self.assembled.tables.push(table);
    }
}
