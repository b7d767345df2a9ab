//! `rlg import`: writes a foreign stream as a recording.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use trueaxis::health::item;
use trueaxis::{SelfTest, Status};

use super::import_columns::ColumnOptions;
use super::import_counts::Destination;
use super::import_format::Format;
use super::import_said::Request;
use super::{import_bank, import_raw};
use crate::error::InputError;
use crate::import::files::columns::Column;
use crate::import::frames::{self, Imported};
use crate::import::hashed::Hashed;
use crate::import::known::{self, Known};
use crate::import::still::{self, Foreign, WITHOUT_SITE};
use crate::import::{f64x7, psins_imu};
use crate::recording::{MANIFEST, Recording, Site};
use crate::terminal::Terminal;

/// Relative difference between the caller's rate and the unit's above which a warning is printed: a crystal is within 1e-4,
/// an internal oscillator within 1e-2.
const RATE_MISMATCH: f64 = 0.02;

/// Import a table of numbers, a captured stream or a foreign file as a recording
///
/// CSV, MATLAB, HDF5 and Parquet: columns are known by their usual names and by the units beside them; what was taken
/// is printed, and what is not known is asked for. It also writes OUT/model.toml, an ideal unit, so that rlg diagnose runs
/// at once. Several files may be given, as one of the gyros and one of the reference.
///
/// f64x7, psins-imu: where the site is known (--latitude-deg and --gravity, the file itself, or a file whose source the project
/// knows) it also writes OUT/model.toml: at rest on the turning Earth, white noise, nominal clock.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  rlg import log.csv --out flight\n  rlg import log.csv --unit gyro_rate:deg/s --time stamp:ms --out flight\n  rlg import run.mat --map quat=reference_attitude:wxyz --rate 200 --out run\n  rlg import capture.bin --format frames --out flight\n  rlg import raw.bin --out run    # the unit's raw stream, known by its bytes\n  rlg import spi.bin --params params.bin --out run    # frames of the counter bank\n  rlg import x_LN100_up.ins --format f64x7 --latitude-deg 51.0447 --gravity 9.80841 --out out/ln100\n  rlg import lasergyro.imu --format psins-imu --sha256 SHA256SUMS --out out/lasergyro\n\nCapture the unit's serial port as it is, e.g.\n  stty -F /dev/ttyUSB0 1000000 raw && cat /dev/ttyUSB0 > capture.bin"
)]
pub struct Import {
    /// Files to import; more than one only of columns
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Format of the files [default: by the extension, or by the unit's frames in the file]
    #[arg(long, value_enum)]
    format: Option<Format>,
    #[command(flatten)]
    columns: ColumnOptions,
    /// Rows a second [Hz]; needed only if the file does not say it
    #[arg(long, visible_alias = "rate")]
    rate_hz: Option<f64>,
    /// Geodetic latitude of the site [deg]; not for frames
    #[arg(long, requires = "gravity", allow_negative_numbers = true)]
    latitude_deg: Option<f64>,
    /// Gravity at the site [m/s^2]; not for frames
    #[arg(long, requires = "latitude_deg")]
    gravity: Option<f64>,
    /// SHA-256 that the file must have: 64 digits, or a file of `SUM  NAME` lines; not for frames
    #[arg(long)]
    sha256: Option<String>,
    /// Parameter block of the unit, for rate and weights of a bank's frames
    #[arg(long, value_name = "BLOCK")]
    params: Option<PathBuf>,
    /// Folder for the recording: new, empty, or a recording to replace
    #[arg(short, long)]
    out: PathBuf,
}

/// Model of a unit at rest, in the recording's folder.
const MODEL: &str = "model.toml";

impl Import {
    /// Creates the import of a file whose source the project knows, or that states its own site.
    pub(super) fn file(file: &Path, format: Format, out: &Path) -> Self {
        Self {
            files: vec![file.to_path_buf()],
            format: Some(format),
            columns: ColumnOptions::default(),
            rate_hz: None,
            latitude_deg: None,
            gravity: None,
            sha256: None,
            params: None,
            out: out.to_path_buf(),
        }
    }

