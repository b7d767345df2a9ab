//! `rlg params`: converts a model to the parameter block that the firmware reads from flash.
//!
//! Values that a model does not state of the unit are asked for: the weights of pickoff and accelerometer codes, and the
//! dither, best measured on a recording of the unit.

use std::path::PathBuf;

use chrono::{Datelike as _, NaiveDate};
use clap::{Args, ValueEnum};
use serde::Serialize;
use sha2::{Digest as _, Sha256};

use super::block::{Block, flexure_line};
use super::inputs::read_model;
use crate::error::InputError;
use crate::limits_file;
use crate::model::ModelEffect;
use crate::output::write_file;
use crate::recording::Recording;
use crate::replay::samples::dither_of_recording;
use crate::target::Image;
use crate::terminal::Terminal;
use rlg_parameters::{SAMPLES_PER_OUTPUT, Unit, parameters_from_model};
use trueaxis::{Identity, OutputFormat, Parameters, TermKind, UnitNumber};

/// Convert a model to the parameter block to flash, and say what the chain cannot compensate
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  rlg params report/model.toml --dither-from bench-17 --generation 2 --out params.bin\n  rlg params report/model.toml --unit-number RLG-0042 --calibrated 2026-11-29 --limits limits.toml --out params.bin"
)]
pub struct Params {
    /// Model file
    model: PathBuf,
    /// File to write the block to
    #[arg(short, long)]
    out: PathBuf,
    /// Samples per second of the unit [Hz]
    #[arg(long, default_value_t = trueaxis::design_parameters::DESIGN_SAMPLE_RATE_HZ)]
    rate_hz: f64,
    /// Samples in one output period
    #[arg(long, default_value_t = SAMPLES_PER_OUTPUT)]
    output_every: u16,
    /// Angle of one pickoff code [rad]
    #[arg(long, default_value_t = trueaxis::Parameters::default().pickoff_weight_rad)]
    pickoff_weight_rad: f64,
    /// A recording of the unit, on whose pickoffs the dither's frequency and amplitude are measured;
    /// without it the firmware neither watches nor follows the dither, and takes no dither_delay off
    #[arg(long, value_name = "RECORDING")]
    dither_from: Option<PathBuf>,
    /// Time in which the dither strip follows the pickoff's gain and delay [s]; 0: frozen
    #[arg(long, default_value_t = 0.0)]
    adapt_s: f64,
    /// Velocity of one accelerometer code, x y z [m/s]; without it the firmware has no accelerometers
    #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"])]
    accelerometer_weight_m_s: Option<Vec<f64>>,
    /// The image that the block is for: an ELF file; a model that asks for a term it lacks is refused
    #[arg(long)]
    image: Option<PathBuf>,
    /// Generation of the block: of two valid ones in flash the later is used
    #[arg(long, default_value_t = 0)]
    generation: u32,
    /// Number of the unit that the block is for, up to 12 characters or 24 hexadecimal digits; a unit of another number refuses the
    /// block, and the SHA-256 of the model's file stands beside it
    #[arg(long, value_name = "NUMBER")]
    unit_number: Option<String>,
    /// Date of the calibration, YYYY-MM-DD; without it the block's date is unknown
    #[arg(long, value_name = "DATE", requires = "unit_number")]
    calibrated: Option<String>,
    /// Limits of temperatures, laser intensity, path-length control, dither and pulse per second: a TOML file, keys in docs/files.md
    #[arg(long, value_name = "FILE")]
    limits: Option<PathBuf>,
    /// Form of the output on the telemetry port
    #[arg(long, value_enum, default_value_t = Output::Frames)]
    output: Output,
}

/// Forms of the output.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Output {
    /// Telemetry frames, as `rlg import` reads them
    Frames,
    /// Δθ, Δv and control messages in HDLC-like frames (docs/inertial_message.py)
    Inertial,
}

/// Result as JSON: the block's content, and what the model has beyond it.
#[derive(Serialize)]
struct Written {
    #[serde(flatten)]
    block: Block,
    /// SHA-256 of the model's file, hexadecimal; null for a block of any unit.
    model_sha256: Option<String>,
    /// Kinds of the model's effects without a term in the chain.
    uncompensated: Vec<String>,
    /// Numbers of the model not determined by any recording, by effect.
    choices: Vec<Choice>,
}

/// Numbers of an effect that are a convention.
#[derive(Serialize)]
struct Choice {
    kind: String,
    choice: String,
}

