//! Parses `recording.toml`: the list of tables and the meaning of their columns.
//!
//! Every check that needs no table is done here. Keys outside the contract are ignored: others may add to it.

use std::collections::HashSet;
use std::path::{Component, Path};

use serde::Deserialize;

use super::nearest::nearest;
use super::quantity::{AxisRule, same_unit};
use super::units::{Dimension, Unit};
use super::{Quantity, Segment, Site};
use crate::error::InputError;
use crate::toml_file;

/// File name of the manifest in the folder.
pub const MANIFEST: &str = "recording.toml";

/// Name of case rates in the file, read as [`Quantity::ReferenceIncrement`]: rate times period.
const REFERENCE_RATE: &str = "reference_rate";

/// Axis expected of a quantity of the whole unit.
const NO_AXIS: &str = "no axis: it is one of the whole unit";

/// Sampling at the row's end.
pub(super) const INSTANT: &str = "instant";

/// Plausible range of gravity on Earth \[m/s²\]; a value outside is in other units.
const GRAVITY_M_S2: [f64; 2] = [9.0, 10.5];

#[derive(Debug, Deserialize)]
pub(super) struct Manifest {
    pub name: Option<String>,
    pub instrument: Option<String>,
    pub start: Option<toml::value::Datetime>,
    pub site: Option<SiteEntry>,
    #[serde(default, rename = "table")]
    pub tables: Vec<TableEntry>,
    #[serde(default, rename = "segment")]
    pub segments: Vec<SegmentEntry>,
}

#[derive(Debug, Deserialize)]
pub(super) struct SiteEntry {
    latitude_rad: f64,
    gravity_m_s2: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct TableEntry {
    pub file: String,
    rate_hz: Option<f64>,
    time: Option<String>,
    start_s: Option<f64>,
    #[serde(default, rename = "channel")]
    pub channels: Vec<ChannelEntry>,
}

#[derive(Debug, Deserialize)]
pub(super) struct ChannelEntry {
    pub column: String,
    quantity: String,
    pub axis: Option<String>,
    unit: Option<String>,
    sampling: Option<String>,
    #[serde(default = "unscaled")]
    pub scale: f64,
    #[serde(default)]
    pub offset: f64,
    /// The channel holds rates of a quantity that is an angle over the row's period.
    #[serde(skip)]
    pub is_rate: bool,
}

#[derive(Debug, Deserialize)]
pub(super) struct SegmentEntry {
    name: String,
    kind: String,
    start_s: f64,
    end_s: f64,
}

fn unscaled() -> f64 {
    1.0
}

/// Clock of a table before its stamps are read.
pub(super) enum ClockEntry<'a> {
    Uniform { rate_hz: f64, start_s: f64 },
    Stamped { column: &'a str },
}

impl Manifest {
    /// Reads and checks `path`.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::from_text(path, &toml_file::read_text(path)?)
    }

    /// Checks a text of the present or future content of `path`.
    pub fn from_text(path: &Path, text: &str) -> Result<Self, InputError> {
        let (_, mut manifest): (_, Self) = toml_file::parse(path, text)?;
        manifest.check(path)?;
        for channel in manifest
            .tables
            .iter_mut()
            .flat_map(|table| &mut table.channels)
        {
            channel.turn_into_si();
        }
        Ok(manifest)
    }

    fn check(&self, path: &Path) -> Result<(), InputError> {
        if self.tables.is_empty() {
            return Err(InputError::new(path, "lists no table").expected("at least one [[table]]"));
        }
        let mut files = HashSet::new();
        for table in &self.tables {
            table.check(path)?;
            if !files.insert(table.file.as_str()) {
                return Err(InputError::new(path, "lists the same file twice").value(&table.file));
            }
        }
        if let Some(site) = &self.site {
            let bounds = [-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2];
            toml_file::within(path, "site.latitude_rad", site.latitude_rad, bounds, "rad")?;
            toml_file::within(
                path,
                "site.gravity_m_s2",
                site.gravity_m_s2,
                GRAVITY_M_S2,
                "m/s^2",
            )?;
        }
        self.segments
            .iter()
            .try_for_each(|segment| segment.check(path))
    }

    pub fn site(&self) -> Option<Site> {
        self.site.as_ref().map(|site| Site {
            latitude_rad: site.latitude_rad,
            gravity_m_s2: site.gravity_m_s2,
        })
    }

    pub fn segments(&self) -> Vec<Segment> {
        let segment = |entry: &SegmentEntry| Segment {
            name: entry.name.clone(),
            kind: entry.kind.clone(),
            start_s: entry.start_s,
            end_s: entry.end_s,
        };
        self.segments.iter().map(segment).collect()
    }
}

