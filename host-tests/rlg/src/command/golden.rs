//! `rlg challenge --golden`: writes the golden table, or recomputes and compares it.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;

use super::import::Import;
use super::import_format::Format;
use crate::challenge::Share;
use crate::challenge::golden::{
    Comparison, Header, Quality, Row, Table, compare, guard_rows, recording_row, trial_rows,
};
use crate::error::InputError;
use crate::output::write_file;
use crate::terminal::Terminal;

/// Options of the golden table.
#[derive(Debug, Args)]
pub(super) struct GoldenArguments {
    /// Write the golden table instead: a row for each trial, for trials of the other kinds of recordings (attitudes, rest,
    /// accelerometers, positions, long ones, several, two motions), and for each shared recording
    #[arg(
        long,
        value_name = "FILE.tsv",
        conflicts_with_all = ["out", "families", "leave_one_out", "merge", "recording", "check"]
    )]
    pub(super) golden: Option<PathBuf>,
    /// Make the rows of FILE.tsv again and compare; its seed and number of trials are used, and
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

/// Parses "0..20".
fn rows(text: &str) -> Result<Range<u64>, String> {
    text.split_once("..")
        .and_then(|(first, end)| Some(first.parse().ok()?..end.parse().ok()?))
        .filter(|rows| rows.start <= rows.end)
        .ok_or_else(|| "expected A..B with A not above B, such as 0..20".to_owned())
}

/// Simulated trials selected by the options.
#[derive(Clone, Copy)]
pub(super) struct Trials {
    /// Seed of every random draw.
    pub(super) seed: u64,
    /// Trials of the whole table.
    pub(super) count: u64,
    /// Trials for which rows are computed.
    pub(super) share: Share,
}

/// Recording with a row in the table.
struct Shared {
    /// Name of its row.
    name: &'static str,
    /// Its file or folder in the folder of recordings.
    path: &'static str,
    /// Format of the file; `None`: a folder in the project's own form.
    format: Option<Format>,
}

/// Shared recordings.
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
    /// Computes its row. A foreign file is imported into a temporary folder first.
    fn row(&self, recordings: &Path) -> Result<Row, InputError> {
        let source = recordings.join(self.path);
        let Some(format) = self.format else {
            return recording_row(self.name, &source);
        };
        let temporary = tempfile::tempdir()
            .map_err(|error| InputError::unwritable(std::env::temp_dir(), &error))?;
        let folder = temporary.path().join("recording");
        Import::file(&source, format, &folder).run(&Terminal::silent())?;
        recording_row(self.name, &folder)
    }
}

impl GoldenArguments {
    /// Writes the table to `file`, or compares. Times go to the terminal, never into the table.
    ///
    /// # Errors
    /// With `--compare` also a row that differs.
    pub(super) fn run(
        &self,
        file: &Path,
        trials: Trials,
        terminal: &Terminal,
    ) -> Result<(), InputError> {
        let begun = Instant::now();
        if !self.compare {
            let header = Header::here(trials.seed, trials.count);
            let made = self.make(header, trials.share, terminal)?;
            say_seconds(&made, begun, terminal);
            if file.exists() {
                holds_floor(&read(file)?, &made, file)?;
            }
            write_file(file, made.text().as_bytes())?;
            return terminal.result(&serde_json::json!({ "rows": made.rows.len() }));
        }
        let reviewed = read(file)?;
        let header = Header::here(reviewed.header.seed, reviewed.header.trials);
        let made = self.make(header, trials.share, terminal)?;
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

    /// Computes the requested rows.
    fn make(&self, header: Header, share: Share, terminal: &Terminal) -> Result<Table, InputError> {
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
                let begun = Instant::now();
                let row = shared.row(recordings)?;
                said(row.name(), begun.elapsed().as_secs_f64());
                rows.push(row);
            }
        }
        let is_whole = self.rows.is_none() && matches!(share, Share::Shard(0, 1));
        if is_whole {
            if let Some(recordings) = &self.recordings {
                rows.extend(outside_rows(recordings, &said)?);
            }
            rows.extend(guard_rows(header.seed, GUARDS_EACH, &said)?);
        }
        rows.extend(trial_rows(
            header.seed,
            &share.trials(header.trials),
            &said,
        )?);
        if rows.is_empty() {
            return Err(InputError::new(option, "leaves no row to make")
                .expected("trials, or --recordings"));
        }
        Ok(Table::new(header, rows))
    }
}

/// Trials of each other kind of recording in a whole table.
const GUARDS_EACH: u64 = 12;

/// Rows of the small recordings in the folder `outside`, by name.
fn outside_rows(recordings: &Path, said: &dyn Fn(&str, f64)) -> Result<Vec<Row>, InputError> {
    let folder = recordings.join("outside");
    let entries = fs::read_dir(&folder).map_err(|error| InputError::unreadable(&folder, &error))?;
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.join("model.toml").is_file());
    paths.sort();
    let each = paths.iter().map(|path| {
        let begun = Instant::now();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let row = recording_row(&format!("outside/{name}"), path)?;
        said(row.name(), begun.elapsed().as_secs_f64());
        Ok(row)
    });
    each.collect()
}

fn read(file: &Path) -> Result<Table, InputError> {
    let text = fs::read_to_string(file).map_err(|error| InputError::unreadable(file, &error))?;
    Table::parse(&text, file)
}

/// Refuses rows of a lower quality than those that they would replace.
fn holds_floor(reviewed: &Table, made: &Table, file: &Path) -> Result<(), InputError> {
    let of = |rows: &Table, others: &Table| {
        let is_there = |row: &&Row| others.rows.iter().any(|one| one.name() == row.name());
        Quality::of(rows.rows.iter().filter(is_there))
    };
    let (floor, now) = (of(reviewed, made), of(made, reviewed));
    if reviewed.header.seed != made.header.seed || now.holds(floor) {
        return Ok(());
    }
    Err(
        InputError::new(file, "holds better rows than those made now")
            .value(now)
            .expected(format!("{floor}, or no such file: then it begins anew")),
    )
}

fn say_seconds(table: &Table, begun: Instant, terminal: &Terminal) {
    let seconds = begun.elapsed().as_secs_f64();
    terminal.say(format!("trials: {}", Quality::of(table.rows.iter())));
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