impl Params {
    /// Reads the model, writes the block and prints the effects that the chain cannot compensate.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let limits = self.limits.as_deref().map(limits_file::read).transpose()?;
        let identity = self.identity()?;
        let model = read_model(&self.model, terminal)?;
        let refused = |error: trueaxis::ParameterError| {
            InputError::new(&self.model, format!("does not fit the chain: {error}"))
        };
        let dither = match &self.dither_from {
            Some(folder) => Some(dither_of_recording(&Recording::read(folder)?, &model)?),
            None => None,
        };
        let weights = self.accelerometer_weight_m_s.as_deref();
        let unit = Unit {
            samples_per_output: self.output_every,
            adaptation_time_s: self.adapt_s,
            dither,
            // three, or clap would have refused them
            accelerometer_weight_m_s: weights.and_then(|weights| weights.try_into().ok()),
            ..Unit::at(self.rate_hz)
        };
        let (mut parameters, uncompensated) =
            parameters_from_model(&model, &unit).map_err(refused)?;
        parameters.pickoff_weight_rad = self.pickoff_weight_rad;
        parameters.limits = limits;
        parameters.output = match self.output {
            Output::Frames => OutputFormat::Frames,
            Output::Inertial => OutputFormat::Inertial,
        };
        let model_sha256 = identity.as_ref().map(|(_, sha256)| sha256.clone());
        parameters.identity = identity.map(|(identity, _)| identity);
        parameters.check().map_err(refused)?;
        self.check_image(&parameters, terminal)?;
        let bytes = parameters.to_block(self.generation);
        let block = Block::of(&parameters, self.generation, bytes.len());
        write_file(&self.out, &bytes)?;
        for kind in &uncompensated {
            terminal.warn(left(kind));
        }
        if self.adapt_s > 0.0 && dither.is_none() {
            terminal.warn(
                "the strip follows no dither that is not known (--dither-from RECORDING): it is frozen",
            );
        }
        terminal.say(format!("{}: {} bytes", self.out.display(), bytes.len()));
        if let Some(line) = flexure_line(&parameters) {
            terminal.say(line);
        }
        if parameters.limits.is_some() || parameters.identity.is_some() {
            for line in block.service_lines() {
                terminal.say(line);
            }
        }
        let choices: Vec<Choice> = model.effects.iter().filter_map(choice_of).collect();
        for one in &choices {
            terminal.say(format!("{}: a choice: {}", one.kind, one.choice));
        }
        terminal.result(&Written {
            block,
            model_sha256,
            uncompensated,
            choices,
        })
    }

    /// Refuses a block with a term that the image lacks; without an image warns of terms.
    fn check_image(&self, parameters: &Parameters, terminal: &Terminal) -> Result<(), InputError> {
        let kinds = parameters.terms.kinds();
        let terms: Vec<&str> = TermKind::ALL
            .iter()
            .filter(|kind| kinds.contains(**kind))
            .map(|kind| kind.name())
            .collect();
        match &self.image {
            Some(path) => {
                let image = Image::read(path)?;
                if let Some(kind) = kinds.first_beyond(image.term_kinds) {
                    return Err(InputError::new(&self.model, "asks for a term that the image lacks")
                        .value(kind.name())
                        .expected(format!("an image with it instead of {}", path.display())));
                }
            }
            None if !terms.is_empty() => terminal.warn(format!(
                "the block is for an image with terms for {} (cargo board --features terms; --image checks it)",
                terms.join(", ")
            )),
            None => {}
        }
        Ok(())
    }

    /// Returns the identity that the options ask for, with the SHA-256 of the model's file; `None` without a unit's number.
    fn identity(&self) -> Result<Option<(Identity, String)>, InputError> {
        let Some(number) = &self.unit_number else {
            return Ok(None);
        };
        let unit = unit_number(number).ok_or_else(|| {
            InputError::new(&self.out, "is no number of a unit")
                .channel("--unit-number")
                .value(format!("{number:?}"))
                .expected("1 to 12 characters of ASCII without blanks, or 24 hexadecimal digits, not all 0")
        })?;
        let calibrated = match &self.calibrated {
            Some(date) => date_number(date).ok_or_else(|| {
                InputError::new(&self.out, "is no date")
                    .channel("--calibrated")
                    .value(format!("{date:?}"))
                    .expected("a day of the calendar as YYYY-MM-DD")
            })?,
            None => 0,
        };
        let bytes = std::fs::read(&self.model)
            .map_err(|error| InputError::unreadable(&self.model, &error))?;
        let sum = Sha256::digest(&bytes);
        let identity = Identity::new(unit).with(|known| {
            known.calibrated = calibrated;
            for (place, byte) in known.model.iter_mut().zip(sum.iter()) {
                *place = *byte;
            }
        });
        let sha256 = sum.iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Some((identity, sha256)))
    }
}

/// Parses a unit's number: 24 hexadecimal digits, or text of 1 to 12 printable bytes.
fn unit_number(text: &str) -> Option<UnitNumber> {
    if text.len() == 24 {
        let mut number = [0; 12];
        for (place, digits) in number.iter_mut().zip(text.as_bytes().chunks(2)) {
            let digits = std::str::from_utf8(digits).ok()?;
            // A sign is no digit.
            let are_digits = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
            *place = u8::from_str_radix(digits, 16).ok().filter(|_| are_digits)?;
        }
        return (number != [0; 12]).then_some(UnitNumber(number));
    }
    let is_printable = text.bytes().all(|byte| byte.is_ascii_graphic());
    UnitNumber::of_text(text).filter(|_| is_printable)
}

/// Parses a day as year × 10 000 + month × 100 + day.
fn date_number(text: &str) -> Option<u32> {
    let date = NaiveDate::parse_from_str(text, "%Y-%m-%d").ok()?;
    // Four digits of a year, two of month and day.
    if text.len() != 10 {
        return None;
    }
    let year = u32::try_from(date.year()).ok().filter(|year| *year > 0)?;
    Some(year * 10_000 + date.month() * 100 + date.day())
}

fn choice_of(effect: &ModelEffect) -> Option<Choice> {
    effect.choice().map(|choice| Choice {
        kind: effect.kind.clone(),
        choice: choice.to_owned(),
    })
}

/// Formats the effect that stays in the output, and the option that would compensate it, if any.
fn left(kind: &str) -> String {
    match kind {
        "dither_delay" => "dither_delay stays in the output: to take it off, the dither must be \
             known (--dither-from RECORDING)"
            .to_owned(),
        "accel_bias" | "accel_scale" | "accel_misalignment" | "accel_delay" | "size_effect"
        | "gyro_g_bias" => format!(
            "{kind} stays in the output: the firmware is told of no accelerometers \
             (--accelerometer-weight-m-s)"
        ),
        _ => format!("the chain has no term for {kind}: it stays in the output"),
    }
}
