//! Holds an [`Entry`] of `paper.json` for every table and figure of the paper; units stand in the names of the values.

use serde::Serialize;
use serde_json::Value;

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
    /// By what measure, and what limits it.
    pub why: String,
    /// For one line of a terminal.
    #[serde(skip)]
    pub short: String,
    /// Whether the item is a drawing, which nothing can reproduce.
    #[serde(skip)]
    pub drawing: bool,
}
