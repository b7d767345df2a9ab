//! Division of a long recording into stretches and blocks.

use rlg_plan::{LongPlan, Plan};
use std::ops::Range;

use rlg_recording::Segment;
use rlg_recording::error::InputError;
use rlg_signal::partition::{Partition, Use};
use rlg_signal::streams::Streams;

/// Reads rows of a recording and puts their channels on the gyros' rows.
pub type Read<'a> = dyn Fn(Range<usize>) -> Result<Streams, InputError> + 'a;

/// A recording of which only a part is in memory at once.
pub struct Long<'a> {
    /// Its name.
    pub name: String,
    /// Its rows.
    pub rows: usize,
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// Beginning of the first row \[s\].
    pub start_s: f64,
    /// Its named stretches.
    pub segments: Vec<Segment>,
    /// Reader of some of its rows.
    pub read: &'a Read<'a>,
}

impl Long<'_> {
    pub(super) fn at_s(&self, row: usize) -> f64 {
        self.start_s + row as f64 / self.rate_hz
    }

    pub(super) fn seconds(&self) -> f64 {
        self.rows as f64 / self.rate_hz
    }

    fn row_at(&self, time_s: f64) -> usize {
        let row = (time_s - self.start_s) * self.rate_hz;
        (row.round().max(0.0) as usize).min(self.rows)
    }

    /// Row number of the first row of some streams: of counts with a pickoff the first row read only starts the dither.
    pub(super) fn first_row(&self, streams: &Streams) -> usize {
        self.row_at(streams.start_s)
    }

    /// Name of some rows: their segment, and their time.
    pub(super) fn name_of(&self, rows: &Range<usize>) -> String {
        let [start_s, end_s] = [rows.start, rows.end].map(|row| self.at_s(row));
        let middle_s = 0.5 * (start_s + end_s);
        let mut segments = self.segments.iter();
        let named = segments.find(|one| one.start_s <= middle_s && middle_s < one.end_s);
        let name = named.map_or(String::new(), |one| format!("{}, ", one.name));
        format!("{name}{start_s:.0} to {end_s:.0} s")
    }

    /// Selects the rows to analyse one by one: from the middle of the longest parts of like motion, as many of each as its
    /// share.
    pub(super) fn stretches(&self, most_rows: usize, plan: &LongPlan) -> Vec<Range<usize>> {
        let rows = (most_rows as f64 * plan.of_rows) as usize;
        let of_ends = plan.least_of_ends * 2.0 * plan.ends_s * self.rate_hz;
        let least = of_ends.max(plan.least_rows.min(rows) as f64);
        let count = plan.stretches.min((rows as f64 / least) as usize).max(1);
        let mut parts = self.parts(self.rows.div_ceil(count));
        parts.sort_by_key(|part| std::cmp::Reverse(part.len()));
        parts.truncate(count);
        parts.sort_by_key(|part| part.start);
        let all: usize = parts.iter().map(ExactSizeIterator::len).sum();
        let share = (rows as f64 / all as f64).min(1.0);
        let middle = |part: Range<usize>| {
            let length = ((part.len() as f64 * share) as usize)
                .max(least as usize)
                .min(part.len());
            let start = part.start + (part.len() - length) / 2;
            start..start + length
        };
        parts.into_iter().map(middle).collect()
    }

    /// Parts of like motion of the recording, those much longer than `even` rows divided into several.
    fn parts(&self, even: usize) -> Vec<Range<usize>> {
        let of_segment = |one: &Segment| [self.row_at(one.start_s), self.row_at(one.end_s)];
        let mut cuts: Vec<usize> = self.segments.iter().flat_map(of_segment).collect();
        cuts.extend([0, self.rows]);
        cuts.sort_unstable();
        cuts.dedup();
        let of_pair = |pair: &[usize]| {
            let (start, rows) = (pair[0], pair[1] - pair[0]);
            let count = (rows as f64 / even as f64).round().max(1.0) as usize;
            let at = move |place: usize| start + rows * place / count;
            (0..count).map(move |place| at(place)..at(place + 1))
        };
        cuts.windows(2).flat_map(of_pair).collect()
    }

    /// Divides the rows into blocks, and partitions the blocks by use.
    pub(super) fn blocks(&self, plan: &Plan) -> Cut {
        let wished = (self.rate_hz / plan.long.blocks_hz).round() as usize;
        let rows_each = wished.max(self.rows.div_ceil(plan.long.most_blocks)).max(1);
        let count = self.rows / rows_each;
        let rate_hz = self.rate_hz / rows_each as f64;
        let of_segment = |one: &Segment| {
            let [start, end] = [one.start_s, one.end_s].map(|time_s| self.row_at(time_s));
            start / rows_each..(end / rows_each).min(count)
        };
        let segments: Vec<Range<usize>> = self.segments.iter().map(of_segment).collect();
        Cut {
            rows_each,
            rate_hz,
            uses: Partition::new(count, rate_hz, &segments, &plan.signal.partition).uses,
        }
    }
}