impl TableEntry {
    fn check(&self, path: &Path) -> Result<(), InputError> {
        let inside = Path::new(&self.file)
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        if !inside || self.file.is_empty() {
            return Err(
                InputError::new(path, "names a table outside the recording's folder")
                    .channel("table.file")
                    .value(&self.file)
                    .expected("a file name inside the folder"),
            );
        }
        let key = |name: &str| format!("table {}, {name}", self.file);
        match (self.rate_hz, &self.time) {
            (Some(rate_hz), None) => {
                if !(rate_hz.is_finite() && rate_hz > 0.0) {
                    return Err(InputError::new(path, "is not a rate")
                        .channel(key("rate_hz"))
                        .value(rate_hz)
                        .expected("a positive number of rows per second"));
                }
            }
            (None, Some(_)) => {
                if self.start_s.is_some_and(|start_s| start_s != 0.0) {
                    return Err(
                        InputError::new(path, "has a start beside a column of times")
                            .channel(key("start_s"))
                            .value(self.start_s.unwrap_or_default())
                            .expected("`start_s` with `rate_hz` only"),
                    );
                }
            }
            (both, _) => {
                let found = if both.is_some() { "both" } else { "neither" };
                return Err(
                    InputError::new(path, "does not say when its rows were taken")
                        .channel(format!("table {}", self.file))
                        .value(found)
                        .expected("either `rate_hz` or `time`"),
                );
            }
        }
        if self.start_s.is_some_and(|start_s| !start_s.is_finite()) {
            return Err(InputError::new(path, "is not a time")
                .channel(key("start_s"))
                .value(self.start_s.unwrap_or_default())
                .expected("a finite number of seconds"));
        }
        if self.channels.is_empty() {
            return Err(InputError::new(path, "has no channel")
                .channel(format!("table {}", self.file))
                .expected("at least one [[table.channel]]"));
        }
        for (index, channel) in self.channels.iter().enumerate() {
            channel.check(path, &self.file)?;
            for earlier in &self.channels[..index] {
                channel.check_beside(earlier, path, &self.file)?;
            }
        }
        Ok(())
    }

    pub fn clock(&self) -> ClockEntry<'_> {
        match (&self.time, self.rate_hz) {
            (Some(column), _) => ClockEntry::Stamped { column },
            (None, rate_hz) => ClockEntry::Uniform {
                rate_hz: rate_hz.unwrap_or(f64::NAN),
                start_s: self.start_s.unwrap_or(0.0),
            },
        }
    }
}

impl ChannelEntry {
    pub fn quantity(&self) -> Quantity {
        Quantity::from_name(&self.quantity)
    }

    /// True if the channel holds the value at the row's end instead of a mean over the row.
    pub fn is_instant(&self) -> bool {
        self.sampling.as_deref() == Some(INSTANT)
    }

    /// Rejects an unknown sampling, or an instant of a quantity counted over a row.
    fn check_sampling(&self, path: &Path, name: &str) -> Result<(), InputError> {
        let fault = |problem: &str, expected: &str| {
            let found = self.sampling.as_deref().unwrap_or_default();
            Err(InputError::new(path, problem)
                .channel(format!("{name}, sampling"))
                .value(format!("{found:?}"))
                .expected(expected))
        };
        match (self.sampling.as_deref(), self.quantity()) {
            (None | Some("mean"), _) => Ok(()),
            (Some(INSTANT), Quantity::GyroCount | Quantity::GyroIncrement) => fault(
                "is counted over a row and cannot be sampled at an instant",
                "gyro_rate for a rate that is sampled, or sampling = \"mean\"",
            ),
            (Some(INSTANT), _) => Ok(()),
            _ => fault(
                "is no way to sample",
                "\"mean\" over the row or \"instant\", at its end",
            ),
        }
    }

    /// Unit of stored × scale + offset, if given and different from the quantity's own.
    fn own_unit(&self) -> Option<&str> {
        let written = self.unit.as_deref()?;
        let expected = match self.quantity.as_str() {
            REFERENCE_RATE => "rad/s",
            _ => self.quantity().unit()?,
        };
        (!same_unit(written, expected)).then_some(written)
    }

    /// Dimension of the stored values.
    fn dimension(&self) -> Option<Dimension> {
        match self.quantity.as_str() {
            REFERENCE_RATE => Some(Dimension::AngularRate),
            _ => Dimension::of(&self.quantity()),
        }
    }

    /// Includes a given unit in scale and offset.
    fn turn_into_si(&mut self) {
        if let Some(unit) = self.own_unit().and_then(Unit::parse) {
            self.offset = self.offset * unit.scale + unit.offset;
            self.scale *= unit.scale;
            self.unit = None;
        }
        if self.quantity == REFERENCE_RATE {
            self.is_rate = true;
            self.quantity = Quantity::ReferenceIncrement.name().to_owned();
        }
    }

