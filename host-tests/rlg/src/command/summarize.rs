//! `rlg summarize`: compares many diagnoses.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;

use crate::error::InputError;
use crate::fleet::page::{headline, page};
use crate::fleet::run::Run;
use crate::fleet::summary::{Summary, SummaryPlan};
use crate::fleet::table::table;
use crate::output::write_file;
use crate::terminal::Terminal;

/// Compare the diagnoses of many recordings and instruments
///
/// Takes the folders that rlg diagnose --for-fleet --out has written, or folders of such. A row is a parameter of an effect of a
/// recording: its value, its place in the fleet (robust z: median and median absolute deviation over instruments; of three or
/// four instruments the distance from the others over the scatter of recordings), the instrument's trend over time and temperature where recording.toml has `start` and a temperature channel. What cannot be
/// used is a row with its sentence. The same results give the same bytes.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg diagnose bench-17 --for-fleet --out results/bench-17\n  rlg summarize results --out fleet.html\n  rlg summarize results --out fleet.parquet"
)]
pub struct Summarize {
    /// Folders of results, or folders that hold them
    #[arg(required = true, value_name = "DIR")]
    results: Vec<PathBuf>,
    /// File to write: .parquet, .csv or .html
    #[arg(short, long)]
    out: PathBuf,
}

impl Summarize {
    /// Reads, compares, writes.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let write = Form::of(&self.out)?;
        let folders = Run::folders(&self.results)?;
        let runs = folders.iter().map(|folder| Run::read(folder)).collect();
        let summary = Summary::of(runs, &SummaryPlan::default());
        let bytes = match write {
            Form::Parquet => table(&summary).to_parquet(&self.out)?,
            Form::Csv => table(&summary).to_csv(),
            Form::Html => page(&summary, &self.out).into_bytes(),
        };
        write_file(&self.out, &bytes)?;
        let refused: Vec<_> = summary.refused().collect();
        let outliers: Vec<_> = summary
            .lines
            .iter()
            .filter(|line| line.found.iter().any(|one| one.is_outlier))
            .map(|line| line.run.name.as_str())
            .collect();
        terminal.say(format!(
            "{}: {} recordings of {} instruments; {} with an outlier; {} cannot be used",
            self.out.display(),
            summary.lines.len(),
            summary.instruments().len(),
            outliers.len(),
            refused.len()
        ));
        for line in headline(&summary) {
            terminal.say(format!("  {line}"));
        }
        for (run, sentence) in &refused {
            terminal.say(format!("  {}: {sentence}", run.name));
        }
        let trends: Vec<_> = summary
            .trends()
            .iter()
            .map(|trend| {
                json!({
                    "instrument": trend.instrument, "kind": trend.of.kind, "parameter": trend.of.parameter, "a": trend.a,
                    "value": trend.slope.measured.value, "std": trend.slope.measured.std,
                })
            })
            .collect();
        let refused: Vec<_> = refused
            .iter()
            .map(|(run, sentence)| json!({"run": run.name, "sentence": sentence}))
            .collect();
        terminal.result(&json!({
            "summary": self.out,
            "recordings": summary.lines.len(),
            "instruments": summary.instruments().len(),
            "outliers": outliers,
            "trends": trends,
            "refused": refused,
        }))
    }
}

/// Forms of the summary.
enum Form {
    Parquet,
    Csv,
    Html,
}

impl Form {
    fn of(file: &Path) -> Result<Self, InputError> {
        match file.extension().and_then(|extension| extension.to_str()) {
            Some("parquet") => Ok(Self::Parquet),
            Some("csv") => Ok(Self::Csv),
            Some("html") => Ok(Self::Html),
            _ => Err(InputError::new(file, "has an extension that tells no form")
                .channel("--out")
                .expected("a name that ends in .parquet, .csv or .html")),
        }
    }
}
