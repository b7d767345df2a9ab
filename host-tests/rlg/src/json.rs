//! Text of a result file in JSON.

use std::path::Path;

use serde::Serialize;

use crate::error::InputError;

/// Formats a result with a line break behind it; `of` is the file or folder that it is written to.
///
/// # Errors
/// The result has no JSON form.
pub fn text(result: &impl Serialize, of: &Path) -> Result<String, InputError> {
    let mut text = serde_json::to_string_pretty(result)
        .map_err(|error| InputError::new(of, format!("the result has no JSON form ({error})")))?;
    text.push('\n');
    Ok(text)
}
