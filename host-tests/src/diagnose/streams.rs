//! The recording as the diagnosis sees it: every channel on the gyros' rows.
//!
//! Enters: [`Recording`] and [`Model`]. Leaves: [`Streams`], row k covering
//! \[start + k/rate, start + (k+1)/rate), increments in rad (body axes), slow channels interpolated to the
//! row's middle, and a mask of the rows in which everything needed was measured.
//!
//! At rest on the Earth the case's motion is the Earth's rotation (still.rs), and no reference is needed.
//!
//! The first row of a dithered recording is dropped: its increment needs the pickoff before it.
//! Deliberately not here: filling gaps with anything but a straight line (those rows are masked), and
//! references slower than the gyros.

use super::accelerometer::rows::Rows;
use super::pieces::Piece;
use super::still::AtRest;
use crate::error::InputError;
use crate::model::{Model, MotionSource};
use crate::recording::{Channel, Clock, Quantity, Recording, Site, Table};

/// Axis names in index order.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// Quantity of the recorder's own times, beside a nominal clock \[s\].
const TIME_STAMP: &str = "time_stamp";

/// Channels of one kind on the three body axes, `[axis][row]`.
pub type Triad = [Vec<f64>; 3];

/// All channels on the gyros' rows.
pub struct Streams {
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// Beginning of row 0 \[s\].
    pub start_s: f64,
    /// Number of rows.
    pub rows: usize,
    /// Angle of one pulse \[rad\]; 0 where the gyros report increments or rates.
    pub pulse_rad: [f64; 3],
    /// What each gyro sensed over the row \[rad\], its own dither included.
    pub sensed_rad: Triad,
    /// Block relative to case at the row's end \[rad\], as the pickoff says; one entry more than rows, the
    /// first being the end of the row before. `None` for gyros without dither channels.
    pub pickoff_rad: Option<Triad>,
    /// The case's angle over the row \[rad\], as the reference says, or as the Earth turns.
    pub case_rad: Triad,
    /// Whether the case's motion is what the gyros themselves say, because the reference is slower than they.
    pub own_motion: bool,
    /// What is known of a unit that stands still; `None` where a reference tells its motion.
    pub at_rest: Option<AtRest>,
    /// The recorder's own time at each row's end \[s\], NaN in gaps.
    pub stamps_s: Option<Vec<f64>>,
    /// Mean specific force \[m/s²\].
    pub force_m_s2: Option<Triad>,
    /// Temperature \[K\].
    pub temperature_k: Option<Triad>,
    /// Magnetic flux density \[T\].
    pub magnetic_t: Option<Triad>,
    /// Channels of unknown quantity, by name, for the search of unlisted physics.
    pub others: Vec<(String, Vec<f64>)>,
    /// Rows in which gyros, pickoffs and reference were all measured.
    pub usable: Vec<bool>,
    /// The same before faults of the data took rows out of use.
    pub measured: Vec<bool>,
    /// Which rows come from which recording; one piece, all rows, unless they were joined (pieces.rs).
    pub pieces: Vec<Piece>,
    /// The accelerometers on rows of their own, or why there are none to diagnose.
    pub accelerometers: Result<Rows, String>,
    /// Where the recording was made.
    pub site: Option<Site>,
    /// Channels with rows that were not measured, with those rows.
    unmeasured: Vec<(String, Vec<bool>)>,
}

impl Streams {
    /// Puts the recording's channels on the gyros' rows.
    pub fn align(recording: &Recording, model: &Model) -> Result<Self, InputError> {
        Self::align_with(recording, model, false)
    }

    /// The same without a reference on the rows: the case's motion is left at nothing, to be filled from the
    /// gyros (attitude/own_motion.rs).
    pub fn align_without_reference(
        recording: &Recording,
        model: &Model,
    ) -> Result<Self, InputError> {
        Self::align_with(recording, model, true)
    }

