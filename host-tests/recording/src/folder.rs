//! Reads a recording's folder into memory, and checks its values.
//!
//! Every channel becomes value = stored · scale + offset in SI. Impossible inputs are rejected by name: a count that is
//! not whole, an infinite value, a whole channel in another unit or without a single value, stamps that do not
//! increase. Possible faults of the unit (a jump, a stuck run, a gap) are left to the user of the recording.

use std::ops::Range;
use std::path::Path;

use super::manifest::{ChannelEntry, ClockEntry, MANIFEST, Manifest, TableEntry};
use super::sampling::on_one_footing;
use super::{Channel, Clock, Quantity, Recording, Table, csv_table, misspelt, parquet_table};
use crate::error::InputError;
use crate::toml_file;

/// Largest distance of a count from an integer \[pulse\]: a count times a scale of 1 is exact; a scale that undoes
/// another (stored in 1/1000 pulses, say) leaves rounding of the order 1e-10 pulse. Beyond a millionth of a pulse the
/// column holds no counts.
const WHOLE_COUNT: f64 = 1e-6;

/// Largest count: the firmware reads the sensor's counter as i32.
const LARGEST_COUNT: f64 = i32::MAX as f64;

/// Largest value: larger numbers are damage, in any unit; sums of products of three stay within the range of f64.
const LARGEST_VALUE: f64 = 1e30;

impl Recording {
    /// True if the folder's manifest can be read and has a table in `file`.
    pub fn lists_table(folder: impl AsRef<Path>, file: &str) -> bool {
        Manifest::read(&folder.as_ref().join(MANIFEST))
            .is_ok_and(|manifest| manifest.tables.iter().any(|table| table.file == file))
    }

    /// Returns the quantities of the channels of the recording in `folder`, from its manifest alone.
    pub fn quantities(folder: impl AsRef<Path>) -> Result<Vec<Quantity>, InputError> {
        let manifest = Self::manifest_of(folder.as_ref())?;
        let channels = manifest.tables.iter().flat_map(|table| &table.channels);
        Ok(channels.map(ChannelEntry::quantity).collect())
    }

    /// Returns the start time of the recording, from the manifest's `start`; `None` without one.
    pub fn start(folder: impl AsRef<Path>) -> Result<Option<String>, InputError> {
        let manifest = Self::manifest_of(folder.as_ref())?;
        Ok(manifest.start.map(|start| start.to_string()))
    }

    /// Returns the names of all files of the recording in `folder`: the manifest, then its tables.
    pub fn files(folder: impl AsRef<Path>) -> Result<Vec<String>, InputError> {
        let manifest = Self::manifest_of(folder.as_ref())?;
        let tables = manifest.tables.into_iter().map(|table| table.file);
        Ok(std::iter::once(MANIFEST.to_owned()).chain(tables).collect())
    }

    /// Reads and checks the recording in `folder`.
    pub fn read(folder: impl AsRef<Path>) -> Result<Self, InputError> {
        let folder = folder.as_ref();
        let manifest = Self::manifest_of(folder)?;
        let name = Self::name_of(folder, &manifest);
        let tables = manifest.tables.iter();
        let tables = tables.map(|entry| read_table(folder, entry, None));
        let mut tables: Vec<Table> = tables.collect::<Result<_, _>>()?;
        on_one_footing(&folder.join(MANIFEST), &manifest.tables, &mut tables)?;
        Ok(Self {
            name,
            folder: folder.to_path_buf(),
            site: manifest.site(),
            tables,
            segments: manifest.segments(),
        })
    }

    /// Checks the values of every channel as [`Recording::read`] does, for a recording converted from `file`.
    pub fn check_values(&self, file: &Path) -> Result<(), InputError> {
        for table in &self.tables {
            let period_s = table.clock.period_s(table.rows);
            let mut channels = table.channels.iter();
            channels.try_for_each(|channel| check_values(file, channel, period_s, true))?;
        }
        Ok(())
    }

    /// Reads the manifest of a folder.
    pub(super) fn manifest_of(folder: &Path) -> Result<Manifest, InputError> {
        if !folder.exists() {
            return Err(InputError::new(folder, "does not exist")
                .expected(format!("a recording: a folder with {MANIFEST}")));
        }
        if !folder.is_dir() {
            return Err(InputError::new(folder, "is not a folder")
                .expected(format!("a recording: a folder with {MANIFEST}")));
        }
        let path = folder.join(MANIFEST);
        let text = toml_file::read_text(&path)?;
        // Before the check for missing keys, since a key may be present under a misspelt name.
        misspelt::check_keys(&path, &toml_file::table(&path, &text)?)?;
        Manifest::from_text(&path, &text)
    }

