//! Lines of a text file, read one by one in two passes: a survey of the whole, then the rows.
//!
//! A file is read anew for each pass, so that its text is never in memory; what cannot be read twice, as a pipe, is kept.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Cursor, Read as _};
use std::path::Path;

use sha2::{Digest as _, Sha256};

use crate::error::InputError;

/// Bytes read at once.
const BUFFER: usize = 1 << 16;

/// Byte-order mark of UTF-8.
const MARK: &[u8] = b"\xEF\xBB\xBF";

/// Byte-order marks of UTF-16, little and big end first.
const UTF_16: [[u8; 2]; 2] = [[0xFF, 0xFE], [0xFE, 0xFF]];

/// Encoding of a text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Encoding {
    Utf8,
    /// In which older loggers write the degree sign.
    Latin1,
}

/// Text of a file.
pub(super) struct Text<'a> {
    file: &'a Path,
    /// Bytes of what cannot be read twice, or of UTF-16, decoded.
    kept: Option<Vec<u8>>,
    /// SHA-256 of the file's own bytes, where others are kept.
    own_sha256: Option<String>,
    encoding: Encoding,
}

/// A line that is neither blank nor a comment, with its number in the file from 1.
pub(super) type BodyLine = (usize, String);

/// The whole of a text.
pub(super) struct Survey {
    /// Comments without their sign.
    pub(super) comments: Vec<String>,
    /// Number of lines that are neither blank nor comments.
    pub(super) body: usize,
    /// The last of them.
    pub(super) last: VecDeque<BodyLine>,
    /// Number of the first blank line that is followed by others.
    pub(super) blank: Option<usize>,
    /// True if the last line ends as a line.
    pub(super) is_whole: bool,
    /// SHA-256 of the bytes.
    pub(super) sha256: String,
}

impl<'a> Text<'a> {
    /// Opens a file.
    ///
    /// # Errors
    /// It cannot be read.
    pub(super) fn open(file: &'a Path) -> Result<Self, InputError> {
        let unreadable = |error| InputError::unreadable(file, &error);
        let is_file = fs::metadata(file).map_err(unreadable)?.is_file();
        let mut kept = match is_file {
            true => None,
            false => Some(fs::read(file).map_err(unreadable)?),
        };
        let mut mark = [0; 2];
        let begin = match &kept {
            Some(bytes) => bytes.get(..2).map(|begin| mark.copy_from_slice(begin)),
            None => File::open(file)
                .and_then(|mut file| file.read_exact(&mut mark))
                .ok(),
        };
        let mut own_sha256 = None;
        if begin.is_some() && UTF_16.contains(&mark) {
            let bytes = match kept.take() {
                Some(bytes) => bytes,
                None => fs::read(file).map_err(unreadable)?,
            };
            own_sha256 = Some(hex(&Sha256::digest(&bytes)));
            kept = Some(of_utf_16(&bytes));
        }
        Ok(Self {
            file,
            kept,
            own_sha256,
            encoding: Encoding::Utf8,
        })
    }

    /// Reads the whole once, and decides its encoding; keeps the `sample` last lines.
    ///
    /// # Errors
    /// The file cannot be read, or holds zero bytes.
    pub(super) fn survey(&mut self, sample: usize) -> Result<Survey, InputError> {
        if let Some(survey) = self.surveyed(sample)? {
            return Ok(survey);
        }
        self.encoding = Encoding::Latin1;
        let survey = self.surveyed(sample)?;
        survey.ok_or_else(|| InputError::new(self.file, "is no text"))
    }

    /// As `survey`; `None` for text that is not in the encoding.
    fn surveyed(&self, sample: usize) -> Result<Option<Survey>, InputError> {
        let mut lines = self.lines()?;
        let mut survey = Survey {
            comments: Vec::new(),
            body: 0,
            last: VecDeque::new(),
            blank: None,
            is_whole: true,
            sha256: String::new(),
        };
        let mut hash = Sha256::new();
        let mut blank = None;
        while lines.read(Some(&mut hash))? {
            survey.is_whole = lines.bytes.ends_with(b"\n");
            let Some(line) = lines.decoded() else {
                return Ok(None);
            };
            match sorted(&line) {
                Line::Blank => blank = blank.or(Some(lines.number)),
                Line::Comment(comment) => survey.comments.push(comment.to_owned()),
                Line::Body => {
                    if survey.body > 0 {
                        survey.blank = blank.or(survey.blank);
                    }
                    blank = None;
                    survey.body += 1;
                    if survey.last.len() == sample {
                        survey.last.pop_front();
                    }
                    survey.last.push_back((lines.number, line));
                }
            }
        }
        let own = self.own_sha256.clone();
        survey.sha256 = own.unwrap_or_else(|| hex(&hash.finalize()));
        Ok(Some(survey))
    }

