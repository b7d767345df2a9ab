//! Defines a scenario: what the simulator is asked to build.
//!
//! A TOML file (SI units, keys as below), and the instrument's file if it names one, give a checked [`Scenario`]: every
//! number finite and physically possible, every key known. An unknown key is an error that names its line, since a
//! misspelt key would otherwise silently simulate something else.
//!
//! `instrument = "triad.toml"` (beside the scenario) brings the sections of `instrument` and `[[effect]]`
//! entries from a file of their own; a section stands in one of the two.
//!
//! There are no defaults for the instrument: a scenario says what it simulates.

mod entry;
pub(crate) mod environment;
mod instrument;
mod other_instruments;
pub(crate) mod segment;
pub(crate) mod source;

use super::effects::Effects;
use super::isolator::IsolatorEntry;
use super::surroundings::{MagneticEntry, ThermalEntry};
pub use entry::Entry;
pub use instrument::{DitherEntry, GyroEntry, GyroOutput};
pub use other_instruments::{AccelerometerEntry, EncoderEntry, FibreOpticEntry, ReferenceEntry};
use rlg_model::ModelEffect;
pub use segment::SegmentEntry;

/// A scenario, checked.
#[derive(Debug, Clone)]
pub struct Scenario {
    /// Name of the recording.
    pub name: String,
    /// Sample rate of gyros, pickoffs and references \[Hz\].
    pub rate_hz: f64,
    /// Begin of the first row \[s\].
    pub start_s: f64,
    /// Where on Earth; `None`: no Earth rate, no gravity.
    pub site: Option<SiteEntry>,
    /// Initial attitude, body to navigation (north, west, up) frame, w x y z.
    pub attitude_wxyz: [f64; 4],
    /// The gyros.
    pub gyro: GyroEntry,
    /// The dithers; `None`: undithered gyros, no pickoff channel.
    pub dither: Option<DitherEntry>,
    /// The reference; `None`: no such channel.
    pub reference: Option<ReferenceEntry>,
    /// A fibre-optic triad beside the gyros; the reference where there is no other.
    pub fibre_optic: Option<FibreOpticEntry>,
    /// The table's encoders; the reference where there is no other.
    pub encoder: Option<EncoderEntry>,
    /// The accelerometers; `None`: no such channel.
    pub accelerometer: Option<AccelerometerEntry>,
    /// Temperature; `None`: constant.
    pub thermal: Option<ThermalEntry>,
    /// Magnetic field; `None`: none.
    pub magnetic: Option<MagneticEntry>,
    /// The motion, segment after segment.
    pub segments: Vec<SegmentEntry>,
    /// Effects that the model admits.
    pub known_effects: Vec<ModelEffect>,
    /// Effects that only the truth file tells.
    pub concealed_effects: Vec<ModelEffect>,
    /// The sum of both, as the simulator applies it.
    pub effects: Effects,
    /// What stands between base and case, where `[isolator]` says so.
    pub mounts: Option<IsolatorEntry>,
}

/// `[site]`.
#[derive(Debug, Clone, Copy)]
pub struct SiteEntry {
    /// Geodetic latitude \[rad\].
    pub latitude_rad: f64,
    /// Gravity \[m/s²\].
    pub gravity_m_s2: f64,
    /// Whether the Earth turns; a reference gyro then shows its rotation too.
    pub earth_rate: bool,
}

impl Scenario {
    /// Rows of the recording.
    pub fn rows(&self) -> usize {
        self.segments.iter().map(|segment| segment.rows).sum()
    }

    /// What stands between base and case.
    pub fn isolator(&self) -> Option<IsolatorEntry> {
        self.mounts.or_else(|| {
            self.effects.isolator().map(|angular| IsolatorEntry {
                angular,
                ..IsolatorEntry::default()
            })
        })
    }

    /// Whether the reference sits on the base: `isolator_mode` means that the case follows the reference.
    pub fn reference_on_base(&self) -> bool {
        self.effects.isolator().is_some()
    }
}
