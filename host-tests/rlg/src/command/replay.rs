//! `rlg replay`: runs a recording through the chain on the host.
//!
//! `compensated.parquet` has `dtheta_*`, and `dvel_*` if the recording has accelerometers.
//!
//! Out of scope: a truth of the velocity. The reported drifts are those of the angle.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::inputs::{read_model, results_folder};
use crate::error::InputError;
use crate::json;
use crate::output::OutputFolder;
use crate::recording::{Axis, Channel, Clock, MANIFEST, Quantity, Recording, Segment, Table};
use crate::replay::drift::{
    drift, mean_difference_deg_h, periods_in, reference_rotations_rad, segments,
};
use crate::replay::samples::{ReplayInput, Setup, samples_from_recording};
use crate::replay::{Core, Replay, replay};
use crate::terminal::Terminal;
use rlg_parameters::SAMPLES_PER_OUTPUT;
use trueaxis::{CrossAxis, ParameterError};

/// Name of the written table.
const TABLE: &str = "compensated.parquet";

/// Run a recording through the chain and compare with its reference
///
/// Writes compensated.parquet (rotation vectors per output period, itself a recording) and replay.json
/// (drift before and after, per segment).
#[derive(Debug, Args)]
#[command(
    name = "replay",
    after_help = "Example:\n  rlg replay bench-17 --model bench-17/model.toml --core fixed --out replayed"
)]
pub struct ReplayCommand {
    /// Folder with recording.toml
    recording: PathBuf,
    /// The model that the chain compensates
    #[arg(short, long)]
    model: PathBuf,
    /// Number system of the chain
    #[arg(long, value_enum)]
    core: Core,
    /// Folder for the results
    #[arg(short, long)]
    out: PathBuf,
    /// Samples in one output period
    #[arg(long, default_value_t = SAMPLES_PER_OUTPUT)]
    output_every: u16,
    /// Time in which the dither strip follows the pickoff's gain and delay [s]; 0: frozen
    #[arg(long, default_value_t = 0.0)]
    adapt_s: f64,
}

#[derive(Serialize)]
struct Report {
    format: u32,
    recording: String,
    version: &'static str,
    core: &'static str,
    samples: usize,
    samples_per_output: u16,
    adaptation_time_s: f64,
    /// As measured on the pickoffs; null without dither.
    dither_frequency_hz: Option<[f64; 3]>,
    dither_amplitude_rad: Option<[f64; 3]>,
    ns_per_sample: f64,
    output_sha256: String,
    segments: Vec<SegmentReport>,
    /// Reason for which the drifts are null although the recording has a reference.
    no_drift_because: Option<String>,
    /// Reason for which there is no `dvel_*` although the recording has accelerometers.
    no_velocity_because: Option<String>,
    against_reference: AgainstReference,
    /// Complete output periods with at least one sample beyond the chain's ranges, per stage; absent for
    /// the reference.
    saturated: Option<Saturated>,
    /// Kinds of the model's effects without a term in the chain.
    uncompensated: Vec<String>,
    /// Rows without a measurement at the beginning and at the end.
    rows_left_out: [usize; 2],
}

#[derive(Serialize)]
struct SegmentReport {
    name: String,
    kind: String,
    drift_before_deg_h: Option<[f64; 3]>,
    /// Standard deviations; null if the segment is too short to estimate its noise.
    drift_before_std_deg_h: Option<[Option<f64>; 3]>,
    drift_after_deg_h: Option<[f64; 3]>,
    drift_after_std_deg_h: Option<[Option<f64>; 3]>,
}

/// This core against the f64 reference chain.
#[derive(Serialize)]
struct AgainstReference {
    /// Largest over the recording and each of its segments, of any axis.
    max_drift_deg_h: f64,
}

#[derive(Serialize)]
struct Saturated {
    counts: u32,
    pickoff: u32,
    acceleration: u32,
    output: u32,
}

