//! `model.toml` in and out.
//!
//! Enters: the path. Leaves: [`Model`] and warnings about keys this version does not know. Every number is
//! finite and physically possible; every effect is one of the catalogue with its own parameter names.
//! Writing gives the same bytes for the same model, and every f64 comes back as it was.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use serde::Deserialize;

use super::catalogue::{Kind, SIX, Value, XYZ};
use super::{
    Accelerometer, Dither, EffectValue, Gyro, Installation, Model, ModelEffect, MotionSource,
    Reference,
};
use crate::error::InputError;
use crate::{output, toml_file};

/// Scale errors of ring-laser gyros are parts per million; a tenth is a wrong unit or a wrong pulse weight.
const LARGEST_SCALE_ERROR: f64 = 0.1;
/// Eq. (7) is of first order in the installation angles; a tenth of a radian is no small angle.
const LARGEST_INSTALLATION_RAD: f64 = 0.1;
/// 0.1 rad/s is 20 000 °/h; a ring-laser gyro's bias is below 1 °/h.
const LARGEST_BIAS_RAD_S: f64 = 0.1;
/// A pulse is a fraction of an arcsecond to some arcseconds; 0.01 rad is a wrong unit.
const LARGEST_PULSE_RAD: f64 = 0.01;
/// The pickoff is calibrated to per cent; a gain outside these is a wrong unit.
const PICKOFF_GAIN: [f64; 2] = [0.1, 10.0];
/// A tenth of g of bias is no navigation accelerometer.
const LARGEST_ACCELEROMETER_BIAS_M_S2: f64 = 1.0;

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

/// Three numbers, x, y, z: not two, not four.
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

#[derive(Deserialize)]
struct GyroEntry {
    pulse_weight_rad: Triple,
    bias_rad_s: Option<Triple>,
    scale_error: Option<Triple>,
    angle_random_walk_rad_sqrt_s: Option<Triple>,
    installation_rad: Option<BTreeMap<String, f64>>,
}

#[derive(Deserialize)]
struct DitherEntry {
    pickoff_gain: Option<Triple>,
    pickoff_noise_rad: Triple,
}

#[derive(Deserialize)]
struct ReferenceEntry {
    angle_noise_rad: f64,
    #[serde(default)]
    angle_random_walk_rad_sqrt_s: f64,
}

#[derive(Deserialize)]
struct AccelerometerEntry {
    bias_m_s2: Option<Triple>,
    scale_error: Option<Triple>,
    noise_m_s2_sqrt_hz: f64,
}

/// The keys this version knows, by section; `""` is the top.
const KNOWN: &[(&str, &[&str])] = &[
    (
        "",
        &[
            "format",
            "motion",
            "gyro",
            "dither",
            "reference",
            "accelerometer",
            "effect",
        ],
    ),
    ("motion", &["source", "earth_rate"]),
    (
        "gyro",
        &[
            "pulse_weight_rad",
            "bias_rad_s",
            "scale_error",
            "angle_random_walk_rad_sqrt_s",
            "installation_rad",
        ],
    ),
    ("dither", &["pickoff_gain", "pickoff_noise_rad"]),
    (
        "reference",
        &["angle_noise_rad", "angle_random_walk_rad_sqrt_s"],
    ),
    (
        "accelerometer",
        &["bias_m_s2", "scale_error", "noise_m_s2_sqrt_hz"],
    ),
];

