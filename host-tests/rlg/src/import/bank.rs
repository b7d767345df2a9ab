//! Imports frames of version 3 of a counter bank, one after another: a capture of its bus, or `rlg export --format bank`.
//!
//! Layout in [`trueaxis::counter_bank`]. The bytes have no marks between frames: a frame is 48 bytes whose check sum is right,
//! and after damage the search goes on byte by byte until two frames follow each other. [`Imported`] has a row a sampling period:
//! `gx|gy|gz` \[pulses\], the pickoffs `px|py|pz` \[rad\], with accelerometers `vx|vy|vz` \[m/s\], and the time since the pulse
//! per second, if any frame has one; and in a table of their own the slow channels, a row a round. Weights and rate are those of the
//! unit's parameter block.
//!
//! A row whose frame is lost is not measured. The counts of the first row and of the row after a gap are known only as a sum with
//! those before, and are not measured either; the sum over a gap is in [`Gap`].

use std::path::Path;

use trueaxis::Parameters;
use trueaxis::counter_bank::{BankFrame, FRAME_BYTES};
use trueaxis::slow_channels::{BankService, CHANNELS, NOT_MEASURED, channel};

use super::raw::triad;
use crate::error::InputError;
use crate::import::still::name_of;
use crate::recording::{Channel, Clock, Quantity, Recording, Site, Table};

/// Longest stretch without a frame \[rows\]: sequence numbers come round after 65 536.
const LONGEST_GAP_ROWS: u16 = 32_768;

/// Frames at the begin of a file that must follow each other, for a file of this kind.
const SURE: usize = 4;

/// The tables' files.
pub const TABLES: [&str; 2] = ["samples.parquet", "slow.parquet"];

/// Resolution of a stamp \[s\].
const STAMP_WEIGHT_S: f64 = 1.0 / 16e6;

/// Rows whose frames are lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// First of them.
    pub row: u64,
    /// Number of them.
    pub rows: u64,
    /// Pulses of gyros x, y, z over them and the row after them.
    pub counts: [i32; 3],
}

/// Frames as a recording, with the statistics of their decoding.
#[derive(Debug, Clone, PartialEq)]
pub struct Imported {
    /// The recording, not yet written.
    pub recording: Recording,
    /// Good frames.
    pub frames: u64,
    /// Frames that came again.
    pub repeated: u64,
    /// Bytes that belong to no good frame.
    pub bytes_skipped: u64,
    /// Stretches of lost rows.
    pub gaps: Vec<Gap>,
}

/// True if `bytes` begin with frames of a bank that follow each other.
pub fn is_bank(bytes: &[u8]) -> bool {
    let frames: Vec<BankFrame> = bytes
        .as_chunks::<FRAME_BYTES>()
        .0
        .iter()
        .take(SURE)
        .map_while(|bytes| BankFrame::from_bytes(bytes).ok())
        .collect();
    let follow = |pair: &[BankFrame]| pair[1].sequence == pair[0].sequence.wrapping_add(1);
    frames.len() == SURE && frames.windows(2).all(follow)
}

/// Reads the frames `bytes` of `file` into a recording for `folder`, with rate and weights of `parameters`.
///
/// # Errors
/// No frame is there; or one does not follow the last within `LONGEST_GAP_ROWS`.
pub fn import(
    file: &Path,
    bytes: &[u8],
    parameters: &Parameters,
    site: Option<Site>,
    folder: &Path,
) -> Result<Imported, InputError> {
    let mut rows = Rows::default();
    let (mut at, mut is_in_step) = (0, true);
    while let Some(frame) = frame_at(bytes, at) {
        let end = at + FRAME_BYTES;
        let is_followed = || bytes.len() < end + FRAME_BYTES || good(bytes, end).is_some();
        match frame.filter(|_| is_in_step || is_followed()) {
            Some(frame) => {
                rows.add(file, at, &frame)?;
                (at, is_in_step) = (end, true);
            }
            None => {
                rows.skipped += 1;
                (at, is_in_step) = (at + 1, false);
            }
        }
    }
    rows.skipped += (bytes.len() - at) as u64;
    if rows.frames == 0 {
        return Err(InputError::new(file, "holds no frame of a counter bank")
            .value(format!("{} bytes", bytes.len()))
            .expected(format!("frames of version 3, {FRAME_BYTES} bytes each")));
    }
    Ok(Imported {
        frames: rows.frames,
        repeated: rows.repeated,
        bytes_skipped: rows.skipped,
        gaps: std::mem::take(&mut rows.gaps),
        recording: Recording {
            name: name_of(file),
            folder: folder.to_path_buf(),
            site,
            tables: rows.into_tables(parameters),
            segments: Vec::new(),
        },
    })
}