impl ReplayCommand {
    /// Replays, compares with the reference, writes and prints the drifts.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let spinner = terminal.spinner("reading");
        let recording = Recording::read(&self.recording)?;
        let model = read_model(&self.model, terminal)?;
        let mut out = self.results_folder()?;
        let setup = Setup {
            samples_per_output: self.output_every,
            adaptation_time_s: self.adapt_s,
            accelerometers: true,
        };
        let input = samples_from_recording(&recording, &model, &self.model, setup)?;
        terminal.step(&spinner, "replaying");
        let refused = |error: ParameterError| {
            InputError::new(&self.model, format!("does not fit the chain: {error}"))
        };
        let done = replay(&input, self.core, &input.parameters).map_err(refused)?;
        terminal.step(&spinner, "replaying without the flexure");
        let mut without_dynamics = input.parameters;
        without_dynamics.flexure_s2 = CrossAxis::default();
        let before = replay(&input, self.core, &without_dynamics).map_err(refused)?;
        terminal.step(&spinner, "replaying through the reference chain");
        let f64_chain = replay(&input, Core::Reference, &input.parameters).map_err(refused)?;
        terminal.step(&spinner, "comparing");
        let report = self.report(&recording, &input, done, &before, &f64_chain, &mut out)?;
        spinner.finish_and_clear();
        for kind in &report.uncompensated {
            terminal.warn(format!(
                "the chain has no term for {kind}: it stays in the output"
            ));
        }
        if let Some(why) = &input.reference_refused {
            terminal.warn(format!("{why}: no drift is given"));
        }
        if let Some(why) = &input.velocity_refused {
            terminal.warn(format!("{why}: no velocity is given"));
        }
        terminal.say(report.table());
        out.commit()?;
        terminal.result(&report)
    }

    /// Creates the folder for the results: not the input's, and not one that holds another recording.
    fn results_folder(&self) -> Result<OutputFolder, InputError> {
        let results = &[TABLE, MANIFEST, "replay.json"];
        let out = results_folder(&self.out, &self.recording, &self.model, results)?;
        if self.out.join(MANIFEST).exists() && !Recording::lists_table(&self.out, TABLE) {
            return Err(InputError::new(&self.out, "holds another recording")
                .channel("--out")
                .expected("another folder, or one with an earlier replay"));
        }
        Ok(out)
    }

    fn report(
        &self,
        recording: &Recording,
        input: &ReplayInput,
        done: Replay,
        before: &Replay,
        f64_chain: &Replay,
        out: &mut OutputFolder,
    ) -> Result<Report, InputError> {
        let truth = reference_rotations_rad(input);
        let segments = segments(recording, input);
        let periods = done.rotations_rad.len();
        let mut against: f64 = 0.0;
        let mut compare = |range: std::ops::Range<usize>| {
            let apart =
                mean_difference_deg_h(&done.rotations_rad, &f64_chain.rotations_rad, range, input);
            against = apart
                .iter()
                .flatten()
                .fold(against, |most, axis| most.max(axis.abs()));
        };
        compare(0..periods);
        let mut reports = Vec::with_capacity(segments.len());
        for segment in &segments {
            let range = periods_in(segment, input, periods);
            compare(range.clone());
            let drift_of = |of: &Replay| {
                let truth = truth.as_ref()?;
                drift(&of.rotations_rad, truth, range.clone(), input)
            };
            let (before, after) = (drift_of(before), drift_of(&done));
            reports.push(SegmentReport {
                name: segment.name.clone(),
                kind: segment.kind.clone(),
                drift_before_deg_h: before.map(|drift| drift.deg_h),
                drift_before_std_deg_h: before.map(|drift| drift.std_deg_h),
                drift_after_deg_h: after.map(|drift| drift.deg_h),
                drift_after_std_deg_h: after.map(|drift| drift.std_deg_h),
            });
        }
        let dithered = input.parameters.dither_amplitude_rad != [0.0; 3];
        let report = Report {
            format: 1,
            recording: recording.name.clone(),
            version: env!("CARGO_PKG_VERSION"),
            core: self.core.name(),
            samples: input.samples.len(),
            samples_per_output: self.output_every,
            adaptation_time_s: input.parameters.adaptation_time_s,
            dither_frequency_hz: dithered.then_some(input.parameters.dither_frequency_hz),
            dither_amplitude_rad: dithered.then_some(input.parameters.dither_amplitude_rad),
            ns_per_sample: done.ns_per_sample,
            output_sha256: done.output_sha256.clone(),
            segments: reports,
            no_drift_because: input.reference_refused.clone(),
            no_velocity_because: input.velocity_refused.clone(),
            against_reference: AgainstReference {
                max_drift_deg_h: against,
            },
            saturated: done.faults.map(|faults| Saturated {
                counts: faults.counts,
                pickoff: faults.pickoff,
                acceleration: faults.acceleration,
                output: faults.output,
            }),
            uncompensated: input.uncompensated.clone(),
            rows_left_out: input.rows_left_out,
        };
        compensated(recording, input, &segments, &done).write_into(out)?;
        let text = json::text(&report, &self.out)?;
        out.write("replay.json", text.as_bytes())?;
        Ok(report)
    }
}

