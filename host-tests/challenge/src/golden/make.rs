//! Rows of the golden table: simulated trials, and recordings on disk.

use std::path::Path;
use std::time::Instant;

use super::row::Row;
use crate::given::MODEL;
use crate::trial::MIX;
use crate::{Plan, prepare};
use rlg_findings::result::Diagnosis;
use rlg_flow::{Settings, diagnose_under};
use rlg_model::Model;
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
