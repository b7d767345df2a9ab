//! Content of a parameter block, for `rlg params` that writes one and `rlg inspect` that reads one.

use std::fmt::Write as _;
use std::path::Path;

use serde::Serialize;
use trueaxis::{FlexureResponse, HealthLimits, Identity, OutputFormat, Parameters, TermKind};

use crate::error::InputError;
use crate::model::catalogue::SIX;
use crate::model::implied_hz;

/// Decodes parameters and generation of a block as the firmware does, `path` for messages.
pub(super) fn parameters(path: &Path, bytes: &[u8]) -> Result<(Parameters, u32), InputError> {
    Parameters::from_block(bytes)
        .map_err(|error| InputError::new(path, format!("is no block for the firmware: {error}")))
}

/// Content of a block, as `--json` prints it.
#[derive(Serialize)]
pub(super) struct Block {
    format: u32,
    version: &'static str,
    pub(super) bytes: usize,
    pub(super) generation: u32,
    pulse_weight_rad: [f64; 3],
    bias_rad_s: [f64; 3],
    scale_error: [f64; 3],
    /// xy, xz, yx, yz, zx, zy, as all six below.
    installation_rad: [f64; 6],
    flexure_s2: [f64; 6],
    pickoff_gain: [f64; 3],
    pickoff_weight_rad: f64,
    sample_rate_hz: f64,
    samples_per_output: u16,
    /// `mode`: each pair has the mode implied by its K; `static`.
    flexure_response: &'static str,
    /// Frequency of each pair's mode [Hz], and damping; null without a mode.
    flexure_mode_hz: [Option<f64>; 6],
    flexure_damping: Option<f64>,
    pickoff_delay_s: [f64; 3],
    dither_frequency_hz: [f64; 3],
    dither_amplitude_rad: [f64; 3],
    adaptation_time_s: f64,
    accelerometers: Option<Accelerometers>,
    /// Kinds of optional terms with records in the block.
    pub(super) terms: Vec<&'static str>,
    /// Limits of the unit's health; null without.
    limits: Option<Limits>,
    /// Unit and calibration that the block names; null for a block of any unit.
    identity: Option<Named>,
    /// Form of the output.
    output: &'static str,
}

#[derive(Serialize)]
struct Accelerometers {
    weight_m_s: [f64; 3],
    bias_m_s2: [f64; 3],
    scale_error: [f64; 3],
    misalignment_rad: [f64; 6],
    /// Row i: the position of accelerometer i.
    lever_arm_m: [[f64; 3]; 3],
}

/// Limits by the keys of their file; null where not watched.
#[derive(Serialize)]
struct Limits {
    temperature_k: Option<[f64; 2]>,
    intensity_least: Option<[f64; 3]>,
    path_length_step: Option<f64>,
    dither_drive: Option<[f64; 2]>,
    dither_amplitude: [f64; 2],
    pulse_silence_s: Option<f64>,
}

#[derive(Serialize)]
struct Named {
    /// As text where it is printable, else hexadecimal.
    unit: String,
    /// Its 12 bytes, hexadecimal.
    unit_bytes: String,
    /// Date of the calibration, YYYY-MM-DD; null if unknown.
    calibrated: Option<String>,
    /// First 8 bytes of the SHA-256 of the model's file, hexadecimal; null if unknown.
    model_sha256_begins: Option<String>,
}

