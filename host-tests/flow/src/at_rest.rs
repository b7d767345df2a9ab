//! Unit at rest on the Earth, and the reason for its accelerometers not being tested.

use rlg_diagnosis::rows::data_words;
use rlg_diagnosis::{Unfit, at_rest};
use rlg_model::DeclaredModel;
use rlg_signal::qualify;
use rlg_signal::streams::Streams;

use crate::{Outcome, Settings};

/// Diagnoses aligned channels, consuming the sensed increments.
pub(super) fn diagnose(
    settings: &Settings,
    streams: &mut Streams,
    of: DeclaredModel<'_>,
    progress: &dyn Fn(&str),
) -> Result<Outcome, Unfit> {
    let model = of.model;
    let faults = qualify::qualify(streams, &settings.plan.signal.faults);
    if !faults.is_empty() {
        streams.stand_still_again(model, &settings.plan.signal.align);
    }
    let is_news =
        |fault: &&rlg_signal::fault::Fault| !qualify::is_known(fault, streams, &model.effects);
    let faults: Vec<_> = faults.iter().filter(is_news).cloned().collect();
    let said = data_words::lines(streams, &faults);
    let reason = rlg_force::why_not_at_rest(streams);
    let mut found = at_rest::diagnose(settings, streams, &faults, of, progress)?;
    found.diagnosis.summary.extend(said);
    rlg_force::say_why_not(&reason, &mut found);
    Ok(found)
}
