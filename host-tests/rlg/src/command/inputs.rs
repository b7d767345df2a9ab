//! Inputs that several sub-commands take, read once and the same way, and never written over.

use std::path::Path;

use crate::error::InputError;
use crate::model::Model;
use crate::output::OutputFolder;
use crate::terminal::Terminal;

/// Reads a model and warns about keys that this version does not know.
pub(super) fn read_model(path: &Path, terminal: &Terminal) -> Result<Model, InputError> {
    let (model, warnings) = Model::read_with_warnings(path)?;
    for warning in warnings {
        terminal.warn(warning);
    }
    Ok(model)
}

/// Prepares `out` for files of the names `results`, which must replace neither the recording nor the model.
pub(super) fn results_folder(
    out: &Path,
    recording: &Path,
    model: &Path,
    results: &[&str],
) -> Result<OutputFolder, InputError> {
    let same = |one: &Path, other: &Path| match (one.canonicalize(), other.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        // what does not exist is nothing to overwrite
        _ => false,
    };
    if same(out, recording) {
        return Err(
            InputError::new(out, "is the folder of the recording itself")
                .channel("--out")
                .expected("another folder: results must not mix with their input"),
        );
    }
    if let Some(name) = results.iter().find(|name| same(&out.join(name), model)) {
        return Err(InputError::new(
            out,
            format!("holds the model, which the result {name} would replace"),
        )
        .channel("--out")
        .expected("another folder"));
    }
    OutputFolder::create(out)
}
