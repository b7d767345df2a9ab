//! `rlg challenge --golden`: the golden table is written, or made again and compared.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::import::Import;
use super::import_format::Format;
use crate::challenge::Share;
use crate::challenge::golden::{
    Comparison, Header, Row, Table, compare, recording_row, trial_name, trial_rows,
};
use crate::diagnose::Engine;
use crate::error::InputError;
use crate::output::write_file;
use crate::terminal::Terminal;

/// Options of the golden table.
#[derive(Debug, Args)]
pub(super) struct GoldenArguments {
    /// Write the golden table instead: a row for each trial, and for each shared recording. Rows that FILE.tsv has of
    /// other engines stay
    #[arg(
        long,
        value_name = "FILE.tsv",
        conflicts_with_all = ["out", "families", "leave_one_out", "merge", "recording", "check"]
    )]
    pub(super) golden: Option<PathBuf>,
    /// Make the rows of FILE.tsv again, each with its engine, and compare; its seed and number of trials are used, and
    /// the exit code is 2 if any row differs
    #[arg(long, requires = "golden", conflicts_with_all = ["seed", "trials"])]
    compare: bool,
    /// Folder with the shared recordings; without it the table holds trials only
    #[arg(long, value_name = "DIR", requires = "golden")]
    recordings: Option<PathBuf>,
    /// Make only the trials with numbers from A up to, but without, B
    #[arg(long, value_name = "A..B", value_parser = rows, requires = "golden", conflicts_with_all = ["shard", "trial"])]
    rows: Option<Range<u64>>,
}

/// "0..20".
fn rows(text: &str) -> Result<Range<u64>, String> {
    text.split_once("..")
        .and_then(|(first, end)| Some(first.parse().ok()?..end.parse().ok()?))
        .filter(|rows| rows.start <= rows.end)
        .ok_or_else(|| "expected A..B with A not above B, such as 0..20".to_owned())
}

/// The simulated trials that the options name.
#[derive(Clone, Copy)]
pub(super) struct Trials {
    /// Seed of every random draw.
    pub(super) seed: u64,
    /// Trials of the whole table.
    pub(super) count: u64,
    /// Those of which rows are made.
    pub(super) share: Share,
}

/// A recording that has a row.
struct Shared {
    /// Name of its row.
    name: &'static str,
    /// Its file or folder in the folder of recordings.
    path: &'static str,
    /// What the file holds; `None`: a folder in the project's own form.
    format: Option<Format>,
}

/// The shared recordings.
const SHARED: [Shared; 5] = [
    Shared {
        name: "bench-coning",
        path: "bench-coning",
        format: None,
    },
    Shared {
        name: "bench-null",
        path: "bench-null",
        format: None,
    },
    Shared {
        name: "bench-shake",
        path: "bench-shake",
        format: None,
    },
    Shared {
        name: "laser-gyro-vehicle",
        path: "lasergyro.imu",
        format: Some(Format::PsinsImu),
    },
    Shared {
        name: "ln100-x-up",
        path: "x_LN100_up.ins",
        format: Some(Format::F64x7),
    },
];

impl Shared {
    /// Makes its row by `engine`. A foreign file is imported into a temporary folder first.
    fn row(&self, recordings: &Path, engine: Engine) -> Result<Row, InputError> {
        let source = recordings.join(self.path);
        let Some(format) = self.format else {
            return recording_row(self.name, &source, engine);
        };
        let temporary = tempfile::tempdir()
            .map_err(|error| InputError::unwritable(std::env::temp_dir(), &error))?;
        let folder = temporary.path().join("recording");
        Import::file(&source, format, &folder).run(&Terminal::silent())?;
        recording_row(self.name, &folder, engine)
    }
}

impl GoldenArguments {
    /// Writes the table to `file`, or compares. Times go to the terminal, never into the table.
    ///
    /// # Inputs
    /// `engine`: that of the rows written, of the rows compared; `None` where none is named: the default engine's rows
    /// are written, rows of all engines are compared.
    ///
    /// # Errors
    /// With `--compare` also a row that differs.
    pub(super) fn run(
        &self,
        file: &Path,
        trials: Trials,
        engine: Option<Engine>,
        terminal: &Terminal,
    ) -> Result<(), InputError> {
        let begun = Instant::now();
        if !self.compare {
            let engine = engine.unwrap_or_default();
            let header = Header::here(trials.seed, trials.count);
            let others = rows_of_others(file, &header, engine)?;
            let made = self.make(header, trials.share, &|_| vec![engine], terminal)?;
            say_seconds(&made, begun, terminal);
            let rows = made.rows.len();
            let table = Table::new(made.header, [made.rows, others].concat());
            write_file(file, table.text().as_bytes())?;
            return terminal.result(&serde_json::json!({ "rows": rows }));
        }
        let reviewed = read(file)?;
        let header = Header::here(reviewed.header.seed, reviewed.header.trials);
        // A name without any row is made all the same, and is then not in the reviewed table.
        let engines = |name: &str| {
            let mut engines = reviewed.engines_of(name);
            if engines.is_empty() {
                return vec![engine.unwrap_or_default()];
            }
            engines.retain(|one| engine.is_none_or(|engine| engine == *one));
            engines
        };
        let made = self.make(header, trials.share, &engines, terminal)?;
        say_seconds(&made, begun, terminal);
        let comparison = compare(&reviewed, &made);
        say_comparison(&comparison, &reviewed, &made, terminal);
        terminal.result(&comparison)?;
        if comparison.is_equal() {
            return Ok(());
        }
        let differ = comparison.rows.len() + comparison.not_reviewed.len();
        Err(InputError::new(file, "does not have the rows made now")
            .value(format!("{differ} that differ"))
            .expected(format!("{} equal rows", made.rows.len())))
    }

