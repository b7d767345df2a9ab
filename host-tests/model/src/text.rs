//! `model.toml` as text: equal models give equal bytes, and every f64 is exact on reading.

use std::fmt::Write as _;
use std::path::Path;

use super::catalogue::SIX;
use super::{EffectValue, Model, MotionSource};
use rlg_recording::error::InputError;
use rlg_recording::output;
use rlg_recording::toml_file;

impl Model {
    /// Writes the model to `path`, whole or not at all.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), InputError> {
        let path = path.as_ref();
        self.check(path)?;
        output::write_file(path, self.to_toml().as_bytes())
    }

    /// Formats the text of `model.toml`.
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
        let _ = writeln!(out, "\n[gyro]");
        if gyro.names_pulse_weights() {
            let weights = list(gyro.pulse_weight_rad);
            let _ = writeln!(out, "pulse_weight_rad = {weights}");
        }
        let _ = writeln!(out, "bias_rad_s = {}", list(gyro.bias_rad_s));
        let _ = writeln!(out, "scale_error = {}", list(gyro.scale_error));
        if let Some(walk) = gyro.angle_random_walk_rad_sqrt_s {
            let _ = writeln!(out, "angle_random_walk_rad_sqrt_s = {}", list(walk));
        }
        if let Some(walk) = gyro.rate_random_walk_rad_s_sqrt_s {
            let _ = writeln!(out, "rate_random_walk_rad_s_sqrt_s = {}", list(walk));
        }
        if let Some(flicker) = gyro.flicker_rad_s {
            let _ = writeln!(out, "flicker_rad_s = {}", list(flicker));
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
            let _ = writeln!(out, "\n[reference]");
            if let Some(noise) = reference.angle_noise_rad {
                let _ = writeln!(out, "angle_noise_rad = {}", toml_file::float(noise));
            }
            if let Some(walk) = reference.angle_random_walk_rad_sqrt_s {
                let walk = toml_file::float(walk);
                let _ = writeln!(out, "angle_random_walk_rad_sqrt_s = {walk}");
            }
        }
        if let Some(accelerometer) = &self.accelerometer {
            let _ = writeln!(
                out,
                "\n[accelerometer]\nbias_m_s2 = {}",
                list(accelerometer.bias_m_s2)
            );
            let _ = writeln!(out, "scale_error = {}", list(accelerometer.scale_error));
            let noise = match accelerometer.noise_m_s2_sqrt_hz {
                [x, y, z] if x == y && y == z => toml_file::float(x),
                each => list(each),
            };
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

fn list(values: [f64; 3]) -> String {
    let [x, y, z] = values.map(toml_file::float);
    format!("[{x}, {y}, {z}]")
}

/// Bare key if TOML allows it, else quoted.
fn key(name: &str) -> String {
    let bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    if !name.is_empty() && name.chars().all(bare) {
        name.to_owned()
    } else {
        toml_file::string(name)
    }
}
