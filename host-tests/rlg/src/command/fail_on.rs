//! `--fail-on`: verdicts that end `rlg diagnose` with exit code 1.

use clap::ValueEnum;
use rlg_findings::result::Verdict;

/// Least failure among the verdicts: a verdict with all that are worse.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum FailOn {
    /// Nothing can be said of the recording
    Unusable,
    /// Something differs and nothing explains it
    Unexplained,
    /// Something differs that is not explained as a whole
    Partly,
    /// Anything differs from the model
    Any,
}

impl FailOn {
    /// True if a verdict is one of these failures.
    pub(super) fn names(self, verdict: Verdict) -> bool {
        match verdict {
            Verdict::Matches => false,
            Verdict::Explained => matches!(self, Self::Any),
            Verdict::PartlyExplained => matches!(self, Self::Any | Self::Partly),
            Verdict::Unexplained => !matches!(self, Self::Unusable),
            Verdict::Unusable => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{FailOn, Verdict};

    #[test]
    fn a_verdict_fails_where_it_or_a_better_one_is_named() {
        let worse = [
            Verdict::Matches,
            Verdict::Explained,
            Verdict::PartlyExplained,
            Verdict::Unexplained,
            Verdict::Unusable,
        ];
        let first_failures = [
            (FailOn::Any, 1),
            (FailOn::Partly, 2),
            (FailOn::Unexplained, 3),
            (FailOn::Unusable, 4),
        ];
        for (on, first) in first_failures {
            let fails = worse.map(|verdict| on.names(verdict));
            assert_eq!(fails, [0, 1, 2, 3, 4].map(|place| place >= first), "{on:?}");
        }
    }
}
