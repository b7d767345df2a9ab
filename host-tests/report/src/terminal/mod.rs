//! Text of a diagnosis for a terminal: at most [`MOST_LINES`] lines, none of them cut.
//!
//! verdict → residual relative to the motion → findings, with sizes → locations → held-out time before and after → alternative causes → next experiment.
//! Everything is formatted from the fields of [`Diagnosis`], never from its sentences, except the verdict's own and that on the
//! attitudes' convention.

mod effects;
mod figures;
mod noise;
mod picture;
mod registration;
mod sizes;

pub(crate) use effects::fault_groups;
pub(crate) use figures::{QUIET, quieter};
pub use picture::picture;
pub use registration::alignment;
pub(crate) use sizes::{below_significance, is_time};

use rlg_findings::names::plain;
use rlg_findings::numbers::Scale;
use rlg_findings::result::{Diagnosis, Verdict};
use rlg_findings::sentences::READ_AS;

/// Largest number of lines of an answer, before the line with the page's path.
pub const MOST_LINES: usize = 14;

/// Largest number of kinds listed as detectable in a recording without findings.
const MOST_KINDS: usize = 5;

/// Names and sizes of the findings, as in the answer.
pub fn findings(diagnosis: &Diagnosis) -> Vec<(String, String)> {
    effects::said(diagnosis)
}

/// Lines of the answer on held-out time and on alternative causes.
pub fn beside_findings(diagnosis: &Diagnosis) -> Vec<String> {
    let drift = figures::drift(diagnosis);
    drift
        .into_iter()
        .chain(effects::not_distinguishable(diagnosis))
        .collect()
}

/// Formats the answer, a line each.
///
/// `note`: additional information for the reader, such as an assumed model.
pub fn lines(diagnosis: &Diagnosis, note: Option<&str>) -> Vec<String> {
    let mut head: Vec<String> = diagnosis.summary.first().cloned().into_iter().collect();
    let mut said = diagnosis.summary.iter();
    head.extend(said.find(|line| line.starts_with(READ_AS)).cloned());
    if diagnosis.verdict != Verdict::Unusable {
        head.extend(noise::residual(diagnosis));
    }
    if diagnosis.verdict == Verdict::Unusable {
        // There is no finding to format: the rest are sentences.
        let left = diagnosis.summary.iter().skip(1);
        head.extend(left.filter(|line| !line.starts_with(READ_AS)).cloned());
    }
    head.extend(note.map(str::to_owned));
    let mut tail = Vec::new();
    if diagnosis.verdict != Verdict::Unusable {
        tail.extend(figures::places(diagnosis));
        tail.extend(figures::drift(diagnosis));
        tail.extend(figures::power(diagnosis));
        tail.extend(figures::unlike_noise(diagnosis));
        tail.extend(noise::noise(diagnosis));
        tail.extend(sensitive(diagnosis));
        tail.extend(effects::not_distinguishable(diagnosis));
    }
    if !diagnosis.next_experiment.is_empty() {
        tail.push(format!("Next: {}", diagnosis.next_experiment));
    }
    let room = MOST_LINES.saturating_sub(head.len() + tail.len());
    head.extend(effects::lines(diagnosis, room));
    head.extend(tail);
    head
}

/// For a recording without findings: the kinds with the highest sensitivity.
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
    let needed_snr = diagnosis.thresholds().findings.needed_snr;
    let said = reach.iter().take(MOST_KINDS).map(|one| {
        let from = one.typical * needed_snr / one.snr;
        let scale = Scale::of("x", &one.unit, from);
        let size = sizes::to_two_digits(from * scale.factor);
        format!("{} from {}", plain(&one.kind), scale.with_unit(&size))
    });
    let said: Vec<String> = said.collect();
    (!said.is_empty()).then(|| format!("Detectable here: {}.", said.join(", ")))
}
