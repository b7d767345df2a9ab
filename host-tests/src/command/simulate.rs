//! `rlg simulate`: a scenario becomes a recording, its model, and a truth that stays outside both.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::error::InputError;
use crate::output::OutputFile;
use crate::recording::Recording;
use crate::simulate::scenario::Scenario;
use crate::simulate::simulate;
use crate::terminal::Terminal;

/// Make a recording of a dithered ring-laser triad from a scenario
///
/// Writes OUT (a recording), OUT/model.toml (what its simulation admits) and, beside the folder,
/// OUT.truth.json (what it conceals).
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg simulate host-tests/scenarios/coning.toml --out /tmp/coning --seed 7"
)]
pub struct Simulate {
    /// Scenario file; its keys are explained in host-tests/scenarios
    scenario: PathBuf,
    /// Folder for the recording: new, empty, or a recording to replace
    #[arg(long)]
    out: PathBuf,
    /// Seed of every random draw; the same scenario and seed give the same bytes
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

impl Simulate {
    /// Simulates and writes; says where.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let scenario = Scenario::read(&self.scenario)?;
        let mut out = Recording::create_folder(&self.out)?;
        let truth_path = truth_path(&self.out)?;

        let bar = terminal.bar(scenario.rows() as u64, "simulating");
        let simulation = simulate(&scenario, self.seed, |rows| bar.set_position(rows as u64));
        bar.finish_and_clear();

        let spinner = terminal.spinner("writing");
        simulation.recording.write_into(&mut out)?;
        out.write("model.toml", simulation.model.to_toml().as_bytes())?;
        let truth = OutputFile::create(&truth_path, simulation.truth.to_json().as_bytes())?;
        out.commit()?;
        truth.commit()?;
        spinner.finish_and_clear();

        terminal.say(format!(
            "{}: {} s, {} channels in {}; model in {}, truth in {}",
            scenario.name,
            scenario.rows() as f64 / scenario.rate_hz,
            simulation.recording.tables[0].channels.len(),
            self.out.display(),
            self.out.join("model.toml").display(),
            truth_path.display()
        ));
        terminal.result(&json!({
            "recording": self.out,
            "model": self.out.join("model.toml"),
            "truth": truth_path,
            "samples": scenario.rows(),
            "seed": self.seed,
        }))
    }
}

/// Beside the recording, not in it: whoever reads the folder reads no truth.
fn truth_path(recording: &Path) -> Result<PathBuf, InputError> {
    let Some(name) = recording.file_name() else {
        return Err(
            InputError::new(recording, "is no folder's name").expected("a folder to write to")
        );
    };
    let mut name = name.to_os_string();
    name.push(".truth.json");
    Ok(recording.with_file_name(name))
}
