//! `rlg plan`: prints the thresholds of a diagnosis and of a calibration as a file for `--plan`; reads such a file.

use std::path::{Path, PathBuf};

use clap::Args;
use rlg_plan::{Number, Plan};
use serde_json::{Map, json};

use crate::error::InputError;
use crate::plan_file;
use crate::terminal::Terminal;

/// Print the thresholds of a diagnosis and of a calibration
///
/// Every number with its unit, permitted range and reason, as a file: change a number, leave out what stays, and give the
/// file to rlg diagnose --plan or rlg calibrate --plan.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg plan > plan.toml\n  rlg diagnose RECORDING --model model.toml --plan plan.toml"
)]
pub struct PlanCommand {
    /// File whose numbers replace the defaults
    file: Option<PathBuf>,
}

impl PlanCommand {
    /// Prints the plan.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let plan = given(self.file.as_deref())?;
        terminal.say(plan_file::to_toml(&plan).trim_end());
        let numbers = plan.numbers().into_iter().map(|number| {
            let facts = json!({
                "value": values(&number),
                "unit": number.unit,
                "range": number.range,
                "reason": number.reason,
            });
            (number.name, facts)
        });
        terminal.result(&numbers.collect::<Map<_, _>>())
    }
}

/// Returns the value of a number, or the list of its values.
fn values(number: &Number) -> serde_json::Value {
    match number.values.as_slice() {
        [value] => json!(value),
        values => json!(values),
    }
}

/// Reads a plan; the defaults without a file.
pub(super) fn given(file: Option<&Path>) -> Result<Plan, InputError> {
    file.map_or_else(|| Ok(Plan::default()), plan_file::read)
}