    fn align_with(
        recording: &Recording,
        model: &Model,
        own_motion: bool,
    ) -> Result<Self, InputError> {
        let file = recording.folder.join("recording.toml");
        let site = match (model.motion, recording.site) {
            _ if own_motion => None,
            (MotionSource::Reference, _) => None,
            (MotionSource::Static, Some(site)) => Some(site),
            (MotionSource::Static, None) => {
                return Err(
                    InputError::new(&file, "does not say where the unit stood still")
                        .channel("site")
                        .expected(
                            "latitude_rad and gravity_m_s2, for the model's motion is static",
                        ),
                );
            }
        };
        let finder = Finder::new(recording);
        let gyro = finder.gyro(&file)?;
        let (rate_hz, table_start_s) = gyro.clock;
        let dithered = gyro.quantity == Quantity::GyroCount;
        // Increments and rates carry no dither to strip (contract), whatever else was recorded.
        let pickoff = finder.triad(&Quantity::DitherAngle).filter(|_| dithered);
        if dithered && pickoff.is_none() && model.dither.is_some() {
            return Err(InputError::new(
                &file,
                "the model has a dither pickoff, the recording none",
            )
            .channel("dither_angle")
            .expected("dither_angle channels on x, y and z"));
        }
        let reference = match site {
            Some(_) => None,
            None if own_motion => None,
            None => Some(finder.triad(&Quantity::ReferenceIncrement).ok_or_else(|| {
                InputError::new(&file, "no reference to predict the gyros from")
                    .channel("reference_increment")
                    .expected(
                        "reference_increment channels on x, y and z, or a model with static motion",
                    )
            })?),
        };
        let skip = usize::from(pickoff.is_some());
        let table_rows = gyro.channels[0].values.len();
        if table_rows < skip + 2 {
            return Err(InputError::new(&file, "too few rows")
                .value(table_rows)
                .expected("at least 3 rows"));
        }
        let rows = table_rows - skip;
        let grid = Grid {
            rate_hz,
            start_s: table_start_s,
            rows: table_rows,
        };

        let mut unmeasured: Vec<(String, Vec<bool>)> = Vec::new();
        let mut missing = |stem: &str, axis: usize, missing: Vec<bool>| {
            if missing.contains(&true) {
                unmeasured.push((format!("{stem}_{}", AXES[axis]), missing));
            }
        };
        let mut increments = |stem: &str,
                              channels: &[(&Channel, &Table); 3],
                              factor: &dyn Fn(usize) -> f64| {
            let mut triad: Triad = Default::default();
            for (axis, (channel, table)) in channels.iter().enumerate() {
                let all = grid.on_rows(&file, channel, table)?;
                let mut values: Vec<f64> = all[skip..].iter().map(|v| v * factor(axis)).collect();
                missing(
                    stem,
                    axis,
                    values.iter().map(|value| !value.is_finite()).collect(),
                );
                bridge_gaps(&mut values);
                triad[axis] = values;
            }
            Ok::<Triad, InputError>(triad)
        };
        let gyro_pairs = [0, 1, 2].map(|axis| (gyro.channels[axis], gyro.table));
        let sensed_rad = match gyro.quantity {
            Quantity::GyroCount => increments("gyro", &gyro_pairs, &|axis| {
                model.gyro.pulse_weight_rad[axis]
            })?,
            Quantity::GyroRate => increments("gyro", &gyro_pairs, &|_| 1.0 / rate_hz)?,
            _ => increments("gyro", &gyro_pairs, &|_| 1.0)?,
        };
        let mut case_rad: Triad = match &reference {
            Some(reference) => increments("reference", reference, &|_| 1.0)?,
            None => [0, 1, 2].map(|_| vec![0.0; rows]),
        };
        let pickoff_rad = match &pickoff {
            None => None,
            Some(channels) => {
                let mut triad: Triad = Default::default();
                for (axis, (channel, table)) in channels.iter().enumerate() {
                    let mut values = grid.on_rows(&file, channel, table)?;
                    let either = |pair: &[f64]| !pair[0].is_finite() || !pair[1].is_finite();
                    missing("dither", axis, values.windows(2).map(either).collect());
                    bridge_gaps(&mut values);
                    triad[axis] = values;
                }
                Some(triad)
            }
        };
        let measured: Vec<bool> = (0..rows)
            .map(|row| !unmeasured.iter().any(|(_, missing)| missing[row]))
            .collect();
        // Rows in a long gap of a slow channel are out of use; a channel that is mostly gap is absent.
        let mut usable = measured.clone();
        let mut slow = |quantity: &Quantity| {
            let mut triad = finder
                .triad(quantity)?
                .map(|(channel, table)| grid.at_middle(channel, table).split_off(skip));
            /// More than this share of gaps, and explaining with the channel would cost more than it tells.
            const MOST_GAPS: f64 = 0.3;
            let gaps = triad
                .iter()
                .flatten()
                .filter(|value| value.is_nan())
                .count();
            if gaps as f64 > MOST_GAPS * (3 * rows) as f64 {
                return None;
            }
            for values in &mut triad {
                for (usable, value) in usable.iter_mut().zip(values.iter()) {
                    *usable &= !value.is_nan();
                }
                bridge_gaps(values);
            }
            Some(triad)
        };
        let force_m_s2 = slow(&Quantity::SpecificForce).or_else(|| {
            let velocity = finder.triad(&Quantity::VelocityIncrement)?;
            let Clock::Uniform { rate_hz, .. } = velocity[0].1.clock else {
                return None;
            };
            let mut force = slow(&Quantity::VelocityIncrement)?;
            force
                .iter_mut()
                .flatten()
                .for_each(|value| *value *= rate_hz);
            Some(force)
        });
        let (temperature_k, magnetic_t) =
            (slow(&Quantity::Temperature), slow(&Quantity::MagneticField));
        let others = recording
            .tables
            .iter()
            .flat_map(|table| table.channels.iter().map(move |channel| (channel, table)))
            .filter(|(channel, _)| {
                matches!(&channel.quantity, Quantity::Other(name) if name != TIME_STAMP)
            })
            .map(|(channel, table)| {
                let axis = channel
                    .axis
                    .as_deref()
                    .map(|axis| format!("_{axis}"))
                    .unwrap_or_default();
                let name = match &channel.quantity {
                    Quantity::Other(name) => format!("{name}{axis}"),
                    _ => unreachable!("filtered above"),
                };
                let mut values = grid.at_middle(channel, table).split_off(skip);
                bridge_gaps(&mut values);
                (name, values)
            })
            .fold(
                Vec::new(),
                |mut others: Vec<(String, Vec<f64>)>, (name, values)| {
                    // Names become factors of an expression: no operators, no builtin's name, none twice.
                    let safe: String = name
                        .chars()
                        .map(|c| {
                            if c.is_alphanumeric() || c == '_' {
                                c
                            } else {
                                '_'
                            }
                        })
                        .collect();
                    let taken = |name: &str, others: &[(String, Vec<f64>)]| {
                        others.iter().any(|(n, _)| n == name)
                    };
                    let mut unique = format!("channel_{safe}");
                    while taken(&unique, &others) {
                        unique.push('_');
                    }
                    others.push((unique, values));
                    others
                },
            );
        let at_rest = site.map(|site| {
            // Nothing is taken from rows that will be held out.
            let fitted = 0..rows / 2;
            AtRest::new(
                &sensed_rad,
                force_m_s2.as_ref(),
                &usable,
                fitted,
                rate_hz,
                site,
            )
        });
        if let Some(rest) = &at_rest {
            case_rad = [0, 1, 2].map(|axis: usize| vec![rest.earth_rad_s[axis] / rate_hz; rows]);
        }
        let stamps_s = gyro
            .table
            .channels
            .iter()
            .find(|channel| channel.quantity == Quantity::Other(TIME_STAMP.to_string()))
            .map(|channel| channel.values[skip..].to_vec());
        let start_s = table_start_s + skip as f64 / rate_hz;
        let gyro_rows = (rate_hz, start_s, rows);
        Ok(Self {
            accelerometers: Rows::new(recording, gyro_rows),
            site: recording.site,
            rate_hz,
            start_s,
            rows,
            pulse_rad: if dithered {
                model.gyro.pulse_weight_rad
            } else {
                [0.0; 3]
            },
            sensed_rad,
            pickoff_rad,
            case_rad,
            own_motion,
            at_rest,
            stamps_s,
            force_m_s2,
            temperature_k,
            magnetic_t,
            others,
            usable,
            measured,
            pieces: vec![Piece {
                recording: recording.name.clone(),
                rows: 0..rows,
                start_s: table_start_s + skip as f64 / rate_hz,
                segments: recording.segments.clone(),
                held_out: false,
            }],
            unmeasured,
        })
    }

