//! Resamples rows of uneven length on an even clock.
//!
//! A row holds a mean or a sum over its period, from the previous stamp to its own. Within a row the rate is taken as
//! constant; an even row is the sum of the parts of the rows that it overlaps. A row after a gap covers one usual period,
//! and even rows that are not fully covered are missing.

/// Share of an even row that must be covered.
const WHOLE: f64 = 0.999;

/// Rows by their stamps, and the even clock.
#[derive(Debug, Clone, PartialEq)]
pub struct Resampling {
    /// End of each row \[s\].
    pub stamps_s: Vec<f64>,
    /// Usual length of a row \[s\].
    pub usual_s: f64,
    /// Longest step that is one row \[s\].
    pub longest_s: f64,
    /// Even rows a second \[Hz\].
    pub rate_hz: f64,
    /// Beginning of even row 0 \[s\].
    pub start_s: f64,
    /// Even rows.
    pub rows: usize,
}

impl Resampling {
    /// Returns the beginning of a row \[s\].
    fn begin_s(&self, row: usize) -> f64 {
        let end_s = self.stamps_s[row];
        let before_s = row.checked_sub(1).map(|before| self.stamps_s[before]);
        before_s
            .filter(|before_s| end_s - before_s <= self.longest_s)
            .unwrap_or(end_s - self.usual_s)
    }

    /// Returns the beginning of an even row \[s\].
    fn edge_s(&self, row: usize) -> f64 {
        self.start_s + row as f64 / self.rate_hz
    }

    /// Computes means over the even rows from means over the rows.
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        let mut first = 0;
        (0..self.rows)
            .map(|even| {
                let (begin_s, end_s) = (self.edge_s(even), self.edge_s(even + 1));
                while first + 1 < values.len() && self.stamps_s[first] <= begin_s {
                    first += 1;
                }
                let (mut sum, mut covered_s) = (0.0, 0.0);
                for (row, value) in values.iter().enumerate().skip(first) {
                    let (from_s, to_s) = (self.begin_s(row), self.stamps_s[row]);
                    if from_s >= end_s {
                        break;
                    }
                    let part_s = (to_s.min(end_s) - from_s.max(begin_s)).max(0.0);
                    if part_s > 0.0 {
                        sum += value * part_s;
                        covered_s += part_s;
                    }
                }
                match covered_s * self.rate_hz >= WHOLE {
                    true => sum / covered_s,
                    false => f64::NAN,
                }
            })
            .collect()
    }

    /// Computes sums over the even rows from sums over the rows.
    pub fn sums(&self, values: &[f64]) -> Vec<f64> {
        let rates = values.iter().enumerate();
        let rates: Vec<f64> = rates
            .map(|(row, value)| value / (self.stamps_s[row] - self.begin_s(row)))
            .collect();
        let means = self.means(&rates).into_iter();
        means.map(|mean| mean / self.rate_hz).collect()
    }

    /// Computes sums over the even rows of the steps of an angle known at the stamps; `steps` lead from one to the next.
    pub fn steps(&self, steps: &[f64]) -> Vec<f64> {
        // A step across a gap does not determine the one period covered by its row.
        let is_row =
            |row: usize| row > 0 && self.stamps_s[row] - self.stamps_s[row - 1] <= self.longest_s;
        let steps = steps.iter().enumerate();
        let known: Vec<f64> = steps
            .map(|(row, step)| if is_row(row) { *step } else { f64::NAN })
            .collect();
        self.sums(&known)
    }

    /// Returns the last value at or before each even row's end, not older than a row.
    pub fn latest(&self, values: &[f64]) -> Vec<f64> {
        let mut next = 0;
        (1..=self.rows)
            .map(|even| {
                let end_s = self.edge_s(even) + (1.0 - WHOLE) / self.rate_hz;
                while next < values.len() && self.stamps_s[next] <= end_s {
                    next += 1;
                }
                let last = next.checked_sub(1);
                let recent = last.filter(|last| end_s - self.stamps_s[*last] <= self.longest_s);
                recent.map_or(f64::NAN, |last| values[last])
            })
            .collect()
    }
}
