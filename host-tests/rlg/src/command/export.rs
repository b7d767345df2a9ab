//! `rlg export`: writes a recording as a file for other programs.

use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::json;
use trueaxis::counter_bank::FRAME_BYTES;

use crate::error::InputError;
use crate::export::sheet::{Sheet, sheets};
use crate::export::{bank_file, mat_file, mcap_file};
use crate::output::{OutputFolder, write_file};
use crate::recording::{About, Quantity, Recording};
use crate::terminal::Terminal;

/// What other programs open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Text with a header row, parted by commas
    Csv,
    /// MATLAB's MAT-file of version 5, a structure a table; Octave and SciPy open it too
    Mat,
    /// Parquet
    Parquet,
    /// MCAP with a topic a table and a JSON object a row, for Foxglove
    Mcap,
    /// Frames of version 3 of a counter bank: counts, pickoffs, slow channels, time since the pulse per second
    Bank,
}

/// Write a recording as CSV, MATLAB, Parquet, MCAP or frames of a counter bank
///
/// Values are in SI, with the unit in the column's name; t_s is the end of each row. rlg import reads CSV, MATLAB and
/// Parquet back, value for value. Of several tables CSV and Parquet are a file each: FILE, and FILE with the table's name
/// in its own.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg export recordings/bench-17 --out bench-17.mat\n  rlg export recordings/bench-17 --format csv --out bench-17.csv"
)]
pub struct Export {
    /// Folder with recording.toml
    recording: PathBuf,
    /// Format of the file [default: by its extension]
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// File to write
    #[arg(short, long, value_name = "FILE")]
    out: PathBuf,
}

