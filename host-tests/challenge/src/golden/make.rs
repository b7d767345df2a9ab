//! Rows of the golden table: simulated trials, and recordings on disk.

use std::path::Path;
use std::time::Instant;

use super::row::Row;
use crate::acceptance::judge::judge;
use crate::acceptance::read_as::ReadAs;
use crate::acceptance::record::{Declares, record};
use crate::acceptance::run::{self as marks, Outcome};
use crate::acceptance::under_test::DiagnosisSummary;
use crate::given::MODEL;
use crate::marks::family::Family;
use crate::trial::MIX;
use crate::{Plan, prepare};
use rayon::prelude::*;
use rlg_findings::result::Diagnosis;
use rlg_flow::{Settings, diagnose_under};
use rlg_model::{DeclaredModel, Model};
use rlg_recording::Recording;
use rlg_recording::error::InputError;

/// Makes the rows of simulated trials, in the order of their numbers.
///
/// # Inputs
/// The seed, and the numbers of the trials. They are those of `rlg challenge` with the same seed: all families, as often as
/// its marks need them. `progress` gets the name of each finished row and its wall-clock time \[s\], in the order of
/// completion.
///
/// # Assumptions
/// Rows share the threads: the time of one row includes work for others.
pub fn trial_rows(
    seed: u64,
    trials: &[u64],
    progress: &(dyn Fn(&str, f64) + Sync),
) -> Result<Vec<Row>, InputError> {
    let plan = Plan {
        seed,
        trials: trials.last().map_or(0, |last| last + 1),
        families: MIX.to_vec(),
        leave_one_out: false,
    };
    let begun = Instant::now();
    let prepared = prepare(&plan, trials, &|_, _| {})?;
    progress("answers of the trials", begun.elapsed().as_secs_f64());
    let rows = prepared.diagnose_each(|answer, said, seconds| {
        let row = Row::of_trial(answer, said.as_ref().map_err(String::as_str))?;
        progress(row.name(), seconds);
        Ok(row)
    });
    rows.into_iter().collect()
}

/// A kind of recording that the trials above have none of.
struct Guard {
    /// Name of its rows.
    name: &'static str,
    family: Family,
    read_as: ReadAs,
}

const GUARDS: [Guard; 7] = [
    guard("attitude", Family::Attitude, ReadAs::Whole),
    guard("rest", Family::Rest, ReadAs::Whole),
    guard("force", Family::Force, ReadAs::Whole),
    guard("positions", Family::Positions, ReadAs::Whole),
    guard("unrelated", Family::Unrelated, ReadAs::Whole),
    guard("long", Family::Single, ReadAs::Long),
    guard("several", Family::Single, ReadAs::Several),
];

const fn guard(name: &'static str, family: Family, read_as: ReadAs) -> Guard {
    Guard {
        name,
        family,
        read_as,
    }
}

/// Makes the rows of the other kinds of recordings: trials of the marks, with models that declare no noise.
///
/// # Inputs
/// The seed; `each`: trials of each kind; `progress` as of [`trial_rows`].
pub fn guard_rows(
    seed: u64,
    each: u64,
    progress: &(dyn Fn(&str, f64) + Sync),
) -> Result<Vec<Row>, InputError> {
    /// Longest recording \[s\], and most rows of one.
    const LONGEST_S: f64 = 120.0;
    const MOST_ROWS: f64 = 40_000.0;
    let mut rows = Vec::new();
    for guard in &GUARDS {
        let prepared = marks::prepare(
            &marks::Plan {
                longest_s: LONGEST_S,
                most_rows: MOST_ROWS,
                ..marks::Plan::new(seed, each, &[guard.family])
            },
            &|| {},
        )?;
        let trials = prepared.trials.par_iter().zip(&prepared.answers);
        let own = trials.map(|(trial, answer)| {
            let begun = Instant::now();
            let (recording, model) = record(trial, Declares::Nothing)?;
            let of = DeclaredModel::new(&model, Path::new(MODEL));
            let said = guard.read_as.diagnose(&Settings::default(), &recording, of);
            let said = said.map(|outcome| outcome.diagnosis);
            let said = said.map_err(|error| format!("refused: {}", error.problem));
            let outcome = Outcome {
                trial: trial.number,
                said: match &said {
                    Ok(diagnosis) => Some(summary(diagnosis)?),
                    Err(_) => None,
                },
                failure: said.as_ref().err().cloned(),
            };
            let name = format!("{}-{:03}", guard.name, trial.number);
            let said = said.as_ref().map_err(String::as_str);
            let row = Row::of_marks(&name, answer, said, &judge(answer, &outcome))?;
            progress(row.name(), begun.elapsed().as_secs_f64());
            Ok(row)
        });
        rows.extend(own.collect::<Result<Vec<Row>, InputError>>()?);
    }
    Ok(rows)
}

fn summary(diagnosis: &Diagnosis) -> Result<DiagnosisSummary, InputError> {
    let json = serde_json::to_value(diagnosis).map_err(|error| error.to_string());
    let summary = json.and_then(|json| DiagnosisSummary::from_json(&json));
    summary.map_err(|problem| InputError::new("diagnosis.json", problem))
}

/// Makes the row of a recording with the model in its folder, as in `rlg diagnose`.
///
/// # Errors
/// The recording or its model cannot be read. A recording that the diagnosis refuses is a row that states so.
pub fn recording_row(name: &str, folder: &Path) -> Result<Row, InputError> {
    let file = folder.join(MODEL);
    let (model, _) = Model::read_with_warnings(&file)?;
    let recording = Recording::read(folder)?;
    let said: Result<Diagnosis, String> =
        diagnose_under(&Settings::default(), &recording, &model, &file, &|_| {})
            .map(|outcome| outcome.diagnosis)
            // The error's file is left out: the folder must not enter the table.
            .map_err(|error| format!("refused: {}", error.problem));
    Row::of_recording(name, said.as_ref().map_err(String::as_str))
}
