//! Residual, columns and noise of the accelerometers, for the same selection as the gyros'.
//!
//! Enters: the scene with its felt force, the residual \[m/s per row\], a portion of the accelerometers' rows. Leaves:
//! [`Information`] over all parameters of the catalogue and, behind them, the unknowns of the vertical, which
//! belong to every fit.

use rayon::prelude::*;

use crate::diagnose::bench::Bench;
use crate::diagnose::hypotheses::CATALOGUE;
use crate::diagnose::information::Information;
use crate::diagnose::noise::{self, Declared, Noise};
use crate::diagnose::portion::{Bins, Portion};
use crate::diagnose::regressor::{Regressor, regressors};
use crate::diagnose::scene::Scene;
use crate::diagnose::streams::Triad;
use crate::diagnose::workbench::{ParameterId, Parameters};

/// One column on one accelerometer.
struct Column {
    axis: usize,
    index: usize,
    bins: Regressor,
}

/// See the page above.
pub struct ForceBench<'a> {
    scene: &'a Scene,
    parameters: &'a Parameters,
    residual_m_s: &'a Triad,
    /// The rows it works on.
    pub portion: Portion,
    /// Noise of each accelerometer.
    pub noise: [Noise; 3],
    residual: [Bins; 3],
    joints: Vec<Regressor>,
    columns: Vec<Column>,
    /// Where each effect is linearised.
    at: Vec<Vec<f64>>,
    unknowns: usize,
}

impl<'a> ForceBench<'a> {
    /// Transforms the residual, the columns of `effects` and those of the vertical.
    pub fn new(
        scene: &'a Scene,
        residual_m_s: &'a Triad,
        parameters: &'a Parameters,
        portion: Portion,
        noise: [Noise; 3],
        effects: &[usize],
        at: &[Vec<f64>],
    ) -> Self {
        let mut bench = Self {
            scene,
            parameters,
            residual_m_s,
            residual: [0, 1, 2].map(|axis| portion.transform(&residual_m_s[axis])),
            joints: regressors(&portion.joints()),
            portion,
            noise,
            columns: Vec::new(),
            at: at.to_vec(),
            unknowns: 0,
        };
        bench.columns = bench.make_columns(effects);
        // Without a prediction there are no columns, and nothing will be found.
        let Some(felt) = &scene.felt else {
            return bench;
        };
        let tilts = felt.vertical.columns(&felt.rows, &felt.carried);
        bench.unknowns = tilts.len();
        for (place, tilt) in tilts.iter().enumerate() {
            for (axis, force) in tilt.iter().enumerate() {
                let sensed = felt.sensed_from_force(axis, force.iter().copied());
                bench.columns.push(Column {
                    axis,
                    index: parameters.count() + place,
                    bins: Regressor::new(&bench.portion.transform(&sensed)),
                });
            }
        }
        bench
    }

    fn make_columns(&self, effects: &[usize]) -> Vec<Column> {
        let wanted: Vec<(usize, usize)> = self
            .parameters
            .of_all(effects)
            .into_iter()
            .flat_map(|index| (0..3).map(move |axis| (index, axis)))
            .collect();
        wanted
            .into_par_iter()
            .filter_map(|(index, axis)| {
                let ParameterId { effect, parameter } = self.parameters.id(index)?;
                let at = &self.at[effect];
                let values = CATALOGUE[effect].column(self.scene, at, parameter, axis)?;
                let bins = Regressor::new(&self.portion.transform(&values));
                Some(Column { axis, index, bins })
            })
            .collect()
    }

    /// The indices of the vertical's unknowns.
    pub fn unknowns(&self) -> Vec<usize> {
        let first = self.parameters.count();
        (first..first + self.unknowns).collect()
    }

    fn columns_on(&self, axis: usize) -> impl Iterator<Item = &Column> {
        self.columns
            .iter()
            .filter(move |column| column.axis == axis)
    }

    /// Everything fitted on an accelerometer, joints and vertical included, but one effect's columns.
    pub fn columns_without(
        &self,
        axis: usize,
        effect: Option<usize>,
    ) -> impl Iterator<Item = &Regressor> {
        let parameters = self.parameters;
        let kept = self.columns_on(axis).filter(move |column| {
            let of = parameters.id(column.index).map(|id| id.effect);
            of.is_none() || of != effect
        });
        self.joints.iter().chain(kept.map(|column| &column.bins))
    }

