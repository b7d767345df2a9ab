//! Reads tables of text: CSV and its relatives, as loggers and spreadsheets write them.
//!
//! The delimiter is the one of `;`, tab, `,` and blanks that splits the rows into most numbers. Lines that begin with `#`,
//! `%` or `//` are comments. Header lines are those of the table's width right above the first row of numbers: two are
//! joined, the upper one carried to the right over its empty cells; a line of units gives units. Decimal commas are read if
//! the delimiter is `;` or tab. Date-times become seconds.

use std::path::Path;

use super::columns::{Block, Column};
use super::date_times;
use crate::error::InputError;
use crate::recording::units::Unit;

/// Number of rows used to select the delimiter.
const SAMPLE_ROWS: usize = 50;

/// Largest number of header lines right above the numbers.
const MOST_HEADER_LINES: usize = 3;

/// Separator of cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Delimiter {
    Character(char),
    Blanks,
}

/// Candidates in order of preference: a `;` never stands in a number, a `,` may.
const DELIMITERS: [Delimiter; 4] = [
    Delimiter::Character(';'),
    Delimiter::Character('\t'),
    Delimiter::Character(','),
    Delimiter::Blanks,
];

/// Lines of a text, sorted.
struct Lines<'a> {
    /// Comments without their sign.
    comments: Vec<&'a str>,
    /// All other lines that are not blank, with their number in the file from 1.
    body: Vec<(usize, &'a str)>,
    /// Number of the first blank line that is followed by others.
    blank: Option<usize>,
}

/// Reads the columns of the text `bytes`, which is `file`.
pub fn read(file: &Path, bytes: &[u8]) -> Result<Block, InputError> {
    let text = decode(file, bytes)?;
    let lines = sort(&text);
    let delimiter = delimiter(&lines.body);
    let is_row = |cells: &[String]| {
        let filled = cells.iter().filter(|cell| !cell.is_empty());
        let numbers = filled
            .clone()
            .filter(|cell| delimiter.number(cell).is_some());
        2 * numbers.count() >= filled.count().max(1)
    };
    let first = lines
        .body
        .iter()
        .position(|(_, line)| is_row(&delimiter.split(line)))
        .ok_or_else(|| {
            InputError::new(file, "holds no row of numbers")
                .value(format!("{} lines of text", lines.body.len()))
                .expected("a header and rows of numbers, parted by `,`, `;`, tabs or blanks")
        })?;
    let (above, rows) = lines.body.split_at(first);
    if let Some(blank) = lines.blank.filter(|blank| *blank > rows[0].0) {
        return Err(InputError::new(file, "has a blank line between its rows")
            .channel(format!("line {blank}"))
            .expected("a row of cells, empty ones where nothing was measured"));
    }
    let width = width(&delimiter, above, rows);
    let (names, units) = header(&delimiter, above, &lines.comments, width);
    let mut notes = Vec::new();
    let columns = cells(file, &delimiter, rows, names, units, &text, &mut notes)?;
    let rate_hz = lines
        .comments
        .iter()
        .find_map(|comment| stated_rate(comment));
    Ok(Block {
        file: file.to_path_buf(),
        rows: columns.first().map_or(0, |column| column.values.len()),
        columns,
        rate_hz,
        notes,
    })
}

/// Decodes UTF-8 with or without a byte-order mark, else Latin-1, in which older loggers write the degree sign.
fn decode(file: &Path, bytes: &[u8]) -> Result<String, InputError> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    if bytes.contains(&0) {
        return Err(InputError::new(file, "is no text: it holds zero bytes")
            .expected("UTF-8 text, or --format mat|hdf5|parquet"));
    }
    Ok(match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    })
}

fn sort(text: &str) -> Lines<'_> {
    let mut lines = Lines {
        comments: Vec::new(),
        body: Vec::new(),
        blank: None,
    };
    let mut blank = None;
    for (place, line) in text.lines().enumerate() {
        let line = line.trim_end_matches('\r');
        let start = line.trim_start();
        let comment = ["#", "%", "//"]
            .into_iter()
            .find_map(|sign| start.strip_prefix(sign));
        if start.is_empty() {
            blank = blank.or(Some(place + 1));
        } else if let Some(comment) = comment {
            lines.comments.push(comment.trim());
        } else {
            if !lines.body.is_empty() {
                lines.blank = blank.or(lines.blank);
            }
            blank = None;
            lines.body.push((place + 1, line));
        }
    }
    lines
}

