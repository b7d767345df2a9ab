//! `rlg close-loop`: residual error of the chain for each kind of effect after a blind diagnosis.

use clap::Args;
use serde::Serialize;

use crate::close_loop::{CASES, Case, Row, Twin};
use crate::error::InputError;
use crate::terminal::Terminal;

/// Simulate kinds of effects, diagnose them blind, correct them in the chain, and print the error before and after
///
/// Without KIND every kind that the chain or one of its optional terms compensates. Errors are the distance of the
/// chain's summed output from that of the same motion and noise without the effect, both read in fine steps, rms, the
/// axis that is farthest off.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  rlg close-loop gyro_delay axis_flexure")]
pub struct CloseLoop {
    /// Kinds of the catalogue
    kinds: Vec<String>,
    /// Seed of the simulation
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

#[derive(Serialize)]
struct Report {
    format: u32,
    version: &'static str,
    seed: u64,
    rows: Vec<Row>,
}

impl CloseLoop {
    /// Closes the loop over each kind and prints a table.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let cases = self.cases()?;
        let spinner = terminal.spinner("simulating");
        let mut twins: Vec<Twin> = Vec::new();
        terminal.say(
            "| kind | found | before | after, f32 | after, fixed | left | with the true size |",
        );
        terminal.say("|---|---|---|---|---|---|---|");
        let mut rows = Vec::new();
        let mut failed = None;
        for case in cases {
            spinner.set_message(case.kind);
            if !twins.iter().any(|twin| twin.setting() == case.setting) {
                twins.push(Twin::new(case.setting, self.seed)?);
            }
            let of_setting = |twin: &&Twin| twin.setting() == case.setting;
            let Some(twin) = twins.iter().find(of_setting) else {
                continue;
            };
            match twin.close(case, &|_| {}) {
                Ok(row) => {
                    terminal.say(words(&row));
                    rows.push(row);
                }
                // Minutes a kind: one failure does not end the others.
                Err(error) => {
                    terminal.say(format!("| {} | {error} | | | | | |", case.kind));
                    failed.get_or_insert(error);
                }
            }
        }
        spinner.finish_and_clear();
        terminal.result(&Report {
            format: 1,
            version: env!("CARGO_PKG_VERSION"),
            seed: self.seed,
            rows,
        })?;
        failed.map_or(Ok(()), Err)
    }

    fn cases(&self) -> Result<Vec<&'static Case>, InputError> {
        if self.kinds.is_empty() {
            return Ok(CASES.iter().collect());
        }
        let find = |kind: &String| {
            let known = || {
                let names: Vec<_> = CASES.iter().map(|case| case.kind).collect();
                names.join(", ")
            };
            CASES.iter().find(|case| case.kind == kind).ok_or_else(|| {
                InputError::new("close-loop", "the chain compensates no such kind")
                    .value(kind)
                    .expected(known())
            })
        };
        self.kinds.iter().map(find).collect()
    }
}

/// Formats a line of the table; angles in arc seconds.
fn words(row: &Row) -> String {
    let (unit, per) = match row.unit {
        "rad" => ("″", 180.0 / std::f64::consts::PI * 3600.0),
        _ => ("mm/s", 1e3),
    };
    let shown = |value: f64| format!("{:.3} {unit}", value * per);
    let found = if row.found.is_empty() {
        "nothing".to_owned()
    } else {
        row.found.join(", ")
    };
    format!(
        "| {} | {found} | {} | {} | {} | {:.1} % | {} |",
        row.kind,
        shown(row.before),
        shown(row.after_f32),
        shown(row.after_fixed),
        100.0 * row.left(),
        shown(row.with_truth)
    )
}
