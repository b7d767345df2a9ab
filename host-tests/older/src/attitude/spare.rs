//! Which of a few steps can be spared for validation.
//!
//! Enters: the steps between attitudes that lie far apart, each with a motion of its own, and the catalogue's columns.
//! Leaves: the steps to hold out: those that teach what others teach too. Only columns are looked at, never errors, so
//! nothing of the answer enters the choice.
//!
//! With W the columns of the steps, whitened, for effects of typical size, K = W Wᵀ is what the steps have in common;
//! leaving step s out costs −½ ln det(1 − H_ss) of ln evidence, H = K (K + 1)⁻¹ its leverage.

use nalgebra::{DMatrix, Matrix3};

use super::bench::AttitudeBench;
use super::record::Record;
use super::whiten::Levels;
use crate::declare::HELD_OUT_SHARE;
use crate::hypotheses::CATALOGUE;
use crate::scene::Scene;
use crate::workbench::Parameters;

/// A step that alone teaches this much (ln evidence) is not spared: a direction nearly unknown without it.
const DEAR: f64 = 1.5;

/// Beyond this the last part of the record is held out instead: many steps repeat themselves anyway.
const MOST: usize = 80;

/// The steps of `steps` to hold out.
pub fn spare(
    scene: &Scene,
    record: &Record,
    parameters: &Parameters,
    candidates: &[usize],
    levels: &Levels,
    steps: &[usize],
) -> Vec<usize> {
    let wanted = (steps.len() as f64 * HELD_OUT_SHARE) as usize;
    if steps.len() > MOST {
        return steps[steps.len() - wanted..].to_vec();
    }
    // Every step by itself: both ends are its own.
    let runs = steps.iter().map(|&step| step - 1..step + 1).collect();
    let bench = AttitudeBench::new(scene, record, parameters, runs, *levels, candidates);
    let indices = parameters.of_all(candidates);
    let columns = bench.whitened_columns(&bench.whitener(), &indices);
    let mut common = DMatrix::<f64>::zeros(3 * steps.len(), 3 * steps.len());
    for (index, column) in &columns {
        let typical = parameters
            .id(*index)
            .map_or(0.0, |id| CATALOGUE[id.effect].card().typical);
        let column = nalgebra::DVector::from_column_slice(column) * typical;
        common.ger(1.0, &column, &column, 1.0);
    }
    let mut kept: Vec<usize> = (0..steps.len()).collect();
    let mut spared = Vec::new();
    while spared.len() < wanted {
        let rows: Vec<usize> = kept
            .iter()
            .flat_map(|k| [3 * k, 3 * k + 1, 3 * k + 2])
            .collect();
        let of_kept = DMatrix::from_fn(rows.len(), rows.len(), |a, b| {
            common[(rows[a], rows[b])] + f64::from(u8::from(a == b))
        });
        // 1 − H = (K + 1)⁻¹.
        let Some(free) = of_kept.cholesky().map(|root| root.inverse()) else {
            break;
        };
        let cost = |place: usize| {
            let block: Matrix3<f64> = free.fixed_view::<3, 3>(3 * place, 3 * place).into_owned();
            -0.5 * block.determinant().max(f64::MIN_POSITIVE).ln()
        };
        let cheapest = (0..kept.len())
            .map(|place| (place, cost(place)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        match cheapest {
            Some((place, cost)) if cost < DEAR => spared.push(steps[kept.remove(place)]),
            _ => break,
        }
    }
    spared.sort_unstable();
    spared
}
