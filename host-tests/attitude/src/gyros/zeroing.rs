//! Automatic zeroing of gyros beside attitudes: found and undone before anything is aligned, for a gyro that forgets a constant rate
//! follows no scale, axis or delay.
//!
//! Each gyro is predicted from the reference's three rates behind a high pass, with a free map and a free constant, in sums over a
//! tenth of a second; the time constant of least squares stands where it leaves much less than no high pass does.

use rlg_plan::{GridPlan, ZeroingPlan};
use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use rlg_catalogue::entries::HIGH_PASS;
use rlg_catalogue::high_pass::{HighPass, Part, grid};
use rlg_findings::entries::{uncorrelated, unlisted};
use rlg_findings::result::{EffectEntry, ParameterEntry};
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_signal::axes::{AXES, Triad};

use crate::reference::cards::card;
use crate::rows::linearised_rows::Gyros;

/// Time constant of a gyro's high pass, and its standard deviation \[s\].
pub(crate) type Zeroed = [Option<[f64; 2]>; 3];

/// Time constants of a model.
pub(crate) fn of_model(model: &Model) -> [Option<HighPass>; 3] {
    let of_kind = model.effects.iter().filter(|one| one.kind == HIGH_PASS);
    let of_kind: Vec<&ModelEffect> = of_kind.collect();
    AXES.map(|axis| {
        let time_s: f64 = of_kind.iter().map(|one| one.number(axis)).sum();
        (time_s > 0.0).then_some(HighPass { time_s })
    })
}

/// Finds the high pass of each gyro, in the rows that are `seen`.
///
/// # Inputs
/// `reference_rad`: the reference's increments on the gyros' rows.
pub(crate) fn find(
    gyros: &Gyros,
    (reference_rad, seen): (&Triad, &[bool]),
    (plan, grids): (&ZeroingPlan, &GridPlan),
) -> Zeroed {
    let data = Data {
        reference_rad,
        block: ((plan.block_s * gyros.rate_hz).round() as usize).max(1),
        seen,
        period_s: 1.0 / gyros.rate_hz,
    };
    [0, 1, 2].map(|gyro| data.high_pass(&gyros.along(gyro), plan, grids))
}

struct Data<'a> {
    reference_rad: &'a Triad,
    seen: &'a [bool],
    /// Rows of a sum.
    block: usize,
    period_s: f64,
}

impl Data<'_> {
    fn high_pass(&self, values: &[f64], plan: &ZeroingPlan, grids: &GridPlan) -> Option<[f64; 2]> {
        let sums = self.sums(values);
        let left = |time_s: Option<f64>| self.left(&sums, time_s);
        let without = left(None)?;
        let best = grid(self.period_s, values.len(), grids)
            .into_iter()
            .filter_map(|one| Some((left(Some(one.time_s))?, one.time_s)))
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        if best.0 > plan.left * without {
            return None;
        }
        /// Golden sections of an octave either way: to 1e-6 of the time constant.
        const SECTIONS: usize = 32;
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut from, mut to) = (best.1.ln() - 0.7, best.1.ln() + 0.7);
        for _ in 0..SECTIONS {
            let [low, high] = [to - golden * (to - from), from + golden * (to - from)];
            match left(Some(low.exp()))? < left(Some(high.exp()))? {
                true => to = high,
                false => from = low,
            }
        }
        let time_s = (0.5 * (from + to)).exp();
        /// Relative step of the second difference.
        const STEP: f64 = 0.01;
        let here = left(Some(time_s))?;
        let beside = left(Some(time_s * (1.0 + STEP)))? + left(Some(time_s * (1.0 - STEP)))?;
        let curvature = (beside - 2.0 * here) / (STEP * time_s).powi(2);
        let variance = here / sums.len() as f64;
        Some([time_s, (2.0 * variance / curvature).max(0.0).sqrt()])
    }

    /// Sums of rows that are all seen.
    fn sums(&self, values: &[f64]) -> Vec<f64> {
        let blocks = values
            .chunks_exact(self.block)
            .zip(self.seen.chunks_exact(self.block));
        let whole = blocks.filter(|(_, seen)| seen.iter().all(|seen| *seen));
        whole.map(|(values, _)| values.iter().sum()).collect()
    }

    /// Sum of squares that a map of the reference behind a high pass, or behind none, leaves.
    fn left(&self, sums: &[f64], time_s: Option<f64>) -> Option<f64> {
        let passed = |values: &[f64]| -> Vec<f64> {
            let mut passed = values.to_vec();
            if let Some(time_s) = time_s {
                let beyond = HighPass { time_s }.beyond(values, self.period_s, Part::Response);
                passed
                    .iter_mut()
                    .zip(beyond)
                    .for_each(|(value, beyond)| *value += beyond);
            }
            passed
        };
        let constant = vec![self.period_s; self.seen.len()];
        let mut columns: Vec<Cow<[f64]>> = self
            .reference_rad
            .iter()
            .map(|axis| Cow::Owned(passed(axis)))
            .collect();
        columns.push(Cow::Owned(passed(&constant)));
        if time_s.is_some() {
            columns.push(Cow::Borrowed(&constant));
        }
        let columns: Vec<Vec<f64>> = columns.iter().map(|column| self.sums(column)).collect();
        if sums.len() <= columns.len() {
            return None;
        }
        let design = DMatrix::from_fn(sums.len(), columns.len(), |row, column| {
            columns[column][row]
        });
        let values = DVector::from_column_slice(sums);
        let moments = design.tr_mul(&values);
        let inverse = rlg_inference::linear::pseudo_inverse(&design.tr_mul(&design));
        Some(values.norm_squared() - moments.dot(&(inverse * &moments)))
    }
}