    /// Returns the name in the manifest, or else the folder's.
    pub(super) fn name_of(folder: &Path, manifest: &Manifest) -> String {
        manifest.name.clone().unwrap_or_else(|| {
            let last = folder.file_name().unwrap_or(folder.as_os_str());
            last.to_string_lossy().into_owned()
        })
    }
}

/// Reads and checks a table, or some rows of a Parquet table.
pub(super) fn read_table(
    folder: &Path,
    entry: &TableEntry,
    rows: Option<Range<usize>>,
) -> Result<Table, InputError> {
    let whole = rows.is_none();
    let path = folder.join(&entry.file);
    let mut wanted: Vec<&str> = entry.channels.iter().map(|c| c.column.as_str()).collect();
    if let ClockEntry::Stamped { column } = entry.clock() {
        wanted.push(column);
    }
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    let mut columns = match extension.as_ref().and_then(|e| e.to_str()) {
        Some("parquet") => parquet_table::read_rows(&path, &wanted, rows)?,
        Some("csv") => csv_table::read(&path, &wanted)?,
        _ => {
            return Err(InputError::new(&path, "is a table of an unknown kind")
                .expected("a name that ends in .parquet or .csv"));
        }
    };
    let mut rows = columns.first().map_or(0, Vec::len);
    if rows == 0 {
        return Err(InputError::new(&path, "has no rows").expected("at least one row of data"));
    }
    let clock = match entry.clock() {
        ClockEntry::Uniform { rate_hz, start_s } => Clock::Uniform { rate_hz, start_s },
        ClockEntry::Stamped { column } => {
            let stamps_s = columns.pop().unwrap_or_default();
            check_stamps(&path, column, &stamps_s)?;
            let sums = |channel: &ChannelEntry| channel.quantity().is_of_a_period();
            match Grid::of(&stamps_s).filter(|_| entry.channels.iter().any(sums)) {
                Some(grid) => {
                    rows = grid.rows();
                    columns.iter_mut().for_each(|column| grid.fill(column));
                    grid.clock
                }
                None => Clock::Stamped {
                    column: column.to_owned(),
                    stamps_s,
                },
            }
        }
    };
    let period_s = clock.period_s(rows);
    let mut channels = Vec::with_capacity(columns.len());
    for (channel, mut values) in entry.channels.iter().zip(columns) {
        // A rate of a quantity that is an angle over the row's period.
        let period = if channel.is_rate { period_s } else { 1.0 };
        let (scale, offset) = (channel.scale * period, channel.offset * period);
        for value in &mut values {
            *value = *value * scale + offset;
        }
        let channel = Channel {
            column: channel.column.clone(),
            quantity: channel.quantity(),
            axis: channel.axis.clone(),
            scale,
            offset,
            values,
        };
        check_values(&path, &channel, period_s, whole)?;
        channels.push(channel);
    }
    Ok(Table {
        file: entry.file.clone(),
        clock,
        rows,
        channels,
    })
}

/// Uniform grid of rows, some of which may be missing: sums over a row's period need one period for all rows.
struct Grid {
    clock: Clock,
    /// Index in the grid of each row present.
    places: Vec<usize>,
}

impl Grid {
    fn of(stamps_s: &[f64]) -> Option<Self> {
        /// Largest deviation of a stamp from the grid \[rows\], as of one printed with few digits.
        const OFF_ROWS: f64 = 0.01;
        /// Smallest share of the grid's rows that must be present.
        const FEWEST: f64 = 0.5;
        let (first, last) = (*stamps_s.first()?, *stamps_s.last()?);
        let mut apart_s: Vec<f64> = stamps_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        apart_s.sort_by(f64::total_cmp);
        let usual_s = *apart_s.get(apart_s.len().checked_sub(1)? / 2)?;
        // The median period is as coarse as the printed stamps: rows are counted from one to the next.
        let mut place = 0;
        let mut places = vec![0];
        for pair in stamps_s.windows(2) {
            place += ((pair[1] - pair[0]) / usual_s).round().max(1.0) as usize;
            places.push(place);
        }
        let measured_hz = place as f64 / (last - first);
        let rate_hz = match (measured_hz - measured_hz.round()).abs() * (last - first) < OFF_ROWS {
            true => measured_hz.round(),
            false => measured_hz,
        };
        let is_on = |(place, stamp): (&usize, &f64)| {
            ((stamp - first) * rate_hz - *place as f64).abs() < OFF_ROWS
        };
        let is_full = stamps_s.len() as f64 > FEWEST * (place + 1) as f64;
        let is_grid = is_full && places.iter().zip(stamps_s).all(is_on);
        is_grid.then_some(Self {
            clock: Clock::Uniform {
                rate_hz,
                start_s: first,
            },
            places,
        })
    }

