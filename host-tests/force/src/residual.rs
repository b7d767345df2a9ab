//! Residual of the accelerometers: measured less predicted by their model.

use rlg_catalogue::accelerometers::KINDS;
use rlg_model::Model;
use rlg_signal::axes::{Triad, add};

use crate::candidates::terms_of;
use crate::prediction::Prediction;

/// Subtracts from the accelerometer samples the model's prediction, its own accelerometer effects included \[m/s per row\].
pub fn residual_m_s(made_of: &Prediction, model: &Model) -> Triad {
    let accelerometer = model.accelerometer.as_ref();
    let bias_m_s2 = accelerometer.map_or([0.0; 3], |accelerometer| accelerometer.bias_m_s2);
    let mut residual = made_of.rows.sensed_m_s.clone();
    let period_s = made_of.rows.period_s();
    let keeps = made_of.scale_error.map(|scale_error| 1.0 - scale_error);
    for (axis, residual) in residual.iter_mut().enumerate() {
        let bias = bias_m_s2[axis] / keeps[axis];
        for (value, force) in residual.iter_mut().zip(&made_of.force_m_s2[axis]) {
            *value -= (force + bias) * period_s / keeps[axis];
        }
    }
    for effect in &model.effects {
        let Some(kind) = KINDS.iter().find(|kind| kind.kind == effect.kind) else {
            continue;
        };
        for (name, on) in kind.law.parameters() {
            let size = effect.number(&name);
            if size == 0.0 {
                continue;
            }
            for axis in on {
                for (column, factor) in terms_of(kind, &name, axis, size) {
                    let values = column.values(made_of);
                    add(&mut residual[axis], &values, -factor / keeps[axis]);
                }
            }
        }
    }
    residual
}
