//! Seen rows of the records, and interpolation over the others.
//!
//! A span is a stretch of rows transformed as one. Unseen rows inside it are bridged: a straight line through the means of
//! as many rows on either side as the gap is long. The same linear operation is applied to records and columns, so
//! coefficients are unbiased; drift stays continuous. Deviations of a gap's rows from the line are nuisance parameters,
//! projected out with the transform.

use std::fmt;
use std::ops::Range;

/// A stretch of rows with its gaps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Span {
    /// Rows of the record.
    pub rows: Range<usize>,
    /// Unseen rows within, ascending, inside `rows` and touching neither end.
    pub gaps: Vec<Range<usize>>,
    /// The span's level is a nuisance parameter, as for a stretch of a longer record, whose level is estimated from the
    /// whole.
    pub has_free_level: bool,
}

/// All spans of a likelihood.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Observations {
    /// Spans, ascending.
    pub spans: Vec<Span>,
    /// Rows of the whole record, seen or not.
    pub record_rows: usize,
}

/// Too few rows for a likelihood.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooFewRows {
    /// Number of rows that can be fitted.
    pub have: usize,
    /// Least number of rows.
    pub need: usize,
}

impl std::error::Error for TooFewRows {}

impl fmt::Display for TooFewRows {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { have, need } = self;
        let rows = if *have == 1 { "row is" } else { "rows are" };
        write!(out, "{have} {rows} left to fit, {need} are needed")
    }
}

impl Observations {
    /// Forms one span from the first seen row to the last, gaps bridged.
    ///
    /// # Errors
    /// Fewer than eight rows are seen.
    pub fn bridged(seen: &[bool]) -> Result<Self, TooFewRows> {
        let have = seen.iter().filter(|seen| **seen).count();
        let first = seen.iter().position(|&seen| seen);
        let last = seen.iter().rposition(|&seen| seen);
        let (Some(first), Some(last), LEAST_ROWS..) = (first, last, have) else {
            let need = LEAST_ROWS;
            return Err(TooFewRows { have, need });
        };
        let rows = first..last + 1;
        let gaps: Vec<Range<usize>> = runs(seen, false)
            .into_iter()
            .filter(|gap| gap.start > first && gap.end <= last)
            .collect();
        Ok(Self {
            spans: vec![Span {
                rows,
                gaps,
                has_free_level: false,
            }],
            record_rows: seen.len(),
        })
    }

    /// A span for each run of at least `least` seen rows.
    pub fn separate(seen: &[bool], least: usize) -> Self {
        Self {
            spans: runs(seen, true)
                .into_iter()
                .filter(|rows| rows.len() >= least.max(LEAST_ROWS))
                .map(|rows| Span {
                    rows,
                    gaps: Vec::new(),
                    has_free_level: false,
                })
                .collect(),
            record_rows: seen.len(),
        }
    }

    /// Drops up to 1 % of each span's last rows for a length without a prime factor above 7: the transforms are then several
    /// times as fast.
    pub fn to_fast_length(mut self) -> Self {
        for span in &mut self.spans {
            let (first, rows) = (span.rows.start, span.rows.len());
            let is_seen = |last: usize| !span.gaps.iter().any(|gap| gap.contains(&last));
            let is_fast = |rows: &usize| rows.is_multiple_of(2) && has_small_factors(*rows);
            let least = rows - rows / 100;
            let fast = (least..=rows)
                .rev()
                .find(|rows| is_fast(rows) && is_seen(first + rows - 1));
            if let Some(rows) = fast {
                span.rows.end = first + rows;
                span.gaps.retain(|gap| gap.end < first + rows);
            }
        }
        self
    }

    /// Makes the level of every span a nuisance parameter.
    pub fn with_free_levels(mut self) -> Self {
        self.spans
            .iter_mut()
            .for_each(|span| span.has_free_level = true);
        self
    }

    /// Rows of all spans, gaps included.
    pub fn rows(&self) -> usize {
        self.spans.iter().map(|span| span.rows.len()).sum()
    }
}

/// Least number of rows of a span.
const LEAST_ROWS: usize = 8;

fn has_small_factors(mut rows: usize) -> bool {
    for factor in [2, 3, 5, 7] {
        while rows.is_multiple_of(factor) {
            rows /= factor;
        }
    }
    rows == 1
}

/// Runs of rows whose flag is `of`, ascending.
pub fn runs(flags: &[bool], of: bool) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut row = 0;
    for group in flags.chunk_by(|a, b| a == b) {
        if group[0] == of {
            found.push(row..row + group.len());
        }
        row += group.len();
    }
    found
}

