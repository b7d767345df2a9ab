//! Says a diagnosis on a terminal: in at most [`MOST_LINES`] lines, none of them cut.
//!
//! verdict → what was found, with sizes → where → held-out time before and after → what it could also be → what to
//! record next. Everything is made of the fields of [`Diagnosis`], never of its sentences, save the verdict's own.

mod effects;
mod figures;
mod noise;
mod registration;
mod sizes;

pub use registration::alignment;

use rlg_findings::names::plain;
use rlg_findings::numbers::Scale;
use rlg_findings::result::{Diagnosis, Verdict};
use rlg_findings::sentences::NEEDED_SNR;

/// Lines of an answer; the one that names the page comes after them.
pub const MOST_LINES: usize = 14;

/// Kinds that a recording without findings is said to have been sensitive to.
const MOST_KINDS: usize = 5;

/// Names and sizes of what was found, as the answer says them.
pub fn findings(diagnosis: &Diagnosis) -> Vec<(String, String)> {
    effects::said(diagnosis)
}

/// What the answer says of held-out time and of other causes, a line each.
pub fn beside_findings(diagnosis: &Diagnosis) -> Vec<String> {
    let drift = figures::drift(diagnosis);
    drift
        .into_iter()
        .chain(effects::not_told_apart(diagnosis))
        .collect()
}

/// Writes the answer, a line each.
///
/// `note`: what the reader must know beside the verdict, as a model that was assumed.
pub fn lines(diagnosis: &Diagnosis, note: Option<&str>) -> Vec<String> {
    let mut head: Vec<String> = diagnosis.summary.first().cloned().into_iter().collect();
    head.extend(note.map(str::to_owned));
    let mut tail = Vec::new();
    if diagnosis.verdict != Verdict::Unusable {
        tail.extend(figures::places(diagnosis));
        tail.extend(figures::drift(diagnosis));
        tail.extend(figures::power(diagnosis));
        tail.extend(figures::unlike_noise(diagnosis));
        tail.extend(noise::noise(diagnosis));
        tail.extend(sensitive(diagnosis));
        tail.extend(effects::not_told_apart(diagnosis));
    }
    if !diagnosis.next_experiment.is_empty() {
        tail.push(format!("Next: {}", diagnosis.next_experiment));
    }
    let room = MOST_LINES.saturating_sub(head.len() + tail.len());
    head.extend(effects::lines(diagnosis, room));
    head.extend(tail);
    head
}

/// Where nothing was found: what would have been, the kinds that this recording shows best.
fn sensitive(diagnosis: &Diagnosis) -> Option<String> {
    if !diagnosis.effects.is_empty() {
        return None;
    }
    let mut reach: Vec<_> = diagnosis
        .sensitivity
        .iter()
        .filter(|one| one.snr > 0.0)
        .collect();
    reach.sort_by(|a, b| b.snr.total_cmp(&a.snr));
    let said = reach.iter().take(MOST_KINDS).map(|one| {
        let from = one.typical * NEEDED_SNR / one.snr;
        let scale = Scale::of("x", &one.unit, from);
        let size = sizes::to_two_digits(from * scale.factor);
        format!("{} from {}", plain(&one.kind), scale.with_unit(&size))
    });
    let said: Vec<String> = said.collect();
    (!said.is_empty()).then(|| format!("Would have shown: {}.", said.join(", ")))
}
