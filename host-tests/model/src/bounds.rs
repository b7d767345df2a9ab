//! Checks a model: finite numbers in a plausible range, effects of the catalogue.
//!
//! The error names the file and the first faulty key, with its value and the expected one. The bounds reject wrong
//! units and typing errors; they do not assess a gyro.

use std::path::Path;

use super::catalogue::{Kind, SIX, Value, XYZ};
use super::{EffectValue, Model, ModelEffect};
use rlg_recording::error::InputError;
use rlg_recording::toml_file::{self, within};

/// Limit of a scale error \[1\]: those of ring-laser gyros are parts per million; a tenth is a wrong unit or pulse
/// weight.
const LARGEST_SCALE_ERROR: f64 = 0.1;
/// Limit of an installation angle \[rad\]: Eq. (7) is of first order; a tenth of a radian is no small angle.
const LARGEST_INSTALLATION_RAD: f64 = 0.1;
/// Limit of a bias \[rad/s\]: 0.1 rad/s is 20 000 °/h; a ring-laser gyro's bias is below 1 °/h.
const LARGEST_BIAS_RAD_S: f64 = 0.1;
/// Limit of a pulse weight \[rad\]: a pulse is a fraction of an arcsecond to some arcseconds; 0.01 rad is a wrong unit.
const LARGEST_PULSE_RAD: f64 = 0.01;
/// Range of a pickoff gain \[1\]: pickoffs are calibrated to per cent; a gain outside the range is a wrong unit.
const PICKOFF_GAIN: [f64; 2] = [0.1, 10.0];
/// Limit of an accelerometer bias \[m/s²\]: a tenth of g is beyond any navigation accelerometer.
const LARGEST_ACCELEROMETER_BIAS_M_S2: f64 = 1.0;

impl Model {
    /// Checks that every number is finite and physically possible and every effect is the catalogue's; an error names
    /// `path` and the key.
    pub fn check(&self, path: &Path) -> Result<(), InputError> {
        let gyro = &self.gyro;
        if gyro.names_pulse_weights() {
            pulse_weights(path, gyro.pulse_weight_rad)?;
        }
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
        if let Some(walk) = gyro.rate_random_walk_rad_s_sqrt_s {
            let key = "gyro.rate_random_walk_rad_s_sqrt_s";
            triple(path, key, walk, noise, "rad/s/sqrt(s)")?;
        }
        if let Some(flicker) = gyro.flicker_rad_s {
            triple(path, "gyro.flicker_rad_s", flicker, noise, "rad/s")?;
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
            let walk = reference.angle_random_walk_rad_sqrt_s;
            for (key, value, unit) in [
                ("angle_noise_rad", reference.angle_noise_rad, "rad"),
                ("angle_random_walk_rad_sqrt_s", walk, "rad/sqrt(s)"),
            ] {
                if let Some(value) = value {
                    within(path, &format!("reference.{key}"), value, noise, unit)?;
                }
            }
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
            triple(
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
            let beside = kind.compensation.iter().flat_map(|group| group.names);
            let names: Vec<_> = kind.parameter_names().chain(beside.copied()).collect();
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
            (Value::Recording, _) => {
                let named = effect.text(name).is_some();
                (named, "a recording's name".to_owned())
            }
            (Value::OneOf(words), _) => {
                let listed: Vec<String> = words.iter().map(|w| format!("{w:?}")).collect();
                let known = effect.text(name).is_some_and(|text| words.contains(&text));
                (known, listed.join(" or "))
            }
            (Value::Between([low, high], _), number) => (
                number.is_some_and(|v| (low..=high).contains(&v)),
                format!("{low} to {high}"),
            ),
            (Value::Remark, _) => (effect.text(name).is_some(), "text".to_owned()),
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

/// Checks pulse weights \[rad\] and returns them.
pub(super) fn pulse_weights(path: &Path, weights: [f64; 3]) -> Result<[f64; 3], InputError> {
    let range = [f64::MIN_POSITIVE, LARGEST_PULSE_RAD];
    triple(path, "gyro.pulse_weight_rad", weights, range, "rad")?;
    Ok(weights)
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