    /// Writes a recording of columns in memory, treated as those of a file; `FILE` is then their name.
    pub(super) fn run_on(
        &self,
        columns: Vec<Column>,
        terminal: &Terminal,
    ) -> Result<(), InputError> {
        self.check_rate()?;
        self.columns(Some(columns), terminal)
    }

    fn check_rate(&self) -> Result<(), InputError> {
        if let Some(rate_hz) = self.rate_hz
            && !(rate_hz.is_finite() && rate_hz > 0.0)
        {
            return Err(
                InputError::new(self.file_itself(), "cannot be read at this rate")
                    .channel("--rate-hz")
                    .value(rate_hz)
                    .expected("a positive number of frames a second"),
            );
        }
        Ok(())
    }

    /// Imports the file, writes the recording and reports its content.
    pub fn run(&self, terminal: &Terminal) -> Result<(), InputError> {
        let file = self.file_itself();
        self.check_rate()?;
        let format = match self.format {
            Some(format) => format,
            None => Format::of_file(file)?,
        };
        if self.params.is_some() && format != Format::Bank {
            return Err(InputError::new(file, "holds no frames of a counter bank")
                .channel("--params")
                .expected("a file in --format bank"));
        }
        if format.has_columns() {
            return self.columns(None, terminal);
        }
        if self.files.len() > 1 || !self.columns.is_empty() {
            return Err(InputError::new(file, "holds no columns with names")
                .channel("--map, --unit, --time, --euler or a second file")
                .expected("a file in --format csv|mat|hdf5|parquet"));
        }
        if format == Format::Raw {
            return self.raw(terminal);
        }
        if format == Format::Bank {
            return self.bank(terminal);
        }
        if format != Format::Frames {
            return self.foreign(format, terminal);
        }
        let bytes = fs::read(file).map_err(|error| InputError::unreadable(file, &error))?;
        let imported = frames::import(file, &bytes, self.rate_hz, &self.out)?;
        self.keep_input(&[frames::TABLE, MANIFEST])?;
        let mut out = Recording::create_folder(&self.out)?;
        imported.recording.write_into(&mut out)?;
        out.commit()?;
        self.say(terminal, &imported);
        self.result(terminal, &imported)
    }

    /// Returns the file, or the first of several.
    fn file_itself(&self) -> &Path {
        &self.files[0]
    }

    /// Reads files with columns, or takes those in memory.
    fn columns(
        &self,
        in_memory: Option<Vec<Column>>,
        terminal: &Terminal,
    ) -> Result<(), InputError> {
        let site = self.site()?;
        self.keep_input(&[still::TABLE, "reference.parquet", MANIFEST, MODEL])?;
        let out = Recording::create_folder(&self.out)?;
        let request = Request {
            files: &self.files,
            format: self.format,
            rate_hz: self.rate_hz,
            site,
            sha256: self.sha256.as_deref(),
            target: &self.out,
        };
        self.columns.run(&request, in_memory, out, terminal)
    }

    /// Reads the unit's raw stream.
    fn raw(&self, terminal: &Terminal) -> Result<(), InputError> {
        let site = self.site()?;
        let [samples, slow] = crate::import::raw::TABLES;
        self.keep_input(&[samples, slow, MANIFEST, MODEL])?;
        let request = import_raw::Request {
            file: self.file_itself(),
            rate_hz: self.rate_hz,
            destination: Destination {
                site,
                target: &self.out,
                model: MODEL,
            },
        };
        import_raw::run(&request, Recording::create_folder(&self.out)?, terminal)
    }

