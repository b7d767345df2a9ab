//! Permutation control: the same search on the same rows in shuffled order; a line found there does not depend on time.

use rlg_inference::Observations;
use rlg_plan::Plan;

use super::one_rate::Looked;
use super::rows::shuffled;
use crate::lines_at_rest::lines::{self, Lines};
use crate::rows::noise_levels::first_levels;

/// Result of the search on shuffled rows.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Control {
    /// Number of lines.
    pub(super) lines: usize,
    /// 2 Δ ln L of the strongest, 0 without any.
    pub(super) strongest: f64,
}

/// Searches the shuffled rows. The three gyros are permuted alike, fitted and held-out rows separately, so that only order
/// is lost; the lines of the recording are among them.
pub(super) fn of_shuffled(looked: &Looked, rate_hz: f64, plan: &Plan, seed: u64) -> Control {
    let parted = &looked.parted;
    let shuffled = shuffled(&looked.before_rad, [&parted.fitted, &parted.held_out], seed);
    let mut seen = vec![false; shuffled[0].len()];
    parted
        .fitted
        .iter()
        .for_each(|rows| seen[rows.clone()].fill(true));
    let observations = Observations::bridged(&seen).ok();
    let found: Option<Lines> = observations.and_then(|observations| {
        let levels = first_levels(&shuffled, &observations);
        lines::search(&shuffled, &seen, &levels, rate_hz, plan)
    });
    let lines = found.map_or_else(Vec::new, |found| found.lines);
    Control {
        lines: lines.len(),
        strongest: lines.iter().map(|line| line.gain).fold(0.0, f64::max),
    }
}
