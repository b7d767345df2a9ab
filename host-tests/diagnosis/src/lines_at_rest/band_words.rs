//! Bands of noise as entries of `diagnosis.json` and as effects of a model.

use rlg_findings::entries::{append, by_axis, unlisted};
use rlg_findings::result::{EffectEntry, ParameterEntry};
use rlg_findings::sentences::DEG_H;
use rlg_model::{EffectValue, Model, ModelEffect};

use super::bands::Band;

const FREQUENCY: &str = "frequency_hz";
const WIDTH: &str = "width_hz";

/// Entries of bands that the model does not hold, the strongest first.
pub(crate) fn entries(bands: &[Band], model: &Model) -> Vec<EffectEntry> {
    let mut news: Vec<&Band> = bands.iter().filter(|band| !is_known(band, model)).collect();
    news.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    news.into_iter().map(entry).collect()
}

/// True if a model has a band at this frequency.
pub(crate) fn is_known(band: &Band, model: &Model) -> bool {
    let mut known = model.effects.iter().filter_map(|effect: &ModelEffect| {
        let number = |name: &str| match effect.parameters.get(name) {
            Some(EffectValue::Number(value)) => Some(*value),
            _ => None,
        };
        Some([number(FREQUENCY)?, number(WIDTH)?])
    });
    known.any(|[hz, width_hz]| (hz - band.hz[0]).abs() < width_hz.max(band.width_hz[0]))
}

fn entry(band: &Band) -> EffectEntry {
    let [hz, hz_std] = band.hz;
    let [width_hz, width_std] = band.width_hz;
    let sizes = band.rms_rad_s.map(|[rms, _]| rms);
    let stds = band.rms_rad_s.map(|[_, std]| std);
    let (mut parameters, mut covariance) = by_axis(sizes, stds, "rad/s");
    for (name, value, std) in [(FREQUENCY, hz, hz_std), (WIDTH, width_hz, width_std)] {
        let number = ParameterEntry::number(name, value, std, "Hz");
        append(&mut parameters, &mut covariance, number);
    }
    let [x, y, z] = sizes.map(|rms| rms * DEG_H);
    EffectEntry {
        parameters,
        covariance,
        log_evidence_gain: 0.5 * band.gain,
        p_value: band.ln_chance.exp(),
        expression: Some(format!("band({hz:.5},{width_hz:.5})")),
        ..unlisted(
            format!("S_i(f) += A_i^2 (w/2) / (pi ((f - {hz:.5})^2 + (w/2)^2)), w = {width_hz:.5}"),
            format!(
                "Band of noise at {hz:.4} Hz, {width_hz:.4} Hz wide at half power, {x:.2}, {y:.2}, {z:.2} °/h root mean square on x, y, z. No constant phase: an excited resonance of the mount or of the unit, or a tone of unstable frequency."
            ),
        )
    }
}
