//! What the accelerometers read less what their model predicts.
//!
//! Enters: the scene with its felt force, the model. Leaves: the residual on the accelerometers' rows \[m/s per row\],
//! and sums of such.

use super::Given;
use super::felt::Felt;
use crate::hypotheses::{self, CATALOGUE, Subject};
use crate::residual::values_of;
use crate::scene::Scene;
use crate::streams::{Triad, add_triad, each_axis};

/// The prediction that a scene with accelerometers has.
pub(super) fn scene_felt(scene: &Scene) -> &Felt {
    scene.felt.as_ref().expect("prepared before")
}

/// What an effect adds to the readings \[m/s per row\], be it the accelerometers' own or the reference's.
pub(super) fn prediction(scene: &Scene, effect: usize, values: &[f64]) -> Triad {
    let entry = CATALOGUE[effect];
    if entry.subject() == Subject::Accelerometers {
        return entry.prediction(scene, values);
    }
    hypotheses::sum_of_columns(scene_felt(scene).rows.count, values, &|parameter, axis| {
        entry.force_column(scene, parameter, axis)
    })
}

/// Readings less the model's prediction, its own accelerometer effects included \[m/s per row\].
pub(super) fn residual_m_s(scene: &Scene, given: &Given) -> Triad {
    let felt = scene_felt(scene);
    let bias_m_s2 = given
        .model
        .accelerometer
        .as_ref()
        .map_or([0.0; 3], |accelerometer| accelerometer.bias_m_s2);
    let mut residual = felt.rows.sensed_m_s.clone();
    let plain = each_axis(|axis| felt.sensed_m_s(axis, bias_m_s2[axis]));
    add_triad(&mut residual, &plain, -1.0);
    for effect in &given.model.effects {
        let known = hypotheses::find(&effect.kind).map(|(_, hypothesis)| hypothesis);
        if let Some(hypothesis) = known.filter(|h| h.subject() == Subject::Accelerometers) {
            let values = values_of(hypothesis, effect);
            add_triad(&mut residual, &hypothesis.prediction(scene, &values), -1.0);
        }
    }
    residual
}
