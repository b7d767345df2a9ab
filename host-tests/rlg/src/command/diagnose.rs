//! `rlg diagnose`: tests a recording against its model, identifies the effects missing from the model, and reports the
//! evidence.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Args;
use rlg_attitude::serves as is_slow;
use rlg_diagnosis::Outcome;
use rlg_findings::result::{PlanEntry, Verdict};

use super::fail_on::FailOn;
use super::given::Given;
use super::inputs::{IDEAL, assumed, check_plausible, given_or_ideal, read_model, results_folder};
use super::page_beside::gather;
use super::plan;
use super::steps::{Steps, Work};
use super::timings::Timings;
use crate::diagnose::{
    LongRecording, MOST_ROWS, Settings, align, diagnose_together, diagnose_under,
    diagnose_without_reference, stands_in_positions,
};
use crate::error::InputError;
use crate::fleet::run::{RUN_FILE, RunFile};
use crate::json;
use crate::model::{DeclaredModel, Model, MotionSource};
use crate::output::OutputFolder;
use crate::plausibility::{Bounds, is_unreferenced_motion};
use crate::recording::{About, Quantity, Recording};
use crate::report::beside::{Beside, Rate, rates};
use crate::report::terminal::{lines, picture};
use crate::report::{figure, page_beside};
use crate::terminal::{Listener, Terminal};

/// Files written by the command.
const RESULTS: &[&str] = &[
    "diagnosis.json",
    "model.toml",
    "report.html",
    "residual.svg",
    RUN_FILE,
];

/// Length of the part of a long recording that is checked for plausibility \[s\].
const CHECKED_S: f64 = 60.0;

/// Refuses an implausible recording of the named folder.
type Check<'a> = &'a (dyn Fn(&Path, &Recording) -> Result<(), InputError> + Sync);

/// Takes the kind of work and its rows, once they are known.
type Expect<'a> = &'a (dyn Fn(Work, usize) + Sync);

/// Takes the name of each stage.
type Progress<'a> = &'a (dyn Fn(&str) + Sync);

/// Callbacks of the work: plausibility check, expected work, progress.
type Told<'a> = (Check<'a>, Expect<'a>, Progress<'a>);

/// Exit code of a verdict named by `--fail-on`.
const FAILED: u8 = 1;

/// Find what a model leaves out of a recording
///
/// Prints the answer: the verdict, what was left out with sizes and standard deviations, where, what it could also be,
/// and what to record next. With --out it writes OUT/diagnosis.json (every number), OUT/report.html (one page with the
/// plots), OUT/residual.svg (the residual of the three gyros before and after, a picture for a document) and
/// OUT/model.toml (the model with the found effects switched on: diagnosed again, it matches; none where nothing can be said).
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg diagnose recordings/bench-17 -m recordings/bench-17/model.toml -o out/bench-17\n  rlg diagnose log.csv --plot\n  rlg diagnose monday tuesday friday --model unit.toml --hold-out friday --out out/unit\n\nExit code 0: done, whatever the verdict; 1: a verdict that --fail-on names; 2: an input that cannot be used."
)]
pub struct Diagnose {
    /// Folders with recording.toml, or files that rlg import reads without a question; several are explained together
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Of several recordings, hold this one out for validation; may be given several times [default: the last]
    #[arg(long, value_name = "RECORDING")]
    hold_out: Vec<PathBuf>,
    /// The model: what the simulation of the recordings already contains [default: an ideal unit]
    #[arg(short, long)]
    model: Option<PathBuf>,
    /// Rows to hold in memory at once; a longer recording is diagnosed by intervals, with the rest as sums over blocks
    #[arg(long, default_value_t = MOST_ROWS)]
    most_rows: usize,
    /// Folder for the results [default: none is written]
    #[arg(short, long)]
    out: Option<PathBuf>,
    /// Also write OUT/run.json for rlg summarize: instrument, date, mean temperature. An input that cannot be used stands
    /// there with its sentence, and the exit code is 0
    #[arg(long, requires = "out")]
    for_fleet: bool,
    /// Verdicts that end with exit code 1; a recording of which nothing can be said is one of them
    #[arg(long, value_enum)]
    fail_on: Option<FailOn>,
    /// Seed of the self-test and the control; the findings do not depend on it
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Take a recording as it is that cannot be plausible; put channels right that are reversed, exchanged or of another unit
    /// than the reference, and report it
    #[arg(long)]
    anyway: bool,
    /// Thresholds other than the defaults, as rlg plan prints them
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// Threads to use; results are the same for any number [default: all]
    #[arg(long)]
    threads: Option<std::num::NonZeroUsize>,
    /// Print the integrated residual of each gyro with a finding, before and after, as a picture of characters
    #[arg(long)]
    plot: bool,
    /// Print, and write on the page, what each stage took: seconds, processor seconds, columns, transforms, fits
    #[arg(long)]
    timings: bool,
}

