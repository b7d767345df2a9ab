//! `rlg diagnose`: where a recording and its model differ, what physics was left out, and the proof.

use std::path::{Path, PathBuf};

use clap::Args;

use super::inputs::{read_model, results_folder};
use crate::diagnose::apart::look_at_each;
use crate::diagnose::attitude::is_slow;
use crate::diagnose::declare::MOST_ROWS;
use crate::diagnose::long::Long;
use crate::diagnose::streams::Streams;
use crate::diagnose::{Engine, Settings, diagnose, diagnose_aligned, diagnose_streams};
use crate::error::InputError;
use crate::recording::Recording;
use crate::report::terminal::lines;
use crate::report::{figure, page};
use crate::terminal::Terminal;

/// Files that the command writes.
const RESULTS: &[&str] = &[
    "diagnosis.json",
    "model.toml",
    "report.html",
    "residual.svg",
];

/// Find what a model leaves out of a recording
///
/// Writes OUT/diagnosis.json (every number), OUT/report.html (one page with the plots), OUT/residual.svg (the
/// residual of the three gyros before and after, a picture for a document) and OUT/model.toml (the model with
/// the found effects switched on: diagnosed again, it matches).
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg diagnose recordings/bench-17 --model recordings/bench-17/model.toml --out out/bench-17\n  rlg diagnose monday tuesday friday --model unit.toml --hold-out friday --out out/unit"
)]
pub struct Diagnose {
    /// Folders with recording.toml; several are explained together
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Of several recordings, hold this one out for validation; may be given several times [default: the last]
    #[arg(long, value_name = "RECORDING")]
    hold_out: Vec<PathBuf>,
    /// The model: what the simulation of the recordings already contains
    #[arg(long)]
    model: PathBuf,
    /// Rows to hold in memory at once; a longer recording is diagnosed by intervals, with the rest as sums over blocks
    #[arg(long, default_value_t = MOST_ROWS)]
    most_rows: usize,
    /// Folder for the results
    #[arg(long)]
    out: PathBuf,
    /// Seed of the self-test and the control; the findings do not depend on it
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Which engine decides on one recording with a reference at every row
    #[arg(long, value_enum, default_value = "both")]
    engine: EngineChoice,
    /// Put channels right that are reversed, exchanged or of another unit than the reference, and report it, instead of
    /// refusing the recording
    #[arg(long)]
    anyway: bool,
    /// Threads to use; results are the same for any number [default: all]
    #[arg(long)]
    threads: Option<std::num::NonZeroUsize>,
}

/// Engines of the diagnosis.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum EngineChoice {
    /// One likelihood for gyros without a dither, the older stages for all others and for accelerometers
    Both,
    /// The older stages alone
    Old,
    /// One likelihood alone, dithered gyros included
    New,
}

impl From<EngineChoice> for Engine {
    fn from(choice: EngineChoice) -> Self {
        match choice {
            EngineChoice::Both => Self::Both,
            EngineChoice::Old => Self::Old,
            EngineChoice::New => Self::New,
        }
    }
}

impl Diagnose {
    /// Which of the recordings are held out as a whole.
    fn held_out(&self) -> Result<Vec<bool>, InputError> {
        let mut held_out = vec![false; self.recordings.len()];
        for folder in &self.hold_out {
            let place = self.recordings.iter().position(|given| given == folder);
            let place = place.ok_or_else(|| {
                InputError::new(
                    folder,
                    "is to be held out, but is no recording of this list",
                )
                .channel("--hold-out")
                .expected("one of the RECORDING folders, written the same way")
            })?;
            held_out[place] = true;
        }
        if let (true, [_, .., last]) = (self.hold_out.is_empty(), held_out.as_mut_slice()) {
            *last = true;
        }
        if held_out.iter().all(|held_out| *held_out) {
            return Err(InputError::new("--hold-out", "leaves no recording to fit")
                .expected("at least one recording that is not held out"));
        }
        Ok(held_out)
    }

    /// Diagnoses and writes; the verdict does not change the exit code.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let model = read_model(&self.model, terminal)?;
        let mut out = results_folder(&self.out, &self.recordings[0], &self.model, RESULTS)?;
        for recording in &self.recordings[1..] {
            results_folder(&self.out, recording, &self.model, RESULTS)?;
        }
        let spinner = terminal.spinner("reading");
        let progress = |stage: &str| spinner.set_message(stage.to_string());
        let held_out = self.held_out()?;
        let work = || {
            if let [folder] = self.recordings.as_slice()
                && let Some(long) = Long::new(folder, &model, &self.model, self.most_rows)?
            {
                let share = |done: f64| {
                    let read_s = done * long.seconds();
                    progress(&format!("reading {read_s:.0} of {:.0} s", long.seconds()));
                };
                let (pieces, blocks) = long.read(&share)?;
                let (blocks, seed) = (Some(&blocks), self.seed);
                return diagnose_aligned(&[], pieces, blocks, &model, &self.model, seed, &progress);
            }
            let mut aligned = Vec::with_capacity(self.recordings.len());
            for (folder, held_out) in self.recordings.iter().zip(&held_out) {
                // The recording's own tables go before the next is read; the rows live in the streams.
                let recording = Recording::read(folder)?;
                if is_slow(&recording, &model) {
                    if self.recordings.len() > 1 {
                        return Err(InputError::new(
                            folder,
                            "has attitudes as its reference, not a rate at every row",
                        )
                        .expected("one such recording at a time"));
                    }
                    return diagnose(&recording, &model, &self.model, self.seed, &progress);
                }
                if self.recordings.len() == 1 {
                    progress("aligning the channels");
                    let streams = Streams::align(&recording, &model)?;
                    drop(recording);
                    let again = || Streams::align(&Recording::read(folder)?, &model);
                    let settings = Settings {
                        seed: self.seed,
                        anyway: self.anyway,
                        ..Settings::by(self.engine.into())
                    };
                    let of = (&model, self.model.as_path());
                    return diagnose_streams(&settings, (streams, &again), of, &progress);
                }
                let mut streams = Streams::align(&recording, &model)?;
                streams.pieces[0].held_out = *held_out;
                aligned.push(streams);
            }
            let seed = self.seed;
            let count = aligned.len();
            let mut outcome =
                diagnose_aligned(&[], aligned, None, &model, &self.model, seed, &progress)?;
            if count > 1 {
                let read = |place: usize| {
                    Streams::align(&Recording::read(&self.recordings[place])?, &model)
                };
                let of = (&model, self.model.as_path());
                look_at_each(&mut outcome, (count, &read), of, seed, &progress)?;
            }
            Ok(outcome)
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
        let residual = figure::residuals(&outcome.diagnosis, outcome.pictures.as_ref());
        out.write("residual.svg", residual.as_bytes())?;
        out.commit()?;
        for line in lines(&outcome.diagnosis) {
            terminal.say(line);
        }
        let report = self.out.join("report.html");
        terminal.say(format!("To read: {}", report.display()));
        terminal.result(&outcome.diagnosis)
    }
}
