//! Parsed file of a scenario or an instrument: its sections with their places.
//!
//! From TOML text and its path, a [`Source`], whose sections are read as [`Entry`], so that every error has file and line.
//! Numbers are checked when the sections are read.

use crate::entry::Entry;
use crate::entry::line_of;
use rlg_recording::error::InputError;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// A file's sections with their places.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct File {
    pub format: i64,
    pub name: Option<String>,
    pub rate_hz: Option<Spanned<f64>>,
    pub start_s: Option<f64>,
    pub attitude_wxyz: Option<[f64; 4]>,
    pub instrument: Option<Spanned<String>>,
    pub site: Option<Spanned<toml::Table>>,
    pub gyro: Option<Spanned<toml::Table>>,
    pub dither: Option<Spanned<toml::Table>>,
    pub reference: Option<Spanned<toml::Table>>,
    pub fibre_optic: Option<Spanned<toml::Table>>,
    pub encoder: Option<Spanned<toml::Table>>,
    pub accelerometer: Option<Spanned<toml::Table>>,
    pub thermal: Option<Spanned<toml::Table>>,
    pub magnetic: Option<Spanned<toml::Table>>,
    pub isolator: Option<Spanned<toml::Table>>,
    pub slow_channels: Option<Spanned<toml::Table>>,
    #[serde(default)]
    pub fault: Vec<Spanned<toml::Table>>,
    #[serde(default)]
    pub motion: Vec<Spanned<toml::Table>>,
    #[serde(default)]
    pub effect: Vec<Spanned<toml::Table>>,
}

/// Parsed file: its sections, and its text for the line numbers of errors.
pub struct Source {
    pub path: PathBuf,
    pub text: String,
    pub file: File,
}

impl Source {
    pub fn parse(text: &str, path: &Path) -> Result<Self, InputError> {
        let file: File = toml::from_str(text).map_err(|error| {
            let line = error.span().map_or(1, |span| line_of(text, span.start));
            InputError::new(path, format!("line {line}: {}", error.message()))
        })?;
        if file.format != 1 {
            return Err(InputError::new(path, "is of another format number")
                .channel("format")
                .value(file.format)
                .expected("1"));
        }
        Ok(Self {
            path: path.to_path_buf(),
            text: text.to_owned(),
            file,
        })
    }

    pub fn entry<'a>(&'a self, table: &Spanned<toml::Table>) -> Entry<'a> {
        Entry::new(&self.path, &self.text, table.span().start, table.get_ref())
    }

    /// Error at a top-level key.
    pub fn error(&self, key: &str, problem: &str) -> InputError {
        Entry::new(&self.path, &self.text, 0, &toml::Table::new()).error(key, problem)
    }
}

type Section = fn(&File) -> Option<&Spanned<toml::Table>>;

/// Sections of an instrument by name.
pub const SECTIONS: [(&str, Section); 10] = [
    ("gyro", |file| file.gyro.as_ref()),
    ("dither", |file| file.dither.as_ref()),
    ("reference", |file| file.reference.as_ref()),
    ("fibre_optic", |file| file.fibre_optic.as_ref()),
    ("encoder", |file| file.encoder.as_ref()),
    ("accelerometer", |file| file.accelerometer.as_ref()),
    ("thermal", |file| file.thermal.as_ref()),
    ("magnetic", |file| file.magnetic.as_ref()),
    ("isolator", |file| file.isolator.as_ref()),
    ("slow_channels", |file| file.slow_channels.as_ref()),
];

pub fn text_of(path: &Path) -> Result<String, InputError> {
    std::fs::read_to_string(path).map_err(|error| InputError::unreadable(path, &error))
}

/// File of the instrument, if the scenario names one.
pub fn instrument_of(own: &Source) -> Result<Option<Source>, InputError> {
    let Some(name) = &own.file.instrument else {
        return Ok(None);
    };
    let path = own
        .path
        .parent()
        .unwrap_or(Path::new(""))
        .join(name.get_ref());
    let source = Source::parse(&text_of(&path)?, &path)?;
    let file = &source.file;
    for (key, there) in [
        ("name", false),
        ("rate_hz", file.rate_hz.is_some()),
        ("start_s", file.start_s.is_some()),
        ("attitude_wxyz", file.attitude_wxyz.is_some()),
        ("instrument", file.instrument.is_some()),
        ("site", file.site.is_some()),
        ("motion", !file.motion.is_empty()),
        ("fault", !file.fault.is_empty()),
    ] {
        if there {
            return Err(source
                .error(key, "belongs to a scenario")
                .expected("an instrument: gyro, dither, reference, ..., effect"));
        }
    }
    for (name, find) in SECTIONS {
        if let Some((table, _)) = find(&own.file).zip(find(file)) {
            return Err(own
                .entry(table)
                .error(name, "stands in the instrument too")
                .value(path.display())
                .expected("one of them"));
        }
    }
    Ok(Some(source))
}
