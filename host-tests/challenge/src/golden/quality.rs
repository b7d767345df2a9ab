//! Quality of the diagnosis on some rows: a floor for a regenerated table.

use serde::Serialize;

use super::row::{NO, Row, YES};

/// Counts of trials by correctness.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Quality {
    /// Number of trials.
    pub trials: usize,
    /// Named correctly, and nothing else.
    pub right: usize,
    /// With a wrong name.
    pub wrong: usize,
    /// With a value more than three standard deviations from the truth.
    pub beyond: usize,
}

impl Quality {
    /// Counts the rows.
    pub fn of<'a>(rows: impl Iterator<Item = &'a Row>) -> Self {
        let mut sum = Self::default();
        for row in rows {
            let right = row.right();
            sum.trials += usize::from(right.is_some());
            sum.right += usize::from(right == Some(YES));
            sum.wrong += usize::from(right == Some(NO));
            sum.beyond += usize::from(row.sigmas().is_some_and(|sigmas| sigmas > 3.0));
        }
        sum
    }

    /// True if no count is worse than in `floor`.
    pub fn holds(self, floor: Self) -> bool {
        self.right >= floor.right && self.wrong <= floor.wrong && self.beyond <= floor.beyond
    }
}

impl std::fmt::Display for Quality {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let Self {
            trials,
            right,
            wrong,
            beyond,
        } = self;
        write!(
            f,
            "{right} of {trials} right, {wrong} with a wrong name, {beyond} beyond 3 σ"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::Quality;
    use crate::golden::{COLUMNS, Row};

    fn row(right: &str, sigmas: &str) -> Row {
        let cells = COLUMNS.map(|column| match column {
            "right" => right.to_owned(),
            "sigmas" => sigmas.to_owned(),
            _ => "-".to_owned(),
        });
        Row { cells }
    }

    #[test]
    fn rows_are_counted_and_held_against_a_floor() {
        let rows = [
            row("yes", "0.40"),
            row("yes", "3.10"),
            row("silent", "-"),
            row("no", "-"),
            row("-", "-"),
        ];
        let all = Quality::of(rows.iter());
        assert_eq!(
            all.to_string(),
            "2 of 4 right, 1 with a wrong name, 1 beyond 3 σ"
        );
        assert!(all.holds(all));
        let without = |place: usize| {
            let kept = rows.iter().enumerate().filter(|(other, _)| *other != place);
            Quality::of(kept.map(|(_, row)| row))
        };
        // One right name fewer; one wrong name more, or one value beyond 3 σ more.
        assert!(!without(0).holds(all));
        assert!(!all.holds(without(3)));
        assert!(without(3).holds(all));
    }
}