    fn check(&self, path: &Path, file: &str) -> Result<(), InputError> {
        let name = format!("table {file}, channel {}", self.column);
        if self.quantity != REFERENCE_RATE {
            check_quantity(path, &name, &self.quantity)?;
        }
        let quantity = self.quantity();
        let axis = self.axis.as_deref();
        let (allowed, expected) = match quantity.axis_rule() {
            AxisRule::Body => (
                matches!(axis, Some("x" | "y" | "z")),
                "\"x\", \"y\" or \"z\"",
            ),
            AxisRule::BodyOrNone => (
                matches!(axis, None | Some("x" | "y" | "z")),
                "\"x\", \"y\", \"z\" or no axis",
            ),
            AxisRule::Absent => (axis.is_none(), NO_AXIS),
            AxisRule::Quaternion => (
                matches!(axis, Some("w" | "x" | "y" | "z")),
                "\"w\", \"x\", \"y\" or \"z\"",
            ),
            AxisRule::Free if self.quantity == REFERENCE_RATE => (
                matches!(axis, Some("x" | "y" | "z")),
                "\"x\", \"y\" or \"z\"",
            ),
            AxisRule::Free => (true, ""),
        };
        if !allowed {
            let problem = format!("{} cannot have this axis", quantity.name());
            return Err(InputError::new(path, problem)
                .channel(name)
                .value(axis.map_or("none".to_owned(), |axis| format!("{axis:?}")))
                .expected(match expected {
                    NO_AXIS => NO_AXIS.to_owned(),
                    labels => format!("axis = {labels}"),
                }));
        }
        let fits = |unit: Unit| {
            let is_count = quantity == Quantity::GyroCount;
            !is_count && Some(unit.dimension) == self.dimension()
        };
        if let Some(written) = self
            .own_unit()
            .filter(|unit| !Unit::parse(unit).is_some_and(fits))
        {
            let problem = format!("{} is in another unit", self.quantity);
            let own = quantity.unit().unwrap_or("1");
            let examples = self.dimension().map_or("1", Dimension::examples);
            return Err(InputError::new(path, problem)
                .channel(name)
                .value(format!("{written:?}"))
                .expected(match quantity {
                    Quantity::GyroCount => "\"1\" after scale and offset".to_owned(),
                    _ => format!("{own:?} after scale and offset, or one of {examples}"),
                }));
        }
        self.check_sampling(path, &name)?;
        if !self.scale.is_finite() || self.scale == 0.0 {
            return Err(InputError::new(path, "is not a scale")
                .channel(format!("{name}, scale"))
                .value(self.scale)
                .expected("a finite number other than 0"));
        }
        if !self.offset.is_finite() {
            return Err(InputError::new(path, "is not an offset")
                .channel(format!("{name}, offset"))
                .value(self.offset)
                .expected("a finite number"));
        }
        Ok(())
    }

    fn check_beside(&self, earlier: &Self, path: &Path, file: &str) -> Result<(), InputError> {
        let (quantity, name) = (
            self.quantity(),
            format!("table {file}, channel {}", self.column),
        );
        // One thermometer may serve several gyros; every other column measures one quantity.
        if self.column == earlier.column && quantity != Quantity::Temperature {
            return Err(InputError::new(path, "is listed twice")
                .channel(name)
                .expected("one [[table.channel]] for each column"));
        }
        let labelled = !matches!(quantity, Quantity::Other(_)) && self.axis.is_some();
        if labelled && quantity == earlier.quantity() && self.axis == earlier.axis {
            return Err(
                InputError::new(path, "measures what another channel already measures")
                    .channel(name)
                    .value(format!(
                        "{} {} in column {} too",
                        quantity.name(),
                        self.axis.as_deref().unwrap_or_default(),
                        earlier.column
                    ))
                    .expected("each quantity and axis once in a table"),
            );
        }
        Ok(())
    }
}

impl SegmentEntry {
    fn check(&self, path: &Path) -> Result<(), InputError> {
        let name = format!("segment {}", self.name);
        for (key, value) in [("start_s", self.start_s), ("end_s", self.end_s)] {
            if !value.is_finite() {
                return Err(InputError::new(path, "is not a time")
                    .channel(format!("{name}, {key}"))
                    .value(value)
                    .expected("a finite number of seconds"));
            }
        }
        if self.end_s <= self.start_s {
            return Err(InputError::new(path, "ends before it starts")
                .channel(name)
                .value(format!(
                    "start_s = {}, end_s = {}",
                    self.start_s, self.end_s
                ))
                .expected("end_s after start_s"));
        }
        Ok(())
    }
}

/// Rejects a quantity with a name similar to that of a listed one.
fn check_quantity(path: &Path, channel: &str, name: &str) -> Result<(), InputError> {
    let listed = || Quantity::LISTED.iter().map(Quantity::name);
    match nearest(name, listed()).filter(|near| *near != name) {
        Some(near) => Err(InputError::new(path, "is no quantity")
            .channel(channel)
            .value(format!("{name:?}"))
            .expected(format!(
                "{near:?}; a quantity of your own has a name that is like no listed one: \"custom_{name}\""
            ))),
        None => Ok(()),
    }
}
