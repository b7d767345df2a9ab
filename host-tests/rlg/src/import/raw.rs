//! Imports a captured raw stream: the inputs of the unit's chain, period by period.
//!
//! The stream is the bytes of the unit's second serial port as they came, garbage and cuts included; layout in
//! [`trueaxis::raw_frame`]. [`Imported`] has a row a sampling period: `gx|gy|gz` \[pulses\], `px|py|pz`, the pickoffs
//! \[rad\], and, if the unit has accelerometers, `vx|vy|vz` \[m/s\]; and a table of temperatures \[K\] and flux densities
//! \[T\] if the unit sends them. `rlg replay` of it feeds the chain with the same codes as the unit's.
//!
//! A row holds the counts of its own period only. After a missing frame, a failed reading or a missed interrupt, the counts
//! of the periods until the next frame are known only as a sum: these rows are missing (NaN), and the sum is stored in the
//! [`Gap`]. The counts of the first row are unknown, too; its pickoffs initialise the strip of the dither.

use std::path::Path;

use trueaxis::frame_finder::StreamStatistics;
use trueaxis::raw_frame::{RAW_BYTES, RAW_VERSION, RawFinder, RawFrame, item};
use trueaxis::raw_period::RawPeriod;
use trueaxis::sample_source::SourceFault;

use crate::error::InputError;
use crate::import::still::name_of;
use crate::recording::{Axis, Channel, Clock, Quantity, Recording, Site, Table};

/// Longest stretch without a frame \[rows\]: a quarter of an hour at 4 kHz. A longer one is two recordings.
const LONGEST_GAP_ROWS: u32 = 3_600_000;

/// The tables' files.
pub const TABLES: [&str; 2] = ["samples.parquet", "slow.parquet"];

/// Rows whose counts are known only as a sum.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Gap {
    /// First of the rows.
    pub row: u64,
    /// Number of the rows.
    pub rows: u64,
    /// Rows of them without a frame.
    pub frames_lost: u64,
    /// Rows in which the unit's interrupt was missed.
    pub interrupts_missed: u64,
    /// Rows in which the unit had no sample.
    pub without_sample: u64,
    /// True if the counter bank restarted, so that its counts are lost.
    pub bank_restarted: bool,
    /// Pulses of gyros x, y, z over all of them, as far as the bank counted.
    pub counts: [i32; 3],
}

/// A raw stream as a recording, with the statistics of its decoding.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The recording, not yet written.
    pub recording: Recording,
    /// Rows a second \[Hz\].
    pub rate_hz: f64,
    /// Rate reported by the unit; `None` if the stream is too short to contain it.
    pub unit_rate_hz: Option<f64>,
    /// Angle of a pulse of gyros x, y, z \[rad\].
    pub pulse_weight_rad: [f64; 3],
    /// Generation of the unit's parameters.
    pub generation: Option<u32>,
    /// Number of dropped frames reported by the unit.
    pub dropped: Option<u32>,
    /// Sampling period of the first row, since the unit's start.
    pub first_period: u32,
    /// Stretches of rows with unknown counts.
    pub gaps: Vec<Gap>,
    /// Statistics of the decoder.
    pub stream: StreamStatistics,
    /// Bytes of an unfinished frame at the end.
    pub bytes_at_end: usize,
}

/// True if `bytes` hold a frame of the raw stream.
pub fn is_raw(bytes: &[u8]) -> bool {
    let mut finder = RawFinder::new();
    bytes.iter().any(|byte| finder.push(*byte).is_some())
}

/// Reads the stream `bytes` of `file` into a recording for `folder`. `rate_hz`: the caller's, before the unit's own.
pub fn import(
    file: &Path,
    bytes: &[u8],
    rate_hz: Option<f64>,
    site: Option<Site>,
    folder: &Path,
) -> Result<Imported, InputError> {
    let mut finder = RawFinder::new();
    let mut rows = Rows::default();
    for (at, byte) in bytes.iter().enumerate() {
        if let Some(frame) = finder.push(*byte) {
            rows.add(file, at + 1 - RAW_BYTES, &frame)?;
        }
    }
    let stream = *finder.statistics();
    let Some(first_period) = rows.first else {
        return Err(InputError::new(file, "holds no frame of the raw stream")
            .value(format!(
                "{} bytes, {} damaged frames, {} headers of another version",
                bytes.len(),
                stream.bad_checksums,
                stream.other_versions
            ))
            .expected(format!(
                "frames of version {RAW_VERSION}, {RAW_BYTES} bytes each"
            )));
    };
    rows.end_gap();
    let told = |what: &str, first: u8| {
        rows.items.weight(first).ok_or_else(|| {
            InputError::new(file, format!("does not tell the {what}"))
                .value(format!("{} frames", stream.frames))
                .expected(format!("a stream of at least {} frames", item::COUNT))
        })
    };
    let pickoff_weight_rad = told("weight of a pickoff code", item::PICKOFF_WEIGHT)?;
    let triad = |what: &str, first: u8| -> Result<[f64; 3], InputError> {
        Ok([
            told(what, first)?,
            told(what, first + 2)?,
            told(what, first + 4)?,
        ])
    };
    let velocity_weight_m_s = triad("weights of accelerometer codes", item::VELOCITY_WEIGHT)?;
    let pulse_weight_rad = triad("weights of gyro pulses", item::PULSE_WEIGHT)?;
    let unit_rate_hz = rows
        .items
        .word(item::SAMPLE_RATE)
        .map(|bits| f64::from(f32::from_bits(bits)))
        .filter(|rate_hz| rate_hz.is_finite() && *rate_hz > 0.0);
    let rate_hz = rate_hz.or(unit_rate_hz).ok_or_else(|| {
        InputError::new(file, "does not tell its sample rate").expected("--rate-hz")
    })?;
    let (generation, dropped) = (
        rows.items.word(item::GENERATION),
        rows.items.word(item::DROPPED),
    );
    let gaps = std::mem::take(&mut rows.gaps);
    let tables = rows.into_tables(rate_hz, pickoff_weight_rad, velocity_weight_m_s);
    Ok(Imported {
        recording: Recording {
            name: name_of(file),
            folder: folder.to_path_buf(),
            site,
            tables,
            segments: Vec::new(),
        },
        rate_hz,
        unit_rate_hz,
        pulse_weight_rad,
        generation,
        dropped,
        first_period,
        gaps,
        stream,
        bytes_at_end: finder.pending_bytes(),
    })
}

