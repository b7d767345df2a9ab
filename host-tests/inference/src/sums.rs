//! Sums of records and columns over blocks of rows: slow signals at a fraction of the cost.

use std::ops::Range;

use crate::noise::NoiseLevels;
use crate::normal_equations::Columns;
use crate::observations::{Observations, Span};

/// Sums over whole blocks of `each` rows; rows behind the last whole block are dropped.
pub fn sums(values: &[f64], each: usize) -> Vec<f64> {
    values
        .chunks_exact(each)
        .map(|block| block.iter().sum())
        .collect()
}

/// Columns summed over blocks of rows.
pub struct Summed<'a, C> {
    /// Columns by row.
    pub columns: &'a C,
    /// Rows of a block.
    pub each: usize,
}

impl<C: Columns> Columns for Summed<'_, C> {
    fn count(&self) -> usize {
        self.columns.count()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        sums(&self.columns.column(place), self.each)
    }
}

impl Observations {
    /// Blocks of `each` rows, seen where all of their rows are.
    pub fn summed(&self, each: usize) -> Self {
        let inside = |rows: &Range<usize>| rows.start.div_ceil(each)..rows.end / each;
        let outside = |rows: &Range<usize>| rows.start / each..rows.end.div_ceil(each);
        let spans = self.spans.iter().map(|span| {
            let rows = inside(&span.rows);
            let mut gaps: Vec<Range<usize>> = Vec::new();
            for gap in span.gaps.iter().map(outside) {
                match gaps.last_mut() {
                    Some(last) if gap.start <= last.end => last.end = gap.end,
                    _ => gaps.push(gap),
                }
            }
            gaps.retain(|gap| gap.start > rows.start && gap.end < rows.end);
            Span {
                rows,
                gaps,
                has_free_level: span.has_free_level,
            }
        });
        Self {
            spans: spans.collect(),
            record_rows: self.record_rows / each,
        }
    }
}

impl NoiseLevels {
    /// Noise levels of sums over blocks of `each` rows, at the remaining frequencies.
    ///
    /// White angle telescopes: its differences are as large over a block as over a row.
    pub fn summed(self, each: usize) -> Self {
        let each = each as f64;
        Self {
            white: self.white * each,
            angle: self.angle,
            flicker: self.flicker * each,
            walk: self.walk * each,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::sums;
    use crate::{NoiseBasis, NoiseLevels, Observations};

    #[test]
    fn sums_have_the_slow_power_of_their_rows() {
        let rows = 4000;
        let each = 8;
        let fine = Observations::bridged(&vec![true; rows]).expect("rows");
        let coarse = fine.summed(each);
        assert_eq!(coarse.rows(), rows / each);
        let levels = NoiseLevels {
            white: 2.0,
            angle: 0.0,
            flicker: 3.0,
            walk: 5.0,
        };
        let of_rows = NoiseBasis::new(&fine).by_coefficient(levels);
        let of_sums = NoiseBasis::new(&coarse).by_coefficient(levels.summed(each));
        for k in 0..20 {
            let ratio = of_sums[k] / (of_rows[k] * each as f64);
            assert!((ratio - 1.0).abs() < 0.02, "{k}: {ratio}");
        }
    }

    #[test]
    fn a_block_with_a_hole_is_not_seen_and_the_rest_behind_is_left_out() {
        let mut seen = vec![true; 103];
        seen[41..43].fill(false);
        let coarse = Observations::bridged(&seen).expect("rows").summed(10);
        assert_eq!(coarse.spans[0].rows, 0..10);
        let [gap] = coarse.spans[0].gaps.as_slice() else {
            panic!("one gap")
        };
        assert_eq!(*gap, 4..5);
        assert_eq!(sums(&[1.0; 103], 10), [10.0; 10]);
    }
}