impl Delimiter {
    /// Splits a line into cells, without blanks and quotes around them; an empty last cell is dropped.
    fn split(&self, line: &str) -> Vec<String> {
        let mut cells: Vec<String> = match self {
            Self::Blanks => line.split_whitespace().map(unquoted).collect(),
            Self::Character(sign) if line.contains('"') => quoted_split(line, *sign),
            Self::Character(sign) => line.split(*sign).map(unquoted).collect(),
        };
        // Many loggers end every line with the delimiter.
        if cells.len() > 1 && cells.last().is_some_and(String::is_empty) && self.ends(line) {
            cells.pop();
        }
        cells
    }

    /// True if a line ends with it, other than blanks.
    fn ends(&self, line: &str) -> bool {
        self != &Self::Blanks && line.trim_end_matches([' ', '\r']).ends_with(self.sign())
    }

    fn sign(&self) -> char {
        match self {
            Self::Character(sign) => *sign,
            Self::Blanks => ' ',
        }
    }

    /// Parses the number in a cell, NaN if missing; `None` for text.
    fn number(&self, cell: &str) -> Option<f64> {
        if let Ok(number) = cell.parse() {
            return Some(number);
        }
        let lower = cell.to_ascii_lowercase();
        let absent = matches!(
            lower.as_str(),
            "" | "null" | "na" | "n/a" | "none" | "-" | "--"
        );
        // -nan(ind), 1.#QNAN: printed by C libraries.
        if absent || lower.trim_start_matches('-').starts_with("nan") || lower.contains(".#") {
            return Some(f64::NAN);
        }
        let decimal_comma = matches!(self, Self::Character(';' | '\t'));
        let one_comma = cell.matches(',').count() == 1 && !cell.contains('.');
        (decimal_comma && one_comma)
            .then(|| cell.replace(',', ".").parse().ok())
            .flatten()
    }
}

fn unquoted(cell: &str) -> String {
    cell.trim().trim_matches('"').trim().to_owned()
}

/// Splits a line in which delimiters may stand between quotes.
fn quoted_split(line: &str, sign: char) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut inside = false;
    for letter in line.chars() {
        match (letter, cells.last_mut()) {
            ('"', _) => inside = !inside,
            (letter, _) if letter == sign && !inside => cells.push(String::new()),
            (letter, Some(cell)) => cell.push(letter),
            (_, None) => {}
        }
    }
    cells.iter().map(|cell| cell.trim().to_owned()).collect()
}

/// Returns the delimiter that splits the last lines into most numbers.
fn delimiter(body: &[(usize, &str)]) -> Delimiter {
    let sample = &body[body.len().saturating_sub(SAMPLE_ROWS)..];
    let numbers = |delimiter: &Delimiter| -> usize {
        let cells = sample.iter().map(|(_, line)| delimiter.split(line));
        let share = |cells: Vec<String>| {
            let numbers = cells.iter().filter(|cell| delimiter.number(cell).is_some());
            // A wrong delimiter leaves text between the numbers.
            (2 * numbers.clone().count()).saturating_sub(cells.len())
        };
        cells.map(share).sum()
    };
    let mut best = DELIMITERS[0];
    for delimiter in DELIMITERS {
        if numbers(&delimiter) > numbers(&best) {
            best = delimiter;
        }
    }
    best
}

/// Returns the number of columns: cells of the first row, and one more if the header has it and the row ends with a
/// delimiter.
fn width(delimiter: &Delimiter, above: &[(usize, &str)], rows: &[(usize, &str)]) -> usize {
    let cells = delimiter.split(rows[0].1).len();
    let header = above
        .last()
        .map_or(0, |(_, line)| delimiter.split(line).len());
    match header == cells + 1 && delimiter.ends(rows[0].1) {
        true => header,
        false => cells,
    }
}

