//! Which rows of the records are seen, and how the others are bridged.
//!
//! A span is a stretch of rows that is transformed as one. Rows inside it that are not seen are bridged: a straight line
//! through the means of as many rows on either side as the gap is long. The same linear operation is applied to
//! records and columns, so coefficients are not biased; a line of such means leaves about as much low-frequency power as white
//! noise had in the gap, and drift stays continuous.

use std::ops::Range;

/// A stretch of rows with its gaps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Span {
    /// Rows of the record.
    pub rows: Range<usize>,
    /// Rows within that are not seen, ascending, inside `rows` and touching neither end.
    pub gaps: Vec<Range<usize>>,
}

/// All spans that a likelihood looks at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Observations {
    /// Spans, ascending.
    pub spans: Vec<Span>,
    /// Rows of the whole record, seen or not.
    pub record_rows: usize,
}

impl Observations {
    /// One span from the first seen row to the last, gaps bridged; `None` where fewer than eight rows are seen.
    pub fn bridged(seen: &[bool]) -> Option<Self> {
        let first = seen.iter().position(|&seen| seen)?;
        let last = seen.iter().rposition(|&seen| seen)?;
        let rows = first..last + 1;
        let gaps: Vec<Range<usize>> = runs(seen, false)
            .into_iter()
            .filter(|gap| gap.start > first && gap.end <= last)
            .collect();
        let missing: usize = gaps.iter().map(ExactSizeIterator::len).sum();
        (rows.len() - missing >= LEAST_ROWS).then(|| Self {
            spans: vec![Span { rows, gaps }],
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
                })
                .collect(),
            record_rows: seen.len(),
        }
    }

    /// Rows of all spans, gaps included.
    pub fn rows(&self) -> usize {
        self.spans.iter().map(|span| span.rows.len()).sum()
    }
}

/// Fewer rows than this are no span.
const LEAST_ROWS: usize = 8;

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
        for (place, gap) in self.gaps.iter().enumerate() {
            let (begin, end) = (gap.start - self.rows.start, gap.end - self.rows.start);
            let length = end - begin;
            let before = place
                .checked_sub(1)
                .map_or(0, |previous| self.gaps[previous].end - self.rows.start);
            let after = self
                .gaps
                .get(place + 1)
                .map_or(values.len(), |next| next.start - self.rows.start);
            let windows = [
                begin.saturating_sub(length).max(before)..begin,
                end..(end + length).min(after),
            ];
            let [left, right] = windows.clone().map(|window| mean(&values[window]));
            let [first, last] =
                windows.map(|window| 0.5 * (window.start + window.end) as f64 - 0.5);
            for (row, value) in values[..end].iter_mut().enumerate().skip(begin) {
                let share = (row as f64 - first) / (last - first);
                *value = left + share * (right - left);
            }
        }
        values
    }

    /// Rows of the span at which differenced white noise is not stationary, from the span's begin: its two ends, and the first
    /// and the last row of each gap.
    pub fn edges(&self) -> Vec<usize> {
        let ends = [0, self.rows.len() - 1];
        let gaps = self.gaps.iter().flat_map(|gap| [gap.start, gap.end - 1]);
        let mut edges: Vec<usize> = gaps.map(|row| row - self.rows.start).chain(ends).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// Share of the span's rows that are seen.
    pub fn seen_share(&self) -> f64 {
        let missing: usize = self.gaps.iter().map(ExactSizeIterator::len).sum();
        1.0 - missing as f64 / self.rows.len() as f64
    }

    /// Longest gap in rows.
    pub fn longest_gap(&self) -> usize {
        let lengths = self.gaps.iter().map(ExactSizeIterator::len);
        lengths.max().unwrap_or(0)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::{Observations, Span, runs};

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
        };
        assert_eq!(span.edges(), [0, 8, 9, 16, 23]);
        assert_eq!(observations.spans, [span]);
    }

    #[test]
    fn too_few_rows_are_no_observations() {
        assert_eq!(Observations::bridged(&[true; 7]), None);
        assert!(Observations::separate(&[true; 7], 1).spans.is_empty());
    }
}
