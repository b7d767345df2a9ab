//! Golden table as text: comment lines with the header, the names of the columns, then a row a line.
//!
//! Cells are separated by tabs, rows are sorted by name. The text contains no date, path, version or duration: the same
//! program gives the same bytes.

use std::path::Path;

use super::row::{COLUMNS, Row};
use rlg_recording::error::InputError;

/// Version of the table's format.
const FORMAT: u32 = 3;

/// Start of the header line.
const TITLE: &str = "# golden table";

/// Shared recordings without a row.
const NOT_IN_IT: &str =
    "# no row yet: repoimu-11 (csv) and broad-24 (mat), which rlg import does not read";

/// Origin of the rows.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// Seed of the simulated trials.
    pub seed: u64,
    /// Number of simulated trials of the whole table.
    pub trials: u64,
    /// Processor architecture, and its fused multiply-add. The system's mathematical functions and the Fourier transforms
    /// select their code by it, so hashes are comparable only if equal.
    pub arithmetic: String,
}

impl Header {
    /// Header of a table made on this machine.
    pub fn here(seed: u64, trials: u64) -> Self {
        Self {
            seed,
            trials,
            arithmetic: arithmetic(),
        }
    }

    fn line(&self) -> String {
        format!(
            "{TITLE}: format={FORMAT} seed={} trials={} arithmetic={}",
            self.seed, self.trials, self.arithmetic
        )
    }

    fn parse(line: &str) -> Option<Self> {
        let mut pairs = line
            .strip_prefix(TITLE)?
            .strip_prefix(':')?
            .split_whitespace();
        let mut value = |key: &str| pairs.next()?.strip_prefix(key)?.strip_prefix('=');
        let format: u32 = value("format")?.parse().ok()?;
        (format == FORMAT).then_some(())?;
        Some(Self {
            seed: value("seed")?.parse().ok()?,
            trials: value("trials")?.parse().ok()?,
            arithmetic: value("arithmetic")?.to_owned(),
        })
    }
}

/// Processor architecture, with the extensions that change the last bits of results.
fn arithmetic() -> String {
    let architecture = std::env::consts::ARCH;
    #[cfg(target_arch = "x86_64")]
    let fused = std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    let fused = false;
    if fused {
        format!("{architecture}+avx2+fma")
    } else {
        architecture.to_owned()
    }
}

/// Rows with their header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Table {
    /// Origin of the rows.
    pub header: Header,
    /// Sorted by name.
    pub rows: Vec<Row>,
}

impl Table {
    /// Sorts rows into a table.
    pub fn new(header: Header, mut rows: Vec<Row>) -> Self {
        rows.sort_by(|one, other| one.name().cmp(other.name()));
        Self { header, rows }
    }

    /// Formats the table as text.
    pub fn text(&self) -> String {
        let header = [self.header.line(), NOT_IN_IT.to_owned(), COLUMNS.join("\t")];
        let rows = self.rows.iter().map(|row| row.cells.join("\t"));
        header
            .into_iter()
            .chain(rows)
            .map(|line| line + "\n")
            .collect()
    }

    /// Parses a table from its text. `file` is named in errors.
    pub fn parse(text: &str, file: &Path) -> Result<Self, InputError> {
        let fault = |problem: &str, expected: &str| {
            Err(InputError::new(file, problem).expected(expected.to_owned()))
        };
        let header = text.lines().next().and_then(Header::parse);
        let Some(header) = header else {
            return fault(
                "is no golden table of this version",
                "what rlg challenge --golden writes",
            );
        };
        let mut lines = text.lines().filter(|line| !line.starts_with('#'));
        let columns = COLUMNS.join("\t");
        if lines.next() != Some(columns.as_str()) {
            return fault("has other columns", &columns);
        }
        let mut rows = Vec::new();
        for (number, line) in lines.enumerate() {
            let cells: Vec<String> = line.split('\t').map(str::to_owned).collect();
            let found = cells.len();
            let Ok(cells) = cells.try_into() else {
                return Err(InputError::new(file, "has a row of another length")
                    .row(number as u64)
                    .value(format!("{found} cells"))
                    .expected(COLUMNS.len().to_string()));
            };
            rows.push(Row { cells });
        }
        Ok(Self::new(header, rows))
    }
}
