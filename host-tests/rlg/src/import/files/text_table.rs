//! Reads tables of text: CSV and its relatives, as loggers and spreadsheets write them.
//!
//! The delimiter is the one of `;`, tab, `,` and blanks that splits the rows into most numbers. Lines that begin with `#`,
//! `%` or `//` are comments. Header lines are those of the table's width right above the first row of numbers: two are
//! joined, the upper one carried to the right over its empty cells; a line of units gives units. Decimal commas are read if
//! the delimiter is `;` or tab. Date-times become seconds.

use std::collections::VecDeque;
use std::path::Path;

use super::columns::{Block, Column};
use super::date_times;
use super::text_lines::{BodyLine, Text};
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

/// Reads the columns of a text file, row by row, and its SHA-256; `check` may refuse the sum before the rows are read.
pub fn read(
    file: &Path,
    check: impl FnOnce(&str) -> Result<(), InputError>,
) -> Result<(Block, String), InputError> {
    let mut text = Text::open(file)?;
    let survey = text.survey(SAMPLE_ROWS)?;
    check(&survey.sha256)?;
    let delimiter = delimiter(&survey.last);
    let usual = usual_width(&delimiter, &survey.last);
    let mut body = text.body()?;
    let mut above: VecDeque<BodyLine> = VecDeque::new();
    let mut rows = survey.body;
    let first = loop {
        let line = body.next()?.ok_or_else(|| {
            InputError::new(file, "holds no row of numbers")
                .value(format!("{} lines of text", survey.body))
                .expected("a header and rows of numbers, parted by `,`, `;`, tabs or blanks")
        })?;
        if delimiter.is_row(&line.1) && is_as_wide(&delimiter, &line.1, usual) {
            break line;
        }
        if above.len() == MOST_HEADER_LINES {
            above.pop_front();
        }
        above.push_back(line);
        rows -= 1;
    };
    if let Some(blank) = survey.blank.filter(|blank| *blank > first.0) {
        return Err(InputError::new(file, "has a blank line between its rows")
            .channel(format!("line {blank}"))
            .expected("a row of cells, empty ones where nothing was measured"));
    }
    let width = width(&delimiter, above.back(), &first);
    let (names, units) = header(&delimiter, &above, &survey.comments, width);
    let mut table = Cells::new(file, delimiter, (names, units), rows, survey.is_whole);
    let footer = survey.last.iter().rev();
    let footer = footer.take_while(|(_, line)| !delimiter.is_row(line));
    let footer: Vec<usize> = footer.map(|(line, _)| *line).collect();
    let mut next = Some(first);
    while let Some((line, content)) = next.filter(|(line, _)| !footer.contains(line)) {
        if !table.add(line, &content)? {
            break;
        }
        next = body.next()?;
    }
    if let (Some(last), Some(first)) = (footer.first(), footer.last()) {
        table.notes.push(format!(
            "lines {first} to {last}, which hold no numbers, are left out"
        ));
    }
    table
        .columns
        .iter_mut()
        .for_each(date_times::unwrap_midnight);
    let mut comments = survey.comments.iter();
    let block = Block {
        file: file.to_path_buf(),
        rows: table
            .columns
            .first()
            .map_or(0, |column| column.values.len()),
        rate_hz: comments.find_map(|comment| stated_rate(comment)),
        columns: table.columns,
        notes: table.notes,
    };
    Ok((block, survey.sha256))
}

