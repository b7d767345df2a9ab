//! Formats of the files that `rlg import` reads.

use std::path::Path;

use clap::ValueEnum;

use crate::error::InputError;

/// What a file can hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// Telemetry frames from the unit's serial port
    Frames,
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
    /// The format that files with this extension usually have.
    pub(super) fn of_extension(file: &Path) -> Result<Self, InputError> {
        let extension = file.extension().unwrap_or_default().to_string_lossy();
        Ok(match extension.to_ascii_lowercase().as_str() {
            "csv" | "tsv" | "txt" | "dat" | "log" | "asc" => Self::Csv,
            "mat" => Self::Mat,
            "h5" | "hdf5" | "hdf" => Self::Hdf5,
            "parquet" | "pq" => Self::Parquet,
            "imu" => Self::PsinsImu,
            _ => {
                return Err(
                    InputError::new(file, "has an extension that tells no format")
                        .value(format!("{extension:?}"))
                        .expected("--format csv|mat|hdf5|parquet|frames|f64x7|psins-imu"),
                );
            }
        })
    }

    /// Whether it holds columns with names.
    pub(super) fn has_columns(self) -> bool {
        matches!(self, Self::Csv | Self::Mat | Self::Hdf5 | Self::Parquet)
    }
}
