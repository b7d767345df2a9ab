//! `rlg params`: a model as the parameter block that the firmware reads from flash.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::inputs::read_model;
use crate::error::InputError;
use crate::model::compensation::{ACCELERATION_ORDER, SAMPLES_PER_OUTPUT, parameters_from_model};
use crate::output::write_file;
use crate::terminal::Terminal;

/// Turn a model into the parameter block to flash, and say what the chain cannot compensate
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  rlg params report/model.toml --out params.bin")]
pub struct Params {
    /// The model
    model: PathBuf,
    /// File of the block
    #[arg(long)]
    out: PathBuf,
    /// Samples per second of the unit [Hz]
    #[arg(long, default_value_t = trueaxis::design_parameters::DESIGN_SAMPLE_RATE_HZ)]
    rate_hz: f64,
    /// Samples in one output period
    #[arg(long, default_value_t = SAMPLES_PER_OUTPUT)]
    output_every: u16,
    /// Terms of the acceleration filter, 1 to 4
    #[arg(long, default_value_t = ACCELERATION_ORDER)]
    order: u8,
    /// Angle of one pickoff code [rad]
    #[arg(long, default_value_t = trueaxis::Parameters::default().pickoff_weight_rad)]
    pickoff_weight_rad: f64,
}

#[derive(Serialize)]
struct Block {
    format: u32,
    version: &'static str,
    bytes: usize,
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
    acceleration_order: u8,
    /// Kinds of the model's effects that the chain has no term for.
    uncompensated: Vec<String>,
}

impl Params {
    /// Reads the model, writes the block, says what is left.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let model = read_model(&self.model, terminal)?;
        let refused = |error: trueaxis::ParameterError| {
            InputError::new(&self.model, format!("does not fit the chain: {error}"))
        };
        let (mut parameters, uncompensated) =
            parameters_from_model(&model, self.rate_hz, self.output_every, self.order)
                .map_err(refused)?;
        parameters.pickoff_weight_rad = self.pickoff_weight_rad;
        parameters.check().map_err(refused)?;
        let block = parameters.to_block(0);
        write_file(&self.out, &block)?;
        for kind in &uncompensated {
            terminal.warn(format!(
                "the chain has no term for {kind}: it stays in the output"
            ));
        }
        terminal.say(format!("{}: {} bytes", self.out.display(), block.len()));
        terminal.result(&Block {
            format: 1,
            version: env!("CARGO_PKG_VERSION"),
            bytes: block.len(),
            pulse_weight_rad: parameters.pulse_weight_rad,
            bias_rad_s: parameters.bias_rad_s,
            scale_error: parameters.scale_error,
            installation_rad: parameters.installation_rad.to_array(),
            flexure_s2: parameters.flexure_s2.to_array(),
            pickoff_gain: parameters.pickoff_gain,
            pickoff_weight_rad: parameters.pickoff_weight_rad,
            sample_rate_hz: parameters.sample_rate_hz,
            samples_per_output: parameters.samples_per_output,
            acceleration_order: parameters.acceleration_order,
            uncompensated,
        })
    }
}
