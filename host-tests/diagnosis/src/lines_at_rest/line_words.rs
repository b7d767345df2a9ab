//! Lines as entries of `diagnosis.json` and as effects of a model.

use rlg_findings::entries::{append, by_axis, unlisted};
use rlg_findings::result::{EffectEntry, ParameterEntry};
use rlg_findings::sentences::DEG_H;
use rlg_model::{EffectValue, Model, ModelEffect};

use super::line::{Clock, Line, Origin};
use super::products::{expression, words};

/// Entries of lines that the model does not hold, the strongest first.
pub(crate) fn entries(lines: &[Line], clock: Clock, model: &Model) -> Vec<EffectEntry> {
    let mut news: Vec<&Line> = lines
        .iter()
        .filter(|line| line.is_any() && !is_known(line, clock, model))
        .collect();
    news.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let each = news.into_iter();
    each.map(|line| entry(line, lines, clock)).collect()
}

/// True if a model has a line of this frequency: its phase is free in each recording.
pub(crate) fn is_known(line: &Line, clock: Clock, model: &Model) -> bool {
    let frequency_hz = |effect: &ModelEffect| {
        let is_line = matches!(
            effect.parameters.get("expression"),
            Some(EffectValue::Text(text)) if text.starts_with("sine(") || text.starts_with("line(")
        );
        match effect.parameters.get(FREQUENCY) {
            Some(EffectValue::Number(hz)) if is_line => Some(*hz),
            _ => None,
        }
    };
    let mut known = model.effects.iter().filter_map(frequency_hz);
    known.any(|hz| (hz - line.shown_hz).abs() < clock.resolution_hz())
}

const FREQUENCY: &str = "frequency_hz";

fn entry(line: &Line, lines: &[Line], clock: Clock) -> EffectEntry {
    let hz = line.shown_hz;
    let sizes = [0, 1, 2].map(|gyro| line.size_rad(gyro).map(|size| size * clock.rate_hz));
    let amplitudes = sizes.map(|[amplitude, _]| amplitude);
    let (mut parameters, mut covariance) = by_axis(amplitudes, sizes.map(|[_, std]| std), "rad/s");
    let mut number = |name: &str, value: f64, std: f64| {
        let number = ParameterEntry::number(name, value, std, "Hz");
        append(&mut parameters, &mut covariance, number);
    };
    let [x, y, z] = amplitudes.map(|amplitude| amplitude * DEG_H);
    let on_gyros = format!("{x:.2}, {y:.2}, {z:.2} °/h on x, y, z.");
    let (equation, written, said) = match &line.origin {
        Origin::Own(phase) => {
            number(FREQUENCY, hz, phase.hz_std);
            let [wander_hz, std_hz] = phase.wander_hz;
            let wanders = match phase.course_rad.len() {
                0 => String::new(),
                1 => format!(
                    " Its frequency drifts, {:.2} mHz about its mean.",
                    1e3 * wander_hz
                ),
                _ => format!(
                    " Its frequency wanders, {:.2} mHz about its mean.",
                    1e3 * wander_hz
                ),
            };
            if !phase.course_rad.is_empty() {
                number("frequency_wander_hz", wander_hz, std_hz);
            }
            (
                format!("omega_i += A_i sin(2 pi {hz:.5} t + phase_i)"),
                format!("sine({hz:.5})"),
                format!(
                    "Spectral line at {hz:.4} Hz, {on_gyros} Vibration, a converter's tone, or an alias from above half the row rate, such as a dither's: not distinguishable at one row rate.{wanders}"
                ),
            )
        }
        Origin::Product(orders) => {
            let variances = orders
                .iter()
                .map(|&(place, order)| match &lines[place].origin {
                    Origin::Own(phase) => (f64::from(order) * phase.hz_std).powi(2),
                    Origin::Product(_) => 0.0,
                });
            number(FREQUENCY, hz, variances.sum::<f64>().sqrt());
            let written = expression(orders, lines);
            (
                format!("omega_i += Re(C_i {written})"),
                written,
                format!(
                    "Spectral line at {hz:.4} Hz, {on_gyros} Alias of {} at the row rate: a product or harmonic of those lines, with their phase.",
                    words(orders, lines)
                ),
            )
        }
    };
    EffectEntry {
        parameters,
        covariance,
        log_evidence_gain: 0.5 * line.gain,
        p_value: line.ln_chance.exp(),
        expression: Some(written),
        ..unlisted(equation, said)
    }
}
