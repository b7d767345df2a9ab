//! Figures of a diagnosis as entries of `diagnosis.json`.
//!
//! Enters: the choice, before and after on held-out time, the self-test. Leaves: their entries, gyros and accelerometers
//! alike.

use super::hypotheses::CATALOGUE;
use super::result::{RunnerUp, SelfTestEntry, SelfTestKind, SelfTestPoint, Sensitivity};
use super::select::Choice;
use super::self_test::SelfTest;
pub(super) use rlg_diagnosis::entries_of_rows::channel;

/// Effects that came near to being chosen.
pub(super) fn runners_up(choice: &Choice) -> impl Iterator<Item = RunnerUp> {
    choice.runners_up.iter().map(|(effect, behind)| RunnerUp {
        kind: CATALOGUE[*effect].card().kind.to_string(),
        behind: *behind,
    })
}

/// How strongly each effect would show.
pub(super) fn sensitivity(choice: &Choice) -> impl Iterator<Item = Sensitivity> {
    choice.reach.iter().map(|(effect, snr)| {
        let card = CATALOGUE[*effect].card();
        Sensitivity {
            kind: card.kind.to_string(),
            typical: card.typical,
            unit: card.unit.to_string(),
            snr: *snr,
        }
    })
}

/// Time slides and injections.
pub(super) fn self_test_entry(test: &SelfTest) -> SelfTestEntry {
    SelfTestEntry {
        slides: test.slides,
        false_names: test.false_names,
        upper_limit_95: test.upper_limit,
        curve: test
            .curve
            .iter()
            .map(|point| SelfTestPoint {
                rho: point.rho,
                injections: point.injections,
                detected: point.detected,
                named: point.named,
                theory: point.theory,
            })
            .collect(),
        kinds: test
            .kinds
            .iter()
            .map(|kind| SelfTestKind {
                kind: CATALOGUE[kind.effect].card().kind.to_string(),
                false_names: kind.false_names,
                detected: kind
                    .by_rho
                    .iter()
                    .map(|found| found.map(|[detected, _]| detected))
                    .collect(),
                named: kind
                    .by_rho
                    .iter()
                    .map(|found| found.map(|[_, named]| named))
                    .collect(),
            })
            .collect(),
    }
}