/// Returns names and units of `width` columns, from the lines above the numbers or, if there are none, from a comment.
fn header(
    delimiter: &Delimiter,
    above: &[(usize, &str)],
    comments: &[&str],
    width: usize,
) -> (Vec<String>, Vec<Option<String>>) {
    let fits = |cells: &Vec<String>| cells.len() == width;
    // A header may end with empty cells: pandas writes `time,,,` under two levels of names.
    let whole = |line: &str| {
        let mut cells = delimiter.split(line);
        if cells.len() + 1 == width && delimiter.ends(line) {
            cells.push(String::new());
        }
        cells
    };
    let mut lines: Vec<Vec<String>> = above
        .iter()
        .rev()
        .map(|(_, line)| whole(line))
        .take_while(fits)
        .take(MOST_HEADER_LINES)
        .collect();
    if lines.is_empty() {
        let comments = comments.iter().rev().map(|line| delimiter.split(line));
        lines = comments.filter(fits).take(1).collect();
    }
    let mut units = vec![None; width];
    let is_unit = |cell: &String| cell.is_empty() || Unit::parse(bare(cell)).is_some();
    let told = |cells: &[String]| cells.iter().any(|cell| !cell.is_empty());
    // Two lines at least: a single line `t g s` holds the names of columns.
    if lines.len() > 1 && lines[0].iter().all(is_unit) && told(&lines[0]) {
        let filled = |cell: &String| (!cell.is_empty()).then(|| bare(cell).to_owned());
        units = lines.remove(0).iter().map(filled).collect();
    }
    // Names of pandas' index stand alone in the last line, and above them the names of its levels.
    let is_index = |cells: &Vec<String>| cells.iter().filter(|cell| !cell.is_empty()).count() == 1;
    if width > 1 && lines.len() > 1 && is_index(&lines[0]) {
        let index = lines.remove(0);
        let place = index.iter().position(|cell| !cell.is_empty()).unwrap_or(0);
        let (last, upper) = lines.split_at_mut(1);
        upper.iter_mut().for_each(|cells| cells[place].clear());
        last[0][place].clone_from(&index[place]);
    }
    lines.reverse();
    let mut names = vec![String::new(); width];
    let last = lines.len().saturating_sub(1);
    for (place, cells) in lines.iter().enumerate() {
        let mut carried = String::new();
        for (name, cell) in names.iter_mut().zip(cells) {
            if !cell.is_empty() {
                carried.clone_from(cell);
            }
            let part = if place < last { &carried } else { cell };
            if !part.is_empty() {
                let gap = if name.is_empty() { "" } else { " " };
                name.push_str(&format!("{gap}{part}"));
            }
        }
    }
    for (place, name) in names.iter_mut().enumerate() {
        if name.is_empty() {
            *name = (place + 1).to_string();
        }
    }
    (names, units)
}

/// Returns a unit without the brackets around it.
fn bare(cell: &str) -> &str {
    cell.trim_matches(['[', ']', '(', ')'])
}

/// Parses the values of all rows.
fn cells(
    file: &Path,
    delimiter: &Delimiter,
    rows: &[(usize, &str)],
    names: Vec<String>,
    units: Vec<Option<String>>,
    text: &str,
    notes: &mut Vec<String>,
) -> Result<Vec<Column>, InputError> {
    let width = names.len();
    let mut columns: Vec<Column> = names
        .into_iter()
        .zip(units)
        .map(|(name, unit)| Column {
            unit,
            ..Column::new(name, Vec::with_capacity(rows.len()))
        })
        .collect();
    for (row, (line, content)) in rows.iter().enumerate() {
        let mut cells = delimiter.split(content);
        if cells.len() + 1 == width && delimiter.ends(content) {
            // The part behind the last delimiter was a cell.
            cells.push(String::new());
        }
        if cells.len() != width {
            if row + 1 == rows.len() && cells.len() < width && !text.ends_with('\n') {
                notes.push(format!(
                    "line {line}, cut short at the end of the file, is left out"
                ));
                break;
            }
            return Err(
                InputError::new(file, "has a row of another length than the first")
                    .channel(format!("line {line}"))
                    .row(row as u64)
                    .value(format!("{} cells", cells.len()))
                    .expected(format!("{width} cells in every row")),
            );
        }
        for (column, cell) in columns.iter_mut().zip(&cells) {
            let number = match column.dates {
                None => delimiter.number(cell),
                // An empty cell is a missing time; a number among dates is an error.
                Some(_) => cell.is_empty().then_some(f64::NAN),
            };
            let value = number.or_else(|| seconds(column, cell));
            if value.is_none() && column.bad_cell.is_none() {
                column.bad_cell = Some((row as u64, cell.clone()));
            }
            column.values.push(value.unwrap_or(f64::NAN));
        }
    }
    Ok(columns)
}

/// Returns a date-time as seconds since the second of the column's first; `None` for other text, or if the column held
/// numbers.
fn seconds(column: &mut Column, cell: &str) -> Option<f64> {
    if column.dates.is_none() && column.values.iter().any(|value| !value.is_nan()) {
        return None;
    }
    let (whole_s, fraction_s, dates) = date_times::parse(cell)?;
    let first = *column.dates.get_or_insert(dates);
    let is_alike = first.has_day == dates.has_day && first.has_zone == dates.has_zone;
    is_alike.then(|| (whole_s - first.origin_s) as f64 + fraction_s)
}

/// Returns the rate in a comment such as `Update Rate: 100.0Hz` \[Hz\].
fn stated_rate(comment: &str) -> Option<f64> {
    let lower = comment.to_lowercase();
    let (before, _) = lower.split_once("hz")?;
    if !["rate", "freq", "sampl"]
        .iter()
        .any(|word| before.contains(word))
    {
        return None;
    }
    let number = before
        .trim_end()
        .rsplit(|letter: char| !(letter.is_ascii_digit() || letter == '.'));
    let rate_hz: f64 = number.into_iter().next()?.parse().ok()?;
    (rate_hz > 0.0).then_some(rate_hz)
}
