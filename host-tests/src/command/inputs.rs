//! Inputs that several sub-commands take, read once and the same way.

use std::path::Path;

use crate::error::InputError;
use crate::model::Model;
use crate::terminal::Terminal;

/// Reads a model and warns about keys that this version passes over.
pub(super) fn read_model(path: &Path, terminal: &Terminal) -> Result<Model, InputError> {
    let (model, warnings) = Model::read_with_warnings(path)?;
    for warning in warnings {
        terminal.warn(warning);
    }
    Ok(model)
}