    /// Returns the lines that are neither blank nor comments, one by one.
    ///
    /// # Errors
    /// The file cannot be opened again.
    pub(super) fn body(&self) -> Result<Body<'_>, InputError> {
        Ok(Body {
            lines: self.lines()?,
        })
    }

    fn lines(&self) -> Result<Lines<'_>, InputError> {
        let reader: Box<dyn BufRead + '_> = match &self.kept {
            Some(bytes) => Box::new(Cursor::new(bytes)),
            None => {
                let file = File::open(self.file);
                let file = file.map_err(|error| InputError::unreadable(self.file, &error))?;
                Box::new(BufReader::with_capacity(BUFFER, file))
            }
        };
        Ok(Lines {
            file: self.file,
            reader,
            encoding: self.encoding,
            bytes: Vec::new(),
            number: 0,
        })
    }
}

/// Lines that are neither blank nor comments.
pub(super) struct Body<'a> {
    lines: Lines<'a>,
}

impl Body<'_> {
    /// Reads the next; `None` behind the last.
    ///
    /// # Errors
    /// The file cannot be read any more, or has changed since the survey.
    pub(super) fn next(&mut self) -> Result<Option<BodyLine>, InputError> {
        while self.lines.read(None)? {
            let line = self.lines.decoded().ok_or_else(|| {
                InputError::new(self.lines.file, "changed while it was read")
                    .expected("a file that nobody writes to")
            })?;
            if matches!(sorted(&line), Line::Body) {
                return Ok(Some((self.lines.number, line)));
            }
        }
        Ok(None)
    }
}

fn hex(digest: &[u8]) -> String {
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Decodes UTF-16 behind its mark.
fn of_utf_16(bytes: &[u8]) -> Vec<u8> {
    let is_little = bytes.starts_with(&UTF_16[0]);
    let pairs = bytes[2..].chunks_exact(2).map(|pair| match is_little {
        true => u16::from_le_bytes([pair[0], pair[1]]),
        false => u16::from_be_bytes([pair[0], pair[1]]),
    });
    let units: Vec<u16> = pairs.collect();
    String::from_utf16_lossy(&units).into_bytes()
}

/// All lines.
struct Lines<'a> {
    file: &'a Path,
    reader: Box<dyn BufRead + 'a>,
    encoding: Encoding,
    /// The line, with its end.
    bytes: Vec<u8>,
    number: usize,
}

impl Lines<'_> {
    /// Reads the next line; false behind the last.
    fn read(&mut self, hash: Option<&mut Sha256>) -> Result<bool, InputError> {
        self.bytes.clear();
        let read = self.reader.read_until(b'\n', &mut self.bytes);
        read.map_err(|error| InputError::unreadable(self.file, &error))?;
        if let Some(hash) = hash {
            hash.update(&self.bytes);
        }
        // A logger that was switched off leaves the end of its file as it was allocated.
        if self.bytes.last() == Some(&0) {
            let end = self.bytes.iter().rposition(|byte| *byte != 0);
            self.bytes.truncate(end.map_or(0, |end| end + 1));
        }
        if self.bytes.contains(&0) {
            return Err(
                InputError::new(self.file, "is no text: it holds zero bytes")
                    .expected("UTF-8 text, or --format mat|hdf5|parquet"),
            );
        }
        self.number += 1;
        if self.number == 1 && self.bytes.starts_with(MARK) {
            self.bytes.drain(..MARK.len());
            // A file of a mark alone has no line.
            return Ok(!self.bytes.is_empty());
        }
        Ok(!self.bytes.is_empty())
    }

    /// Returns the line without its end; `None` if it is not in the encoding.
    fn decoded(&self) -> Option<String> {
        let bytes = self.bytes.strip_suffix(b"\n").unwrap_or(&self.bytes);
        let mut line = match self.encoding {
            Encoding::Utf8 => std::str::from_utf8(bytes).ok()?.to_owned(),
            Encoding::Latin1 => bytes.iter().map(|byte| char::from(*byte)).collect(),
        };
        line.truncate(line.trim_end_matches('\r').len());
        Some(line)
    }
}

enum Line<'a> {
    Blank,
    Comment(&'a str),
    Body,
}

fn sorted(line: &str) -> Line<'_> {
    let start = line.trim_start();
    let signs = ["#", "%", "//"].into_iter();
    let comment = signs.filter_map(|sign| start.strip_prefix(sign)).next();
    match comment {
        _ if start.is_empty() => Line::Blank,
        Some(comment) => Line::Comment(comment.trim()),
        None => Line::Body,
    }
}
