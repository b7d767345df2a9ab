//! Holds an [`Entry`] of `paper.json` for every table and figure of the paper; the names of the values hold their units.

use serde::Serialize;
use serde_json::Value;

/// Origin of the mark that decides on [`Entry::reproduced`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum By {
    /// Number printed in the paper.
    Paper,
    /// Bound of ours, for a statement of the paper in words.
    Ours,
    /// Number printed in the paper, within a bound of ours.
    Both,
}

impl By {
    /// Returns the origin as one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Paper => "paper's",
            Self::Ours => "ours",
            Self::Both => "both",
        }
    }
}

/// Criterion of reproduction.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Criterion {
    /// Origin of the mark.
    pub by: By,
    /// The mark.
    pub mark: String,
}

impl Criterion {
    /// Creates the criterion of a mark and its origin.
    pub fn new(by: By, mark: impl Into<String>) -> Option<Self> {
        let mark = mark.into();
        Some(Self { by, mark })
    }
}

/// One table or figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Entry {
    /// "Fig. 4", "Table 3".
    pub item: String,
    /// The paper's values, or its words if it prints no number.
    pub paper: Value,
    /// Corresponding values from this simulator and chain.
    pub ours: Value,
    /// True if ours reproduces the paper's result.
    pub reproduced: bool,
    /// Mark applied; a drawing has none.
    pub criterion: Option<Criterion>,
    /// Measure of the comparison, and its limit.
    pub why: String,
    /// Summary for one line of a terminal.
    #[serde(skip)]
    pub short: String,
    /// True if the item is a drawing, which cannot be reproduced.
    #[serde(skip)]
    pub drawing: bool,
}