/// The bytes of a frame at a place, decoded where they are one; `None` at the end.
fn frame_at(bytes: &[u8], at: usize) -> Option<Option<BankFrame>> {
    let frame = bytes.get(at..)?.first_chunk::<FRAME_BYTES>()?;
    Some(BankFrame::from_bytes(frame).ok())
}

fn good(bytes: &[u8], at: usize) -> Option<BankFrame> {
    frame_at(bytes, at).flatten()
}

const LOST: [f64; 3] = [f64::NAN; 3];

/// Columns under construction.
#[derive(Debug, Default)]
struct Rows {
    last: Option<BankFrame>,
    frames: u64,
    repeated: u64,
    skipped: u64,
    gaps: Vec<Gap>,
    counts: [Vec<f64>; 3],
    pickoff_codes: [Vec<f64>; 3],
    velocity_codes: [Vec<f64>; 3],
    /// Slow channels since the round began.
    round: [Option<i16>; CHANNELS],
    /// The last channel of the round.
    turn: u8,
    /// Rounds: number of rows at their end, and the codes.
    rounds: Vec<(usize, [Option<i16>; CHANNELS])>,
    /// Time since the pulse at each row's end \[s\].
    stamps_s: Vec<f64>,
}

impl Rows {
    /// Adds the frame at byte `at`, and rows for those lost before it.
    fn add(&mut self, file: &Path, at: usize, frame: &BankFrame) -> Result<(), InputError> {
        let pickoffs = frame.pickoff_codes.map(f64::from);
        match self.last {
            None => self.push(LOST, pickoffs, LOST),
            Some(last) => {
                let step = frame.sequence.wrapping_sub(last.sequence);
                if step == 0 && last.counters == frame.counters {
                    self.repeated += 1;
                    return Ok(());
                }
                if !(1..=LONGEST_GAP_ROWS).contains(&step) {
                    return Err(InputError::new(file, "holds more than one run of the bank")
                        .value(format!(
                            "frame {} after frame {} at byte {at}",
                            frame.sequence, last.sequence
                        ))
                        .expected("one run: cut the file there"));
                }
                self.follow(frame, &last, step, pickoffs);
            }
        }
        self.frames += 1;
        self.last = Some(*frame);
        self.slow(&frame.service);
        Ok(())
    }

    /// Adds the row of a frame `step` periods after the last, and the lost ones before it.
    fn follow(&mut self, frame: &BankFrame, last: &BankFrame, step: u16, pickoffs: [f64; 3]) {
        let counts = difference(frame.counters, last.counters);
        if step == 1 {
            let velocities = difference(frame.accelerometers, last.accelerometers);
            self.push(counts.map(f64::from), pickoffs, velocities.map(f64::from));
            return;
        }
        // Longer than a round: what comes next is of another one.
        if usize::from(step) > CHANNELS {
            self.end_round(self.counts[0].len());
        }
        self.gaps.push(Gap {
            row: self.counts[0].len() as u64,
            rows: u64::from(step - 1),
            counts,
        });
        for _ in 1..step {
            self.push(LOST, LOST, LOST);
        }
        self.push(LOST, pickoffs, LOST);
    }

    /// Adds a row, without a stamp yet.
    fn push(&mut self, counts: [f64; 3], pickoff_codes: [f64; 3], velocity_codes: [f64; 3]) {
        self.stamps_s.push(f64::NAN);
        for axis in 0..3 {
            self.counts[axis].push(counts[axis]);
            self.pickoff_codes[axis].push(pickoff_codes[axis]);
            self.velocity_codes[axis].push(velocity_codes[axis]);
        }
    }

