//! Prints what each stage of the chain costs (`cargo stages`), as the markdown table of `docs/measured.md`.
//!
//! It builds both emulated images and plays a simulated motion: three dithered gyros on a coning case. It prints
//! instructions a sample by stage and number system, as QEMU executed them, and a static estimate of cycles.
//!
//! `cargo stages terms` prints instead what each optional term adds to a sample, alone in an image.
//!
//! An example and not a command of `rlg`: it looks at the build, not at a recording.

mod terms;

use std::f64::consts::TAU;
use std::process::ExitCode;

use rlg::error::InputError;
use rlg::target::code::Code;
use rlg::target::records::records_of;
use rlg::target::stages::{Row, StageCosts, interrupt_ranges};
use rlg::target::{Image, Platform, SlotImages, TargetCore, cycles, emulator};
use trueaxis::{CrossAxis, Parameters, Sample};

/// Samples: 0.5 s, a dozen adaptation windows.
const SAMPLES: usize = 2000;

/// One output every 10 samples, as the project's marks have it.
const SAMPLES_PER_OUTPUT: u16 = 10;

/// Dither frequencies \[Hz\] and amplitude \[rad\] (150″).
const DITHER_HZ: [f64; 3] = [390.0, 420.0, 450.0];
const DITHER_RAD: f64 = 150.0 / 206_265.0;

/// Coning of the case \[Hz\], \[rad\].
const CONING_HZ: f64 = 15.0;
const CONING_RAD: f64 = 0.0064;

/// Most that the sum of the stages and the image's own timer may differ, as a part of the sum: the compiler
/// puts a few of the processor's instructions between the timer's two readings, and at some places it names
/// none. More would mean that a stage is missing from the table.
const MOST_APART: f64 = 0.03;