impl Span {
    /// Values of a record in the span, gaps bridged.
    pub fn bridge(&self, record: &[f64]) -> Vec<f64> {
        let mut values = record[self.rows.clone()].to_vec();
        for line in self.lines() {
            let [left, right] = line.windows.clone().map(|window| mean(&values[window]));
            for row in line.gap.clone() {
                values[row] = left + line.share(row) * (right - left);
            }
        }
        values
    }

    /// The line across each gap, rows counted from the span's begin.
    fn lines(&self) -> Vec<Line> {
        let begin = self.rows.start;
        let mut before = 0;
        let mut lines = Vec::with_capacity(self.gaps.len());
        for (place, gap) in self.gaps.iter().enumerate() {
            let gap = gap.start - begin..gap.end - begin;
            let next = self.gaps.get(place + 1);
            let after = next.map_or(self.rows.len(), |next| next.start - begin);
            let length = gap.len();
            let windows = [
                gap.start.saturating_sub(length).max(before)..gap.start,
                gap.end..(gap.end + length).min(after),
            ];
            before = gap.end;
            lines.push(Line { gap, windows });
        }
        lines
    }

    /// Rows of the span at which differenced white noise is not stationary, from the span's begin: its two ends, and the
    /// first and the last row of each gap.
    pub fn edges(&self) -> Vec<usize> {
        let ends = [0, self.rows.len() - 1];
        let gaps = self.gaps.iter().flat_map(|gap| [gap.start, gap.end - 1]);
        let mut edges: Vec<usize> = gaps.map(|row| row - self.rows.start).chain(ends).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }
}

/// A straight line across a gap, through the means of two windows at their middles.
struct Line {
    gap: Range<usize>,
    windows: [Range<usize>; 2],
}

impl Line {
    /// Weight of the second window's mean in a row.
    fn share(&self, row: usize) -> f64 {
        let middle = |window: &Range<usize>| 0.5 * (window.start + window.end) as f64 - 0.5;
        let [first, last] = [&self.windows[0], &self.windows[1]].map(middle);
        (row as f64 - first) / (last - first)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::{Observations, Span, TooFewRows, runs};

    #[test]
    fn runs_are_found_with_their_ends() {
        let flags = [true, false, false, true, true, false];
        assert_eq!(runs(&flags, true), [0..1, 3..5]);
        assert_eq!(runs(&flags, false), [1..3, 5..6]);
    }

    #[test]
    fn a_straight_line_is_bridged_by_itself() {
        let record: Vec<f64> = (0..40).map(|row| 3.0 - 0.5 * f64::from(row)).collect();
        let mut seen = vec![true; 40];
        seen[10..15].fill(false);
        seen[30..33].fill(false);
        let observations = Observations::bridged(&seen).expect("rows enough");
        let mut holed = record.clone();
        holed[10..15].fill(1e9);
        holed[30..33].fill(-1e9);
        for (value, expected) in observations.spans[0].bridge(&holed).iter().zip(&record) {
            assert!((value - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn unseen_ends_are_no_part_of_a_span_and_edges_lie_in_the_gaps() {
        let mut seen = vec![true; 30];
        seen[0..4].fill(false);
        seen[28..30].fill(false);
        seen[12..14].fill(false);
        seen[20] = false;
        let observations = Observations::bridged(&seen).expect("rows enough");
        let span = Span {
            rows: 4..28,
            gaps: vec![12..14, 20..21],
            has_free_level: false,
        };
        assert_eq!(span.edges(), [0, 8, 9, 16, 23]);
        assert_eq!(observations.spans, [span]);
    }

    #[test]
    fn a_fast_length_ends_with_a_seen_row_and_keeps_the_gaps_before_it() {
        // From 995 to 1005 only 1000 has no prime factor above 7.
        let of = |late: std::ops::Range<usize>| {
            let mut seen = vec![true; 1005];
            seen[40..50].fill(false);
            seen[late].fill(false);
            let observations = Observations::bridged(&seen).expect("rows enough");
            observations.to_fast_length().spans.remove(0)
        };
        let span = |rows, gaps: &[std::ops::Range<usize>]| Span {
            rows,
            gaps: gaps.to_vec(),
            has_free_level: false,
        };
        assert_eq!(
            of(1001..1003),
            span(0..1000, std::slice::from_ref(&(40..50)))
        );
        assert_eq!(of(998..1000), span(0..1005, &[40..50, 998..1000]));
    }

    #[test]
    fn too_few_rows_are_no_observations() {
        let too_few = TooFewRows { have: 7, need: 8 };
        assert_eq!(Observations::bridged(&[true; 7]), Err(too_few));
        assert!(Observations::separate(&[true; 7], 1).spans.is_empty());
    }
}