impl Delimiter {
    /// True for a line of numbers: half of its filled cells at least.
    fn is_row(&self, line: &str) -> bool {
        let cells = self.split(line);
        let filled = cells.iter().filter(|cell| !cell.is_empty());
        let numbers = filled.clone().filter(|cell| self.number(cell).is_some());
        2 * numbers.count() >= filled.count().max(1)
    }

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
        // MATLAB writes durations as `0.01 sec`.
        if let Ok(number) = cell.strip_suffix(" sec").unwrap_or(cell).parse() {
            return Some(number);
        }
        let lower = cell.to_ascii_lowercase();
        let absent = matches!(
            lower.as_str(),
            "" | "null" | "na" | "n/a" | "#n/a" | "none" | "-" | "--"
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
fn delimiter(sample: &VecDeque<BodyLine>) -> Delimiter {
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

/// Returns the number of cells of most of the last rows; of a preamble of `key,value` lines before the table each has another.
fn usual_width(delimiter: &Delimiter, last: &VecDeque<BodyLine>) -> usize {
    let rows = last.iter().filter(|(_, line)| delimiter.is_row(line));
    let mut widths: Vec<usize> = rows.map(|(_, line)| delimiter.split(line).len()).collect();
    widths.sort_unstable();
    widths.get(widths.len() / 2).copied().unwrap_or(0)
}

/// True if a line has the usual number of cells, give or take empty ones at its end.
fn is_as_wide(delimiter: &Delimiter, line: &str, usual: usize) -> bool {
    delimiter.split(line).len().abs_diff(usual) <= 1 || usual <= 2
}

/// Returns the number of columns: cells of the first row, and one more if the header has it and the row ends with a
/// delimiter.
fn width(delimiter: &Delimiter, above: Option<&BodyLine>, (_, first): &BodyLine) -> usize {
    let cells = delimiter.split(first).len();
    let header = above.map_or(0, |(_, line)| delimiter.split(line).len());
    match header == cells + 1 && delimiter.ends(first) {
        true => header,
        false => cells,
    }
}

/// Returns names and units of `width` columns, from the lines above the numbers or, if there are none, from a comment.
fn header(
    delimiter: &Delimiter,
    above: &VecDeque<BodyLine>,
    comments: &[String],
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

/// Values of the rows so far.
struct Cells<'a> {
    file: &'a Path,
    delimiter: Delimiter,
    columns: Vec<Column>,
    /// Columns that hold a number.
    has_number: Vec<bool>,
    /// Rows read, and rows of the file.
    read: usize,
    rows: usize,
    /// True if the last line of the file ends as a line.
    is_whole: bool,
    notes: Vec<String>,
}

impl<'a> Cells<'a> {
    fn new(
        file: &'a Path,
        delimiter: Delimiter,
        (names, units): (Vec<String>, Vec<Option<String>>),
        rows: usize,
        is_whole: bool,
    ) -> Self {
        let column = |(name, unit)| Column {
            unit,
            ..Column::new(name, Vec::with_capacity(rows))
        };
        let columns: Vec<Column> = names.into_iter().zip(units).map(column).collect();
        Self {
            file,
            delimiter,
            has_number: vec![false; columns.len()],
            columns,
            read: 0,
            rows,
            is_whole,
            notes: Vec::new(),
        }
    }

    /// Parses a row; false for a last one that is cut short.
    fn add(&mut self, line: usize, content: &str) -> Result<bool, InputError> {
        let (width, row) = (self.columns.len(), self.read);
        let mut cells = self.delimiter.split(content);
        if cells.len() + 1 == width && self.delimiter.ends(content) {
            // The part behind the last delimiter was a cell.
            cells.push(String::new());
        }
        if cells.len() != width {
            if row + 1 == self.rows && cells.len() < width && !self.is_whole {
                self.notes.push(format!(
                    "line {line}, cut short at the end of the file, is left out"
                ));
                return Ok(false);
            }
            return Err(
                InputError::new(self.file, "has a row of another length than the first")
                    .channel(format!("line {line}"))
                    .row(row as u64)
                    .value(format!("{} cells", cells.len()))
                    .expected(format!("{width} cells in every row")),
            );
        }
        let columns = self.columns.iter_mut().zip(&mut self.has_number);
        for ((column, has_number), cell) in columns.zip(&cells) {
            let number = match column.dates {
                None => self.delimiter.number(cell),
                // An empty cell is a missing time; a number among dates is an error.
                Some(_) => cell.is_empty().then_some(f64::NAN),
            };
            let value = number.or_else(|| seconds(column, *has_number, cell));
            if value.is_none() && column.bad_cell.is_none() {
                column.bad_cell = Some((row as u64, cell.clone()));
            }
            let value = value.unwrap_or(f64::NAN);
            *has_number |= !value.is_nan();
            column.values.push(value);
        }
        self.read += 1;
        Ok(true)
    }
}

/// Returns a date-time as seconds since the second of the column's first; `None` for other text, or if the column held
/// numbers.
fn seconds(column: &mut Column, has_number: bool, cell: &str) -> Option<f64> {
    if column.dates.is_none() && has_number {
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
