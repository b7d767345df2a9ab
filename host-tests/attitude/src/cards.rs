//! Texts of the kinds beside attitudes.

use rlg_catalogue::entries::{self, Card};

/// Initial error of an attitude filter that decays.
pub(crate) const SETTLING: &str = "reference_settling";

/// Catalogue card of a kind.
pub(crate) fn card(kind: &str) -> Card {
    const CLOCK: Card = Card {
        kind: "reference_clock_rate",
        equation: "reference stamps = gyros' time (1 + c)",
        unit: "1",
        meaning: "The clock of the reference and the clock of the gyros run at different rates.",
        experiment: "A longer record increases the difference of the clocks.",
    };
    const SETTLES: Card = Card {
        kind: SETTLING,
        equation: "reference attitude = exp(e exp(-t/T)) attitude, e in the navigation frame",
        unit: "rad",
        meaning: "The reference is an attitude filter that began with a wrong attitude and settled: its error decays with one time constant. An attitude computed from these gyros cannot reveal their errors.",
        experiment: "Keep the unit at rest until the filter has settled, and start the record then.",
    };
    match kind {
        SETTLING => SETTLES,
        _ => entries::card(kind).unwrap_or(CLOCK),
    }
}
