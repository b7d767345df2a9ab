//! Delays of single gyros: their rows are moved in time, for a column of a delay is its first order only.

use rlg_catalogue::signals::Path;
use rlg_findings::entries::{by_axis, unlisted};
use rlg_findings::result::EffectEntry;
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_signal::axes::AXES;

use crate::reference::cards::card;
use crate::rows::linearised_rows::Gyros;

/// The contract's kind.
pub(crate) const KIND: &str = "gyro_delay";

/// Delays of the gyros beyond that which they share with the reference, and their standard deviations \[s\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Late {
    pub(crate) values_s: [f64; 3],
    pub(crate) stds_s: [f64; 3],
}

impl Late {
    /// Adds delays that were found after these.
    pub(crate) fn add(&mut self, more: &Self) {
        for axis in 0..3 {
            self.values_s[axis] += more.values_s[axis];
        }
        self.stds_s = more.stds_s;
    }
}

/// Delays stated by a model \[s\].
pub(crate) fn of_model(model: &Model) -> [f64; 3] {
    let of_kind = model.effects.iter().filter(|one| one.kind == KIND);
    of_kind.fold([0.0; 3], |sum, one| {
        [0, 1, 2].map(|axis: usize| sum[axis] + one.number(AXES[axis]))
    })
}

/// Moves the gyros' rows to when they were sensed.
pub(crate) fn advance(gyros: &mut Gyros, late_s: [f64; 3]) {
    let path = Path {
        delay_s: late_s.map(|late_s| -late_s),
        ..Path::default()
    };
    for axis in (0..3).filter(|axis| late_s[*axis] != 0.0) {
        let values = gyros.along(axis);
        gyros.set_along(axis, &path.along(axis, &values, gyros.rate_hz));
    }
}

/// The entry of delays that were found, and its effect.
pub(crate) fn entry(late: &Late) -> Option<(EffectEntry, ModelEffect)> {
    if late.values_s == [0.0; 3] {
        return None;
    }
    let card = card(KIND);
    let (parameters, covariance) = by_axis(late.values_s, late.stds_s, card.unit);
    let entry = EffectEntry {
        kind: KIND.to_string(),
        parameters,
        covariance,
        ..unlisted(card.equation.to_string(), card.meaning.to_string())
    };
    let values = AXES.into_iter().zip(late.values_s);
    let effect = ModelEffect {
        kind: KIND.to_string(),
        parameters: values
            .map(|(name, value)| (name.to_string(), EffectValue::Number(value)))
            .collect(),
    };
    Some((entry, effect))
}
