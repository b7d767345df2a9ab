//! Makes the initial model of a foreign recording: at rest on the turning Earth, white noise, nominal clock.
//!
//! The [`Model`] holds only values stated by the file. Everything else is left to the diagnosis, so nothing is estimated
//! from the data but the quantisation step of the stored values.

use crate::model::{Gyro, Model, MotionSource};
use crate::recording::{Axis, Channel, Clock, Quantity, Recording, Site, Table};

/// Description of an imported foreign file.
#[derive(Debug, Clone, PartialEq)]
pub struct Foreign {
    /// The recording's description; its table holds no rows in memory.
    pub recording: Recording,
    /// Rows written.
    pub rows: usize,
    /// Nominal rows a second \[Hz\].
    pub rate_hz: f64,
    /// Rows a second by the file's own stamps \[Hz\], if it has them.
    pub stamped_rate_hz: Option<f64>,
    /// Quantisation step of the stored gyro values, as an angle \[rad\].
    pub resolution_rad: [f64; 3],
}

/// The table's file.
pub const TABLE: &str = "samples.parquet";

/// Makes the model of a unit at rest.
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

/// Makes the model of an ideal unit: nothing is corrected, no noise is declared; in motion if `quantities` hold a reference.
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

/// Message for a unit at rest with an unknown site.
pub const WITHOUT_SITE: &str = "no reference and no [site]: of the Earth's rate the length alone is known; --latitude-deg and \
                                --gravity here, or a [site] in recording.toml, say how much of it is vertical";

/// Makes a channel without its values, which are on disk already.
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

/// Returns the name of a foreign file's recording: the file's own, without its extension.
pub fn name_of(file: &std::path::Path) -> String {
    let stem = file.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}

/// Makes a recording of one table whose rows are on disk already.
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