impl Export {
    /// Reads the recording and writes the file, or the files.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let format = self.format()?;
        let name = self.out.file_name().ok_or_else(|| {
            InputError::new(&self.out, "is not the name of a file").expected("a file to write")
        })?;
        let parent = self.out.parent().filter(|parent| *parent != Path::new(""));
        let parent = parent.unwrap_or(Path::new("."));
        let recording = Recording::read(&self.recording)?;
        let sheets = sheets(&recording);
        let files: Vec<(PathBuf, &[Sheet])> = match format {
            Format::Mat | Format::Mcap | Format::Bank => vec![(name.into(), &sheets[..])],
            Format::Csv | Format::Parquet => file_names(Path::new(name), &sheets),
        };
        self.keep_input(parent, &files)?;
        if format == Format::Bank {
            return self.bank(&recording, terminal);
        }
        let mut out = OutputFolder::create(parent)?;
        for (name, sheets) in &files {
            self.write(format, name, sheets, &mut out)?;
        }
        out.commit()?;
        self.say(&recording, parent, &files, terminal)
    }

    /// Writes the frames of a counter bank.
    fn bank(&self, recording: &Recording, terminal: &Terminal) -> Result<(), InputError> {
        let bytes = bank_file::bytes(recording, &self.recording)?;
        write_file(&self.out, &bytes)?;
        let frames = bytes.len() / FRAME_BYTES;
        terminal.say(format!(
            "{}: {frames} frames of {FRAME_BYTES} bytes",
            self.out.display()
        ));
        let mut left: Vec<&str> = recording
            .channels()
            .map(|channel| &channel.quantity)
            .filter(|quantity| !bank_file::holds(quantity))
            .map(Quantity::name)
            .collect();
        left.sort_unstable();
        left.dedup();
        if !left.is_empty() {
            terminal.warn(format!("a bank's frames do not hold {}", left.join(", ")));
        }
        terminal.result(&json!({
            "recording": self.recording,
            "files": [{ "file": self.out, "frames": frames }],
        }))
    }

    fn format(&self) -> Result<Format, InputError> {
        let extension = self.out.extension().unwrap_or_default().to_string_lossy();
        let by_extension = || match extension.to_ascii_lowercase().as_str() {
            "csv" => Some(Format::Csv),
            "mat" => Some(Format::Mat),
            "parquet" | "pq" => Some(Format::Parquet),
            "mcap" => Some(Format::Mcap),
            "bank" => Some(Format::Bank),
            _ => None,
        };
        self.format.or_else(by_extension).ok_or_else(|| {
            InputError::new(&self.out, "has an extension that tells no format")
                .value(format!("{extension:?}"))
                .expected("--format csv|mat|parquet|mcap|bank")
        })
    }

    /// Refuses to write over the recording's own files.
    fn keep_input(&self, parent: &Path, files: &[(PathBuf, &[Sheet])]) -> Result<(), InputError> {
        let own = Recording::files(&self.recording)?;
        let is_own = |name: &PathBuf| {
            let there = parent.join(name).canonicalize();
            let mut own = own
                .iter()
                .map(|own| self.recording.join(own).canonicalize());
            own.any(|own| matches!((&there, own), (Ok(a), Ok(b)) if *a == b))
        };
        match files.iter().find(|(name, _)| is_own(name)) {
            Some((name, _)) => Err(InputError::new(
                parent.join(name),
                "is a file of the recording, which would be replaced",
            )
            .channel("--out")
            .expected("another file")),
            None => Ok(()),
        }
    }

    fn write(
        &self,
        format: Format,
        name: &Path,
        sheets: &[Sheet],
        out: &mut OutputFolder,
    ) -> Result<(), InputError> {
        let path = out.target().join(name);
        let fault = |error: std::io::Error| InputError::unwritable(&path, &error);
        match format {
            Format::Mat => out.write(name, &mat_file::bytes(&path, sheets)?),
            // Written by `bank`, from the recording itself.
            Format::Bank => Ok(()),
            Format::Parquet => {
                let bytes = sheets[0].to_table().to_parquet(&path)?;
                out.write(name, &bytes)
            }
            Format::Csv => {
                let mut file = BufWriter::new(out.file(name)?);
                sheets[0].write_csv(&mut file).map_err(fault)?;
                file.flush().map_err(fault)
            }
            Format::Mcap => {
                let start_s = About::read(&self.recording)?.start_s;
                let mut file = BufWriter::new(out.file(name)?);
                mcap_file::write(sheets, start_s, &mut file).map_err(|error| {
                    InputError::new(&path, format!("cannot be written ({error})"))
                })?;
                file.flush().map_err(fault)
            }
        }
    }

    fn say(
        &self,
        recording: &Recording,
        parent: &Path,
        files: &[(PathBuf, &[Sheet])],
        terminal: &Terminal,
    ) -> Result<(), InputError> {
        for (name, sheets) in files {
            for sheet in *sheets {
                let columns: Vec<&str> = sheet.columns.iter().map(|(name, _)| &**name).collect();
                terminal.say(format!(
                    "{}: {}, {} rows of {}",
                    parent.join(name).display(),
                    sheet.name,
                    sheet.rows(),
                    columns.join(", ")
                ));
            }
        }
        if recording.holds(&[Quantity::GyroCount]) {
            terminal.warn(
                "the weight of a pulse stands in the model, not here: rlg import asks for it as --unit gyro_count:WEIGHT*rad",
            );
        }
        if recording.site.is_some() || !recording.segments.is_empty() {
            terminal.warn("site and segments of recording.toml are not in the file");
        }
        let file = |(name, sheets): &(PathBuf, &[Sheet])| {
            let tables: Vec<_> = sheets
                .iter()
                .map(|sheet| {
                    let columns: Vec<_> = sheet.columns.iter().map(|(name, _)| name).collect();
                    json!({ "table": sheet.name, "rows": sheet.rows(), "columns": columns })
                })
                .collect();
            json!({ "file": parent.join(name), "tables": tables })
        };
        let files: Vec<_> = files.iter().map(file).collect();
        terminal.result(&json!({ "recording": self.recording, "files": files }))
    }
}

/// Returns a file name a table: `log.csv` for the first, `log-reference.csv` for others.
fn file_names<'a>(name: &Path, sheets: &'a [Sheet]) -> Vec<(PathBuf, &'a [Sheet])> {
    let stem = name.file_stem().unwrap_or_default().to_string_lossy();
    let extension = name
        .extension()
        .map(|extension| extension.to_string_lossy());
    let extension = extension.map_or_else(String::new, |extension| format!(".{extension}"));
    let of = |(place, sheet): (usize, &'a [Sheet])| match place {
        0 => (name.to_path_buf(), sheet),
        _ => (format!("{stem}-{}{extension}", sheet[0].name).into(), sheet),
    };
    sheets.chunks(1).enumerate().map(of).collect()
}
