//! Reads the results of one recording, as written by `rlg diagnose --out`.

use std::fs;
use std::path::{Path, PathBuf};

use rlg_findings::result::FORMAT;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::InputError;
use crate::json;
use crate::output::OutputFolder;
use crate::recording::About;

/// File that describes the inputs of a run.
pub const RUN_FILE: &str = "run.json";

/// File of the findings.
const DIAGNOSIS: &str = "diagnosis.json";

/// File of the page.
const PAGE: &str = "report.html";

/// `run.json`: the inputs of a run, and the reason if it has no diagnosis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunFile {
    /// Format of this file.
    format: u32,
    /// Circumstances of the recording, the first of several.
    about: About,
    /// Reason for which the input cannot be used.
    refused: Option<String>,
}

/// One run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Name of its folder.
    pub name: String,
    /// Its page, if it has one.
    pub page: Option<PathBuf>,
    /// Circumstances of the recording.
    pub about: About,
    /// Findings, or the reason if there are none.
    pub told: Result<Told, String>,
}

/// Fields of `diagnosis.json` used in the comparison of a fleet.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Told {
    /// Name of the recording.
    pub recording: String,
    /// Verdict in one word.
    pub verdict: String,
    /// Effects missing from the model.
    pub effects: Vec<Effect>,
    /// Kinds tested.
    pub sensitivity: Vec<Tested>,
}

/// An effect.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Effect {
    /// Contract's kind.
    pub kind: String,
    /// Kinds not distinguishable from it in the recording.
    pub indistinguishable_from: Vec<String>,
    /// Numbers and texts.
    pub parameters: Vec<Parameter>,
    /// p-value, corrected for the number of trials.
    pub p_value: f64,
    /// `named` or `class`.
    pub label: Option<String>,
}

/// A parameter of an effect: a number with its standard deviation and unit, or a text.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Parameter {
    /// Contract's name.
    pub name: String,
    /// A number, SI, or a text.
    pub value: Value,
    /// Standard deviation of a number.
    pub std: Option<f64>,
    /// Unit of a number.
    pub unit: Option<String>,
}

/// A kind that was tested.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Tested {
    /// Kind.
    pub kind: String,
    /// Typical size, SI.
    pub typical: f64,
    /// Matched-filter SNR at that size.
    pub snr: f64,
}

/// Returns the circumstances of a recording known by its folder's name alone.
fn unknown(folder: &Path) -> About {
    About {
        recording: name(folder),
        instrument: None,
        start: None,
        start_s: None,
        temperature_k: None,
    }
}

fn name(folder: &Path) -> String {
    let last = folder.file_name().unwrap_or(folder.as_os_str());
    last.to_string_lossy().into_owned()
}

impl RunFile {
    /// Describes a recording that was diagnosed.
    pub fn diagnosed(about: About) -> Self {
        Self {
            format: 1,
            about,
            refused: None,
        }
    }

    /// Describes a recording that cannot be used.
    pub fn refused(recording: &Path, error: &InputError) -> Self {
        Self {
            format: 1,
            about: About::read(recording)
                .or_else(|_| About::of_manifest(recording))
                .unwrap_or_else(|_| unknown(recording)),
            refused: Some(error.to_string()),
        }
    }

    /// Adds the file to `out`.
    pub fn write_into(&self, out: &mut OutputFolder) -> Result<(), InputError> {
        let json = json::text(self, out.target())?;
        out.write(RUN_FILE, json.as_bytes())
    }
}

impl Run {
    /// True if the folder holds results of a run.
    fn is_one(folder: &Path) -> bool {
        [RUN_FILE, DIAGNOSIS]
            .iter()
            .any(|file| folder.join(file).is_file())
    }

    /// Returns the folders of runs among `given`: each itself, or those right below it, in the order of their paths.
    ///
    /// # Errors
    /// A folder that is not a run and has none below it.
    pub fn folders(given: &[PathBuf]) -> Result<Vec<PathBuf>, InputError> {
        let mut found = Vec::new();
        for folder in given {
            if Self::is_one(folder) {
                found.push(folder.clone());
                continue;
            }
            let entries = fs::read_dir(folder);
            let entries = entries.map_err(|error| InputError::unreadable(folder, &error))?;
            let below = entries.flatten().map(|entry| entry.path());
            let before = found.len();
            found.extend(below.filter(|path| Self::is_one(path)));
            if found.len() == before {
                return Err(
                    InputError::new(folder, "holds no results").expected(format!(
                        "{DIAGNOSIS} of rlg diagnose --out, in it or in folders right below it"
                    )),
                );
            }
        }
        found.sort();
        found.dedup();
        Ok(found)
    }

    /// Reads a run. Unreadable results are a run without a diagnosis, with the reason as a sentence.
    pub fn read(folder: &Path) -> Self {
        let file: Result<Option<RunFile>, InputError> = read_json(&folder.join(RUN_FILE));
        let (about, refused) = match file {
            Ok(Some(file)) => (Some(file.about), file.refused),
            Ok(None) => (None, None),
            Err(error) => (None, Some(error.to_string())),
        };
        let told: Result<Told, String> = match refused {
            Some(sentence) => Err(sentence),
            None => read_json(&folder.join(DIAGNOSIS))
                .and_then(|told| {
                    told.ok_or_else(|| InputError::new(folder.join(DIAGNOSIS), "does not exist"))
                })
                .map_err(|error| error.to_string()),
        };
        let about = about.unwrap_or_else(|| About {
            recording: told
                .as_ref()
                .map_or_else(|_| name(folder), |told| told.recording.clone()),
            ..unknown(folder)
        });
        Self {
            name: name(folder),
            page: Some(folder.join(PAGE)).filter(|page| page.is_file()),
            about,
            told,
        }
    }

    /// Returns the instrument's name in the recording, or else the run's.
    pub fn instrument(&self) -> &str {
        self.about.instrument.as_deref().unwrap_or(&self.name)
    }

    /// True if the instrument is known: named, or a recording of its own that could be used.
    pub fn has_instrument(&self) -> bool {
        self.about.instrument.is_some() || self.told.is_ok()
    }
}

/// Version of a file's form.
#[derive(Deserialize)]
struct Form {
    format: Option<u32>,
}

/// Reads a file; `None` if it does not exist.
fn read_json<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<Option<T>, InputError> {
    if !path.is_file() {
        return Ok(None);
    }
    let text = fs::read_to_string(path).map_err(|error| InputError::unreadable(path, &error))?;
    if let Ok(Form {
        format: Some(other),
    }) = serde_json::from_str(&text)
        && other != FORMAT
    {
        return Err(
            InputError::new(path, "is in a form that this version does not read")
                .value(format!("format {other}"))
                .expected(format!("format {FORMAT}")),
        );
    }
    serde_json::from_str(&text).map(Some).map_err(|error| {
        InputError::new(path, format!("is no result of this version ({error})"))
            .expected("a file as rlg diagnose writes it")
    })
}
