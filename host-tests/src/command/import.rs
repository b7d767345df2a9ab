//! `rlg import`: a foreign stream becomes a recording.

use std::fs;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;
use trueaxis::Status;
use trueaxis::health::item;

use crate::error::InputError;
use crate::import::frames::{self, Imported};
use crate::recording::{MANIFEST, Recording};
use crate::terminal::Terminal;

/// Relative difference between the caller's rate and the unit's that is worth a word: a crystal is within
/// 1e-4, an internal oscillator within 1e-2.
const RATE_MISMATCH: f64 = 0.02;

/// Read a captured stream into a recording
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg import capture.bin --format frames --out flight\n\nCapture the unit's serial port as it is, e.g.\n  stty -F /dev/ttyUSB0 1000000 raw && cat /dev/ttyUSB0 > capture.bin"
)]
pub struct Import {
    /// The file
    file: PathBuf,
    /// What it holds
    #[arg(long, value_enum)]
    format: Format,
    /// Frames a second [Hz]; as a rule the stream tells it
    #[arg(long)]
    rate_hz: Option<f64>,
    /// Folder for the recording: new, empty, or a recording to replace
    #[arg(long)]
    out: PathBuf,
}

/// What a file can hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Telemetry frames from the unit's serial port
    Frames,
}

impl Import {
    /// Reads, writes the recording, says what was met.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        if let Some(rate_hz) = self.rate_hz
            && !(rate_hz.is_finite() && rate_hz > 0.0)
        {
            return Err(InputError::new(&self.file, "cannot be read at this rate")
                .channel("--rate-hz")
                .value(rate_hz)
                .expected("a positive number of frames a second"));
        }
        let bytes =
            fs::read(&self.file).map_err(|error| InputError::unreadable(&self.file, &error))?;
        let imported = match self.format {
            Format::Frames => frames::import(&self.file, &bytes, self.rate_hz, &self.out)?,
        };
        let same = |name: &str| {
            let (there, here) = (self.out.join(name), &self.file);
            matches!((there.canonicalize(), here.canonicalize()), (Ok(a), Ok(b)) if a == b)
        };
        if let Some(name) = [frames::TABLE, MANIFEST]
            .into_iter()
            .find(|name| same(name))
        {
            let problem = format!("holds the input, which the recording's {name} would replace");
            return Err(InputError::new(&self.out, problem)
                .channel("--out")
                .expected("another folder"));
        }
        let mut out = Recording::create_folder(&self.out)?;
        imported.recording.write_into(&mut out)?;
        out.commit()?;
        self.say(terminal, &imported);
        self.result(terminal, &imported)
    }

    fn say(&self, terminal: &Terminal, imported: &Imported) {
        let stream = &imported.stream;
        terminal.say(format!(
            "{}: {} frames in {} rows at {} Hz in {}; {} rows without a frame, {} bytes skipped, {} bad \
             check sums, {} bytes of an unfinished frame at the end",
            self.file.display(),
            stream.frames,
            imported.recording.tables[0].rows,
            imported.rate_hz,
            self.out.display(),
            imported.rows_without_frame,
            stream.bytes_skipped,
            stream.bad_checksums,
            imported.bytes_at_end,
        ));
        if let (Some(asked), Some(told)) = (self.rate_hz, imported.unit_rate_hz)
            && (asked / told - 1.0).abs() > RATE_MISMATCH
        {
            terminal.warn(format!(
                "the unit says {told} Hz, --rate-hz {asked} is used"
            ));
        }
        let told = |index| imported.health.get(&index).copied();
        if let (Some(bits), Some(period)) = (
            told(item::FIRST_FAULT_STATUS),
            told(item::FIRST_FAULT_PERIOD),
        ) && bits != 0
        {
            let names = names(bits).join(", ");
            terminal.warn(format!(
                "the unit's first fault: {names}, in its sampling period {period}"
            ));
        }
        for (name, frames) in bits_seen(imported) {
            terminal.say(format!("{frames} frames say: {name}"));
        }
    }

    fn result(&self, terminal: &Terminal, imported: &Imported) -> Result<(), InputError> {
        let stream = &imported.stream;
        let status: serde_json::Map<_, _> = bits_seen(imported)
            .map(|(name, frames)| (name.to_owned(), frames.into()))
            .collect();
        terminal.result(&json!({
            "recording": self.out,
            "rate_hz": imported.rate_hz,
            "rows": imported.recording.tables[0].rows,
            "frames": stream.frames,
            "first_sequence": imported.first_sequence,
            "rows_without_frame": imported.rows_without_frame,
            "bytes_skipped": stream.bytes_skipped,
            "bad_checksums": stream.bad_checksums,
            "bytes_at_end": imported.bytes_at_end,
            "status": status,
            "health": imported.health,
        }))
    }
}

/// Names of the bits that any frame carries, with the number of those frames.
fn bits_seen(imported: &Imported) -> impl Iterator<Item = (&'static str, u64)> {
    let frames = imported.frames_with_bit.into_iter();
    (0_u8..)
        .zip(frames)
        .filter(|(_, frames)| *frames > 0)
        .filter_map(|(bit, frames)| Some((Status::name(bit)?, frames)))
}

/// Names of the bits set.
fn names(bits: u32) -> Vec<&'static str> {
    (0..32)
        .filter(|bit| bits >> bit & 1 == 1)
        .filter_map(Status::name)
        .collect()
}