/// Last value of each item.
#[derive(Debug)]
struct Items([Option<u32>; item::COUNT as usize]);

impl Items {
    fn word(&self, index: u8) -> Option<u32> {
        self.0.get(usize::from(index)).copied().flatten()
    }

    /// Returns the f64 stored in two items.
    fn weight(&self, first: u8) -> Option<f64> {
        let (low, high) = (self.word(first)?, self.word(first + 1)?);
        Some(f64::from_bits(u64::from(high) << 32 | u64::from(low)))
    }
}

/// Columns under construction.
#[derive(Debug)]
struct Rows {
    first: Option<u32>,
    last: RawPeriod,
    items: Items,
    counts: [Vec<f64>; 3],
    pickoff_codes: [Vec<f64>; 3],
    velocity_codes: [Vec<f64>; 3],
    gap: Option<Gap>,
    gaps: Vec<Gap>,
    slow: Slow,
}

impl Default for Rows {
    fn default() -> Self {
        Self {
            first: None,
            last: RawPeriod::default(),
            items: Items([None; item::COUNT as usize]),
            counts: Default::default(),
            pickoff_codes: Default::default(),
            velocity_codes: Default::default(),
            gap: None,
            gaps: Vec::new(),
            slow: Slow::default(),
        }
    }
}

const NOT_MEASURED: [f64; 3] = [f64::NAN; 3];

impl Rows {
    /// Adds the frame that begins at byte `at`, and rows for those missing before it.
    fn add(&mut self, file: &Path, at: usize, frame: &RawFrame) -> Result<(), InputError> {
        let period = frame.period;
        let pickoffs = if period.source.has_sample() {
            period.pickoff_codes.map(f64::from)
        } else {
            NOT_MEASURED
        };
        if self.first.is_none() {
            self.first = Some(period.number);
            self.push(NOT_MEASURED, pickoffs, NOT_MEASURED);
        } else {
            let step = period.number.wrapping_sub(self.last.number);
            if !(1..=LONGEST_GAP_ROWS).contains(&step) {
                return Err(not_one_run(file, at, self.last.number, period.number, step));
            }
            self.follow(&period, step, pickoffs);
        }
        self.last = period;
        if let Some(place) = self.items.0.get_mut(usize::from(frame.item.index)) {
            *place = Some(frame.item.value);
        }
        let rows = self.counts[0].len();
        self.slow.tell(frame.item.index, frame.item.value, rows);
        Ok(())
    }

    /// Adds the rows of `step` periods, the last of which is this.
    fn follow(&mut self, period: &RawPeriod, step: u32, pickoffs: [f64; 3]) {
        let counts = difference(period.pulse_counters, self.last.pulse_counters);
        let velocities = difference(period.velocity_counters, self.last.velocity_counters);
        if step == 1 && period.covered == 1 && period.source.has_sample() {
            self.end_gap();
            self.push(counts.map(f64::from), pickoffs, velocities.map(f64::from));
            return;
        }
        let missed = u64::from(period.missed).min(u64::from(step - 1));
        let row = self.counts[0].len() as u64;
        let gap = self.gap.get_or_insert(Gap {
            row,
            ..Gap::default()
        });
        gap.rows += u64::from(step);
        gap.interrupts_missed += missed;
        gap.frames_lost += u64::from(step - 1) - missed;
        gap.without_sample += u64::from(!period.source.has_sample());
        gap.bank_restarted |= period.source.fault() == Some(SourceFault::Restarted);
        for (sum, counts) in gap.counts.iter_mut().zip(counts) {
            *sum = sum.wrapping_add(counts);
        }
        for _ in 1..step {
            self.push(NOT_MEASURED, NOT_MEASURED, NOT_MEASURED);
        }
        self.push(NOT_MEASURED, pickoffs, NOT_MEASURED);
        if period.source.has_sample() {
            self.end_gap();
        }
    }

