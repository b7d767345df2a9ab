//! `rlg schema`: prints the JSON Schema of `diagnosis.json`.

use clap::Args;
use rlg_findings::schema;

use crate::error::InputError;
use crate::terminal::to_standard_output;

/// Print the JSON Schema of diagnosis.json
///
/// Every field with its type, unit and meaning, made from the types that write the file (JSON Schema, draft 2020-12). Fields
/// that it does not list are permitted. The number in "format" is raised when a field is removed or renamed, or its type,
/// unit or meaning changes, and not when one is added.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  rlg schema > diagnosis.schema.json")]
pub struct SchemaCommand {}

impl SchemaCommand {
    /// Prints the schema; `--json` changes nothing.
    pub fn run(&self) -> Result<(), InputError> {
        let unprintable = |reason: &str| {
            InputError::new("standard output", format!("cannot be written ({reason})"))
        };
        let text = serde_json::to_string_pretty(&schema::diagnosis())
            .map_err(|error| unprintable(&error.to_string()))?;
        to_standard_output(&text).map_err(|error| unprintable(&error.to_string()))
    }
}
