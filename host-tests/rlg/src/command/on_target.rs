//! `rlg on-target`: runs a recording through the firmware image in the emulator, and compares it with the host.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::inputs::{read_model, results_folder};
use crate::error::InputError;
use crate::recording::Recording;
use crate::replay::samples::{Setup, samples_from_recording};
use crate::target::on_target::{Instructions, compare};
use crate::target::records::reflected;
use crate::target::{Image, OnTarget, Platform, TargetCore};
use crate::terminal::Terminal;
use rlg_parameters::SAMPLES_PER_OUTPUT;

/// File written by the command.
const RESULT: &str = "on_target.json";

/// File of the raw stream.
const RAW: &str = "raw.bin";

/// Run a recording through the firmware image in QEMU and compare every output with the host's
///
/// Writes on_target.json: whether every output is equal bit for bit, whether accelerometers were played,
/// instructions per sample, flash, RAM and stack, the image's events. Without --image the image is built in the workspace
/// rlg was built from, with the optional terms where the model needs them.
/// The emulator counts instructions, not cycles.
#[derive(Debug, Args)]
#[command(
    name = "on-target",
    after_help = "Example:\n  rlg on-target bench-17 --model bench-17/model.toml --core f32 --out on-target"
)]
pub struct OnTargetCommand {
    /// Folder with recording.toml
    recording: PathBuf,
    /// The model that the chain compensates
    #[arg(short, long)]
    model: PathBuf,
    /// Number system of the image
    #[arg(long, value_enum)]
    core: TargetCore,
    /// Folder for the results
    #[arg(short, long)]
    out: PathBuf,
    /// The image to run instead of building it: an ELF file of this version and number system
    #[arg(long)]
    image: Option<PathBuf>,
    /// Samples to play; more than the recording has: forward, backward and so on [default: all of it]
    #[arg(long)]
    samples: Option<usize>,
    /// Samples in one output period
    #[arg(long, default_value_t = SAMPLES_PER_OUTPUT)]
    output_every: u16,
    /// Time in which the dither strip follows the pickoff's gain and delay [s]; 0: frozen
    #[arg(long, default_value_t = 0.0)]
    adapt_s: f64,
    /// Take the recording's accelerometers through the chain, too; an error if it has none that can be used
    #[arg(long)]
    accelerometers: bool,
    /// Build the image with the raw stream, and write that to raw.bin beside the result, for rlg import
    #[arg(long, conflicts_with = "image")]
    raw: bool,
}

/// `on_target.json`.
#[derive(Serialize)]
struct Report<'a> {
    format: u32,
    recording: &'a str,
    version: &'static str,
    #[serde(flatten)]
    result: &'a OnTarget,
    samples_per_output: u16,
    /// Kinds of the model's effects without a term in the chain.
    uncompensated: Vec<String>,
}

impl OnTargetCommand {
    /// Builds or reads the image, runs it, compares, writes and prints the figures.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let spinner = terminal.spinner("reading");
        let recording = Recording::read(&self.recording)?;
        let model = read_model(&self.model, terminal)?;
        let mut out = results_folder(&self.out, &self.recording, &self.model, &[RESULT, RAW])?;
        let setup = Setup {
            samples_per_output: self.output_every,
            adaptation_time_s: self.adapt_s,
            accelerometers: self.accelerometers,
        };
        let input = samples_from_recording(&recording, &model, &self.model, setup)?;
        if self.accelerometers && input.velocity_m_s.is_none() {
            let why = input
                .velocity_refused
                .unwrap_or_else(|| "there are none".to_owned());
            return Err(InputError::new(
                &self.recording,
                format!("has no accelerometers to play: {why}"),
            )
            .expected("specific_force or velocity_increment for x, y and z, at the gyros' rows"));
        }
        spinner.set_message("building the image");
        let image = match &self.image {
            Some(path) => Image::read(path)?,
            None if self.raw => Image::build_with_raw(Platform::Emulator, self.core)?,
            None if input.parameters.terms.bytes().is_empty() => {
                Image::build(Platform::Emulator, self.core)?
            }
            None => Image::build_with_terms(Platform::Emulator, self.core)?,
        };
        spinner.finish_and_clear();

        let count = self.samples.unwrap_or(input.samples.len());
        let bar = terminal.bar(count as u64, "on target");
        let result = compare(
            &image,
            self.core,
            &input.parameters,
            reflected(&input.samples, count),
            &mut |samples| bar.set_position(samples),
        )?;
        bar.finish_and_clear();

        let report = Report {
            format: 1,
            recording: &recording.name,
            version: env!("CARGO_PKG_VERSION"),
            result: &result,
            samples_per_output: self.output_every,
            uncompensated: input.uncompensated,
        };
        let mut json = serde_json::to_vec_pretty(&report).map_err(|error| {
            InputError::new(&self.out, format!("cannot hold the result ({error})"))
        })?;
        json.push(b'\n');
        out.write(RESULT, &json)?;
        if self.raw {
            out.write(RAW, &result.raw)?;
        }
        out.commit()?;
        for line in words(&result) {
            terminal.say(line);
        }
        terminal.result(&report)
    }
}

/// Formats the result as lines of text.
fn words(result: &OnTarget) -> Vec<String> {
    let verdict = match &result.first_difference {
        None if result.bit_equal => "every frame equal to the host's, bit for bit".to_owned(),
        None => {
            "telemetry equal, but the health counters or the number of periods differ".to_owned()
        }
        Some(difference) => format!(
            "frames DIFFER from the host's from number {}",
            difference.frame
        ),
    };
    let cost = |name: &str, cost: &Option<Instructions>| {
        cost.as_ref().map(|cost| {
            format!(
                "  {name:<18} {:>6} {:>8.1} {:>6}",
                cost.min, cost.mean, cost.max
            )
        })
    };
    let mut lines = vec![
        format!(
            "{}: {} samples, {} frames: {verdict}",
            result.core, result.samples, result.frames
        ),
        match result.accelerometers {
            true => format!(
                "  accelerometers played: velocity in {} of {} frames",
                result.frames_with_velocity, result.frames
            ),
            false => "  accelerometers not played (--accelerometers plays them)".to_owned(),
        },
        format!(
            "  {:<18} {:>6} {:>8} {:>6}   instructions (the emulator knows no cycles)",
            "", "min", "mean", "max"
        ),
    ];
    lines.extend(
        [
            cost("per sample", &result.instructions_per_sample),
            cost("between outputs", &result.instructions_between_outputs),
            cost("after start or gap", &result.instructions_beginning),
            cost("with an output", &result.instructions_with_output),
            cost("processor", &result.instructions_per_processor),
            cost("whole interrupt", &result.instructions_per_interrupt),
        ]
        .into_iter()
        .flatten(),
    );
    lines.push(format!(
        "  flash {} bytes, RAM {} bytes, stack {} bytes at most (computed; {} seen in this run)",
        result.flash_bytes, result.ram_bytes, result.stack_bytes, result.stack_painted_bytes
    ));
    lines.push(format!(
        "  interrupts missed {}, late {}, frames lost {}",
        result.missed, result.late, result.outputs_lost
    ));
    // The image also logs once a second; on_target.json holds every event.
    let last = result.events.len().saturating_sub(1);
    let told = result
        .events
        .iter()
        .enumerate()
        .filter(|(at, event)| *at == 0 || *at == last || !event.starts_with("info"));
    lines.extend(told.map(|(_, event)| format!("  | {event}")));
    lines
}