    /// Makes the rows that were asked for, each name's by its `engines`.
    fn make(
        &self,
        header: Header,
        share: Share,
        engines: &dyn Fn(&str) -> Vec<Engine>,
        terminal: &Terminal,
    ) -> Result<Table, InputError> {
        let share = match &self.rows {
            Some(rows) => Share::Range(rows.start, rows.end),
            None => share,
        };
        let (option, end) = match share {
            Share::Range(_, end) => ("--rows", end),
            Share::One(one) => ("--trial", one.saturating_add(1)),
            Share::Shard(..) => ("--shard", 0),
        };
        if end > header.trials {
            return Err(InputError::new(option, "is beyond the table")
                .expected(format!("trials below {}", header.trials)));
        }
        let said = |name: &str, seconds: f64| terminal.note(format!("{seconds:7.1} s  {name}"));
        let mut rows = Vec::new();
        if let Some(recordings) = &self.recordings {
            for shared in &SHARED {
                for engine in engines(shared.name) {
                    let begun = Instant::now();
                    let row = shared.row(recordings, engine)?;
                    said(&row.key().join(" "), begun.elapsed().as_secs_f64());
                    rows.push(row);
                }
            }
        }
        let trials = share.trials(header.trials).into_iter();
        let trials = trials
            .map(|trial| (trial, engines(&trial_name(trial))))
            .filter(|(_, engines)| !engines.is_empty())
            .collect();
        rows.extend(trial_rows(header.seed, &trials, &said)?);
        if rows.is_empty() {
            return Err(InputError::new(option, "leaves no row to make")
                .expected("trials, or --recordings"));
        }
        Ok(Table::new(header, rows))
    }
}

fn read(file: &Path) -> Result<Table, InputError> {
    let text = fs::read_to_string(file).map_err(|error| InputError::unreadable(file, &error))?;
    Table::parse(&text, file)
}

/// Rows that `file`, where it exists, has of other engines than `engine`.
///
/// # Errors
/// They were made from other trials or with other arithmetic than `header` says: one table has one header.
fn rows_of_others(file: &Path, header: &Header, engine: Engine) -> Result<Vec<Row>, InputError> {
    if !file.exists() {
        return Ok(Vec::new());
    }
    let mut table = read(file)?;
    table.rows.retain(|row| row.engine() != Some(engine));
    if table.rows.is_empty() || table.header == *header {
        return Ok(table.rows);
    }
    let Header {
        seed,
        trials,
        arithmetic,
    } = table.header;
    Err(
        InputError::new(file, "has rows of other engines that are not comparable")
            .value(format!(
                "seed {}, {} trials, {}",
                header.seed, header.trials, header.arithmetic
            ))
            .expected(format!(
                "seed {seed}, {trials} trials, {arithmetic}, or another file"
            )),
    )
}

fn say_seconds(table: &Table, begun: Instant, terminal: &Terminal) {
    let seconds = begun.elapsed().as_secs_f64();
    terminal.say(format!(
        "{} rows in {seconds:.0} s on {} threads",
        table.rows.len(),
        rayon::current_num_threads()
    ));
}

fn say_comparison(comparison: &Comparison, reviewed: &Table, made: &Table, terminal: &Terminal) {
    for line in comparison.lines() {
        terminal.say(line);
    }
    if comparison.hashes_left_out {
        terminal.warn(format!(
            "hashes are not compared: the table was made with {}, these rows with {}",
            reviewed.header.arithmetic, made.header.arithmetic
        ));
    }
    let differ = comparison.rows.len();
    terminal.say(format!(
        "{} rows compared: {} equal, {differ} differ; {} reviewed rows were not made",
        comparison.compared,
        comparison.compared - differ,
        comparison.not_made
    ));
}
