//! Formats of the files that `rlg import` reads.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use clap::ValueEnum;
use trueaxis::Decoder;

use crate::error::InputError;
use crate::import::{bank, raw};

/// Bytes at the beginning of a file searched for frames: a third of a second of the raw stream.
const LOOKED_AT_BYTES: u64 = 65_536;

/// What a file can hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// Telemetry frames from the unit's serial port
    Frames,
    /// The unit's raw stream from its second serial port
    Raw,
    /// Frames of version 3 of a counter bank, captured on its bus; with --params
    Bank,
    /// Records of seven little-endian f64: time s, gyro x y z deg/s, accelerometer x y z m/s^2
    F64x7,
    /// PSINS text: six counts a line
    PsinsImu,
    /// Text with columns: CSV, TSV and their relatives
    Csv,
    /// MATLAB's MAT-files of versions 5, 7 and 7.3
    Mat,
    /// HDF5
    Hdf5,
    /// Parquet
    Parquet,
}

impl Format {
    /// Returns the usual format of the file's extension; if the extension states none, the format of the unit's frames in
    /// it.
    pub(super) fn of_file(file: &Path) -> Result<Self, InputError> {
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        Ok(match extension.to_ascii_lowercase().as_str() {
            "csv" | "tsv" | "txt" | "dat" | "log" | "asc" | "ascii" | "prn" | "lvm" | "gcsv" => {
                Self::Csv
            }
            "mat" => Self::Mat,
            "h5" | "hdf5" | "hdf" => Self::Hdf5,
            "parquet" | "pq" => Self::Parquet,
            "imu" => Self::PsinsImu,
            _ => {
                if let Some(found) = Self::of_frames(file) {
                    return Ok(found);
                }
                return Err(
                    InputError::new(file, "has an extension that tells no format")
                        .value(format!("{extension:?}"))
                        .expected("--format csv|mat|hdf5|parquet|frames|raw|bank|f64x7|psins-imu"),
                );
            }
        })
    }

    /// Detects the unit's frames at the beginning of the file; `None` if it holds none or cannot be read.
    fn of_frames(file: &Path) -> Option<Self> {
        let mut begin = Vec::new();
        let opened = File::open(file).ok()?;
        opened.take(LOOKED_AT_BYTES).read_to_end(&mut begin).ok()?;
        let mut telemetry = Decoder::new();
        if raw::is_raw(&begin) {
            Some(Self::Raw)
        } else if begin.iter().any(|byte| telemetry.push(*byte).is_some()) {
            Some(Self::Frames)
        } else if bank::is_bank(&begin) {
            Some(Self::Bank)
        } else {
            None
        }
    }

    /// True if it holds columns with names.
    pub(super) fn has_columns(self) -> bool {
        matches!(self, Self::Csv | Self::Mat | Self::Hdf5 | Self::Parquet)
    }
}
