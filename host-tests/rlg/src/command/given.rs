//! Recordings as named on the command line: folders as they are, foreign files imported into a scratch folder.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde_json::Value;

use super::import_format::Format;
use crate::error::InputError;
use crate::import::still::name_of;
use crate::output::ScratchFolder;
use crate::recording::MANIFEST;
use crate::terminal::{Listener, Terminal};

/// Recordings with their folders; a scratch folder is removed with this value.
pub(super) struct Given {
    recordings: Vec<One>,
    scratch: Option<ScratchFolder>,
    /// Warnings of the import, which the diagnosis does not repeat.
    warned: Mutex<Vec<String>>,
}

/// One recording.
struct One {
    /// Path on the command line.
    named: PathBuf,
    /// Folder with `recording.toml`.
    folder: PathBuf,
}

/// True if a path is a file that an import reads without `--format`, not the folder of a recording.
fn is_foreign(path: &Path) -> bool {
    let is_manifest = path.file_name().is_some_and(|name| name == MANIFEST);
    path.is_file() && !is_manifest && Format::of_file(path).is_ok()
}

impl Given {
    /// Imports the foreign files among `recordings`; prints the import's warnings, and what each column was taken for.
    ///
    /// # Errors
    /// Those of `rlg import` without options, its questions included.
    pub(super) fn read(
        recordings: &[PathBuf],
        anyway: bool,
        terminal: &Terminal,
    ) -> Result<Self, InputError> {
        let mut given = Self {
            recordings: Vec::with_capacity(recordings.len()),
            scratch: None,
            warned: Mutex::default(),
        };
        if recordings.iter().any(|path| is_foreign(path)) {
            given.scratch = Some(ScratchFolder::new()?);
        }
        for named in recordings {
            let folder = match &given.scratch {
                Some(scratch) if is_foreign(named) => {
                    // The folder's last part is the recording's name on the page.
                    let beside = scratch.path().join(given.recordings.len().to_string());
                    beside.join(name_of(named))
                }
                _ => named.clone(),
            };
            given.recordings.push(One {
                named: named.clone(),
                folder,
            });
            if let Some(one) = given.recordings.last().filter(|one| one.is_imported()) {
                given.import(one, anyway, terminal)?;
            }
        }
        Ok(given)
    }

    /// Runs `rlg import` of a file.
    fn import(&self, one: &One, anyway: bool, terminal: &Terminal) -> Result<(), InputError> {
        let mut arguments: Vec<OsString> = ["import", "--out"].map(OsString::from).into();
        arguments.push(one.folder.clone().into());
        if anyway {
            arguments.push("--anyway".into());
        }
        arguments.extend(["--".into(), one.named.clone().into()]);
        let listener = Listener::new(|_| ());
        let imported = super::run_in_process(arguments, &Terminal::heard_by(listener.clone()));
        let heard = listener.take();
        for warning in heard.warnings {
            self.warn(&warning, terminal);
        }
        imported.map_err(|error| self.renamed(error))?;
        if let Some(told) = heard.json.and_then(|json| serde_json::from_str(&json).ok()) {
            for line in taken(&one.named, &told) {
                terminal.note(line);
            }
        }
        Ok(())
    }

    /// Returns the folders with `recording.toml`.
    pub(super) fn folders(&self) -> Vec<PathBuf> {
        self.recordings
            .iter()
            .map(|one| one.folder.clone())
            .collect()
    }

    /// Returns the files that were imported, in the place of their folders.
    pub(super) fn imported(&self, folder: &Path) -> Option<&Path> {
        let mut imported = self.recordings.iter().filter(|one| one.is_imported());
        let one = imported.find(|one| one.folder == folder)?;
        Some(&one.named)
    }

    /// Returns the model written by the import of the first recording, if it is imported.
    pub(super) fn model(&self) -> Option<PathBuf> {
        let first = self.recordings.first().filter(|one| one.is_imported())?;
        Some(first.folder.join("model.toml")).filter(|file| file.is_file())
    }

    /// Prints a warning once, under the paths of the command line.
    pub(super) fn warn(&self, warning: &str, terminal: &Terminal) {
        let warning = self.said(warning);
        // A list of whole sentences, whoever panicked.
        let mut warned = self.warned.lock().unwrap_or_else(PoisonError::into_inner);
        if self.scratch.is_none() || !warned.contains(&warning) {
            terminal.warn(&warning);
            warned.push(warning);
        }
    }

    /// Replaces paths in the scratch folder by those of the command line.
    pub(super) fn renamed(&self, error: InputError) -> InputError {
        if self.scratch.is_none() {
            return error;
        }
        let file = self.said(&error.file.to_string_lossy());
        let mut renamed = InputError::new(file, self.said(&error.problem));
        if let Some(channel) = &error.channel {
            renamed = renamed.channel(self.said(channel));
        }
        if let Some(row) = error.row {
            renamed = renamed.row(row);
        }
        if let Some(value) = &error.value {
            renamed = renamed.value(self.said(value));
        }
        match &error.expected {
            Some(expected) => renamed.expected(self.said(expected)),
            None => renamed,
        }
    }

    fn said(&self, text: &str) -> String {
        let imported = self.recordings.iter().filter(|one| one.is_imported());
        imported.fold(text.to_owned(), |text, one| {
            let [folder, named] = [&one.folder, &one.named].map(|path| path.display().to_string());
            // The scratch folder goes: the command to paste needs one that stays.
            text.replace(&format!("--out {folder}"), "--out DIR")
                .replace(&folder, &named)
        })
    }
}

impl One {
    fn is_imported(&self) -> bool {
        self.folder != self.named
    }
}

/// Formats what the columns of a file were taken for, a line a table, then what was left out.
fn taken(file: &Path, told: &Value) -> Vec<String> {
    let list = |key: &str| told[key].as_array().map_or(&[][..], Vec::as_slice);
    let word = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let mut lines = Vec::new();
    for table in list("tables") {
        let own = list("channels").iter();
        let own = own.filter(|channel| channel["table"] == table["file"]);
        let mut quantities: Vec<(String, Vec<String>)> = Vec::new();
        for channel in own {
            let (quantity, axis) = (word(&channel["quantity"]), word(&channel["axis"]));
            match quantities.iter_mut().find(|(known, _)| *known == quantity) {
                Some((_, axes)) => axes.push(axis),
                None => quantities.push((quantity, vec![axis])),
            }
        }
        let each = quantities.iter().map(|(quantity, axes)| {
            let text = format!("{quantity} {}", axes.join(" "));
            text.trim_end().to_owned()
        });
        let rate = table["rate_hz"].as_f64();
        let rate = rate.map_or_else(|| "with stamps".to_owned(), |rate| format!("at {rate} Hz"));
        lines.push(format!(
            "{}: {} rows {rate}: {}",
            file.display(),
            table["rows"],
            each.collect::<Vec<_>>().join(", ")
        ));
    }
    for left in list("left_out") {
        lines.push(format!(
            "  left out: {}: {}",
            word(&left["column"]),
            word(&left["reason"])
        ));
    }
    lines
}
