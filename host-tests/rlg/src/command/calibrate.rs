//! `rlg calibrate`: the flexure coefficients K_ij, their unidentifiable combinations, and the programme of motion that
//! identifies them.

use std::path::{Path, PathBuf};

use clap::Args;
use rlg_plan::Plan;

use super::inputs::{read_model, results_folder};
use super::plan::given;
use crate::calibrate::calibrate;
use crate::calibrate::programme::limits::Limits;
use crate::calibrate::programme::propose;
use crate::error::InputError;
use crate::json;
use crate::model::{DeclaredModel, Model};
use crate::recording::Recording;
use crate::report::calibration;
use crate::terminal::Terminal;

/// Files written by the command.
const RESULTS: &[&str] = &["calibration.json", "model.toml", "report.html"];

/// Files written by the command with `--propose`.
const PROPOSED: &[&str] = &["plan.json", "scenario.toml"];

/// Calibrate how far the dither suspensions bend (K_ij)
///
/// Recordings of one instrument are taken together: with a rate reference, or with attitude samples before and
/// after coning. Writes OUT/calibration.json (every number), OUT/report.html and OUT/model.toml (the model with
/// the flexure that the recordings fix).
///
/// With --propose it needs no recording: it proposes the turntable programme that fixes all six K within the limits
/// of a table (greatest_rate_rad_s, greatest_acceleration_rad_s2, table_time_s; optional greatest_angle_rad,
/// greatest_frequency_hz, rate_hz), predicts how well, and writes OUT/plan.json and OUT/scenario.toml for `rlg
/// simulate`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  rlg calibrate recordings/coning-x recordings/coning-y --model model.toml --out out/k\n  rlg calibrate --propose limits.toml --model model.toml --out out/programme"
)]
pub struct Calibrate {
    /// Folders with recording.toml
    #[arg(required_unless_present = "propose")]
    recordings: Vec<PathBuf>,
    /// Propose a programme within the limits of this file instead
    #[arg(long, value_name = "LIMITS", conflicts_with = "recordings")]
    propose: Option<PathBuf>,
    /// Thresholds other than the defaults, as rlg plan prints them
    #[arg(long, value_name = "FILE")]
    plan: Option<PathBuf>,
    /// The instrument: what its compensation already contains
    #[arg(short, long)]
    model: PathBuf,
    /// Folder for the results
    #[arg(short, long)]
    out: PathBuf,
}

impl Calibrate {
    /// Calibrates or proposes a programme, and writes.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let model = read_model(&self.model, terminal)?;
        let plan = given(self.plan.as_deref())?;
        if let Some(limits) = &self.propose {
            return self.programme(limits, &model, &plan, terminal);
        }
        let mut out = results_folder(&self.out, &self.recordings[0], &self.model, RESULTS)?;
        for recording in &self.recordings[1..] {
            results_folder(&self.out, recording, &self.model, RESULTS)?;
        }
        let spinner = terminal.spinner("reading");
        let recordings = self
            .recordings
            .iter()
            .map(Recording::read)
            .collect::<Result<Vec<_>, _>>()?;
        let progress = |stage: &str| terminal.step(&spinner, stage);
        let outcome = calibrate(
            &recordings,
            DeclaredModel::new(&model, &self.model),
            &plan,
            &progress,
        )?;
        spinner.finish_and_clear();
        let json = json::text(&outcome.calibration, &self.out)?;
        out.write("calibration.json", json.as_bytes())?;
        out.write("model.toml", outcome.model.to_toml().as_bytes())?;
        let page = calibration::page(&outcome.calibration);
        out.write("report.html", page.as_bytes())?;
        out.commit()?;
        for line in &outcome.calibration.summary {
            terminal.say(line);
        }
        let report = self.out.join("report.html");
        terminal.say(format!("To read: {}", report.display()));
        terminal.result(&outcome.calibration)
    }

    /// Proposes a programme, and writes it.
    fn programme(
        &self,
        limits_file: &Path,
        model: &Model,
        plan: &Plan,
        terminal: &Terminal,
    ) -> Result<(), InputError> {
        let limits = Limits::read(limits_file)?;
        let mut out = results_folder(&self.out, limits_file, &self.model, PROPOSED)?;
        let programme = propose(
            &limits,
            limits_file,
            DeclaredModel::new(model, &self.model),
            plan,
        )?;
        let json = json::text(&programme.entry, &self.out)?;
        out.write("plan.json", json.as_bytes())?;
        out.write("scenario.toml", programme.scenario.as_bytes())?;
        out.commit()?;
        for line in &programme.entry.summary {
            terminal.say(line);
        }
        let scenario = self.out.join("scenario.toml");
        terminal.say(format!("To simulate: {}", scenario.display()));
        terminal.result(&programme.entry)
    }
}
