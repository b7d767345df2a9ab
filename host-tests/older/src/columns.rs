//! Columns of the catalogue's effects on one portion of rows.
//!
//! Enters: the scene, a portion, effects and where they are linearised. Leaves: [`Column`]s in single precision and, axis by
//! axis, what of them a fit of the noise takes away. The bench
//! (workbench.rs) puts columns of its own behind these, with indices beyond the catalogue's parameters.

use rayon::prelude::*;

use super::hypotheses::CATALOGUE;
use super::noise::Noise;
use super::portion::Portion;
use super::regressor::Regressor;
use super::scene::Scene;
use super::workbench::{ParameterId, Parameters};

/// One column on one axis.
pub struct Column {
    /// The axis that shows it.
    pub axis: usize,
    /// Which parameter it belongs to.
    pub index: usize,
    /// What a unit of the parameter makes.
    pub bins: Regressor,
}

/// The columns of `effects`, linearised at `at`, where they have any.
pub fn make(
    scene: &Scene,
    parameters: &Parameters,
    portion: &Portion,
    effects: &[usize],
    at: &[Vec<f64>],
) -> Vec<Column> {
    let mut columns = Vec::new();
    let mut wanted: Vec<(usize, usize)> = Vec::new();
    for &effect in effects {
        let at_once = CATALOGUE[effect].columns_at_once(scene, &at[effect]);
        let of = parameters.of(effect);
        match at_once {
            Some(rows) => columns.par_extend(rows.into_par_iter().map(
                |(parameter, axis, values)| Column {
                    axis,
                    index: of.start + parameter,
                    bins: Regressor::new(&portion.transform(&values)),
                },
            )),
            None => wanted.extend(of.flat_map(|index| (0..3).map(move |axis| (index, axis)))),
        }
    }
    columns.par_extend(wanted.into_par_iter().filter_map(|(index, axis)| {
        let ParameterId { effect, parameter } = parameters.id(index)?;
        let values = CATALOGUE[effect].column(scene, &at[effect], parameter, axis)?;
        Some(Column {
            axis,
            index,
            bins: Regressor::new(&portion.transform(&values)),
        })
    }));
    columns.sort_by_key(|column| (column.index, column.axis));
    columns
}

/// Makes the columns of one effect anew, linearised at `at`, in the place of those it had.
pub fn renew(
    columns: &mut Vec<Column>,
    scene: &Scene,
    parameters: &Parameters,
    portion: &Portion,
    effect: usize,
    at: &[Vec<f64>],
) {
    let of = parameters.of(effect);
    columns.retain(|column| !of.contains(&column.index));
    columns.extend(make(scene, parameters, portion, &[effect], at));
    columns.sort_by_key(|column| (column.axis, column.index));
}

/// The columns on one axis.
pub fn on(columns: &[Column], axis: usize) -> impl Iterator<Item = &Column> {
    columns.iter().filter(move |column| column.axis == axis)
}

/// What is fitted away on one axis before its noise is judged: the joints, the columns of `effects` and all that stand
/// behind the catalogue.
pub fn fitted<'c>(
    (joints, columns): (&'c [Regressor], &'c [Column]),
    axis: usize,
    (parameters, effects): (&Parameters, &[usize]),
) -> Vec<&'c Regressor> {
    let own = on(columns, axis).filter(|column| {
        let id = parameters.id(column.index);
        id.is_none_or(|id| effects.contains(&id.effect))
    });
    joints
        .iter()
        .chain(own.map(|column| &column.bins))
        .collect()
}

/// Noise of the three axes, fitted side by side.
pub fn noise_by_axis(fit: impl Fn(usize) -> Noise + Sync) -> [Noise; 3] {
    let fitted: Vec<Noise> = (0..3_usize).into_par_iter().map(&fit).collect();
    [fitted[0], fitted[1], fitted[2]]
}