impl Model {
    /// Reads and checks the model in `path`; keys this version does not know are passed over.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, InputError> {
        Self::read_with_warnings(path).map(|(model, _)| model)
    }

    /// As [`Model::read`], with a sentence about each key that was passed over (most likely a slip of
    /// the pen, but others may add keys of their own).
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
                pulse_weight_rad: file.gyro.pulse_weight_rad.0,
                bias_rad_s: file.gyro.bias_rad_s.unwrap_or(zero).0,
                scale_error: file.gyro.scale_error.unwrap_or(zero).0,
                angle_random_walk_rad_sqrt_s: file.gyro.angle_random_walk_rad_sqrt_s.map(|t| t.0),
                installation_rad: installation(
                    path,
                    file.gyro.installation_rad.unwrap_or_default(),
                )?,
            },
            dither: file.dither.map(|dither| Dither {
                pickoff_gain: dither.pickoff_gain.unwrap_or(Triple([1.0; 3])).0,
                pickoff_noise_rad: dither.pickoff_noise_rad.0,
            }),
            reference: file.reference.map(|reference| Reference {
                angle_noise_rad: reference.angle_noise_rad,
                angle_random_walk_rad_sqrt_s: reference.angle_random_walk_rad_sqrt_s,
            }),
            accelerometer: file.accelerometer.map(|accelerometer| Accelerometer {
                bias_m_s2: accelerometer.bias_m_s2.unwrap_or(zero).0,
                scale_error: accelerometer.scale_error.unwrap_or(zero).0,
                noise_m_s2_sqrt_hz: accelerometer.noise_m_s2_sqrt_hz,
            }),
            effects: effects
                .map(|(index, table)| effect(path, index, table))
                .collect::<Result<_, _>>()?,
        };
        model.check(path)?;
        Ok((model, unknown_keys(path, &table)))
    }

    /// Whether every number is finite and physically possible and every effect is the catalogue's; an
    /// error names `path` and the key.
    pub fn check(&self, path: &Path) -> Result<(), InputError> {
        let gyro = &self.gyro;
        let tiny = f64::MIN_POSITIVE;
        triple(
            path,
            "gyro.pulse_weight_rad",
            gyro.pulse_weight_rad,
            [tiny, LARGEST_PULSE_RAD],
            "rad",
        )?;
        let bias = [-LARGEST_BIAS_RAD_S, LARGEST_BIAS_RAD_S];
        triple(path, "gyro.bias_rad_s", gyro.bias_rad_s, bias, "rad/s")?;
        let scale = [-LARGEST_SCALE_ERROR, LARGEST_SCALE_ERROR];
        triple(path, "gyro.scale_error", gyro.scale_error, scale, "1")?;
        let noise = [0.0, f64::MAX];
        if let Some(walk) = gyro.angle_random_walk_rad_sqrt_s {
            triple(
                path,
                "gyro.angle_random_walk_rad_sqrt_s",
                walk,
                noise,
                "rad/sqrt(s)",
            )?;
        }
        let angles = [-LARGEST_INSTALLATION_RAD, LARGEST_INSTALLATION_RAD];
        for (name, value) in SIX.iter().zip(gyro.installation_rad.to_array()) {
            within(
                path,
                &format!("gyro.installation_rad.{name}"),
                value,
                angles,
                "rad",
            )?;
        }
        if let Some(dither) = &self.dither {
            triple(
                path,
                "dither.pickoff_gain",
                dither.pickoff_gain,
                PICKOFF_GAIN,
                "1",
            )?;
            triple(
                path,
                "dither.pickoff_noise_rad",
                dither.pickoff_noise_rad,
                noise,
                "rad",
            )?;
        }
        if let Some(reference) = &self.reference {
            within(
                path,
                "reference.angle_noise_rad",
                reference.angle_noise_rad,
                noise,
                "rad",
            )?;
            let key = "reference.angle_random_walk_rad_sqrt_s";
            within(
                path,
                key,
                reference.angle_random_walk_rad_sqrt_s,
                noise,
                "rad/sqrt(s)",
            )?;
        }
        if let Some(accelerometer) = &self.accelerometer {
            let bias = [
                -LARGEST_ACCELEROMETER_BIAS_M_S2,
                LARGEST_ACCELEROMETER_BIAS_M_S2,
            ];
            triple(
                path,
                "accelerometer.bias_m_s2",
                accelerometer.bias_m_s2,
                bias,
                "m/s^2",
            )?;
            triple(
                path,
                "accelerometer.scale_error",
                accelerometer.scale_error,
                scale,
                "1",
            )?;
            let key = "accelerometer.noise_m_s2_sqrt_hz";
            within(
                path,
                key,
                accelerometer.noise_m_s2_sqrt_hz,
                noise,
                "m/s^2/sqrt(Hz)",
            )?;
        }
        let mut effects = self.effects.iter().enumerate();
        effects.try_for_each(|(index, effect)| check_effect(path, index, effect))
    }

    /// Writes it to `path`, whole or not at all.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), InputError> {
        let path = path.as_ref();
        self.check(path)?;
        output::write_file(path, self.to_toml().as_bytes())
    }

    /// The text of `model.toml`.
    pub fn to_toml(&self) -> String {
        let mut out = format!("format = {}\n", toml_file::FORMAT);
        // Writing to a String cannot fail, so the results of write! are dropped.
        let source = match self.motion {
            MotionSource::Reference => "reference",
            MotionSource::Static => "static",
        };
        let _ = writeln!(out, "\n[motion]\nsource = \"{source}\"");
        let _ = writeln!(out, "earth_rate = {}", self.earth_rate_in_reference);
        let gyro = &self.gyro;
        let _ = writeln!(
            out,
            "\n[gyro]\npulse_weight_rad = {}",
            list(gyro.pulse_weight_rad)
        );
        let _ = writeln!(out, "bias_rad_s = {}", list(gyro.bias_rad_s));
        let _ = writeln!(out, "scale_error = {}", list(gyro.scale_error));
        if let Some(walk) = gyro.angle_random_walk_rad_sqrt_s {
            let _ = writeln!(out, "angle_random_walk_rad_sqrt_s = {}", list(walk));
        }
        let angles = SIX.iter().zip(gyro.installation_rad.to_array());
        let angles: Vec<_> = angles
            .map(|(name, v)| format!("{name} = {}", toml_file::float(v)))
            .collect();
        let _ = writeln!(out, "installation_rad = {{ {} }}", angles.join(", "));
        if let Some(dither) = &self.dither {
            let _ = writeln!(
                out,
                "\n[dither]\npickoff_gain = {}",
                list(dither.pickoff_gain)
            );
            let _ = writeln!(
                out,
                "pickoff_noise_rad = {}",
                list(dither.pickoff_noise_rad)
            );
        }
        if let Some(reference) = &self.reference {
            let noise = toml_file::float(reference.angle_noise_rad);
            let walk = toml_file::float(reference.angle_random_walk_rad_sqrt_s);
            let _ = writeln!(out, "\n[reference]\nangle_noise_rad = {noise}");
            let _ = writeln!(out, "angle_random_walk_rad_sqrt_s = {walk}");
        }
        if let Some(accelerometer) = &self.accelerometer {
            let _ = writeln!(
                out,
                "\n[accelerometer]\nbias_m_s2 = {}",
                list(accelerometer.bias_m_s2)
            );
            let _ = writeln!(out, "scale_error = {}", list(accelerometer.scale_error));
            let noise = toml_file::float(accelerometer.noise_m_s2_sqrt_hz);
            let _ = writeln!(out, "noise_m_s2_sqrt_hz = {noise}");
        }
        for effect in &self.effects {
            let _ = writeln!(
                out,
                "\n[[effect]]\nkind = {}",
                toml_file::string(&effect.kind)
            );
            for (name, value) in &effect.parameters {
                let value = match value {
                    EffectValue::Number(number) => toml_file::float(*number),
                    EffectValue::Text(text) => toml_file::string(text),
                };
                let _ = writeln!(out, "{} = {value}", key(name));
            }
        }
        out
    }
}

