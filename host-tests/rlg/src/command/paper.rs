//! `rlg paper`: repeats the paper's experiments and compares them with its figures.

use std::path::PathBuf;

use clap::Args;

use crate::error::InputError;
use crate::json;
use crate::output::OutputFolder;
use crate::paper::lengths::Lengths;
use crate::paper::page::page;
use crate::paper::{Results, reproduce, rows};
use crate::terminal::Terminal;

/// Run the paper's experiments on simulator and chain, and compare with its printed figures
///
/// Writes OUT/paper.json (an entry for every table and figure: what the paper prints, what came out, whether it
/// is reproduced and why) and OUT/paper.html (one page with the plots).
#[derive(Debug, Args)]
#[command(
    name = "paper",
    after_help = "Example:\n  rlg paper --out out/paper --seed 1"
)]
pub struct PaperCommand {
    /// Folder for the results
    #[arg(short, long)]
    out: PathBuf,
    /// Seed of the simulations
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Shorter runs: quicker, and noise shows more
    #[arg(long)]
    short: bool,
}

impl PaperCommand {
    /// Runs the experiments and writes the results; whether a figure is reproduced does not change the exit code.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let mut out = OutputFolder::create(&self.out)?;
        let lengths = if self.short {
            Lengths::SHORT
        } else {
            Lengths::FULL
        };
        let bar = terminal.bar(rows(&lengths) as u64, "simulating");
        let paper = reproduce(self.seed, &lengths, &|done| bar.inc(done as u64))?;
        bar.finish_and_clear();
        let json = json::text(&paper.results, &self.out)?;
        out.write("paper.json", json.as_bytes())?;
        out.write("paper.html", page(&paper, &json).as_bytes())?;
        out.commit()?;
        self.say(&paper.results, terminal);
        terminal.result(&paper.results)
    }

    fn say(&self, results: &Results, terminal: &Terminal) {
        for entry in results.entries.iter().filter(|entry| !entry.drawing) {
            let mark = if entry.reproduced { "yes" } else { "no" };
            let by = entry
                .criterion
                .as_ref()
                .map_or("", |criterion| criterion.by.word());
            terminal.say(format!(
                "{:<8} {mark:<4} {by:<8} {}",
                entry.item, entry.short
            ));
        }
        let [done, could] = results.score();
        terminal.say(format!(
            "{done} of {could} reproduced, by marks of the paper's, ours or both (criterion in paper.json); Fig. 1 to 3 are drawings"
        ));
        terminal.say(format!(
            "To read: {}",
            self.out.join("paper.html").display()
        ));
    }
}