    /// Reads frames of a counter bank.
    fn bank(&self, terminal: &Terminal) -> Result<(), InputError> {
        if self.rate_hz.is_some() {
            return Err(
                InputError::new(self.file_itself(), "has the rate of the parameter block")
                    .channel("--rate-hz")
                    .expected("--params alone"),
            );
        }
        let site = self.site()?;
        let [samples, slow] = crate::import::bank::TABLES;
        self.keep_input(&[samples, slow, MANIFEST, MODEL])?;
        let request = import_bank::Request {
            file: self.file_itself(),
            params: self.params.as_deref(),
            destination: Destination {
                site,
                target: &self.out,
                model: MODEL,
            },
        };
        import_bank::run(&request, Recording::create_folder(&self.out)?, terminal)
    }

    /// Refuses to write over the input.
    fn keep_input(&self, names: &[&str]) -> Result<(), InputError> {
        let same = |name: &str| {
            let there = self.out.join(name).canonicalize();
            let mut here = self.files.iter().map(|file| file.canonicalize());
            here.any(|here| matches!((&there, here), (Ok(a), Ok(b)) if *a == b))
        };
        match names.iter().find(|name| same(name)) {
            Some(name) => {
                let problem =
                    format!("holds the input, which the recording's {name} would replace");
                Err(InputError::new(&self.out, problem)
                    .channel("--out")
                    .expected("another folder"))
            }
            None => Ok(()),
        }
    }

    /// Reads a foreign file, row by row.
    fn foreign(&self, format: Format, terminal: &Terminal) -> Result<(), InputError> {
        let file = self.file_itself();
        let site = self.site()?;
        let expected = self
            .sha256
            .as_deref()
            .map(|given| known::expected_sum(file, given))
            .transpose()?;
        self.keep_input(&[still::TABLE, MANIFEST, MODEL])?;
        let mut out = Recording::create_folder(&self.out)?;
        let bar = terminal.bar(0, "reading");
        let (mut source, length) = Hashed::open(file, &bar)?;
        let read = match format {
            Format::PsinsImu => psins_imu::import(file, &mut source, self.rate_hz, site, &mut out),
            _ => f64x7::import(file, &mut source, length, self.rate_hz, site, &mut out),
        };
        bar.finish_and_clear();
        let mut foreign = read?;
        let sha256 = source.into_inner().sum();
        known::check(file, &sha256, expected.as_deref())?;
        let source = Known::of(&sha256);
        if foreign.recording.site.is_none() {
            foreign.recording.site = source.and_then(Known::site);
        }
        foreign.recording.write_manifest_into(&mut out)?;
        let model = still::model(foreign.resolution_rad);
        model.check(&self.out.join(MODEL))?;
        out.write(MODEL, model.to_toml().as_bytes())?;
        out.commit()?;
        self.say_foreign(terminal, &foreign, source, expected.is_some());
        terminal.result(&json!({
            "recording": self.out,
            "rows": foreign.rows,
            "rate_hz": foreign.rate_hz,
            "stamped_rate_hz": foreign.stamped_rate_hz,
            "sha256": sha256,
            "source": source.map(|known| known.source),
            "latitude_rad": foreign.recording.site.map(|site| site.latitude_rad),
            "gravity_m_s2": foreign.recording.site.map(|site| site.gravity_m_s2),
        }))
    }

    /// Returns the caller's site.
    fn site(&self) -> Result<Option<Site>, InputError> {
        let (Some(latitude_deg), Some(gravity_m_s2)) = (self.latitude_deg, self.gravity) else {
            return Ok(None);
        };
        let fault = |key: &str, value: f64, expected: &str| {
            Err(
                InputError::new(self.file_itself(), "cannot have been recorded at this site")
                    .channel(key)
                    .value(value)
                    .expected(expected),
            )
        };
        if !(-90.0..=90.0).contains(&latitude_deg) {
            return fault("--latitude-deg", latitude_deg, "-90 to 90 degrees");
        }
        // Gravity on the ground is 9.76 to 9.83 m/s^2.
        if !(9.7..=9.9).contains(&gravity_m_s2) {
            return fault("--gravity", gravity_m_s2, "9.7 to 9.9 m/s^2");
        }
        Ok(Some(Site {
            latitude_rad: latitude_deg.to_radians(),
            gravity_m_s2,
        }))
    }

