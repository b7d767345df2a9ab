//! `rlg params`: converts a model to the parameter block that the firmware reads from flash.
//!
//! Values that a model does not state of the unit are asked for: the weights of pickoff and accelerometer codes, and the
//! dither, best measured on a recording of the unit.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::inputs::read_model;
use crate::error::InputError;
use crate::model::ModelEffect;
use crate::model::catalogue::SIX;
use crate::model::implied_hz;
use crate::output::write_file;
use crate::recording::Recording;
use crate::replay::samples::dither_of_recording;
use crate::target::Image;
use crate::terminal::Terminal;
use rlg_parameters::{SAMPLES_PER_OUTPUT, Unit, parameters_from_model};
use trueaxis::{Parameters, TermKind};

/// Convert a model to the parameter block to flash, and say what the chain cannot compensate
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg params report/model.toml --dither-from bench-17 --generation 2 --out params.bin"
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
}

#[derive(Serialize)]
struct Block {
    format: u32,
    version: &'static str,
    bytes: usize,
    generation: u32,
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
    terms: Vec<&'static str>,
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

#[derive(Serialize)]
struct Accelerometers {
    weight_m_s: [f64; 3],
    bias_m_s2: [f64; 3],
    scale_error: [f64; 3],
    misalignment_rad: [f64; 6],
    /// Row i: the position of accelerometer i.
    lever_arm_m: [[f64; 3]; 3],
}

impl Params {
    /// Reads the model, writes the block and prints the effects that the chain cannot compensate.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
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
        parameters.check().map_err(refused)?;
        let terms: Vec<&str> = TermKind::ALL
            .iter()
            .filter(|kind| parameters.terms.kinds().contains(**kind))
            .map(|kind| kind.name())
            .collect();
        match &self.image {
            Some(path) => {
                let image = Image::read(path)?;
                if let Some(kind) = parameters.terms.kinds().first_beyond(image.term_kinds) {
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
        let block = parameters.to_block(self.generation);
        write_file(&self.out, &block)?;
        for kind in &uncompensated {
            terminal.warn(left(kind));
        }
        if self.adapt_s > 0.0 && dither.is_none() {
            terminal.warn(
                "the strip follows no dither that is not known (--dither-from RECORDING): it is frozen",
            );
        }
        terminal.say(format!("{}: {} bytes", self.out.display(), block.len()));
        let damping = parameters.flexure_response.damping();
        let modes_hz = modes_hz(&parameters);
        if let Some(line) = flexure_line(&parameters, &modes_hz) {
            terminal.say(line);
        }
        let choices: Vec<Choice> = model.effects.iter().filter_map(choice_of).collect();
        for one in &choices {
            terminal.say(format!("{}: a choice: {}", one.kind, one.choice));
        }
        terminal.result(&Block {
            format: 1,
            version: env!("CARGO_PKG_VERSION"),
            bytes: block.len(),
            generation: self.generation,
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
            flexure_mode_hz: modes_hz,
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
            terms,
            uncompensated,
            choices,
        })
    }
}

/// Computes the frequency of each pair's mode, if it has one \[Hz\].
fn modes_hz(parameters: &Parameters) -> [Option<f64>; 6] {
    let rings = parameters.flexure_response.damping().is_some();
    let pairs = parameters.flexure_s2.to_array();
    pairs.map(|k| implied_hz(k).filter(|_| rings))
}

/// Formats the compensation of the flexure; `None` without a flexure.
fn flexure_line(parameters: &Parameters, modes_hz: &[Option<f64>; 6]) -> Option<String> {
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
    Some(match parameters.flexure_response.damping() {
        None => format!(
            "axis_flexure: K {sizes} 10⁻⁹ s², static: of a block that rings it leaves (f/f0)² of the drift, f0 = 1/(2π√K)"
        ),
        Some(damping) => {
            let modes =
                each(&|at| modes_hz[at].map_or("static".to_owned(), |hz| format!("{hz:.0}")));
            format!(
                "axis_flexure: K {sizes} 10⁻⁹ s², with the mode that each K implies, f0 = 1/(2π√K): {modes} Hz, damping {damping}"
            )
        }
    })
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
