//! Partition of the rows into training, confirmation and test.
//!
//! Contiguous stretches, spread over the recording: each part holds a piece of every regime. Rows are assigned before any
//! data are used.

use std::ops::Range;

/// Use of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// Search and fit.
    Train,
    /// Confirmation: a finding must raise the predictive score here.
    Confirm,
    /// Test: figures of the report.
    Test,
}

/// Shares and lengths of a partition.
#[derive(Debug, Clone, Copy)]
pub struct PartitionPlan {
    /// Share of the training rows \[1\].
    pub train: f64,
    /// Share of the confirmation rows \[1\]; the rest is the test.
    pub confirm: f64,
    /// Number of stretches where the recording names no segments.
    pub stretches: usize,
    /// Segments shorter than this are joined to their neighbours \[s\].
    pub shortest_s: f64,
}

impl Default for PartitionPlan {
    fn default() -> Self {
        Self {
            train: 0.6,
            confirm: 0.2,
            stretches: 8,
            shortest_s: 4.0,
        }
    }
}

/// The use of every row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partition {
    /// Use by row.
    pub uses: Vec<Use>,
}

impl Partition {
    /// Cuts `rows` rows at the ends of `segments` (rows, ascending) or into equal stretches; each stretch has its training
    /// rows first, then confirmation, then test.
    pub fn new(rows: usize, rate_hz: f64, segments: &[Range<usize>], plan: &PartitionPlan) -> Self {
        let shortest = (plan.shortest_s * rate_hz) as usize;
        let mut cuts: Vec<usize> = segments
            .iter()
            .flat_map(|rows| [rows.start, rows.end])
            .filter(|&row| row > 0 && row < rows)
            .collect();
        if segments.is_empty() {
            cuts = (1..plan.stretches)
                .map(|place| place * rows / plan.stretches)
                .collect();
        }
        cuts.sort_unstable();
        let mut begins = vec![0];
        for cut in cuts {
            let last = begins[begins.len() - 1];
            if cut >= last + shortest && rows >= cut + shortest {
                begins.push(cut);
            }
        }
        begins.push(rows);
        let mut uses = vec![Use::Train; rows];
        for pair in begins.windows(2) {
            let length = (pair[1] - pair[0]) as f64;
            let confirm = pair[0] + (length * plan.train).round() as usize;
            let test = pair[0] + (length * (plan.train + plan.confirm)).round() as usize;
            uses[confirm..test].fill(Use::Confirm);
            uses[test..pair[1]].fill(Use::Test);
        }
        Self { uses }
    }

    /// Mask of the usable rows of any of `uses`.
    pub fn rows_of(&self, uses: &[Use], usable: &[bool]) -> Vec<bool> {
        let rows = self.uses.iter().zip(usable);
        rows.map(|(of, usable)| *usable && uses.contains(of))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{Partition, PartitionPlan, Use};

    #[test]
    fn every_stretch_has_its_three_parts_in_their_shares() {
        let partition = Partition::new(1000, 10.0, &[0..500, 500..1000], &PartitionPlan::default());
        let count = |of: Use| partition.uses.iter().filter(|other| **other == of).count();
        assert_eq!(
            [Use::Train, Use::Confirm, Use::Test].map(count),
            [600, 200, 200]
        );
        assert_eq!(partition.uses[299], Use::Train);
        assert_eq!(partition.uses[300], Use::Confirm);
        assert_eq!(partition.uses[499], Use::Test);
        assert_eq!(partition.uses[500], Use::Train);
    }
}
