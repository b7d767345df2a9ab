//! Several recordings of one unit.

use crate::section::section;

section! {
    /// Prices in log posterior of the sharing of an effect between recordings: six of ten are common, two of ten have
    /// another size in each recording, two of ten are in one alone.
    SeveralPlan {
        /// One size in all recordings.
        common: f64 = 0.5, "nat", [0.0, 100.0];
        /// A size of its own in each.
        apart: f64 = 1.6, "nat", [0.0, 100.0];
        /// One recording only, besides ln of the number of recordings.
        only: f64 = 1.6, "nat", [0.0, 100.0];
        /// Largest distance of a recording's delay from the joint delay for a common linearisation.
        same_delay: f64 = 5.0, "σ", [0.0, 100.0];
    }
}