    fn end_gap(&mut self) {
        self.gaps.extend(self.gap.take());
    }

    fn push(&mut self, counts: [f64; 3], pickoff_codes: [f64; 3], velocity_codes: [f64; 3]) {
        for axis in 0..3 {
            self.counts[axis].push(counts[axis]);
            self.pickoff_codes[axis].push(pickoff_codes[axis]);
            self.velocity_codes[axis].push(velocity_codes[axis]);
        }
    }

    fn into_tables(
        self,
        rate_hz: f64,
        pickoff_weight_rad: f64,
        velocity_weight_m_s: [f64; 3],
    ) -> Vec<Table> {
        let rows = self.counts[0].len();
        let mut channels = triad("g", &Quantity::GyroCount, [1.0; 3], self.counts);
        channels.extend(triad(
            "p",
            &Quantity::DitherAngle,
            [pickoff_weight_rad; 3],
            self.pickoff_codes,
        ));
        if velocity_weight_m_s != [0.0; 3] {
            channels.extend(triad(
                "v",
                &Quantity::VelocityIncrement,
                velocity_weight_m_s,
                self.velocity_codes,
            ));
        }
        let samples = Table {
            file: TABLES[0].to_owned(),
            clock: Clock::Uniform {
                rate_hz,
                start_s: 0.0,
            },
            rows,
            channels,
        };
        std::iter::once(samples)
            .chain(self.slow.into_table(rate_hz))
            .collect()
    }
}

/// Makes the error of a number that does not follow the last one.
fn not_one_run(file: &Path, at: usize, last: u32, number: u32, step: u32) -> InputError {
    let backward = step == 0 || step > u32::MAX / 2;
    let problem = if backward {
        "holds more than one run of the unit"
    } else {
        "has a gap that no recording should have"
    };
    InputError::new(file, problem)
        .value(format!("period {number} after period {last} at byte {at}"))
        .expected("one run: cut the file there")
}

fn difference(new: [i32; 3], old: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|axis| new[axis].wrapping_sub(old[axis]))
}

/// Makes the channels of x, y, z from codes times their weights.
pub(super) fn triad(
    name: &str,
    quantity: &Quantity,
    weights: [f64; 3],
    codes: [Vec<f64>; 3],
) -> Vec<Channel> {
    Axis::ALL
        .into_iter()
        .zip(codes)
        .zip(weights)
        .map(|((axis, codes), weight)| Channel {
            column: format!("{name}{}", axis.label()),
            quantity: quantity.clone(),
            axis: Some(axis.label().to_owned()),
            scale: weight,
            offset: 0.0,
            values: codes.into_iter().map(|code| code * weight).collect(),
        })
        .collect()
}

/// Temperatures and flux densities, a row each time that all items have been received.
#[derive(Debug, Default)]
struct Slow {
    now: [Option<f64>; 6],
    /// Number of sample rows before each row.
    after_rows: Vec<usize>,
    values: [Vec<f64>; 6],
}

impl Slow {
    /// Items in the order of `now`; derivatives are left out, a replay computes them.
    const ITEMS: [u8; 6] = [
        item::TEMPERATURE,
        item::TEMPERATURE + 1,
        item::TEMPERATURE + 2,
        item::MAGNETIC_FIELD,
        item::MAGNETIC_FIELD + 1,
        item::MAGNETIC_FIELD + 2,
    ];

    /// Stores an item received with the last of `rows` rows.
    fn tell(&mut self, index: u8, value: u32, rows: usize) {
        let Some(place) = Self::ITEMS.iter().position(|item| *item == index) else {
            return;
        };
        let value = f64::from(f32::from_bits(value));
        self.now[place] = Some(value);
        if place + 1 < self.now.len() {
            return;
        }
        self.after_rows.push(rows);
        for (column, now) in self.values.iter_mut().zip(&mut self.now) {
            column.push(now.take().unwrap_or(f64::NAN));
        }
    }

    /// Returns the table; `None` if everything is 0, as for a unit without slow measurements.
    fn into_table(self, rate_hz: f64) -> Option<Table> {
        let measured =
            |columns: &[Vec<f64>]| columns.iter().flatten().any(|value| value.abs() > 0.0);
        let [tx, ty, tz, mx, my, mz] = self.values;
        let mut channels = Vec::new();
        for (name, quantity, columns) in [
            ("t", Quantity::Temperature, [tx, ty, tz]),
            ("m", Quantity::MagneticField, [mx, my, mz]),
        ] {
            if measured(&columns) {
                channels.extend(triad(name, &quantity, [1.0; 3], columns));
            }
        }
        (!channels.is_empty()).then(|| Table {
            file: TABLES[1].to_owned(),
            rows: self.after_rows.len(),
            clock: Clock::Stamped {
                column: "time_s".to_owned(),
                stamps_s: self
                    .after_rows
                    .iter()
                    .map(|rows| *rows as f64 / rate_hz)
                    .collect(),
            },
            channels,
        })
    }
}