    fn rows(&self) -> usize {
        self.places.last().map_or(0, |last| last + 1)
    }

    /// Fills missing rows with NaN.
    fn fill(&self, column: &mut Vec<f64>) {
        let mut filled = vec![f64::NAN; self.rows()];
        for (place, value) in self.places.iter().zip(column.iter()) {
            filled[*place] = *value;
        }
        *column = filled;
    }
}

fn check_stamps(path: &Path, column: &str, stamps_s: &[f64]) -> Result<(), InputError> {
    let mut previous = f64::NEG_INFINITY;
    for (row, &stamp) in stamps_s.iter().enumerate() {
        if !stamp.is_finite() || stamp <= previous {
            let expected = if row == 0 || !stamp.is_finite() {
                "a time in s in every row".to_owned()
            } else {
                format!("a time after {previous} s")
            };
            return Err(
                InputError::new(path, "has time stamps that do not increase")
                    .channel(column)
                    .row(row as u64)
                    .value(stamp)
                    .expected(expected),
            );
        }
        previous = stamp;
    }
    Ok(())
}

fn check_values(
    path: &Path,
    channel: &Channel,
    period_s: f64,
    whole: bool,
) -> Result<(), InputError> {
    let quantity = &channel.quantity;
    let fault = |row: usize, problem: &str, expected: &str| {
        InputError::new(path, problem)
            .channel(format!("{} ({})", channel.column, quantity.name()))
            .row(row as u64)
            .value(channel.values[row])
            .expected(expected)
    };
    for (row, &value) in channel.values.iter().enumerate() {
        if value.is_infinite() {
            return Err(fault(
                row,
                "is infinite",
                "a finite number, or NaN where nothing was measured",
            ));
        }
        if value.abs() > LARGEST_VALUE {
            return Err(fault(
                row,
                "is beyond anything that is measured",
                "a value that an instrument can show, or NaN where nothing was measured",
            ));
        }
        if *quantity == Quantity::GyroCount && !value.is_nan() {
            if (value - value.round()).abs() > WHOLE_COUNT {
                return Err(fault(
                    row,
                    "is not a whole number of pulses",
                    "pulses counted over the row",
                ));
            }
            if value.abs() > LARGEST_COUNT {
                return Err(fault(
                    row,
                    "is beyond a 32-bit counter",
                    "pulses counted over the row",
                ));
            }
        }
    }
    let mut magnitudes: Vec<f64> = channel
        .values
        .iter()
        .filter(|v| !v.is_nan())
        .map(|v| v.abs())
        .collect();
    if !whole {
        // A stretch may be a gap, or too quiet to identify a unit.
        return Ok(());
    }
    if magnitudes.is_empty() {
        if quantity.is_essential() {
            return Err(
                InputError::new(path, "has no value: every row is null or NaN")
                    .channel(format!("{} ({})", channel.column, quantity.name()))
                    .expected("measured values"),
            );
        }
        return Ok(());
    }
    if let Some(plausible) = quantity.plausible(period_s) {
        let middle = magnitudes.len() / 2;
        let median = *magnitudes.select_nth_unstable_by(middle, f64::total_cmp).1;
        if !(plausible.least..=plausible.greatest).contains(&median) {
            return Err(InputError::new(
                path,
                format!("cannot be in {}", quantity.unit().unwrap_or("1")),
            )
            .channel(format!("{} ({})", channel.column, quantity.name()))
            .value(format!("a median magnitude of {median:.6e}"))
            .expected(format!(
                "{:.3e} to {:.3e} {} ({})",
                plausible.least,
                plausible.greatest,
                quantity.unit().unwrap_or("1"),
                plausible.reason
            )));
        }
    }
    Ok(())
}
