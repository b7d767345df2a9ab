//! Partition of the rows into those to fit and those to test.
//!
//! Contiguous stretches, spread over the recording: each part holds a piece of every regime. Rows are assigned before any
//! data are used.

use rlg_plan::{BlockPlan, PartitionPlan};
use std::ops::Range;

/// Use of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// Search, fit and cross-validation over blocks.
    Fit,
    /// Test: figures of the report.
    Test,
}

/// The use of every row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Partition {
    /// Use by row.
    pub uses: Vec<Use>,
}

impl Partition {
    /// Cuts `rows` rows at the ends of `segments` (rows, ascending) or into equal stretches; each stretch has its
    /// rows to fit first.
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
        let mut uses = vec![Use::Fit; rows];
        for pair in begins.windows(2) {
            let length = (pair[1] - pair[0]) as f64;
            let test = pair[0] + (length * plan.fit).round() as usize;
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

/// Cuts the `seen` rows into contiguous blocks of about equal numbers of them; a block may span unseen rows.
pub fn blocks(seen: &[bool], rate_hz: f64, plan: &BlockPlan) -> Vec<Range<usize>> {
    let count = seen.iter().filter(|&&seen| seen).count();
    let wished = (count as f64 / (plan.length_s * rate_hz)).round() as usize;
    let blocks = wished.clamp(plan.least, plan.most).min(count.max(1));
    let mut cuts = vec![0];
    let mut before = 0;
    for (row, _) in seen.iter().enumerate().filter(|(_, seen)| **seen) {
        before += 1;
        if before * blocks >= cuts.len() * count {
            cuts.push(row + 1);
        }
    }
    cuts.windows(2).map(|pair| pair[0]..pair[1]).collect()
}

#[cfg(test)]
mod tests {
    use super::{Partition, Use};
    use rlg_plan::PartitionPlan;

    #[test]
    fn every_stretch_has_both_parts_in_their_shares() {
        let partition = Partition::new(1000, 10.0, &[0..500, 500..1000], &PartitionPlan::default());
        let count = |of: Use| partition.uses.iter().filter(|other| **other == of).count();
        assert_eq!([Use::Fit, Use::Test].map(count), [800, 200]);
        assert_eq!(partition.uses[399], Use::Fit);
        assert_eq!(partition.uses[499], Use::Test);
        assert_eq!(partition.uses[500], Use::Fit);
    }
}
