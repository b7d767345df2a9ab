//! Reads the inputs shared by several sub-commands, once and the same way, and never writes over them.

use std::path::{Path, PathBuf};

use crate::error::InputError;
use crate::import::still;
use crate::model::{Model, MotionSource};
use crate::output::OutputFolder;
use crate::plausibility::{self, Bounds};
use crate::recording::{MANIFEST, Quantity, Recording};
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
        // a path that does not exist cannot be overwritten
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
    refuse_foreign(out, results)?;
    OutputFolder::create(out)
}

/// Refuses a folder with files in it, unless a JSON file among `results` marks them as earlier results.
pub(super) fn refuse_foreign(out: &Path, results: &[&str]) -> Result<(), InputError> {
    let mut earlier = results.iter().filter(|name| name.ends_with(".json"));
    if earlier.any(|name| out.join(name).is_file()) {
        return Ok(());
    }
    let Ok(entries) = out.read_dir() else {
        // A new folder, or one that cannot be written either.
        return Ok(());
    };
    let names = entries
        .filter_map(Result::ok)
        .map(|entry| entry.file_name());
    let names = names.map(|name| name.to_string_lossy().into_owned());
    match names.filter(|name| !name.starts_with('.')).min() {
        None => Ok(()),
        Some(foreign) => {
            let what = match out.join(MANIFEST).is_file() {
                true => "another recording",
                false => &foreign,
            };
            let problem = format!("holds {what}, and no earlier result of this command");
            Err(InputError::new(out, problem)
                .channel("--out")
                .expected("a new or empty folder, or one of earlier results"))
        }
    }
}

/// Refuses an implausible recording, or prints a warning if the caller takes it `anyway`.
pub(super) fn check_plausible(
    folder: &Path,
    recording: &Recording,
    model: &Model,
    anyway: bool,
    terminal: &Terminal,
) -> Result<(), InputError> {
    if let Some(doubt) = plausibility::doubt(recording, model, &Bounds::default()) {
        terminal.warn(doubt);
    }
    match plausibility::check(folder, recording, model, &Bounds::default()) {
        Err(doubt) if anyway => {
            terminal.warn(doubt);
            Ok(())
        }
        other => other,
    }
}

/// Name of the model in messages if none is given.
pub(super) const IDEAL: &str = "the ideal model";

/// Reads the model of a recording from `path`, or if none is given makes an ideal unit of the recording's kind.
///
/// # Returns
/// The model, the path for messages, and the line about the assumed model.
pub(super) fn given_or_ideal(
    path: Option<&Path>,
    recording: &Path,
    terminal: &Terminal,
) -> Result<(Model, PathBuf, Option<String>), InputError> {
    if let Some(path) = path {
        return Ok((read_model(path, terminal)?, path.to_path_buf(), None));
    }
    let model = ideal(recording)?;
    let note = assumed(&model);
    Ok((model, PathBuf::from(IDEAL), Some(note)))
}

/// Formats the line about an assumed ideal unit.
pub(super) fn assumed(model: &Model) -> String {
    let motion = match model.motion {
        MotionSource::Reference => "with the motion of the reference, which rotates with the Earth",
        MotionSource::Static => "on the turning Earth, without a reference of its motion",
    };
    format!(
        "Assumed, as no --model is given: an ideal unit, {motion}; no bias, no scale error, noise as measured."
    )
}

/// Makes an ideal unit of a recording's kind.
pub fn ideal(recording: &Path) -> Result<Model, InputError> {
    let quantities = Recording::quantities(recording)?;
    if quantities.contains(&Quantity::GyroCount) {
        let beside = recording.join("model.toml");
        let known = match beside.is_file() {
            true => format!(", as {}", beside.display()),
            false => String::new(),
        };
        return Err(InputError::new(
            recording,
            "counts pulses, and nothing says what angle one stands for",
        )
        .channel("--model")
        .expected(format!("a model with pulse_weight_rad{known}")));
    }
    Ok(still::ideal([0.0; 3], &quantities))
}