/// Writes the output as a recording: `dtheta_x|y|z` \[rad\] per output period, and `dvel_x|y|z` \[m/s\] if there are
/// accelerometers.
fn compensated(
    recording: &Recording,
    input: &ReplayInput,
    segments: &[Segment],
    done: &Replay,
) -> Recording {
    let parameters = &input.parameters;
    let channel = |stem: &str, quantity: Quantity, values: &[[f64; 3]], axis: Axis| Channel {
        column: format!("{stem}_{}", axis.label()),
        quantity,
        axis: Some(axis.label().to_owned()),
        scale: 1.0,
        offset: 0.0,
        values: values.iter().map(|value| value[axis.index()]).collect(),
    };
    let angle = |axis| {
        let quantity = Quantity::GyroIncrement;
        channel("dtheta", quantity, &done.rotations_rad, axis)
    };
    let velocity = |axis| {
        let quantity = Quantity::VelocityIncrement;
        channel("dvel", quantity, &done.velocities_m_s, axis)
    };
    let mut channels: Vec<Channel> = Axis::ALL.map(angle).into();
    if parameters.accelerometers.is_some() {
        channels.extend(Axis::ALL.map(velocity));
    }
    Recording {
        name: format!("{}-compensated", recording.name),
        folder: PathBuf::new(),
        site: recording.site,
        tables: vec![Table {
            file: TABLE.to_owned(),
            clock: Clock::Uniform {
                rate_hz: parameters.sample_rate_hz / f64::from(parameters.samples_per_output),
                start_s: input.start_s,
            },
            rows: done.rotations_rad.len(),
            channels,
        }],
        segments: segments.to_vec(),
    }
}

impl Report {
    fn table(&self) -> String {
        let mut text = format!(
            "{} through {}: {} samples, {:.1} ns each, within {:.1e} °/h of the f64 reference chain\n",
            self.recording,
            self.core,
            self.samples,
            self.ns_per_sample,
            self.against_reference.max_drift_deg_h
        );
        // writing to a String cannot fail
        let _ = write!(
            text,
            "{:<16} {:>29}   {:>29}",
            "drift [°/h]", "static Eq. (7)   x, y, z", "with flexure   x, y, z"
        );
        let three = |values: Option<[Option<f64>; 3]>| {
            let value = |value: Option<f64>| {
                value.map_or_else(|| format!("{:>9}", "-"), |value| format!("{value:>9.4}"))
            };
            values.unwrap_or_default().map(value).join(" ")
        };
        for segment in &self.segments {
            let known = |drift: Option<[f64; 3]>| three(drift.map(|values| values.map(Some)));
            let _ = write!(
                text,
                "\n{:<16} {}   {}",
                segment.name,
                known(segment.drift_before_deg_h),
                known(segment.drift_after_deg_h)
            );
            if segment.drift_after_deg_h.is_some() {
                let _ = write!(
                    text,
                    "\n{:>16} {}   {}",
                    "±",
                    three(segment.drift_before_std_deg_h),
                    three(segment.drift_after_std_deg_h)
                );
            }
        }
        text
    }
}
