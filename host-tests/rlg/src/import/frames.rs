//! Imports a captured stream of telemetry frames.
//!
//! The stream is the serial port's bytes as they came, garbage and cuts included; layout in [`trueaxis::telemetry`].
//! [`Imported`] has one row an output period: `dtheta_x|y|z` \[rad\] and, if the unit has accelerometers, `dvel_x|y|z`
//! \[m/s\], in the body frame at the row's beginning, and `status`, the frame's bits as a number (a quantity of its own,
//! which the diagnosis keeps as unlisted).
//!
//! A row without a frame is missing (NaN). It has two causes: a frame lost on the way, whose angle is lost with it; and
//! output periods without a sample, whose whole angle is in the next frame, which then has the bit GAP. The status
//! distinguishes them.
//!
//! The row rate is the unit's own, from two health items, or the caller's. Left out: the counters over time; each health
//! item keeps its last value.

use std::collections::BTreeMap;
use std::path::Path;

use trueaxis::health::item;
use trueaxis::telemetry::StreamStatistics;
use trueaxis::{Decoder, OUTPUT_M_S_PER_CODE, OUTPUT_RAD_PER_CODE, OutputFrame, TELEMETRY_BYTES};

use crate::error::InputError;
use crate::import::still::name_of;
use crate::recording::{Axis, Channel, Clock, Quantity, Recording, Table};
use crate::unit_port::{BAD_RAM, says_bad_ram};

/// Longest stretch without a frame \[rows\]: an hour at 1000 frames a second. A longer one is two recordings, and the rows
/// between them would hold nothing.
const LONGEST_GAP_ROWS: u32 = 3_600_000;

/// The table's file.
pub const TABLE: &str = "frames.parquet";

/// A stream as a recording, with the statistics of its decoding.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The recording, not yet written.
    pub recording: Recording,
    /// Frames a second \[Hz\].
    pub rate_hz: f64,
    /// Rate reported by the unit; `None` if the stream is too short to contain it.
    pub unit_rate_hz: Option<f64>,
    /// Sequence number of the first row.
    pub first_sequence: u32,
    /// Rows without a frame.
    pub rows_without_frame: u64,
    /// Statistics of the decoder.
    pub stream: StreamStatistics,
    /// Bytes of an unfinished frame at the end.
    pub bytes_at_end: usize,
    /// Frames that carry each status bit.
    pub frames_with_bit: [u64; 32],
    /// Last value of each health item.
    pub health: BTreeMap<u8, u32>,
}

/// Reads the stream `bytes` of `file` into a recording for `folder`. `rate_hz`: the caller's, before the
/// unit's own.
pub fn import(
    file: &Path,
    bytes: &[u8],
    rate_hz: Option<f64>,
    folder: &Path,
) -> Result<Imported, InputError> {
    if bytes.is_empty() {
        return Err(InputError::new(file, "is empty").expected("a captured stream of frames"));
    }
    let mut decoder = Decoder::new();
    let mut rows = Rows::default();
    let mut health = BTreeMap::new();
    for (at, byte) in bytes.iter().enumerate() {
        if let Some(frame) = decoder.push(*byte) {
            if says_bad_ram(&frame.health) {
                return Err(
                    InputError::new(file, BAD_RAM).expected("frames of a unit that samples")
                );
            }
            rows.add(file, at + 1 - TELEMETRY_BYTES, &frame.output)?;
            health.insert(frame.health.index, frame.health.value);
        }
    }
    let stream = *decoder.statistics();
    let Some(first_sequence) = rows.first else {
        return Err(none_found(file, bytes.len(), &stream));
    };
    let unit_rate_hz = unit_rate_hz(&health);
    let rate_hz = rate_hz.or(unit_rate_hz).ok_or_else(|| {
        InputError::new(file, "does not tell how many frames a second it holds")
            .value(format!(
                "{} frames, none with health items {} and {}",
                stream.frames,
                item::SAMPLE_RATE,
                item::SAMPLES_PER_OUTPUT
            ))
            .expected("--rate-hz, or a longer stream")
    })?;
    let with_velocity = health
        .get(&item::CONFIGURATION)
        .is_some_and(|bits| bits & item::WITH_ACCELEROMETERS != 0)
        || rows.any_velocity;
    let frames_with_bit = rows.frames_with_bit;
    let rows_without_frame = rows.without_frame;
    Ok(Imported {
        recording: Recording {
            name: name_of(file),
            folder: folder.to_path_buf(),
            site: None,
            tables: vec![rows.into_table(rate_hz, with_velocity)],
            segments: Vec::new(),
        },
        rate_hz,
        unit_rate_hz,
        first_sequence,
        rows_without_frame,
        stream,
        bytes_at_end: decoder.pending_bytes(),
        frames_with_bit,
        health,
    })
}