fn main() -> ExitCode {
    let asked = std::env::args().nth(1);
    let made = match asked.as_deref() {
        None => table(),
        Some("terms") => terms::table(),
        Some(other) => Err(InputError::new("stages", "prints no such table")
            .value(other)
            .expected("terms, or nothing")),
    };
    match made {
        Ok(table) => {
            print!("{table}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

/// Every part of the chain switched on but the accelerometers.
fn parameters() -> Parameters {
    Parameters::default().with(|p| {
        p.scale_error = [1.5e-5, -5.4e-6, 1.9e-5];
        p.installation_rad =
            CrossAxis::from_array([-1.7e-4, 1.8e-4, 1.1e-4, -1.7e-5, -2.8e-4, 2.4e-4]);
        p.flexure_s2 = CrossAxis::from_array([6.9e-8, 7.1e-8, 7.5e-8, 7.3e-8, 6.7e-8, 7.6e-8]);
        p.dither_frequency_hz = DITHER_HZ;
        p.dither_amplitude_rad = [DITHER_RAD; 3];
        p.adaptation_time_s = 0.5;
        p.samples_per_output = SAMPLES_PER_OUTPUT;
    })
}

/// Pulses and pickoffs of the motion: the case's angles to first order, each block's own dither on top.
fn samples(parameters: &Parameters) -> Vec<Sample> {
    let block = |axis: usize, time: f64| DITHER_RAD * (TAU * DITHER_HZ[axis] * time).sin();
    let case = |axis: usize, time: f64| {
        let phase = TAU * CONING_HZ * time;
        [0.0, CONING_RAD * phase.cos(), CONING_RAD * phase.sin()][axis]
    };
    let pulses = |axis: usize, at: usize| {
        let time = at as f64 / parameters.sample_rate_hz;
        let angle = case(axis, time) + block(axis, time);
        (angle / parameters.pulse_weight_rad[axis]).floor() as i32
    };
    (1..=SAMPLES)
        .map(|at| {
            let time = at as f64 / parameters.sample_rate_hz;
            Sample {
                pulse_counts: std::array::from_fn(|axis| pulses(axis, at) - pulses(axis, at - 1)),
                pickoff_codes: std::array::from_fn(|axis| {
                    (block(axis, time) / parameters.pickoff_weight_rad).round() as i32
                }),
                accelerometer_codes: [0; 3],
            }
        })
        .collect()
}

/// One number system's figures.
struct Figures {
    costs: StageCosts,
    cycles: Option<u32>,
}

fn figures(core: TargetCore) -> Result<Figures, InputError> {
    let image = Image::build(Platform::Emulator, core)?;
    let wrong = |error: &dyn std::fmt::Display| InputError::new(&image.path, error.to_string());
    let code = Code::read(&image.elf).map_err(|error| wrong(&error))?;
    let ranges = interrupt_ranges(&code).ok_or_else(|| wrong(&"has no sampling interrupt"))?;
    let parameters = parameters();
    let (emulation, executed) = emulator::run_traced(
        &image.path,
        &SlotImages::both(&parameters),
        &records_of(samples(&parameters)),
        &ranges,
    )?;
    let costs = StageCosts::of(
        &image.elf,
        &code,
        &executed,
        usize::from(SAMPLES_PER_OUTPUT),
    )
    .map_err(|error| wrong(&error))?;
    let report = &emulation.report;
    let parts = [
        &report.between_outputs,
        &report.with_output,
        &report.beginning,
    ];
    let instructions: u64 = parts.iter().map(|part| part.sum).sum();
    let samples: u32 = parts.iter().map(|part| part.count).sum();
    let measured = instructions as f64 / f64::from(samples);
    let sorted = costs.chain_mean();
    if (sorted - measured).abs() > MOST_APART * measured {
        return Err(wrong(&format!(
            "has {sorted:.1} instructions a sample in its stages and {measured:.1} by its own timer"
        )));
    }
    eprintln!(
        "{}: {:.1} instructions a sample in all stages, {measured:.1} by the image's own timer",
        core.name(),
        sorted
    );
    let cycles = match cycles::estimate(&image.path, &costs.ordinary_sample) {
        Ok(cycles) => Some(cycles),
        Err(error) => {
            eprintln!("{}: no estimate of cycles: {error}", core.name());
            None
        }
    };
    Ok(Figures { costs, cycles })
}

fn table() -> Result<String, InputError> {
    let both = [figures(TargetCore::F32)?, figures(TargetCore::Fixed)?];
    let mut rows: Vec<Row> = both.iter().flat_map(|one| one.costs.rows()).collect();
    rows.sort_by_key(|row| order(*row, &both));
    rows.dedup();
    let mut lines = vec![
        "| stage | f32, between outputs | with one | mean | fixed, between outputs | with one | mean |"
            .to_owned(),
        "|---|---|---|---|---|---|---|".to_owned(),
    ];
    let line = |name: &str, means: [[f64; 3]; 2]| {
        let cells: Vec<String> = means
            .iter()
            .flatten()
            .map(|mean| format!("{mean:.1}"))
            .collect();
        format!("| {name} | {} |", cells.join(" | "))
    };
    let of = |row: Row| [both[0].costs.means(row), both[1].costs.means(row)];
    let chain: Vec<Row> = rows.iter().copied().filter(|row| row.is_chain()).collect();
    lines.extend(chain.iter().map(|row| line(row.name(), of(*row))));
    let total = chain
        .iter()
        .map(|row| of(*row))
        .fold([[0.0; 3]; 2], |sum, means| {
            std::array::from_fn(|core| std::array::from_fn(|at| sum[core][at] + means[core][at]))
        });
    lines.push(line("**whole chain**", total));
    lines.extend(
        rows.iter()
            .filter(|row| **row == Row::Processor)
            .map(|row| line("around it: processor", of(*row))),
    );
    let cycles = |one: &Figures| {
        one.cycles
            .map_or_else(|| "not estimated".to_owned(), |cycles| cycles.to_string())
    };
    lines.push(String::new());
    lines.push(format!(
        "Cycles of one sample between outputs, f32 {}, fixed {} ({}).",
        cycles(&both[0]),
        cycles(&both[1]),
        cycles::MEANING
    ));
    lines.push(String::new());
    Ok(lines.join("\n"))
}

/// The data's order, as either image has it.
fn order(row: Row, both: &[Figures; 2]) -> usize {
    both.iter()
        .filter_map(|one| one.costs.rows().iter().position(|other| *other == row))
        .max()
        .unwrap_or(usize::MAX)
}