    /// Takes over which rows of `further` were not measured, behind its own.
    pub(super) fn append_unmeasured(&mut self, further: &Self) {
        let (before, rows) = (self.rows, further.rows);
        for (_, missing) in &mut self.unmeasured {
            missing.resize(before + rows, false);
        }
        for (channel, missing) in &further.unmeasured {
            let place = self.unmeasured.iter().position(|(name, _)| name == channel);
            let place = place.unwrap_or_else(|| {
                self.unmeasured
                    .push((channel.clone(), vec![false; before + rows]));
                self.unmeasured.len() - 1
            });
            self.unmeasured[place].1[before..].copy_from_slice(missing);
        }
    }

    /// A perfect, undithered unit on a given motion: what a proposed experiment would feed to the catalogue.
    pub fn of_motion(rate_hz: f64, case_rad: Triad) -> Self {
        let rows = case_rad[0].len();
        Self {
            rate_hz,
            start_s: 0.0,
            rows,
            pulse_rad: [0.0; 3],
            sensed_rad: case_rad.clone(),
            pickoff_rad: None,
            case_rad,
            own_motion: true,
            at_rest: None,
            stamps_s: None,
            force_m_s2: None,
            temperature_k: None,
            magnetic_t: None,
            others: Vec::new(),
            usable: vec![true; rows],
            measured: vec![true; rows],
            unmeasured: Vec::new(),
            accelerometers: Err(String::new()),
            site: None,
            pieces: vec![Piece {
                recording: String::new(),
                rows: 0..rows,
                start_s: 0.0,
                segments: Vec::new(),
                held_out: false,
            }],
        }
    }

