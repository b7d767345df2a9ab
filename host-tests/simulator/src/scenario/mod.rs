//! Scenario: the specification of a simulated recording.
//!
//! A TOML file (SI units, keys as below), and the instrument's file if it names one, give a checked [`Scenario`]: every
//! number finite and physically possible, every key known. An unknown key is an error with its line, since a misspelt key
//! would silently simulate something else.
//!
//! `instrument = "triad.toml"` (in the scenario's folder) includes the sections of `instrument` and `[[effect]]` entries
//! from a separate file; a section may be in one of the two only.
//!
//! There are no defaults for the instrument: a scenario states all of it.

pub(crate) mod environment;
pub(crate) mod health;
mod instrument;
mod other_instruments;
pub(crate) mod segment;
pub(crate) mod source;

use super::effects::Effects;
use super::isolator::IsolatorEntry;
use super::slow_channels::SlowChannelsEntry;
use super::surroundings::{MagneticEntry, ThermalEntry};
use super::unit_faults::UnitFaults;

pub use instrument::{DitherEntry, GyroEntry, GyroOutput};
pub use other_instruments::{AccelerometerEntry, EncoderEntry, FibreOpticEntry, ReferenceEntry};
use rlg_model::ModelEffect;
pub use segment::SegmentEntry;

/// Checked scenario.
#[derive(Debug, Clone)]
pub struct Scenario {
    /// Name of the recording.
    pub name: String,
    /// Sample rate of gyros, pickoffs and references \[Hz\].
    pub rate_hz: f64,
    /// Start of the first row \[s\].
    pub start_s: f64,
    /// Site on Earth; `None`: no Earth rate, no gravity.
    pub site: Option<SiteEntry>,
    /// Initial attitude, body to navigation (north, west, up) frame, w x y z.
    pub attitude_wxyz: [f64; 4],
    /// The gyros.
    pub gyro: GyroEntry,
    /// Dithers; `None`: undithered gyros, no pickoff channel.
    pub dither: Option<DitherEntry>,
    /// The reference; `None`: no such channel.
    pub reference: Option<ReferenceEntry>,
    /// Additional fibre-optic triad; the reference if there is no other.
    pub fibre_optic: Option<FibreOpticEntry>,
    /// Encoders of the table; the reference if there is no other.
    pub encoder: Option<EncoderEntry>,
    /// The accelerometers; `None`: no such channel.
    pub accelerometer: Option<AccelerometerEntry>,
    /// Temperature; `None`: constant.
    pub thermal: Option<ThermalEntry>,
    /// Magnetic field; `None`: none.
    pub magnetic: Option<MagneticEntry>,
    /// Slow channels of the unit's health; `None`: no such channel.
    pub slow_channels: Option<SlowChannelsEntry>,
    /// Faults of the unit.
    pub unit_faults: UnitFaults,
    /// Motion, segment after segment.
    pub segments: Vec<SegmentEntry>,
    /// Effects that the model states.
    pub known_effects: Vec<ModelEffect>,
    /// Effects that only the truth file contains.
    pub concealed_effects: Vec<ModelEffect>,
    /// Sum of both, as the simulator applies it.
    pub effects: Effects,
    /// Mounts between base and case, from `[isolator]`.
    pub mounts: Option<IsolatorEntry>,
}

/// `[site]`.
#[derive(Debug, Clone, Copy)]
pub struct SiteEntry {
    /// Geodetic latitude \[rad\].
    pub latitude_rad: f64,
    /// Gravity \[m/s²\].
    pub gravity_m_s2: f64,
    /// The Earth rotates; a reference gyro then measures its rotation too.
    pub earth_rate: bool,
}

impl Scenario {
    /// Number of rows of the recording.
    pub fn rows(&self) -> usize {
        self.segments.iter().map(|segment| segment.rows).sum()
    }

    /// Mounts between base and case.
    pub fn isolator(&self) -> Option<IsolatorEntry> {
        self.mounts.or_else(|| {
            self.effects.isolator().map(|angular| IsolatorEntry {
                angular,
                ..IsolatorEntry::default()
            })
        })
    }

    /// True if the reference is on the base: with `isolator_mode` the case follows the reference.
    pub fn reference_on_base(&self) -> bool {
        self.effects.isolator().is_some()
    }
}
