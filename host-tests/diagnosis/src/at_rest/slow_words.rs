//! Slow effects as entries of `diagnosis.json` and effects of a model: their selection, and their indistinguishable kinds.

use nalgebra::{DMatrix, DVector, Vector3};
use rlg_findings::result::{EffectEntry, ParameterEntry};
use rlg_model::kinds::NOISE_KINDS;
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_plan::Plan;
use rlg_recording::units::STANDARD_GRAVITY_M_S2;
use rlg_signal::still::AtRest;
use rlg_signal::streams::AXES;

use super::kinds::{BIAS, KINDS};
use super::settle::body_from_sensing;
use super::{bias_confounders, earth};
use crate::rows::data::Data;

/// Selects the significant effects of a search, and adds the kinds from which they are not distinguishable.
///
/// # Inputs
/// `is_judged`: true if the noise is compared with the model's declaration.
pub(super) fn slow_effects(
    mut effects: Vec<EffectEntry>,
    data: &Data,
    rest: &AtRest,
    is_judged: bool,
    plan: &Plan,
) -> Vec<EffectEntry> {
    effects.retain(|effect| {
        let is_excess = NOISE_KINDS.contains(&&*effect.kind);
        is_excess && is_judged || KINDS.contains(&&*effect.kind) && stands(effect, plan)
    });
    for effect in &mut effects {
        match &*effect.kind {
            BIAS => open_to_the_earth(effect, data, rest, plan),
            // If the values are multiples of the pulse, the cause is unambiguous.
            "pulse_quantisation" if !data.lattice.is_any() => coarse(effect),
            _ => {}
        }
    }
    effects
}

/// Model with the selected effects and all its earlier ones.
pub(super) fn with_found(before: &Model, mut model: Model, found: &[EffectEntry]) -> Model {
    model
        .effects
        .retain(|one| before.effects.contains(one) || found.iter().any(|entry| is_of(one, entry)));
    for one in &before.effects {
        if model.effects.iter().all(|other| other.kind != one.kind) {
            model.effects.push(one.clone());
        }
    }
    model
}

/// True if an effect of a model is the finding: of several steps the one at its time.
fn is_of(effect: &ModelEffect, entry: &EffectEntry) -> bool {
    let same_time = entry.number("time_s").is_none_or(|(time_s, _)| {
        effect.parameters.get("time_s") == Some(&EffectValue::Number(time_s))
    });
    effect.kind == entry.kind && same_time
}

/// True if an effect, drift fitted anew beside it, still costs more to omit than the naming threshold.
fn stands(effect: &EffectEntry, plan: &Plan) -> bool {
    let values: Vec<f64> = effect
        .parameters
        .iter()
        .filter_map(|parameter| match parameter {
            ParameterEntry::Number { name, value, .. } if name != "time_s" => Some(*value),
            _ => None,
        })
        .collect();
    let values = DVector::from_vec(values);
    let count = values.len();
    let covariance = DMatrix::from_fn(count, count, |a, b| effect.covariance[a][b]);
    let Some(cholesky) = covariance.cholesky() else {
        return true;
    };
    0.5 * values.dot(&cholesky.solve(&values)) > plan.judgement.naming
}

/// Adds the alternatives to coarse pulses for white noise of angle at rest.
fn coarse(effect: &mut EffectEntry) {
    effect.indistinguishable_from = ["dither_gain", "dither_delay"].map(str::to_string).to_vec();
    effect.what_was_left_out = "White angle noise above the resolution of the file: a converter with larger pulses, or dither not stripped and aliased over the whole band; not distinguishable without the pickoff.".to_string();
}

/// Adds to a bias its uncertainty by the Earth's rotation, and the kinds from which it is not distinguishable.
fn open_to_the_earth(effect: &mut EffectEntry, data: &Data, rest: &AtRest, plan: &Plan) {
    let mut bias_rad_s = Vector3::zeros();
    let mut gyros = Vec::new();
    for parameter in &effect.parameters {
        let ParameterEntry::Number { name, value, .. } = parameter else {
            continue;
        };
        let Some(gyro) = AXES.iter().position(|axis| axis == name) else {
            continue;
        };
        bias_rad_s[gyro] = *value;
        gyros.push(gyro);
    }
    let variance: f64 = (0..gyros.len()).map(|k| effect.covariance[k][k]).sum();
    let mean_rad_s = rest.earth_rad_s + body_from_sensing(data) * bias_rad_s;
    let sensing = data.sensing_from_body;
    let open = sensing * earth::spread(rest, mean_rad_s, variance) * sensing.transpose();
    for (a, &gyro) in gyros.iter().enumerate() {
        for (b, &other) in gyros.iter().enumerate() {
            effect.covariance[a][b] += open[(gyro, other)];
        }
    }
    let std_of = |name: &str| {
        let of = |gyro: &&usize| AXES[**gyro] == name;
        let place = gyros.iter().position(|gyro| of(&gyro))?;
        Some(effect.covariance[place][place].max(0.0).sqrt())
    };
    for parameter in &mut effect.parameters {
        if let ParameterEntry::Number { name, std, .. } = parameter {
            *std = std_of(name).unwrap_or(*std);
        }
    }
    for one in &mut effect.identifiable {
        let mut names = one.combination.keys();
        if let (Some(name), None) = (names.next(), names.next()) {
            one.std = std_of(name).unwrap_or(one.std);
        }
    }
    let gravity_m_s2 = data
        .streams
        .site
        .map_or(STANDARD_GRAVITY_M_S2, |site| site.gravity_m_s2);
    for kind in bias_confounders::alike(bias_rad_s, gravity_m_s2, plan.rest.alike_deviations) {
        if !effect.indistinguishable_from.contains(&kind) {
            effect.indistinguishable_from.push(kind);
        }
    }
    if let Some(evidence) = effect.evidence.as_mut()
        && !effect.indistinguishable_from.is_empty()
    {
        evidence.label = "class";
    }
    let open_is = match (rest.up, rest.latitude_rad) {
        (Some(_), _) => "the azimuth",
        (None, None) => "the direction (no latitude without a [site])",
        (None, Some(_)) => "the direction (no vertical without accelerometers)",
    };
    effect.what_was_left_out = format!(
        "Mean rates differ from the Earth's rotation. Unknown of that rotation: {open_is}, included in the intervals."
    );
}