    /// Rows on another clock and nothing on them: what splitting and locating need.
    pub(super) fn bare(rate_hz: f64, start_s: f64, usable: Vec<bool>, of: &Piece) -> Self {
        Self {
            rate_hz,
            start_s,
            rows: usable.len(),
            pulse_rad: [0.0; 3],
            sensed_rad: Triad::default(),
            pickoff_rad: None,
            case_rad: Triad::default(),
            own_motion: false,
            at_rest: None,
            stamps_s: None,
            force_m_s2: None,
            temperature_k: None,
            magnetic_t: None,
            others: Vec::new(),
            measured: usable.clone(),
            pieces: vec![Piece {
                rows: 0..usable.len(),
                start_s,
                ..of.clone()
            }],
            usable,
            accelerometers: Err(String::new()),
            site: None,
            unmeasured: Vec::new(),
        }
    }

    /// Beginning of a row \[s\].
    pub fn begin_s(&self, row: usize) -> f64 {
        self.start_s + row as f64 / self.rate_hz
    }

    /// A channel that was not measured in this row.
    pub fn unmeasured_channel(&self, row: usize) -> String {
        self.unmeasured
            .iter()
            .find(|(_, missing)| missing[row])
            .map_or_else(String::new, |(channel, _)| channel.clone())
    }

    /// Middle of a row \[s\].
    pub fn middle_s(&self, row: usize) -> f64 {
        self.start_s + (row as f64 + 0.5) / self.rate_hz
    }

    /// End of the last row \[s\].
    pub fn end_s(&self) -> f64 {
        self.start_s + self.rows as f64 / self.rate_hz
    }

    /// The first row that begins at or after `time_s`, at most `rows`.
    pub fn row_at(&self, time_s: f64) -> usize {
        (((time_s - self.start_s) * self.rate_hz).round().max(0.0) as usize).min(self.rows)
    }
}

/// The gyro channels and the clock of their table.
struct GyroTable<'a> {
    table: &'a Table,
    channels: [&'a Channel; 3],
    quantity: Quantity,
    clock: (f64, f64),
}

/// Finds channels by quantity and axis.
struct Finder<'a> {
    recording: &'a Recording,
}

impl<'a> Finder<'a> {
    fn new(recording: &'a Recording) -> Self {
        Self { recording }
    }

    fn one(&self, quantity: &Quantity, axis: &str) -> Option<(&'a Channel, &'a Table)> {
        self.recording.tables.iter().find_map(|table| {
            table
                .channels
                .iter()
                .find(|channel| {
                    channel.quantity == *quantity && channel.axis.as_deref() == Some(axis)
                })
                .map(|channel| (channel, table))
        })
    }

    fn triad(&self, quantity: &Quantity) -> Option<[(&'a Channel, &'a Table); 3]> {
        // One channel without an axis (a thermometer) serves all three.
        let shared = || {
            self.recording.tables.iter().find_map(|table| {
                let without =
                    |channel: &&Channel| channel.quantity == *quantity && channel.axis.is_none();
                table
                    .channels
                    .iter()
                    .find(without)
                    .map(|channel| (channel, table))
            })
        };
        let on = |axis: &str| self.one(quantity, axis).or_else(shared);
        Some([on("x")?, on("y")?, on("z")?])
    }

    fn gyro(&self, file: &std::path::Path) -> Result<GyroTable<'a>, InputError> {
        let kinds = [
            Quantity::GyroCount,
            Quantity::GyroIncrement,
            Quantity::GyroRate,
        ];
        let found = kinds
            .iter()
            .find_map(|quantity| Some((quantity, self.triad(quantity)?)));
        let Some((quantity, channels)) = found else {
            return Err(InputError::new(file, "no gyro channels on all three axes")
                .channel("gyro_count")
                .expected("gyro_count, gyro_increment or gyro_rate on x, y and z"));
        };
        let table = channels[0].1;
        let Clock::Uniform { rate_hz, start_s } = table.clock else {
            return Err(
                InputError::new(file, "the gyros' table has stamps instead of a rate")
                    .channel(table.file.clone())
                    .expected("rate_hz: gyro increments are summed over equal periods"),
            );
        };
        Ok(GyroTable {
            table,
            channels: channels.map(|(channel, _)| channel),
            quantity: quantity.clone(),
            clock: (rate_hz, start_s),
        })
    }
}