/// Returns the unit's own rate, if it is plausible.
fn unit_rate_hz(health: &BTreeMap<u8, u32>) -> Option<f64> {
    let sample_rate_hz = f64::from(f32::from_bits(*health.get(&item::SAMPLE_RATE)?));
    let samples_per_output = f64::from(*health.get(&item::SAMPLES_PER_OUTPUT)?);
    let rate_hz = sample_rate_hz / samples_per_output;
    (rate_hz.is_finite() && rate_hz > 0.0).then_some(rate_hz)
}

fn none_found(file: &Path, bytes: usize, stream: &StreamStatistics) -> InputError {
    let met = match (stream.bad_checksums, stream.other_versions) {
        (0, 0) => String::new(),
        (damaged, 0) => format!(", {damaged} damaged frames"),
        (_, other) => format!(", {other} headers of another version"),
    };
    InputError::new(file, "holds no telemetry frame")
        .value(format!("{bytes} bytes{met}"))
        .expected(format!(
            "frames of version {}, {TELEMETRY_BYTES} bytes each",
            trueaxis::telemetry::TELEMETRY_VERSION
        ))
}

/// Columns under construction.
#[derive(Debug, Default)]
struct Rows {
    first: Option<u32>,
    last: u32,
    dtheta_rad: [Vec<f64>; 3],
    dvel_m_s: [Vec<f64>; 3],
    status: Vec<f64>,
    without_frame: u64,
    frames_with_bit: [u64; 32],
    any_velocity: bool,
}

impl Rows {
    /// Adds the frame that begins at byte `at`, and rows for those missing before it.
    fn add(&mut self, file: &Path, at: usize, frame: &OutputFrame) -> Result<(), InputError> {
        let step = match self.first {
            None => 1,
            Some(_) => frame.sequence.wrapping_sub(self.last),
        };
        if !(1..=LONGEST_GAP_ROWS).contains(&step) {
            let backward = step == 0 || step > u32::MAX / 2;
            let problem = if backward {
                "holds more than one run of the unit"
            } else {
                "has a gap that no recording should have"
            };
            return Err(InputError::new(file, problem)
                .value(format!(
                    "frame {} after frame {} at byte {at}",
                    frame.sequence, self.last
                ))
                .expected("one run: cut the file there"));
        }
        self.first.get_or_insert(frame.sequence);
        self.last = frame.sequence;
        for _ in 1..step {
            self.push([f64::NAN; 3], [f64::NAN; 3], f64::NAN);
        }
        self.without_frame += u64::from(step - 1);
        let bits = frame.status.bits();
        self.push(
            frame
                .dtheta_codes
                .map(|code| f64::from(code) * OUTPUT_RAD_PER_CODE),
            frame
                .dvel_codes
                .map(|code| f64::from(code) * OUTPUT_M_S_PER_CODE),
            f64::from(bits),
        );
        self.any_velocity |= frame.dvel_codes != [0; 3];
        for (bit, frames) in self.frames_with_bit.iter_mut().enumerate() {
            *frames += u64::from(bits >> bit & 1);
        }
        Ok(())
    }

    fn push(&mut self, dtheta_rad: [f64; 3], dvel_m_s: [f64; 3], status: f64) {
        for axis in 0..3 {
            self.dtheta_rad[axis].push(dtheta_rad[axis]);
            self.dvel_m_s[axis].push(dvel_m_s[axis]);
        }
        self.status.push(status);
    }

    fn into_table(self, rate_hz: f64, with_velocity: bool) -> Table {
        let rows = self.status.len();
        let triad = |name: &str, quantity: &Quantity, scale: f64, columns: [Vec<f64>; 3]| {
            Axis::ALL
                .into_iter()
                .zip(columns)
                .map(|(axis, values)| Channel {
                    column: format!("{name}_{}", axis.label()),
                    quantity: quantity.clone(),
                    axis: Some(axis.label().to_owned()),
                    scale,
                    offset: 0.0,
                    values,
                })
                .collect::<Vec<_>>()
        };
        let mut channels = triad(
            "dtheta",
            &Quantity::GyroIncrement,
            OUTPUT_RAD_PER_CODE,
            self.dtheta_rad,
        );
        if with_velocity {
            channels.extend(triad(
                "dvel",
                &Quantity::VelocityIncrement,
                OUTPUT_M_S_PER_CODE,
                self.dvel_m_s,
            ));
        }
        channels.push(Channel {
            column: "status".to_owned(),
            quantity: Quantity::Other("status".to_owned()),
            axis: None,
            scale: 1.0,
            offset: 0.0,
            values: self.status,
        });
        Table {
            file: TABLE.to_owned(),
            clock: Clock::Uniform {
                rate_hz,
                start_s: 0.0,
            },
            rows,
            channels,
        }
    }
}
