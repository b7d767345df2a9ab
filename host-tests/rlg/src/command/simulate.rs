//! `rlg simulate`: simulates a scenario as a recording and its model, with a truth file outside both.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::error::InputError;
use crate::output::OutputFile;
use crate::recording::{Recording, RecordingStream};
use crate::simulate::scenario::Scenario;
use crate::simulate::{Simulator, Truth, model_of};
use crate::terminal::Terminal;

/// Make a recording of a dithered ring-laser triad from a scenario
///
/// Writes OUT (a recording), OUT/model.toml (the model without the concealed effects) and, beside the folder,
/// OUT.truth.json (the concealed effects).
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg simulate host-tests/scenarios/coning.toml --out /tmp/coning --seed 7"
)]
pub struct Simulate {
    /// Scenario file; host-tests/scenarios/README.md explains its keys
    scenario: PathBuf,
    /// Folder for the recording: new, empty, or a recording to replace
    #[arg(short, long)]
    out: PathBuf,
    /// Seed of every random draw; the same scenario and seed give the same bytes
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

impl Simulate {
    /// Simulates, writes the recording and prints its place.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let scenario = Scenario::read(&self.scenario)?;
        let mut out = Recording::create_folder(&self.out)?;
        let truth_path = truth_path(&self.out)?;

        // before the work: without a place for the truth there is nothing to simulate
        let truth = Truth::of(&scenario, self.seed).to_json();
        let truth = OutputFile::create(&truth_path, truth.as_bytes())?;
        let mut simulator = Simulator::new(&scenario, self.seed);
        let recording = simulator.recording();
        let layouts = simulator.tables().to_vec();
        let mut stream = RecordingStream::create(&recording, &mut out, |table, column| {
            layouts[table].columns[column].weight.is_some()
        })?;
        let bar = terminal.bar(scenario.rows() as u64, "simulating");
        while let Some(block) = simulator.next_block() {
            stream.write(&block.tables)?;
            bar.set_position(block.end_row as u64);
            terminal.step(&bar, "simulating");
        }
        stream.finish(&mut out)?;
        bar.finish_and_clear();
        out.write("model.toml", model_of(&scenario).to_toml().as_bytes())?;
        out.commit()?;
        truth.commit()?;

        let channels: usize = layouts.iter().map(|table| table.columns.len()).sum();
        terminal.say(format!(
            "{}: {} s, {} channels in {}; model in {}, truth in {}",
            scenario.name,
            scenario.rows() as f64 / scenario.rate_hz,
            channels,
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

/// Returns the path of the truth file: next to the recording, not in it, so that a reader of the folder does not see it.
fn truth_path(recording: &Path) -> Result<PathBuf, InputError> {
    let Some(name) = recording.file_name() else {
        return Err(InputError::new(recording, "is not the name of a folder")
            .expected("a folder to write to"));
    };
    let mut name = name.to_os_string();
    name.push(".truth.json");
    Ok(recording.with_file_name(name))
}