impl Installation {
    /// In the order xy, xz, yx, yz, zx, zy \[rad\].
    pub fn to_array(self) -> [f64; 6] {
        [self.xy, self.xz, self.yx, self.yz, self.zx, self.zy]
    }

    /// From the order xy, xz, yx, yz, zx, zy \[rad\].
    pub fn from_array([xy, xz, yx, yz, zx, zy]: [f64; 6]) -> Self {
        Self {
            xy,
            xz,
            yx,
            yz,
            zx,
            zy,
        }
    }
}

impl ModelEffect {
    /// A parameter that is a number; absent ones count as 0.
    pub fn number(&self, name: &str) -> f64 {
        match self.parameters.get(name) {
            Some(EffectValue::Number(value)) => *value,
            _ => 0.0,
        }
    }

    /// A parameter that is text.
    pub fn text(&self, name: &str) -> Option<&str> {
        match self.parameters.get(name) {
            Some(EffectValue::Text(text)) => Some(text),
            _ => None,
        }
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

fn check_effect(path: &Path, index: usize, effect: &ModelEffect) -> Result<(), InputError> {
    let at = |key: &str| format!("effect {index} ({}), {key}", effect.kind);
    let Some(kind) = Kind::named(&effect.kind) else {
        return Err(
            InputError::new(path, "is a kind of effect the catalogue does not have")
                .channel(format!("effect {index}, kind"))
                .value(format!("{:?}", effect.kind))
                .expected(format!(
                    "a kind of the catalogue; the nearest is {:?}",
                    Kind::nearest(&effect.kind)
                )),
        );
    };
    for (name, value) in &effect.parameters {
        let number = match value {
            EffectValue::Number(number) if number.is_finite() => Some(*number),
            EffectValue::Number(number) => {
                return Err(InputError::new(path, "is not a finite number")
                    .channel(at(name))
                    .value(number));
            }
            EffectValue::Text(_) => None,
        };
        if kind.is_free() {
            continue;
        }
        let Some(group) = kind.group_of(name) else {
            let names: Vec<_> = kind.parameter_names().collect();
            return Err(InputError::new(path, "is not a parameter of this kind")
                .channel(at(name))
                .expected(format!("one of {}", names.join(", "))));
        };
        let (fits, expected) = match (group.value, number) {
            (Value::Number, number) => (number.is_some(), format!("a number in {}", group.unit)),
            (Value::Positive, number) => (
                number.is_some_and(|v| v > 0.0),
                format!("a number above 0 in {}", group.unit),
            ),
            (Value::NotNegative, number) => (
                number.is_some_and(|v| v >= 0.0),
                format!("a number of at least 0 in {}", group.unit),
            ),
            (Value::Axis, _) => {
                let label = effect.text(name).is_some_and(|text| XYZ.contains(&text));
                (label, "\"x\", \"y\" or \"z\"".to_owned())
            }
            (Value::Channel, _) => (effect.text(name).is_some(), "a channel's name".to_owned()),
        };
        if !fits {
            let found = match value {
                EffectValue::Number(number) => toml_file::float(*number),
                EffectValue::Text(text) => toml_file::string(text),
            };
            return Err(InputError::new(path, "is not a value of this parameter")
                .channel(at(name))
                .value(found)
                .expected(expected));
        }
    }
    let required = kind.groups.iter().filter(|group| group.required);
    for name in required.flat_map(|group| group.names) {
        if !effect.parameters.contains_key(*name) {
            return Err(InputError::new(path, "is missing")
                .channel(at(name))
                .expected(format!(
                    "a value{}",
                    kind.unit_of(name)
                        .filter(|u| !u.is_empty())
                        .map_or(String::new(), |u| format!(" in {u}"))
                )));
        }
    }
    Ok(())
}

fn triple(
    path: &Path,
    key: &str,
    values: [f64; 3],
    range: [f64; 2],
    unit: &str,
) -> Result<(), InputError> {
    let mut named = XYZ.iter().zip(values);
    named.try_for_each(|(axis, value)| within(path, &format!("{key}.{axis}"), value, range, unit))
}

fn within(
    path: &Path,
    key: &str,
    value: f64,
    range: [f64; 2],
    unit: &str,
) -> Result<(), InputError> {
    if value.is_finite() && value >= range[0] && value <= range[1] {
        return Ok(());
    }
    let expected = match range {
        [low, f64::MAX] => format!("a finite number of at least {low} {unit}"),
        [f64::MIN_POSITIVE, high] => format!("a positive number up to {high} {unit}"),
        [low, high] => format!("{low} to {high} {unit}"),
    };
    Err(InputError::new(path, "is out of range")
        .channel(key)
        .value(value)
        .expected(expected))
}

fn unknown_keys(path: &Path, table: &toml::Table) -> Vec<String> {
    let mut warnings = Vec::new();
    for (section, known) in KNOWN {
        let Some(keys) = (if section.is_empty() {
            Some(table)
        } else {
            table.get(*section).and_then(toml::Value::as_table)
        }) else {
            continue;
        };
        for key in keys.keys().filter(|key| !known.contains(&key.as_str())) {
            let whole = if section.is_empty() {
                key.clone()
            } else {
                format!("{section}.{key}")
            };
            warnings.push(format!(
                "{}: the key `{whole}` is not known and was passed over",
                path.display()
            ));
        }
    }
    warnings
}

fn list(values: [f64; 3]) -> String {
    let [x, y, z] = values.map(toml_file::float);
    format!("[{x}, {y}, {z}]")
}

/// A bare key where TOML allows it.
fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) {
        name.to_owned()
    } else {
        toml_file::string(name)
    }
}
