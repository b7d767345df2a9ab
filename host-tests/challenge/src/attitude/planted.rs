//! Effects injected with an attitude reference: nothing, an effect of the catalogue, or a fault of the reference.

use std::collections::BTreeMap;

use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::catalogue::{NINE, SIX};
use rlg_simulator::instrument::normal;
use serde::{Deserialize, Serialize};

use crate::marks::effects::{AXES, Effect};
use crate::marks::setting::{name_of, one_of, sign};

/// Injected effect of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Planted {
    /// Nothing.
    None,
    /// A bias.
    GyroBias,
    /// Scale errors.
    GyroScale,
    /// A reference with late or early stamps.
    ReferenceDelay,
    /// A misaligned reference.
    ReferenceMisalignment,
    /// All gyros with a single-pole low-pass filter.
    GyroBandwidth,
    /// A g-dependent bias.
    GyroGBias,
    /// Flexure of the axes by angular acceleration.
    AxisFlexure,
    /// One to four wrong stamps.
    Glitches,
    /// One or two short spans of wrong stamps.
    GlitchSpans,
    /// A permanent jump of the reference.
    Jump,
    /// A gap of the stamps.
    Gap,
    /// A span with a held attitude of the reference.
    Held,
}

/// Injected effects by the trial's number, repeated in turn.
pub const CYCLE: [Planted; 17] = {
    use Planted::{
        AxisFlexure, Gap, GlitchSpans, Glitches, GyroBandwidth, GyroBias, GyroGBias, GyroScale,
        Held, Jump, None, ReferenceDelay, ReferenceMisalignment,
    };
    [
        None,
        GyroBias,
        GyroScale,
        ReferenceDelay,
        None,
        ReferenceMisalignment,
        GyroBandwidth,
        GyroGBias,
        None,
        AxisFlexure,
        Glitches,
        GlitchSpans,
        None,
        Jump,
        Gap,
        None,
        Held,
    ]
};

/// Range of the filter's time constant \[s\].
pub const POLES_S: [f64; 2] = [5e-3, 5e-2];

impl Planted {
    /// Returns the injected effect of a trial's number.
    pub fn of(number: u64) -> Self {
        CYCLE[(number % CYCLE.len() as u64) as usize]
    }

    /// Returns the name in tables.
    pub fn name(self) -> String {
        name_of(&self)
    }

    /// Draws the pattern of an effect of the catalogue, of size 1 in its largest parameter: of one parameter or of all.
    pub fn pattern(self, rng: &mut ChaCha8Rng) -> Option<Effect> {
        let (kind, names): (&str, &[&str]) = match self {
            Self::GyroBias => ("gyro_bias", &AXES),
            Self::GyroScale => ("gyro_scale", &AXES),
            Self::ReferenceDelay => ("reference_delay", &["all"]),
            Self::ReferenceMisalignment => ("reference_misalignment", &AXES),
            Self::GyroBandwidth => ("gyro_bandwidth", &["x_pole_s", "y_pole_s", "z_pole_s"]),
            Self::GyroGBias => ("gyro_g_bias", NINE),
            Self::AxisFlexure => ("axis_flexure", SIX),
            _ => return None,
        };
        let is_common = matches!(self, Self::GyroBandwidth | Self::AxisFlexure);
        let chosen = match is_common || rng.random_bool(0.5) {
            true => names.to_vec(),
            false => vec![one_of(rng, names)],
        };
        let several = chosen.len() > 1;
        let size = |rng: &mut ChaCha8Rng| match self {
            Self::GyroBandwidth => 1.0,
            // A suspension's compliance J/k has one sign.
            Self::AxisFlexure => 0.5 + 0.5 * rng.random::<f64>(),
            _ if several => normal(rng),
            _ => sign(rng),
        };
        let values: BTreeMap<String, f64> = chosen
            .into_iter()
            .map(|name| (name.to_owned(), size(rng)))
            .collect();
        let effect = Effect {
            kind,
            axis: None,
            values,
        };
        Some(effect.scaled(1.0 / effect.largest()))
    }
}