/// High passes that were found.
pub(crate) fn high_passes(zeroed: &Zeroed) -> [Option<HighPass>; 3] {
    zeroed.map(|one| one.map(|[time_s, _]| HighPass { time_s }))
}

/// Passes what gyros sensed through high passes.
pub(crate) fn pass(gyros: &mut Gyros, high_passes: [Option<HighPass>; 3]) {
    changed(gyros, high_passes, |high_pass, values, period_s| {
        let beyond = high_pass.beyond(values, period_s, Part::Response);
        rlg_signal::axes::add(values, &beyond, 1.0);
    });
}

/// Undoes high passes on what gyros sensed.
pub(crate) fn undo(gyros: &mut Gyros, high_passes: [Option<HighPass>; 3]) {
    changed(gyros, high_passes, |high_pass, values, period_s| {
        high_pass.undo(values, period_s);
    });
}

/// Changes the increments of each gyro that has a high pass.
fn changed(
    gyros: &mut Gyros,
    high_passes: [Option<HighPass>; 3],
    change: impl Fn(HighPass, &mut [f64], f64),
) {
    for (axis, high_pass) in high_passes.into_iter().enumerate() {
        let Some(high_pass) = high_pass else { continue };
        let mut values = gyros.along(axis);
        change(high_pass, &mut values, 1.0 / gyros.rate_hz);
        gyros.set_along(axis, &values);
    }
}

/// The entry of high passes that were found, and its effect.
pub(crate) fn entry(zeroed: &Zeroed) -> Option<(EffectEntry, ModelEffect)> {
    let found = || {
        let each = zeroed.iter().enumerate();
        each.filter_map(|(axis, one)| one.map(|[value, std]| (AXES[axis].to_string(), value, std)))
    };
    if found().count() == 0 {
        return None;
    }
    let card = card(HIGH_PASS);
    let parameters =
        found().map(|(name, value, std)| ParameterEntry::number(&name, value, std, card.unit));
    let stds: Vec<f64> = found().map(|(_, _, std)| std).collect();
    let entry = EffectEntry {
        kind: HIGH_PASS.to_string(),
        parameters: parameters.collect(),
        covariance: uncorrelated(&stds),
        ..unlisted(card.equation.to_string(), card.meaning.to_string())
    };
    let values = found().map(|(name, value, _)| (name, EffectValue::Number(value)));
    let effect = ModelEffect {
        kind: HIGH_PASS.to_string(),
        parameters: values.collect(),
    };
    Some((entry, effect))
}
