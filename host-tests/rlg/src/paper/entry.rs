//! Holds an [`Entry`] of `paper.json` for every table and figure of the paper; units stand in the names of the values.

use serde::Serialize;
use serde_json::Value;

/// Whose mark decides on [`Entry::reproduced`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum By {
    /// A number that the paper prints.
    Paper,
    /// A bound of ours, where the paper says it in words.
    Ours,
    /// A number that the paper prints, within a bound of ours.
    Both,
}

impl By {
    /// The same as one word.
    pub fn word(self) -> &'static str {
        match self {
            Self::Paper => "paper's",
            Self::Ours => "ours",
            Self::Both => "both",
        }
    }
}

/// What counts as reproduced.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Criterion {
    /// Whose mark it is.
    pub by: By,
    /// The mark.
    pub mark: String,
}

impl Criterion {
    /// A mark with whose it is.
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
    /// What the paper prints, or says where it prints no number.
    pub paper: Value,
    /// The same from this simulator and chain.
    pub ours: Value,
    /// Whether ours shows what the paper's shows.
    pub reproduced: bool,
    /// By which mark; a drawing has none.
    pub criterion: Option<Criterion>,
    /// By what measure, and what limits it.
    pub why: String,
    /// For one line of a terminal.
    #[serde(skip)]
    pub short: String,
    /// Whether the item is a drawing, which nothing can reproduce.
    #[serde(skip)]
    pub drawing: bool,
}
