//! Makes the model that a foreign recording starts from: at rest on the turning Earth, white noise, nominal clock.
//!
//! The [`Model`] holds only what the file itself tells. Everything else is left for the diagnosis to find, so nothing
//! here is taken from the data except the resolution in which they are written.

use crate::model::{Gyro, Model, MotionSource};
use crate::recording::{Axis, Channel, Clock, Quantity, Recording, Site, Table};

/// What a foreign file turned out to hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Foreign {
    /// The recording's description; its table holds no rows in memory.
    pub recording: Recording,
    /// Rows written.
    pub rows: usize,
    /// Nominal rows a second \[Hz\].
    pub rate_hz: f64,
    /// Rows a second by the file's own stamps \[Hz\], where it has them.
    pub stamped_rate_hz: Option<f64>,
    /// Angle of the smallest step in which the gyros are written \[rad\].
    pub resolution_rad: [f64; 3],
}

/// The table's file.
pub const TABLE: &str = "samples.parquet";

/// The model of a unit that lay still.
pub fn model(resolution_rad: [f64; 3]) -> Model {
    Model {
        motion: MotionSource::Static,
        earth_rate_in_reference: false,
        gyro: Gyro {
            pulse_weight_rad: resolution_rad,
            ..Gyro::default()
        },
        dither: None,
        reference: None,
        accelerometer: None,
        effects: Vec::new(),
    }
}

/// The model of an ideal unit: nothing is corrected, no noise is declared; in motion where `quantities` hold a reference.
pub fn ideal(pulse_weight_rad: [f64; 3], quantities: &[Quantity]) -> Model {
    let references = [Quantity::ReferenceIncrement, Quantity::ReferenceAttitude];
    let motion = match references.iter().any(|one| quantities.contains(one)) {
        true => MotionSource::Reference,
        false => MotionSource::Static,
    };
    Model {
        motion,
        ..model(pulse_weight_rad)
    }
}

/// What is said of a unit at rest whose site nobody named.
pub const WITHOUT_SITE: &str = "no reference and no [site]: of the Earth's rate the length alone is known; --latitude-deg and \
                                --gravity here, or a [site] in recording.toml, say how much of it is vertical";

/// A column without its values, which are on disk already.
pub fn column(name: &str, quantity: Quantity, axis: Option<Axis>, scale: f64) -> Channel {
    Channel {
        column: name.to_owned(),
        quantity,
        axis: axis.map(|axis| axis.label().to_owned()),
        scale,
        offset: 0.0,
        values: Vec::new(),
    }
}

/// The name of a recording of a foreign file: the file's own, without its extension.
pub fn name_of(file: &std::path::Path) -> String {
    let stem = file.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// A recording of one table whose rows are on disk already.
pub fn recording(
    file: &std::path::Path,
    site: Option<Site>,
    clock: Clock,
    channels: Vec<Channel>,
) -> Recording {
    Recording {
        name: name_of(file),
        folder: std::path::PathBuf::new(),
        site,
        tables: vec![Table {
            file: TABLE.to_owned(),
            clock,
            rows: 0,
            channels,
        }],
        segments: Vec::new(),
    }
}
