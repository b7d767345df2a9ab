//! Texts of the kinds beside attitudes.

use rlg_catalogue::entries::{self, Card};

/// Catalogue card of a kind.
pub(crate) fn card(kind: &str) -> Card {
    const CLOCK: Card = Card {
        kind: "reference_clock_rate",
        equation: "reference stamps = gyros' time (1 + c)",
        unit: "1",
        meaning: "The clock of the reference and the clock of the gyros run at different rates.",
        experiment: "A longer record shows the clocks part further.",
    };
    entries::card(kind).unwrap_or(CLOCK)
}