/// Blocks of rows.
pub(super) struct Cut {
    /// Rows in each.
    pub(super) rows_each: usize,
    /// Blocks per second \[Hz\].
    pub(super) rate_hz: f64,
    /// Use of each block.
    pub(super) uses: Vec<Use>,
}

#[cfg(test)]
mod tests {
    use rlg_plan::Plan;
    use rlg_recording::Segment;

    use super::Long;

    fn long(segments: &[(f64, f64)]) -> Long<'static> {
        let segment = |&(start_s, end_s): &(f64, f64)| Segment {
            name: "shaken".to_string(),
            kind: String::new(),
            start_s,
            end_s,
        };
        Long {
            name: "hour".to_string(),
            rows: 3_600_000,
            rate_hz: 1000.0,
            start_s: 5.0,
            segments: segments.iter().map(segment).collect(),
            read: &|_| unreachable!("nothing is read"),
        }
    }

    #[test]
    fn stretches_lie_in_the_middle_of_every_segment_and_have_the_rows_that_they_may() {
        let plan = Plan::default();
        let long = long(&[(605.0, 1205.0), (1205.0, 3605.0)]);
        let stretches = long.stretches(240_000, &plan.long);
        let rows: usize = stretches.iter().map(ExactSizeIterator::len).sum();
        assert!((119_000..=120_000).contains(&rows), "{rows}");
        assert_eq!(stretches.len(), 12);
        // Two parts of 300 s before the first segment ends, eight in the last.
        assert_eq!(stretches[0].start + stretches[0].len() / 2, 150_000);
        assert_eq!(long.name_of(&stretches[2]), "shaken, 750 to 760 s");
        // Few rows: fewer stretches, none too short.
        let few = long.stretches(20_000, &plan.long);
        assert_eq!(few.iter().map(ExactSizeIterator::len).min(), Some(4000));
        // At a low rate: rows enough to estimate the noise.
        let slow = Long {
            rate_hz: 50.0,
            ..long
        };
        let of = |most_rows| slow.stretches(most_rows, &plan.long);
        assert_eq!(
            of(20_000).iter().map(ExactSizeIterator::len).min(),
            Some(2000)
        );
        // If more than the rows that may be held: all that may be held.
        assert_eq!(of(800).iter().map(ExactSizeIterator::len).max(), Some(400));
    }

    #[test]
    fn blocks_grow_with_the_recording_and_not_in_number() {
        let plan = Plan::default();
        let hour = long(&[]).blocks(&plan);
        assert_eq!((hour.rows_each, hour.uses.len()), (50, 72_000));
        let day = Long {
            rows: 24 * 3_600_000,
            ..long(&[])
        };
        let day = day.blocks(&plan);
        assert_eq!((day.rows_each, day.uses.len()), (1200, 72_000));
    }
}
