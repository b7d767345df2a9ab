//! A line of the residual as an entry of `diagnosis.json` and as an effect of a model, as of the lines of a spectrum alone.

use realfft::num_complex::Complex64;
use rlg_diagnosis::report::own_lines;
use rlg_findings::result::EffectEntry;
use rlg_model::ModelEffect;
use rlg_signal::own_lines::OwnLine;

use crate::fits::report_inputs::Said;
use crate::report::parameter_values::Numbers;
use crate::selection::group_selection::Named;

/// Entry and effect of a line; `None` if the model has it.
pub(crate) fn of(
    said: &Said,
    one: &Named,
    numbers: &Numbers,
) -> Option<(EffectEntry, ModelEffect)> {
    let wave = one.line()?;
    let streams = &said.observed.streams;
    let row_s = 1.0 / streams.rate_hz;
    let mut amplitude_rad = [Complex64::ZERO; 3];
    amplitude_rad[wave.axis] = Complex64::new(numbers.values[1], -numbers.values[0]) * row_s;
    let own = OwnLine {
        hz: [wave.hz, wave.hz_std],
        amplitude_rad,
        std_rad: (0.5 * numbers.covariance.trace()).max(0.0).sqrt() * row_s,
        gain: one.statistic.squared_size,
        is_hidden: false,
    };
    let model = said.observed.model;
    let (entry, effect) = own_lines::entries(&[own], streams.rows, streams.rate_hz, model).pop()?;
    let entry = EffectEntry {
        indistinguishable_from: one.alike.iter().map(|kind| (*kind).to_string()).collect(),
        log_evidence_gain: one.gain,
        p_value: one.p_value,
        evidence: Some(one.evidence()),
        ..entry
    };
    Some((entry, effect))
}
