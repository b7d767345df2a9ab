//! A recording longer than memory.

use crate::section::section;

section! {
    /// Division of a recording longer than memory.
    LongPlan {
        /// Largest number of stretches analysed row by row.
        stretches: usize = 12, "1", [1.0, 10000.0];
        /// Share of the stretches in the rows that may be held at once; the rest is for series derived from them.
        of_rows: f64 = 0.5, "1", [0.01, 1.0];
        /// Ends of a stretch that only feed its spectra: the filtered rate of a truncated motion is wrong there.
        ends_s: f64 = 0.5, "s", [0.0, 1000.0];
        /// Least length of a stretch over that of its two ends.
        least_of_ends: f64 = 4.0, "1", [1.0, 1000.0];
        /// Least number of rows of a stretch: in a few hundred a filter can pass for their noise.
        least_rows: usize = 2000, "rows", [100.0, 1e9];
        /// Blocks per second into which all rows are summed.
        blocks_hz: f64 = 20.0, "Hz", [0.01, 1e5];
        /// Largest number of blocks: a longer recording has longer blocks.
        most_blocks: usize = 72_000, "1", [100.0, 1e9];
        /// Length of a chunk read at once.
        chunk_s: f64 = 30.0, "s", [1.0, 1e5];
        /// Margin read on either side of a chunk: temperature, the slowest channel, is smoothed over two seconds.
        around_s: f64 = 4.0, "s", [2.0, 1e4];
        /// Lower band limit of a stretch: its level and slow drifts belong to the whole recording.
        above_hz: f64 = 5.0, "Hz", [0.0, 1e5];
    }
}
