//! Counts of the work of this process, for tables of timings.

use std::sync::atomic::{AtomicU64, Ordering};

static TRANSFORMS: AtomicU64 = AtomicU64::new(0);

static COLUMNS: AtomicU64 = AtomicU64::new(0);

static EVALUATIONS: AtomicU64 = AtomicU64::new(0);

/// Work done since the start of the process, by all of its threads.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Transforms of a column, a record or a residual, in either direction.
    pub transforms: u64,
    /// Columns of normal equations.
    pub columns: u64,
    /// Fits of a set of hypotheses with its noise.
    pub evaluations: u64,
}

impl Work {
    /// Returns the work up to now.
    pub fn done() -> Self {
        let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Self {
            transforms: of(&TRANSFORMS),
            columns: of(&COLUMNS),
            evaluations: of(&EVALUATIONS),
        }
    }

    /// Returns the work from `earlier` to `self`.
    #[must_use]
    pub fn since(self, earlier: Self) -> Self {
        Self {
            transforms: self.transforms - earlier.transforms,
            columns: self.columns - earlier.columns,
            evaluations: self.evaluations - earlier.evaluations,
        }
    }
}

pub(crate) fn count_transform() {
    TRANSFORMS.fetch_add(1, Ordering::Relaxed);
}

pub(crate) fn count_columns(count: usize) {
    COLUMNS.fetch_add(count as u64, Ordering::Relaxed);
}

pub(crate) fn count_evaluation() {
    EVALUATIONS.fetch_add(1, Ordering::Relaxed);
}
