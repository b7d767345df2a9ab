//! Gathers the content of a diagnosis' page beyond the diagnosis: provenance of recording and model, and the noise declared
//! by the model.

use std::io;
use std::path::Path;

use indicatif::ProgressBar;

use super::given::Given;
use crate::error::InputError;
use crate::import::hashed::Hashed;
use crate::model::{DeclaredModel, Model};
use crate::recording::Recording;
use crate::report::beside::{Beside, Declared};

/// Hexadecimal digits of a sum on the page: enough to distinguish files.
const DIGITS: usize = 16;

/// Largest number of recordings with a sum for each file.
const MOST_SUMMED: usize = 3;

/// Gathers provenance and declared noise; rates are added by the caller that has the rows. Of an imported file the sum is
/// its own: the recording made of it is removed.
pub(super) fn gather(
    given: &Given,
    of: DeclaredModel<'_>,
    note: Option<&str>,
) -> Result<Beside, InputError> {
    let DeclaredModel { model, file } = of;
    let mut provenance = Vec::new();
    let recordings = given.folders();
    for folder in &recordings {
        let shown = given.imported(folder).unwrap_or(folder);
        provenance.push(("recording", name(shown)));
        if let Some(start) = Recording::start(folder)? {
            provenance.push(("start", start));
        }
    }
    provenance.push(("model", name(file)));
    for folder in recordings.iter().take(MOST_SUMMED) {
        if let Some(file) = given.imported(folder) {
            provenance.push(("SHA-256", format!("{} {}", sum(file)?, name(file))));
            continue;
        }
        // Files of several recordings have the same names.
        let of = match recordings.len() {
            1 => String::new(),
            _ => format!("{}/", name(folder)),
        };
        for file in Recording::files(folder)? {
            let sum = sum(&folder.join(&file))?;
            provenance.push(("SHA-256", format!("{sum} {of}{file}")));
        }
    }
    if file.is_file() {
        provenance.push(("SHA-256", format!("{} {}", sum(file)?, name(file))));
    }
    Ok(Beside {
        provenance,
        note: note.map(str::to_owned),
        declared: declared(model),
        rates: Vec::new(),
        timings: Vec::new(),
    })
}

/// Returns the noise declared by a model.
pub(super) fn declared(model: &Model) -> Declared {
    Declared {
        angle_random_walk_rad_sqrt_s: model.gyro.angle_random_walk_rad_sqrt_s,
        bias_instability_rad_s: model.gyro.flicker_rad_s,
        rate_random_walk_rad_s_sqrt_s: model.gyro.rate_random_walk_rad_s_sqrt_s,
    }
}

/// Returns the last part of a path: folders of one machine mean nothing on another.
fn name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Computes the first digits of a file's SHA-256, as printed by `sha256sum`.
fn sum(path: &Path) -> Result<String, InputError> {
    let (mut reader, _) = Hashed::open(path, &ProgressBar::hidden())?;
    io::copy(&mut reader, &mut io::sink()).map_err(|error| InputError::unreadable(path, &error))?;
    Ok(format!("{}…", &reader.into_inner().sum()[..DIGITS]))
}