/// Diagnosis with its inputs.
pub struct Diagnosed {
    /// Outcome of the diagnosis.
    pub outcome: Outcome,
    /// Line about the assumed model, if none was given.
    pub assumed: Option<String>,
    given: Given,
    model: Model,
    model_file: PathBuf,
    /// Rates as recorded, if the rows were in memory.
    recorded: Vec<Rate>,
    /// Lines about the stages, if asked for.
    timings: Vec<String>,
}

impl Diagnosed {
    /// Writes the results that `rlg diagnose --out` writes, all at once.
    pub fn write(&self, out: &Path) -> Result<(), InputError> {
        write(
            &self.outcome,
            &self.beside()?,
            None,
            results(out, &self.given.folders(), &self.model_file)?,
        )
    }

    /// Gathers the page's content beyond the diagnosis.
    fn beside(&self) -> Result<Beside, InputError> {
        let of = DeclaredModel::new(&self.model, &self.model_file);
        let beside = gather(&self.given, of, self.assumed.as_deref())?;
        Ok(Beside {
            rates: self.recorded.clone(),
            timings: self.timings.clone(),
            ..beside
        })
    }

    /// Returns the answer as the command prints it, a line each.
    pub fn lines(&self) -> Vec<String> {
        lines(&self.outcome.diagnosis, self.assumed.as_deref())
    }
}

impl Diagnose {
    /// Returns for each recording true if it is held out as a whole.
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

    /// Diagnoses, prints the answer and writes the results.
    pub fn run(&self, terminal: &Terminal) -> Result<ExitCode, InputError> {
        // Before the work: without a valid folder for the results there is nothing to do.
        let model_file = self.model.clone().unwrap_or_else(|| IDEAL.into());
        let out = self.out.as_deref();
        let out = out.map(|out| results(out, &self.recordings, &model_file));
        let out = out.transpose()?;
        let (about, diagnosed) = match (self.told(terminal), &out) {
            (Err(error), Some(_)) if self.for_fleet => return self.refused(&error, out, terminal),
            (done, _) => done?,
        };
        let outcome = &diagnosed.outcome;
        let diagnosis = &outcome.diagnosis;
        if let Some(out) = out {
            write(outcome, &diagnosed.beside()?, about, out)?;
        }
        for line in diagnosed.lines() {
            terminal.say(line);
        }
        if self.plot {
            for line in picture(diagnosis, outcome.pictures.as_ref(), terminal.width()) {
                terminal.say(line);
            }
        }
        for line in &diagnosed.timings {
            terminal.say(line);
        }
        terminal.say(match &self.out {
            Some(out) => format!("To read: {}", out.join("report.html").display()),
            None => "To read: --out DIR writes the page with the plots and the model with what was found.".to_owned(),
        });
        terminal.result(diagnosis)?;
        let fails = self.fail_on.is_some_and(|on| on.names(diagnosis.verdict));
        Ok(if fails {
            ExitCode::from(FAILED)
        } else {
            ExitCode::SUCCESS
        })
    }