    /// Takes the slow channel and the stamp of the last row.
    fn slow(&mut self, service: &BankService) {
        let rows = self.counts[0].len();
        if let Some(stamp_s) = self
            .stamps_s
            .last_mut()
            .filter(|_| service.since_pulse < BankService::NO_PULSE)
        {
            *stamp_s = f64::from(service.since_pulse) * STAMP_WEIGHT_S;
        }
        if usize::from(service.channel) >= CHANNELS {
            return;
        }
        // A number that is not above the last begins the next round.
        if service.channel <= self.turn {
            self.end_round(rows - 1);
        }
        self.turn = service.channel;
        self.round[usize::from(service.channel)] = Some(service.value);
    }

    /// Ends a round of channels, if one has begun, after so many rows.
    fn end_round(&mut self, rows: usize) {
        let round = std::mem::take(&mut self.round);
        if round.iter().any(Option::is_some) {
            self.rounds.push((rows, round));
        }
    }

    fn into_tables(mut self, parameters: &Parameters) -> Vec<Table> {
        let rate_hz = parameters.sample_rate_hz;
        let rows = self.counts[0].len();
        self.end_round(rows);
        let mut channels = triad("g", &Quantity::GyroCount, [1.0; 3], self.counts);
        channels.extend(triad(
            "p",
            &Quantity::DitherAngle,
            [parameters.pickoff_weight_rad; 3],
            self.pickoff_codes,
        ));
        if let Some(known) = parameters.accelerometers {
            channels.extend(triad(
                "v",
                &Quantity::VelocityIncrement,
                known.weight_m_s,
                self.velocity_codes,
            ));
        }
        if self.stamps_s.iter().any(|stamp_s| stamp_s.is_finite()) {
            channels.push(Channel {
                column: Quantity::TimeSincePulse.name().to_owned(),
                quantity: Quantity::TimeSincePulse,
                axis: None,
                scale: STAMP_WEIGHT_S,
                offset: 0.0,
                values: self.stamps_s,
            });
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
        let channels = slow_channels(&self.rounds);
        let ends = self.rounds.iter().map(|(rows, _)| *rows as f64 / rate_hz);
        let slow = (!channels.is_empty()).then(|| Table {
            file: TABLES[1].to_owned(),
            rows: self.rounds.len(),
            clock: Clock::Stamped {
                column: "time_s".to_owned(),
                stamps_s: ends.collect(),
            },
            channels,
        });
        std::iter::once(samples).chain(slow).collect()
    }
}

/// Channels of the rounds, those left out that never came.
fn slow_channels(rounds: &[(usize, [Option<i16>; CHANNELS])]) -> Vec<Channel> {
    let kinds = [
        (Quantity::Temperature, channel::TEMPERATURE, 64.0),
        (Quantity::LaserIntensity, channel::INTENSITY, 16384.0),
        (Quantity::PathLengthDrive, channel::PATH_LENGTH, 32768.0),
        (Quantity::PathLengthResets, channel::PATH_LENGTH_RESETS, 1.0),
        (Quantity::DitherDrive, channel::DITHER_DRIVE, 16384.0),
    ];
    let mut channels = Vec::new();
    for (quantity, first, codes_per_unit) in kinds {
        for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let place = usize::from(first) + axis;
            if rounds.iter().all(|(_, codes)| codes[place].is_none()) {
                continue;
            }
            let weight = 1.0 / codes_per_unit;
            let value = |code: Option<i16>| match code {
                Some(code) if code != NOT_MEASURED => f64::from(code) * weight,
                _ => f64::NAN,
            };
            channels.push(Channel {
                column: format!("{}_{letter}", quantity.name()),
                quantity: quantity.clone(),
                axis: Some(letter.to_owned()),
                scale: weight,
                offset: 0.0,
                values: rounds
                    .iter()
                    .map(|(_, codes)| value(codes[place]))
                    .collect(),
            });
        }
    }
    channels
}

fn difference(new: [i32; 3], old: [i32; 3]) -> [i32; 3] {
    std::array::from_fn(|axis| new[axis].wrapping_sub(old[axis]))
}
