//! Scenario (TOML) of a programme, for `rlg simulate`.
//!
//! Values needed in a scenario but not stated in a model (dither frequencies and amplitude, resolutions) are taken from
//! real instruments (physics §5) and marked in the text.

use std::fmt::Write as _;

use super::limits::Limits;
use rlg_catalogue::moves::{Kind, Move};
use rlg_model::{EffectValue, Model};
use rlg_recording::toml_file::{float, string};
use rlg_signal::streams::AXES;

/// Resolutions far below every noise.
const FINE_RAD: &str = "5e-9";

/// Text of the scenario.
pub fn text(name: &str, moves: &[Move], limits: &Limits, model: &Model) -> String {
    let mut out = format!(
        "# A calibration programme by `rlg calibrate --propose`. Body rates; a three-axis table follows them.\n\
         format = 1\nname = {}\nrate_hz = {}\n",
        string(name),
        float(limits.rate_hz)
    );
    // Writing to a String cannot fail, so the results of write! are dropped.
    instrument(&mut out, model);
    for one in moves {
        motion(&mut out, one);
    }
    for effect in &model.effects {
        let _ = writeln!(
            out,
            "\n[[effect]]\nkind = {}\nconcealed = false",
            string(&effect.kind)
        );
        for (key, value) in &effect.parameters {
            let value = match value {
                EffectValue::Number(number) => float(*number),
                EffectValue::Text(text) => string(text),
            };
            let _ = writeln!(out, "{key} = {value}");
        }
    }
    out
}

fn instrument(out: &mut String, model: &Model) {
    let list = |values: [f64; 3]| format!("[{}]", values.map(float).join(", "));
    let gyro = &model.gyro;
    let walk = gyro.angle_random_walk_rad_sqrt_s.unwrap_or_default();
    let e = &gyro.installation_rad;
    let _ = writeln!(
        out,
        "\n[gyro]\npulse_weight_rad = {}\nbias_rad_s = {}\nscale_error = {}\nangle_random_walk_rad_sqrt_s = {}\n\
         installation_rad = {{ xy = {}, xz = {}, yx = {}, yz = {}, zx = {}, zy = {} }}",
        list(gyro.pulse_weight_rad),
        list(gyro.bias_rad_s),
        list(gyro.scale_error),
        list(walk),
        float(e.xy),
        float(e.xz),
        float(e.yx),
        float(e.yz),
        float(e.zx),
        float(e.zy),
    );
    if let Some(dither) = &model.dither {
        let _ = writeln!(
            out,
            "\n[dither]\nfrequency_hz = [392.6, 430.1, 474.8]          # assumed: three unlike ones\n\
             amplitude_rad = [7.3e-4, 7.3e-4, 7.3e-4]        # assumed: 150 arcsec\n\
             amplitude_spread = 0.15                         # assumed: against lock-in\n\
             pickoff_gain = {}\npickoff_noise_rad = {}\npickoff_weight_rad = {FINE_RAD}",
            list(dither.pickoff_gain),
            list(dither.pickoff_noise_rad),
        );
    }
    if let Some(reference) = &model.reference {
        let _ = writeln!(
            out,
            "\n[reference]\nangle_noise_rad = {}\nangle_random_walk_rad_sqrt_s = {}\nweight_rad = {FINE_RAD}",
            float(reference.angle_noise_rad.unwrap_or_default()),
            float(reference.angle_random_walk_rad_sqrt_s.unwrap_or_default()),
        );
    }
}

fn motion(out: &mut String, one: &Move) {
    let _ = writeln!(out, "\n[[motion]]");
    match one.kind {
        Kind::Still => {
            let _ = writeln!(out, "kind = \"still\"");
        }
        Kind::Coning {
            axis,
            frequency_hz,
            angle_rad,
        } => {
            let _ = writeln!(
                out,
                "kind = \"coning\"\naxis = \"{}\"\nfrequency_hz = {}\nangle_rad = {}\nramp_s = {}",
                AXES[axis],
                float(frequency_hz),
                float(angle_rad),
                float(one.ramp_s)
            );
        }
        Kind::Spin {
            axis,
            rate_rad_s,
            across,
            frequency_hz,
            angle_rad,
            phase_rad,
        } => {
            let _ = writeln!(
                out,
                "kind = \"spin\"\naxis = \"{}\"\nrate_rad_s = {}\nramp_s = {}\noscillation_axis = \"{}\"\n\
                 oscillation_frequency_hz = {}\noscillation_angle_rad = {}\noscillation_phase_rad = {}",
                AXES[axis],
                float(rate_rad_s),
                float(one.ramp_s),
                AXES[across],
                float(frequency_hz),
                float(angle_rad),
                float(phase_rad)
            );
        }
    }
    let _ = writeln!(out, "duration_s = {}", float(one.duration_s));
}
