//! Reads `model.toml` into a checked [`Model`], with warnings about unknown keys.
//!
//! Keys with a neutral value in the contract may be absent: bias, scale error and installation are then 0, the pickoff
//! gain 1, the motion that of the reference. Pulse weights have no neutral value, but only pulse counts need them. An
//! absent accelerometer noise is estimated. Drift without a key is unknown, which is not zero.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::bounds;
use super::catalogue::SIX;
use super::keys::KEYS;
use super::{
    Accelerometer, Dither, EffectValue, Gyro, Installation, Model, ModelEffect, MotionSource,
    Reference,
};
use rlg_recording::error::InputError;
use rlg_recording::keys::names;
use rlg_recording::nearest;
use rlg_recording::toml_file;

#[derive(Deserialize)]
struct ModelFile {
    motion: Option<MotionEntry>,
    gyro: GyroEntry,
    dither: Option<DitherEntry>,
    reference: Option<ReferenceEntry>,
    accelerometer: Option<AccelerometerEntry>,
    #[serde(default, rename = "effect")]
    effects: Vec<toml::Table>,
}

#[derive(Deserialize)]
struct MotionEntry {
    source: Source,
    #[serde(default)]
    earth_rate: bool,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum Source {
    Reference,
    Static,
}

/// Exactly three numbers, x, y, z.
#[derive(Deserialize, Clone, Copy)]
#[serde(try_from = "Vec<f64>")]
struct Triple([f64; 3]);

impl TryFrom<Vec<f64>> for Triple {
    type Error = String;
    fn try_from(values: Vec<f64>) -> Result<Self, String> {
        let count = values.len();
        let triple = values.try_into();
        triple
            .map(Self)
            .map_err(|_| format!("{count} numbers where three (x, y, z) are expected"))
    }
}

/// One number for all three axes, or three.
#[derive(Deserialize, Clone, Copy)]
#[serde(untagged, expecting = "expected a number, or three for x, y, z")]
enum OneOrThree {
    One(f64),
    Three(Triple),
}

impl OneOrThree {
    fn each(self) -> [f64; 3] {
        match self {
            Self::One(value) => [value; 3],
            Self::Three(Triple(values)) => values,
        }
    }
}

#[derive(Deserialize)]
struct GyroEntry {
    pulse_weight_rad: Option<Triple>,
    bias_rad_s: Option<Triple>,
    scale_error: Option<Triple>,
    angle_random_walk_rad_sqrt_s: Option<Triple>,
    rate_random_walk_rad_s_sqrt_s: Option<Triple>,
    flicker_rad_s: Option<Triple>,
    installation_rad: Option<BTreeMap<String, f64>>,
}

#[derive(Deserialize)]
struct DitherEntry {
    pickoff_gain: Option<Triple>,
    pickoff_noise_rad: Option<Triple>,
}

#[derive(Deserialize)]
struct ReferenceEntry {
    angle_noise_rad: Option<f64>,
    angle_random_walk_rad_sqrt_s: Option<f64>,
}

#[derive(Deserialize)]
struct AccelerometerEntry {
    bias_m_s2: Option<Triple>,
    scale_error: Option<Triple>,
    noise_m_s2_sqrt_hz: Option<OneOrThree>,
}

/// Names accepted by the reader, by section.
pub(super) fn read_names() -> [(&'static str, &'static [&'static str]); 6] {
    [
        ("", names::<ModelFile>()),
        ("motion", names::<MotionEntry>()),
        ("gyro", names::<GyroEntry>()),
        ("dither", names::<DitherEntry>()),
        ("reference", names::<ReferenceEntry>()),
        ("accelerometer", names::<AccelerometerEntry>()),
    ]
}

impl Model {
    /// Reads and checks the model in `path`; unknown keys are ignored.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        Self::read_with_warnings(path).map(|(model, _)| model)
    }

    /// As [`Model::read`], with a sentence about each ignored key (most likely a typing error, but others may add keys
    /// of their own).
    pub fn read_with_warnings(path: impl AsRef<Path>) -> Result<(Self, Vec<String>), InputError> {
        let path = path.as_ref();
        let (table, file): (_, ModelFile) = toml_file::read(path)?;
        let effects = file.effects.into_iter().enumerate();
        let zero = Triple([0.0; 3]);
        let motion = file.motion.as_ref();
        let model = Self {
            motion: match motion.map_or(Source::Reference, |motion| motion.source) {
                Source::Reference => MotionSource::Reference,
                Source::Static => MotionSource::Static,
            },
            earth_rate_in_reference: motion.is_some_and(|motion| motion.earth_rate),
            gyro: Gyro {
                pulse_weight_rad: match file.gyro.pulse_weight_rad {
                    Some(Triple(weights)) => bounds::pulse_weights(path, weights)?,
                    None => [0.0; 3],
                },
                bias_rad_s: file.gyro.bias_rad_s.unwrap_or(zero).0,
                scale_error: file.gyro.scale_error.unwrap_or(zero).0,
                angle_random_walk_rad_sqrt_s: file.gyro.angle_random_walk_rad_sqrt_s.map(|t| t.0),
                rate_random_walk_rad_s_sqrt_s: file.gyro.rate_random_walk_rad_s_sqrt_s.map(|t| t.0),
                flicker_rad_s: file.gyro.flicker_rad_s.map(|t| t.0),
                installation_rad: installation(
                    path,
                    file.gyro.installation_rad.unwrap_or_default(),
                )?,
            },
            dither: file.dither.map(|dither| Dither {
                pickoff_gain: dither.pickoff_gain.unwrap_or(Triple([1.0; 3])).0,
                pickoff_noise_rad: dither.pickoff_noise_rad.unwrap_or(zero).0,
            }),
            reference: file.reference.map(|reference| Reference {
                angle_noise_rad: reference.angle_noise_rad,
                angle_random_walk_rad_sqrt_s: reference.angle_random_walk_rad_sqrt_s,
            }),
            accelerometer: file.accelerometer.map(|accelerometer| Accelerometer {
                bias_m_s2: accelerometer.bias_m_s2.unwrap_or(zero).0,
                scale_error: accelerometer.scale_error.unwrap_or(zero).0,
                noise_m_s2_sqrt_hz: accelerometer
                    .noise_m_s2_sqrt_hz
                    .map_or([0.0; 3], OneOrThree::each),
            }),
            effects: effects
                .map(|(index, table)| effect(path, index, table))
                .collect::<Result<_, _>>()?,
        };
        model.check(path)?;
        Ok((model, unknown_keys(path, &table)?))
    }
}

fn installation(path: &Path, entries: BTreeMap<String, f64>) -> Result<Installation, InputError> {
    let mut angles = [0.0; 6];
    for (name, value) in entries {
        let Some(index) = SIX.iter().position(|known| *known == name) else {
            return Err(InputError::new(path, "is not an installation angle")
                .channel(format!("gyro.installation_rad.{name}"))
                .value(value)
                .expected(format!("one of {}", SIX.join(", "))));
        };
        angles[index] = value;
    }
    Ok(Installation::from_array(angles))
}

fn effect(path: &Path, index: usize, table: toml::Table) -> Result<ModelEffect, InputError> {
    let at = |key: &str| format!("effect {index}, {key}");
    let mut kind = None;
    let mut parameters = BTreeMap::new();
    for (key, value) in table {
        let value = match value {
            toml::Value::Float(number) => EffectValue::Number(number),
            toml::Value::Integer(number) => EffectValue::Number(number as f64),
            toml::Value::String(text) => EffectValue::Text(text),
            other => {
                return Err(InputError::new(path, "is neither a number nor text")
                    .channel(at(&key))
                    .value(other)
                    .expected("a number or a string"));
            }
        };
        match (key.as_str(), value) {
            ("kind", EffectValue::Text(text)) => kind = Some(text),
            (_, value) => {
                parameters.insert(key, value);
            }
        }
    }
    let kind = kind.ok_or_else(|| {
        InputError::new(path, "has no kind")
            .channel(at("kind"))
            .expected("kind = \"...\" from the catalogue")
    })?;
    Ok(ModelEffect { kind, parameters })
}

/// Warnings about unknown keys; an error for one that is similar to a known key.
fn unknown_keys(path: &Path, table: &toml::Table) -> Result<Vec<String>, InputError> {
    let mut warnings = Vec::new();
    let known = |section: &str, key: &str| {
        let mut keys = KEYS.iter();
        match section {
            "" => keys.any(|known| known.top() == key),
            section => keys.any(|known| known.section == section && known.name == key),
        }
    };
    let mut warn = |section: &str, key: &str| {
        let of_section = KEYS.iter().filter(|known| known.section == section);
        let near = match section {
            "" => nearest(key, KEYS.iter().map(|known| known.top())),
            _ => nearest(key, of_section.map(|known| known.name)),
        };
        let whole = match section {
            "" => key.to_owned(),
            section => format!("{section}.{key}"),
        };
        if let Some(near) = near {
            return Err(InputError::new(path, "is no key here")
                .channel(whole)
                .expected(format!("{near:?}")));
        }
        warnings.push(format!(
            "{}: the key `{whole}` is not known and was passed over",
            path.display()
        ));
        Ok(())
    };
    for (section, value) in table {
        if !known("", section) {
            warn("", section)?;
        }
        let Some(keys) = value.as_table().filter(|_| known("", section)) else {
            continue;
        };
        for key in keys.keys().filter(|key| !known(section, key)) {
            warn(section, key)?;
        }
    }
    Ok(warnings)
}