    /// Writes the reason for which an input cannot be used, for the summary of a fleet.
    fn refused(
        &self,
        error: &InputError,
        out: Option<OutputFolder>,
        terminal: &Terminal,
    ) -> Result<ExitCode, InputError> {
        terminal.warn(error);
        if let Some(mut out) = out {
            RunFile::refused(&self.recordings[0], error).write_into(&mut out)?;
            out.commit()?;
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Reads the circumstances of the recording, for a fleet, and diagnoses.
    fn told(&self, terminal: &Terminal) -> Result<(Option<About>, Diagnosed), InputError> {
        let given = Given::read(&self.recordings, self.anyway, terminal)?;
        let about = self.for_fleet.then(|| About::read(&given.folders()[0]));
        let about = about.transpose().map_err(|error| given.renamed(error))?;
        Ok((about, self.of(given, terminal)?))
    }

    /// Diagnoses; writes nothing and prints only progress and warnings.
    pub(super) fn diagnosed(&self, terminal: &Terminal) -> Result<Diagnosed, InputError> {
        let given = Given::read(&self.recordings, self.anyway, terminal)?;
        self.of(given, terminal)
    }

    /// Reads the model, or makes that of an ideal unit.
    fn model(
        &self,
        given: &Given,
        terminal: &Terminal,
    ) -> Result<(Model, PathBuf, Option<String>), InputError> {
        match (&self.model, given.model()) {
            (None, Some(file)) => {
                let model = read_model(&file, terminal)?;
                let note = assumed(&model);
                Ok((model, IDEAL.into(), Some(note)))
            }
            (model, _) => given_or_ideal(model.as_deref(), &given.folders()[0], terminal),
        }
    }

    /// Diagnoses recordings in their folders.
    fn of(&self, given: Given, terminal: &Terminal) -> Result<Diagnosed, InputError> {
        let (model, model_file, assumed) = self.model(&given, terminal)?;
        let folders = given.folders();
        let held_out = self.held_out()?;
        let settings = Settings {
            seed: self.seed,
            anyway: self.anyway,
            plan: plan::given(self.plan.as_deref())?,
            ..Settings::default()
        };
        let spinner = terminal.spinner("reading");
        let steps = Steps::new(terminal, &spinner);
        let timings = self.timings.then(|| Timings::new("reading"));
        let progress = |stage: &str| {
            steps.show(stage);
            if let Some(timings) = &timings {
                timings.begin(stage);
            }
        };
        let expect = |work: Work, rows: usize| steps.expect(work, rows);
        let mut recorded = Vec::new();
        let check = |folder: &Path, recording: &Recording| {
            let listener = Listener::new(|_| ());
            let heard = Terminal::heard_by(listener.clone());
            // One recording that moves without a reference is no contradiction: it shows what it can.
            let moving = Model {
                motion: MotionSource::Reference,
                ..model.clone()
            };
            let model = match folders.len() == 1 && self.is_unreferenced(recording, &model) {
                true => &moving,
                false => &model,
            };
            let checked = check_plausible(folder, recording, model, self.anyway, &heard);
            for warning in listener.take().warnings {
                given.warn(&warning, terminal);
            }
            checked
        };
        let of = DeclaredModel::new(&model, &model_file);
        let mut work = || {
            self.outcome(
                &folders,
                (&settings, of),
                &held_out,
                &mut recorded,
                (&check, &expect, &progress),
            )
        };
        let mut outcome = match self.threads {
            None => work(),
            Some(threads) => rayon::ThreadPoolBuilder::new()
                .num_threads(threads.get())
                .build()
                .map_err(|error| {
                    InputError::new("--threads", format!("cannot be started ({error})"))
                })?
                .install(work),
        }
        .map_err(|error| given.renamed(error))?;
        spinner.finish_and_clear();
        outcome
            .diagnosis
            .under_plan(PlanEntry::changed(&settings.plan));
        Ok(Diagnosed {
            outcome,
            assumed,
            given,
            model,
            model_file,
            recorded,
            timings: timings.map_or_else(Vec::new, |timings| timings.lines()),
        })
    }

    /// True for gyros that move without a reference, unless the caller takes them to be at rest anyway.
    fn is_unreferenced(&self, recording: &Recording, model: &Model) -> bool {
        !self.anyway && is_unreferenced_motion(recording, model, &Bounds::default())
    }

    /// Reads and diagnoses one recording, or several together; `recorded` takes the rates of a recording in memory.
    fn outcome(
        &self,
        folders: &[PathBuf],
        (settings, of): (&Settings, DeclaredModel<'_>),
        held_out: &[bool],
        recorded: &mut Vec<Rate>,
        (check, expect, progress): Told<'_>,
    ) -> Result<Outcome, InputError> {
        let DeclaredModel { model, file } = of;
        let [folder] = folders else {
            return together(folders, (settings, of), held_out, (check, expect, progress));
        };
        if let Some(long) = LongRecording::of(folder, model, self.most_rows)? {
            // A first part represents the whole, which is never in memory at once.
            check(folder, &long.first(CHECKED_S)?)?;
            expect(Work::Dithered, self.most_rows);
            return long.diagnose(settings, of, progress);
        }
        let recording = Recording::read(folder)?;
        check(folder, &recording)?;
        expect(work(&recording, model), rows(&recording));
        *recorded = rates(&recording, model.gyro.pulse_weight_rad);
        if self.is_unreferenced(&recording, model)
            && !stands_in_positions(&recording, &settings.plan)
        {
            return diagnose_without_reference(settings, &recording, model, progress);
        }
        diagnose_under(settings, recording, model, file, progress)
    }
}

/// Reads and diagnoses several recordings by one model.
fn together(
    folders: &[PathBuf],
    (settings, of): (&Settings, DeclaredModel<'_>),
    held_out: &[bool],
    (check, expect, progress): Told<'_>,
) -> Result<Outcome, InputError> {
    let model = of.model;
    let mut aligned = Vec::with_capacity(folders.len());
    let mut all_rows = 0;
    for (folder, held_out) in folders.iter().zip(held_out) {
        // The recording's own tables are dropped before the next is read; the rows are in the streams.
        let recording = Recording::read(folder)?;
        check(folder, &recording)?;
        all_rows += rows(&recording);
        if is_slow(&recording, model) {
            return Err(InputError::new(
                folder,
                "has attitudes as its reference, or one at other rows than its gyros",
            )
            .expected("one such recording at a time, or a reference at every row of the gyros"));
        }
        if stands_in_positions(&recording, &settings.plan) {
            return Err(InputError::new(
                folder,
                "has still positions of accelerometers, and no reference",
            )
            .expected("one such recording at a time"));
        }
        let mut one = align(settings, &recording, model)?;
        one.streams.piece.held_out = *held_out;
        aligned.push(one);
    }
    expect(Work::Dithered, all_rows);
    diagnose_together(settings, aligned, of, progress)
}

/// Returns the kind of work for a recording.
pub(super) fn work(recording: &Recording, model: &Model) -> Work {
    if is_slow(recording, model) {
        Work::Attitudes
    } else if model.motion == MotionSource::Static {
        Work::AtRest
    } else if recording.holds(&[Quantity::DitherAngle]) {
        Work::DitheredInMemory
    } else {
        Work::Rates
    }
}

/// Returns the number of rows of the longest table.
pub(super) fn rows(recording: &Recording) -> usize {
    let rows = recording.tables.iter().map(|table| table.rows);
    rows.max().unwrap_or(0)
}

/// Creates the folder for the results, which must differ from the recordings' and not hold the model.
fn results(
    out: &Path,
    recordings: &[PathBuf],
    model_file: &Path,
) -> Result<OutputFolder, InputError> {
    for recording in &recordings[1..] {
        results_folder(out, recording, model_file, RESULTS)?;
    }
    results_folder(out, &recordings[0], model_file, RESULTS)
}

/// Writes all results at once.
fn write(
    outcome: &Outcome,
    beside: &Beside,
    about: Option<About>,
    mut out: OutputFolder,
) -> Result<(), InputError> {
    let diagnosis = &outcome.diagnosis;
    let json = json::text(diagnosis, out.target())?;
    out.write("diagnosis.json", json.as_bytes())?;
    match diagnosis.verdict {
        Verdict::Unusable => out.without("model.toml"),
        _ => out.write("model.toml", outcome.model.to_toml().as_bytes())?,
    }
    let report = page_beside(diagnosis, outcome.pictures.as_ref(), beside);
    out.write("report.html", report.as_bytes())?;
    let residual = figure::residuals(diagnosis, outcome.pictures.as_ref());
    out.write("residual.svg", residual.as_bytes())?;
    if let Some(about) = about {
        // Written last: it implies that the others exist.
        RunFile::diagnosed(about).write_into(&mut out)?;
    }
    out.commit()
}