    fn say_foreign(
        &self,
        terminal: &Terminal,
        foreign: &Foreign,
        source: Option<&Known>,
        checked: bool,
    ) {
        terminal.say(format!(
            "{}: {} rows at {} Hz in {}",
            self.file_itself().display(),
            foreign.rows,
            foreign.rate_hz,
            self.out.display()
        ));
        match (source, checked) {
            (Some(known), _) => terminal.say(format!("{} from {}", known.name, known.source)),
            (None, true) => terminal.say("the sha256 is the one given"),
            (None, false) => {
                terminal.warn("no sha256 was given, and the file is none that is known")
            }
        }
        if foreign.recording.site.is_none() {
            terminal.warn(WITHOUT_SITE);
        }
        terminal.say(format!(
            "To diagnose: rlg diagnose {0} --model {0}/{MODEL} --out DIR",
            self.out.display()
        ));
    }

    fn say(&self, terminal: &Terminal, imported: &Imported) {
        let stream = &imported.stream;
        terminal.say(format!(
            "{}: {} frames in {} rows at {} Hz in {}; {} rows without a frame, {} bytes skipped, {} bad \
             check sums, {} bytes of an unfinished frame at the end",
            self.file_itself().display(),
            stream.frames,
            imported.recording.tables[0].rows,
            imported.rate_hz,
            self.out.display(),
            imported.rows_without_frame,
            stream.bytes_skipped,
            stream.bad_checksums,
            imported.bytes_at_end,
        ));
        if let (Some(asked), Some(told)) = (self.rate_hz, imported.unit_rate_hz)
            && (asked / told - 1.0).abs() > RATE_MISMATCH
        {
            terminal.warn(format!(
                "the unit says {told} Hz, --rate-hz {asked} is used"
            ));
        }
        let told = |index| imported.health.get(&index).copied();
        if let (Some(bits), Some(period)) = (
            told(item::FIRST_FAULT_STATUS),
            told(item::FIRST_FAULT_PERIOD),
        ) && bits != 0
        {
            let names = names(bits).join(", ");
            terminal.warn(format!(
                "the unit's first fault: {names}, in its sampling period {period}"
            ));
        }
        if let Some(results) = told(item::SELF_TEST).map(SelfTest::from_word)
            && results.has_failed()
        {
            let failed = results.failures().collect::<Vec<_>>().join(", ");
            terminal.warn(format!("the unit's built-in test has failed: {failed}"));
        }
        for (name, frames) in bits_seen(imported) {
            terminal.say(format!("{frames} frames say: {name}"));
        }
    }

    fn result(&self, terminal: &Terminal, imported: &Imported) -> Result<(), InputError> {
        let stream = &imported.stream;
        let status: serde_json::Map<_, _> = bits_seen(imported)
            .map(|(name, frames)| (name.to_owned(), frames.into()))
            .collect();
        terminal.result(&json!({
            "recording": self.out,
            "rate_hz": imported.rate_hz,
            "rows": imported.recording.tables[0].rows,
            "frames": stream.frames,
            "first_sequence": imported.first_sequence,
            "rows_without_frame": imported.rows_without_frame,
            "bytes_skipped": stream.bytes_skipped,
            "bad_checksums": stream.bad_checksums,
            "bytes_at_end": imported.bytes_at_end,
            "status": status,
            "health": imported.health,
        }))
    }
}

/// Returns the names of the bits set in any frame, with the number of those frames.
fn bits_seen(imported: &Imported) -> impl Iterator<Item = (&'static str, u64)> {
    let frames = imported.frames_with_bit.into_iter();
    (0_u8..)
        .zip(frames)
        .filter(|(_, frames)| *frames > 0)
        .filter_map(|(bit, frames)| Some((Status::name(bit)?, frames)))
}

/// Returns the names of the bits set.
fn names(bits: u32) -> Vec<&'static str> {
    (0..32)
        .filter(|bit| bits >> bit & 1 == 1)
        .filter_map(Status::name)
        .collect()
}