impl Block {
    /// Content of the parameters of a block of so many bytes.
    pub(super) fn of(parameters: &Parameters, generation: u32, bytes: usize) -> Self {
        let damping = parameters.flexure_response.damping();
        Self {
            format: 1,
            version: env!("CARGO_PKG_VERSION"),
            bytes,
            generation,
            pulse_weight_rad: parameters.pulse_weight_rad,
            bias_rad_s: parameters.bias_rad_s,
            scale_error: parameters.scale_error,
            installation_rad: parameters.installation_rad.to_array(),
            flexure_s2: parameters.flexure_s2.to_array(),
            pickoff_gain: parameters.pickoff_gain,
            pickoff_weight_rad: parameters.pickoff_weight_rad,
            sample_rate_hz: parameters.sample_rate_hz,
            samples_per_output: parameters.samples_per_output,
            flexure_response: match damping {
                Some(_) => "mode",
                None => "static",
            },
            flexure_mode_hz: modes_hz(parameters),
            flexure_damping: damping,
            pickoff_delay_s: parameters.pickoff_delay_s,
            dither_frequency_hz: parameters.dither_frequency_hz,
            dither_amplitude_rad: parameters.dither_amplitude_rad,
            adaptation_time_s: parameters.adaptation_time_s,
            accelerometers: parameters.accelerometers.map(|known| Accelerometers {
                weight_m_s: known.weight_m_s,
                bias_m_s2: known.bias_m_s2,
                scale_error: known.scale_error,
                misalignment_rad: known.misalignment_rad.to_array(),
                lever_arm_m: known.lever_arm_m,
            }),
            terms: TermKind::ALL
                .iter()
                .filter(|kind| parameters.terms.kinds().contains(**kind))
                .map(|kind| kind.name())
                .collect(),
            limits: parameters.limits.as_ref().map(Limits::of),
            identity: parameters.identity.as_ref().map(Named::of),
            output: match parameters.output {
                OutputFormat::Inertial => "inertial",
                _ => "frames",
            },
        }
    }

    /// Reads a block from its bytes, `path` for messages.
    pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<Self, InputError> {
        let (parameters, generation) = parameters(path, bytes)?;
        let length = usize::from(u16::from_le_bytes([bytes[6], bytes[7]]));
        Ok(Self::of(&parameters, generation, length))
    }

    /// Formats the whole content, a line a parameter.
    pub(super) fn text(&self) -> String {
        let numbers = |numbers: &[f64]| {
            let texts: Vec<String> = numbers.iter().map(|number| format!("{number:e}")).collect();
            texts.join(", ")
        };
        let mut lines: Vec<(&str, String)> = vec![
            ("pulse weight [rad]", numbers(&self.pulse_weight_rad)),
            ("bias [rad/s]", numbers(&self.bias_rad_s)),
            ("scale error", numbers(&self.scale_error)),
            ("installation [rad]", numbers(&self.installation_rad)),
            ("flexure [s^2]", numbers(&self.flexure_s2)),
            ("flexure response", self.flexure_response.to_owned()),
            ("pickoff gain", numbers(&self.pickoff_gain)),
            ("pickoff weight [rad]", numbers(&[self.pickoff_weight_rad])),
            ("pickoff delay [s]", numbers(&self.pickoff_delay_s)),
            ("dither frequency [Hz]", numbers(&self.dither_frequency_hz)),
            (
                "dither amplitude [rad]",
                numbers(&self.dither_amplitude_rad),
            ),
            ("adaptation time [s]", numbers(&[self.adaptation_time_s])),
            ("sample rate [Hz]", numbers(&[self.sample_rate_hz])),
            ("samples per output", self.samples_per_output.to_string()),
            ("output", self.output.to_owned()),
        ];
        if let Some(known) = &self.accelerometers {
            lines.push(("accelerometer weight [m/s]", numbers(&known.weight_m_s)));
            lines.push(("accelerometer bias [m/s^2]", numbers(&known.bias_m_s2)));
            lines.push(("accelerometer scale error", numbers(&known.scale_error)));
        }
        if !self.terms.is_empty() {
            lines.push(("terms", self.terms.join(", ")));
        }
        // Writing to a String cannot fail.
        let mut out = String::new();
        for (name, value) in lines {
            let _ = writeln!(out, "  {name:<27} {value}");
        }
        for line in self.service_lines() {
            let _ = writeln!(out, "{line}");
        }
        out.truncate(out.trim_end().len());
        out
    }

