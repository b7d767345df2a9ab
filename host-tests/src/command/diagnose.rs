//! `rlg diagnose`: where a recording and its model differ, what physics was left out, and the proof.

use std::path::{Path, PathBuf};

use clap::Args;

use super::inputs::{read_model, results_folder};
use crate::diagnose::diagnose_aligned;
use crate::diagnose::streams::Streams;
use crate::error::InputError;
use crate::recording::Recording;
use crate::report::page;
use crate::terminal::Terminal;

/// What it writes.
const RESULTS: &[&str] = &["diagnosis.json", "model.toml", "report.html"];

/// Find what a model leaves out of a recording
///
/// Writes OUT/diagnosis.json (every number), OUT/report.html (one page with the plots) and OUT/model.toml
/// (the model with the found effects switched on: diagnosed again, it matches).
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg diagnose recordings/bench-17 --model recordings/bench-17/model.toml --out out/bench-17"
)]
pub struct Diagnose {
    /// Folder with recording.toml
    recording: PathBuf,
    /// What the simulation of this recording already contains
    #[arg(long)]
    model: PathBuf,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
    /// Written into the result; nothing random enters the diagnosis itself
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Threads to work with; the result is the same bytes for any number [default: all]
    #[arg(long)]
    threads: Option<std::num::NonZeroUsize>,
}

impl Diagnose {
    /// Diagnoses and writes; the verdict does not change the exit code.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let model = read_model(&self.model, terminal)?;
        let mut out = results_folder(&self.out, &self.recording, &self.model, RESULTS)?;
        let spinner = terminal.spinner("reading");
        let mut recording = Recording::read(&self.recording)?;
        let progress = |stage: &str| spinner.set_message(stage.to_string());
        let mut work = || {
            let streams = Streams::align(&recording, &model)?;
            // From here on the rows live in the streams alone.
            recording.tables.clear();
            let (seed, file) = (self.seed, &self.model);
            diagnose_aligned(&[], &recording, streams, &model, file, seed, &progress)
        };
        let outcome = match self.threads {
            None => work(),
            Some(threads) => rayon::ThreadPoolBuilder::new()
                .num_threads(threads.get())
                .build()
                .map_err(|error| {
                    InputError::new(
                        Path::new("--threads"),
                        format!("cannot be started ({error})"),
                    )
                })?
                .install(work),
        }?;
        spinner.finish_and_clear();
        let mut json = serde_json::to_string_pretty(&outcome.diagnosis).map_err(|error| {
            InputError::new(&self.out, format!("the result has no JSON form ({error})"))
        })?;
        json.push('\n');
        out.write("diagnosis.json", json.as_bytes())?;
        out.write("model.toml", outcome.model.to_toml().as_bytes())?;
        let report = page(&outcome.diagnosis, outcome.pictures.as_ref());
        out.write("report.html", report.as_bytes())?;
        out.commit()?;
        for line in &outcome.diagnosis.summary {
            terminal.say(line);
        }
        let report = self.out.join("report.html");
        terminal.say(format!("To read: {}", report.display()));
        terminal.result(&outcome.diagnosis)
    }
}
