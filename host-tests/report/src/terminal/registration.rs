//! Text on the alignment of two instruments: supported and unsupported parameters, and held-out time.

use rlg_findings::names::plain;
use rlg_findings::result::Diagnosis;

use super::{effects, figures, sizes};

/// Formats an alignment, a line each, with every parameter of the registration.
///
/// `note`: additional information for the reader, such as an assumed model.
pub fn alignment(diagnosis: &Diagnosis, note: Option<&str>) -> Vec<String> {
    let registration = &diagnosis.registration;
    let supported = registration.iter().filter(|one| one.supported).count();
    let mut lines = vec![format!(
        "{}: the recording supports {supported} of {} groups of numbers that align the two instruments.",
        diagnosis.recording,
        registration.len(),
    )];
    lines.extend(note.map(str::to_owned));
    lines.extend(effects::lines(diagnosis, usize::MAX));
    let others: Vec<(String, String)> = registration
        .iter()
        .filter(|one| !one.supported)
        .map(|one| (plain(&one.kind), sizes::all(&one.parameters)))
        .collect();
    if !others.is_empty() {
        lines.push("Not supported, each beside the others:".to_owned());
    }
    let width = others.iter().map(|(name, _)| name.chars().count()).max();
    let width = width.unwrap_or(0);
    let other = |(name, sizes): &(String, String)| format!("  {name:<width$}   {sizes}");
    lines.extend(others.iter().map(other));
    lines.extend(effects::not_distinguishable(diagnosis));
    lines.extend(figures::drift(diagnosis));
    lines.extend(figures::power(diagnosis));
    lines.push("Physics was not searched for: rlg diagnose does that.".to_owned());
    lines
}