    /// The residual's bins.
    pub fn residual(&self, axis: usize) -> &Bins {
        &self.residual[axis]
    }

    /// Fits the noise of every accelerometer to what the columns of `effects`, the joints and the vertical leave.
    pub fn fit_noise(&mut self, effects: &[usize], declared: &[Declared; 3]) {
        let parameters = self.parameters;
        let of_these = |column: &&Column| {
            let effect = parameters.id(column.index).map(|id| id.effect);
            effect.is_none_or(|effect| effects.contains(&effect))
        };
        let fitted: Vec<Noise> = (0..3_usize)
            .into_par_iter()
            .map(|axis| {
                let own = self.columns_on(axis).filter(of_these);
                let columns: Vec<&Regressor> = self
                    .joints
                    .iter()
                    .chain(own.map(|column| &column.bins))
                    .collect();
                let start = Some(self.noise[axis]);
                let residual = &self.residual[axis];
                noise::fit(&self.portion, residual, &columns, declared[axis], start)
            })
            .collect();
        self.noise = [fitted[0], fitted[1], fitted[2]];
    }

    /// Power of each bin of an accelerometer once joints and all columns are fitted away.
    pub fn left_power(&self, axis: usize) -> Vec<f64> {
        let weights = self.noise[axis].weights(&self.portion);
        let own = self.columns_on(axis).map(|column| &column.bins);
        let columns: Vec<Regressor> = self
            .joints
            .iter()
            .chain(own)
            .map(|column| Regressor::new(&column.to_bins()))
            .collect();
        let mut left = self.residual[axis].clone();
        crate::diagnose::information::fit_away(&mut left, &columns, &weights);
        left.iter().map(|value| value.norm_sqr()).collect()
    }

    /// residual − f(p0) + J(p0) p0 for the nonlinear effects, so that a linear solution is p itself.
    fn remake_residual(&mut self) {
        let mut shifted: Triad = self.residual_m_s.clone();
        for (effect, entry) in CATALOGUE.iter().enumerate() {
            let at = &self.at[effect];
            if entry.is_linear() || at.iter().all(|value| *value == 0.0) {
                continue;
            }
            for (sum, part) in shifted.iter_mut().zip(entry.prediction(self.scene, at)) {
                sum.iter_mut()
                    .zip(part)
                    .for_each(|(sum, part)| *sum -= part);
            }
        }
        self.residual = [0, 1, 2].map(|axis| self.portion.transform(&shifted[axis]));
        for column in &self.columns {
            let Some(ParameterId { effect, parameter }) = self.parameters.id(column.index) else {
                continue;
            };
            let value = self.at[effect][parameter];
            if CATALOGUE[effect].is_linear() || value == 0.0 {
                continue;
            }
            column.bins.add_to(&mut self.residual[column.axis], value);
        }
    }
}

impl Bench for ForceBench<'_> {
    type Declared = [Declared; 3];

    fn information(&self) -> Information {
        let count = self.parameters.count() + self.unknowns;
        let parts: Vec<Information> = (0..3_usize)
            .into_par_iter()
            .map(|axis| {
                let weights = self.noise[axis].weights(&self.portion);
                let columns: Vec<(usize, &Regressor)> = self
                    .columns_on(axis)
                    .map(|column| (column.index, &column.bins))
                    .collect();
                let mut part = Information::empty(count);
                part.add_axis(&self.joints, &self.residual[axis], &columns, &weights);
                part
            })
            .collect();
        let mut total = Information::empty(count);
        for part in parts {
            total.fisher += part.fisher;
            total.right += part.right;
            total.power += part.power;
        }
        total
    }

    fn relinearise(&mut self, effect: usize, at: &[f64]) {
        self.at[effect] = at.to_vec();
        let parameters = self.parameters;
        self.columns
            .retain(|column| parameters.id(column.index).map(|id| id.effect) != Some(effect));
        let mut fresh = self.make_columns(&[effect]);
        self.columns.append(&mut fresh);
        self.columns
            .sort_by_key(|column| (column.axis, column.index));
        self.remake_residual();
    }

    fn linearise_at_nothing(&mut self) {
        for effect in 0..CATALOGUE.len() {
            if self.at[effect].iter().any(|value| *value != 0.0) {
                self.relinearise(effect, &vec![0.0; self.at[effect].len()]);
            }
        }
    }

    fn refit_noise(&mut self, effects: &[usize], declared: &[Declared; 3]) {
        self.fit_noise(effects, declared);
    }
}