/// The rows of the gyros' table.
struct Grid {
    rate_hz: f64,
    start_s: f64,
    rows: usize,
}

impl Grid {
    /// A hundredth of a row: closer than that, two clocks are the same clock.
    const SAME_ROW: f64 = 0.01;

    /// The channel's values on the gyros' rows, NaN where it has none: its table must have the same rate and
    /// begin a whole number of rows earlier or later.
    fn on_rows(
        &self,
        file: &std::path::Path,
        channel: &Channel,
        table: &Table,
    ) -> Result<Vec<f64>, InputError> {
        let offset = match table.clock {
            Clock::Uniform { rate_hz, start_s } => {
                let drift = (rate_hz - self.rate_hz) * self.rows as f64 / self.rate_hz;
                let offset = (start_s - self.start_s) * self.rate_hz;
                let whole = (offset - offset.round()).abs() < Self::SAME_ROW;
                (drift.abs() < Self::SAME_ROW && whole).then_some(offset.round() as i64)
            }
            Clock::Stamped { .. } => None,
        };
        let Some(offset) = offset else {
            return Err(InputError::new(file, "not on the gyros' rows")
                .channel(channel.column.clone())
                .value(format!("{} rows in {}", channel.values.len(), table.file))
                .expected(format!(
                    "rows at {} Hz, a whole number of them from {} s, as the gyros have",
                    self.rate_hz, self.start_s
                )));
        };
        let value = |row: usize| {
            usize::try_from(row as i64 - offset)
                .ok()
                .and_then(|row| channel.values.get(row).copied())
        };
        Ok((0..self.rows)
            .map(|row| value(row).unwrap_or(f64::NAN))
            .collect())
    }

    /// The channel at the middle of each gyro row, by straight lines; held at the ends, NaN in gaps.
    fn at_middle(&self, channel: &Channel, table: &Table) -> Vec<f64> {
        // Means over a row belong to its middle, readings to its end.
        let at_row = match channel.quantity {
            Quantity::SpecificForce | Quantity::VelocityIncrement => 0.5,
            _ => 1.0,
        };
        let stamp = |row: usize| match &table.clock {
            Clock::Uniform { rate_hz, start_s } => start_s + (row as f64 + at_row) / rate_hz,
            Clock::Stamped { stamps_s, .. } => stamps_s[row],
        };
        let known: Vec<usize> = (0..channel.values.len())
            .filter(|&row| channel.values[row].is_finite())
            .collect();
        // Longer than three readings without one is a gap, not a slow channel.
        let period_s = table.clock.period_s(channel.values.len());
        let mut after = 0;
        (0..self.rows)
            .map(|row| {
                let time_s = self.start_s + (row as f64 + 0.5) / self.rate_hz;
                while after < known.len() && stamp(known[after]) < time_s {
                    after += 1;
                }
                match (
                    after.checked_sub(1).map(|before| known[before]),
                    known.get(after),
                ) {
                    (Some(before), Some(&after))
                        if stamp(after) - stamp(before) > 3.5 * period_s =>
                    {
                        f64::NAN
                    }
                    (Some(before), Some(&after)) => {
                        let share = (time_s - stamp(before)) / (stamp(after) - stamp(before));
                        channel.values[before]
                            + share * (channel.values[after] - channel.values[before])
                    }
                    (Some(before), None) => channel.values[before],
                    (None, Some(&after)) => channel.values[after],
                    (None, None) => 0.0,
                }
            })
            .collect()
    }
}

/// Replaces what was not measured by a straight line, so that filters stay finite; the mask remembers.
fn bridge_gaps(values: &mut [f64]) {
    let mut row = 0;
    while row < values.len() {
        if values[row].is_finite() {
            row += 1;
            continue;
        }
        let begin = row;
        while row < values.len() && !values[row].is_finite() {
            row += 1;
        }
        let before = begin.checked_sub(1).map(|before| values[before]);
        let after = values.get(row).copied();
        let (from, to) = match (before, after) {
            (Some(from), Some(to)) => (from, to),
            (Some(only), None) | (None, Some(only)) => (only, only),
            (None, None) => (0.0, 0.0),
        };
        let steps = (row - begin + 1) as f64;
        for (step, value) in values[begin..row].iter_mut().enumerate() {
            *value = from + (to - from) * (step + 1) as f64 / steps;
        }
    }
}
