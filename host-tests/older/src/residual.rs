//! What the gyros sensed less what the model predicts.
//!
//! Contract, "The model without effects predicts": sensed increment of gyro i =
//! \[M⁻¹ (case increment) + b_i T/(1 − s_i)\]_i/(1 − s_i) + pickoff_gain_i · (pickoff difference), M the matrix
//! of Eq. (7). Effects that the model already has are added through their own hypotheses.
//!
//! Enters: [`Scene`], [`Model`]. Leaves: residual increments \[rad\], `[gyro][row]`.

use super::empirical;
use super::hypotheses::{self, Hypothesis};
use super::scene::Scene;
use super::streams::{Triad, add_triad};
use rlg_model::kinds::{FAULT_KINDS, NOISE_KINDS};
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_recording::error::InputError;
pub use rlg_signal::residual::{body_from_sensing, without_effects};

/// The residual of a model.
pub fn residual_rad(
    scene: &Scene,
    model: &Model,
    file: &std::path::Path,
) -> Result<Triad, InputError> {
    let streams = &scene.streams;
    let sensing_from_body = body_from_sensing(&model.gyro.installation_rad)
        .try_inverse()
        .ok_or_else(|| {
            InputError::new(file, "the installation matrix has no inverse")
                .channel("gyro.installation_rad")
        })?;
    let dither_rad = scene
        .dither_increment_rad(0)
        .map(|_| std::array::from_fn(|axis| scene.dither_increment_rad(axis).unwrap_or_default()));
    let mut residual = without_effects(streams, model, sensing_from_body, dither_rad.as_ref());
    for effect in model
        .effects
        .iter()
        .filter(|effect| predicts_something(effect))
    {
        let part = prediction_of(scene, effect, file)?;
        add_triad(&mut residual, &part, -1.0);
    }
    Ok(residual)
}

/// Effects of the noise, of the accelerometers and faults of the data add nothing to what a gyro senses.
fn predicts_something(effect: &ModelEffect) -> bool {
    let kind = effect.kind.as_str();
    if matches!(effect.parameters.get("expression"), Some(EffectValue::Text(text)) if is_of_rows(text) || is_line(effect))
    {
        return false;
    }
    let of_accelerometer = kind.starts_with("accel_") || kind == "size_effect";
    !NOISE_KINDS.contains(&kind)
        && !FAULT_KINDS.contains(&kind)
        && !of_accelerometer
        && kind != "lock_in"
}

/// Whether an effect is a line of all gyros, whose phase is that of each recording.
fn is_line(effect: &ModelEffect) -> bool {
    !effect.parameters.contains_key("axis") && effect.parameters.contains_key("frequency_hz")
}

/// Expressions about when and how rows were taken: they say nothing of what a gyro sensed.
pub fn is_of_rows(expression: &str) -> bool {
    ["row_rate(", "noise_cycle("]
        .iter()
        .any(|stem| expression.starts_with(stem))
}

/// What an effect of the model adds to the sensed increments \[rad\].
fn prediction_of(
    scene: &Scene,
    effect: &ModelEffect,
    file: &std::path::Path,
) -> Result<Triad, InputError> {
    if let Some(part) = empirical::prediction(scene, effect) {
        return part.map_err(|problem| InputError::new(file, problem).channel(effect.kind.clone()));
    }
    let Some((_, hypothesis)) = hypotheses::find(&effect.kind) else {
        return Err(
            InputError::new(file, "this version cannot predict the effect")
                .channel(effect.kind.clone())
                .expected("an effect of the catalogue that `rlg diagnose` tests, or none"),
        );
    };
    if let Some(missing) = hypothesis.missing(scene) {
        return Err(InputError::new(
            file,
            format!("the effect needs what the recording lacks: {missing}"),
        )
        .channel(effect.kind.clone()));
    }
    Ok(hypothesis.prediction(scene, &values_of(hypothesis, effect)))
}

/// The effect's numbers in the catalogue's order; absent ones are zero.
pub(super) fn values_of(hypothesis: &dyn Hypothesis, effect: &ModelEffect) -> Vec<f64> {
    let card = hypothesis.card();
    (0..card.count())
        .map(
            |parameter| match effect.parameters.get(&card.name(parameter)) {
                Some(EffectValue::Number(value)) => *value,
                _ => 0.0,
            },
        )
        .collect()
}