    /// Formats identity and limits, a line each.
    pub(super) fn service_lines(&self) -> Vec<String> {
        let mut lines = vec![match &self.identity {
            None => "of any unit: the block names none".to_owned(),
            Some(named) => format!(
                "of unit {} alone, calibrated {}, model {}",
                named.unit,
                named.calibrated.as_deref().unwrap_or("at an unknown date"),
                named.model_sha256_begins.as_deref().unwrap_or("unknown"),
            ),
        }];
        lines.push(match &self.limits {
            None => "limits: none, but the dither's amplitude as built in".to_owned(),
            Some(limits) => format!("limits: {}", limits.words()),
        });
        lines
    }
}

impl Limits {
    fn of(limits: &HealthLimits) -> Self {
        Self {
            temperature_k: limits.temperature_k,
            intensity_least: limits.intensity_least,
            path_length_step: limits.path_length_step,
            dither_drive: limits.dither_drive,
            dither_amplitude: limits.dither_amplitude,
            pulse_silence_s: limits.pulse_silence_s,
        }
    }

    fn words(&self) -> String {
        let mut parts = Vec::new();
        if let Some([least, largest]) = self.temperature_k {
            parts.push(format!("temperature {least} to {largest} K"));
        }
        if let Some([x, y, z]) = self.intensity_least {
            parts.push(format!("laser intensity at least {x}, {y}, {z} of nominal"));
        }
        if let Some(step) = self.path_length_step {
            parts.push(format!("path-length drive steps up to {step} of its range"));
        }
        if let Some([least, largest]) = self.dither_drive {
            parts.push(format!("dither drive {least} to {largest} of nominal"));
        }
        let [least, largest] = self.dither_amplitude;
        parts.push(format!("dither amplitude {least} to {largest} of nominal"));
        if let Some(silence_s) = self.pulse_silence_s {
            parts.push(format!("pulse per second within {silence_s} s"));
        }
        parts.join("; ")
    }
}

impl Named {
    fn of(identity: &Identity) -> Self {
        let date = identity.calibrated;
        let is_known = identity.model != [0; 8];
        Self {
            unit: identity.unit.to_string(),
            unit_bytes: hexadecimal(&identity.unit.0),
            calibrated: (date != 0).then(|| {
                let (year, month, day) = (date / 10_000, date / 100 % 100, date % 100);
                format!("{year:04}-{month:02}-{day:02}")
            }),
            model_sha256_begins: is_known.then(|| hexadecimal(&identity.model)),
        }
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Computes the frequency of each pair's mode, if it has one \[Hz\].
fn modes_hz(parameters: &Parameters) -> [Option<f64>; 6] {
    let rings = parameters.flexure_response.damping().is_some();
    let pairs = parameters.flexure_s2.to_array();
    pairs.map(|k| implied_hz(k).filter(|_| rings))
}

/// Formats the compensation of the flexure; `None` without a flexure.
pub(super) fn flexure_line(parameters: &Parameters) -> Option<String> {
    let pairs = parameters.flexure_s2.to_array();
    if pairs == [0.0; 6] {
        return None;
    }
    let each = |text: &dyn Fn(usize) -> String| {
        let named = SIX.iter().enumerate();
        let named = named.filter(|(at, _)| pairs[*at] != 0.0);
        let texts: Vec<String> = named
            .map(|(at, name)| format!("{name} {}", text(at)))
            .collect();
        texts.join(", ")
    };
    let sizes = each(&|at| format!("{:.1}", pairs[at] * 1e9));
    let modes_hz = modes_hz(parameters);
    Some(match parameters.flexure_response {
        FlexureResponse::Mode { damping } => {
            let modes =
                each(&|at| modes_hz[at].map_or("static".to_owned(), |hz| format!("{hz:.0}")));
            format!(
                "axis_flexure: K {sizes} 10⁻⁹ s², with the mode that each K implies, f0 = 1/(2π√K): {modes} Hz, damping {damping}"
            )
        }
        FlexureResponse::Static => format!(
            "axis_flexure: K {sizes} 10⁻⁹ s², static: of a block that rings it leaves (f/f0)² of the drift, f0 = 1/(2π√K)"
        ),
    })
}
