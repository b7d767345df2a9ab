//! Residual, columns and noise of the accelerometers, for the same selection as the gyros'.
//!
//! Enters: the scene with its felt force, the residual \[m/s per row\], a portion of the accelerometers' rows. Leaves:
//! [`Information`] over all parameters of the catalogue and, behind them, the unknowns of the vertical, which
//! belong to every fit.

use rayon::prelude::*;

use crate::bench::Bench;
use crate::columns::{self, Column};
use crate::hypotheses::{CATALOGUE, Subject};
use crate::information::{Information, fit_away};
use crate::noise::{self, Declared, Noise};
use crate::portion::{Bins, Portion};
use crate::regressor::{Regressor, regressors};
use crate::scene::Scene;
use crate::streams::{Triad, add_triad, each_axis};
use crate::workbench::{ParameterId, Parameters};

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
            residual: each_axis(|axis| portion.transform(&residual_m_s[axis])),
            joints: regressors(&portion.joints()),
            columns: columns::make(
                Subject::Accelerometers,
                scene,
                parameters,
                &portion,
                effects,
                at,
            ),
            portion,
            noise,
            at: at.to_vec(),
            unknowns: 0,
        };
        // Without a prediction there are no columns, and nothing will be found.
        let Some(felt) = &scene.felt else {
            return bench;
        };
        let tilts = felt.vertical.columns(&felt.rows, &felt.carried);
        bench.unknowns = tilts.len();
        let of_axes =
            (0..tilts.len()).flat_map(|place| (0..3_usize).map(move |axis| (place, axis)));
        let of_axes: Vec<(usize, usize)> = of_axes.collect();
        let portion = &bench.portion;
        let tilted = of_axes.into_par_iter().map(|(place, axis)| {
            let force = tilts[place][axis].iter().copied();
            Column {
                axis,
                index: parameters.count() + place,
                bins: Regressor::new(&portion.transform(&felt.sensed_from_force(axis, force))),
            }
        });
        bench.columns.par_extend(tilted);
        bench
    }

    /// The indices of the vertical's unknowns.
    pub fn unknowns(&self) -> Vec<usize> {
        let first = self.parameters.count();
        (first..first + self.unknowns).collect()
    }

    /// Everything fitted on an accelerometer, joints and vertical included, but one effect's columns.
    pub fn columns_without(
        &self,
        axis: usize,
        effect: Option<usize>,
    ) -> impl Iterator<Item = &Regressor> {
        let parameters = self.parameters;
        let kept = columns::on(&self.columns, axis).filter(move |column| {
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
        let columns = (self.joints.as_slice(), self.columns.as_slice());
        self.noise = columns::noise_by_axis(|axis| {
            let columns = columns::fitted(columns, axis, (self.parameters, effects));
            let (residual, start) = (&self.residual[axis], Some(self.noise[axis]));
            noise::fit(&self.portion, residual, &columns, declared[axis], start)
        });
    }

    /// Power of each bin of an accelerometer once joints and all columns are fitted away.
    pub fn left_power(&self, axis: usize) -> Vec<f64> {
        let weights = self.noise[axis].weights(&self.portion);
        let own = columns::on(&self.columns, axis).map(|column| &column.bins);
        let columns: Vec<&Regressor> = self.joints.iter().chain(own).collect();
        let mut left = self.residual[axis].clone();
        fit_away(&mut left, &columns, &weights);
        left.iter().map(|value| value.norm_sqr()).collect()
    }

    /// residual − f(p0) + J(p0) p0 for the nonlinear effects, so that a linear solution is p itself.
    fn remake_residual(&mut self) {
        let mut shifted: Triad = self.residual_m_s.clone();
        for (effect, entry) in CATALOGUE.iter().enumerate() {
            let at = &self.at[effect];
            if is_linear(effect) || at.iter().all(|value| *value == 0.0) {
                continue;
            }
            add_triad(&mut shifted, &entry.prediction(self.scene, at), -1.0);
        }
        self.residual = each_axis(|axis| self.portion.transform(&shifted[axis]));
        for column in &self.columns {
            let Some(ParameterId { effect, parameter }) = self.parameters.id(column.index) else {
                continue;
            };
            let value = self.at[effect][parameter];
            if is_linear(effect) || value == 0.0 {
                continue;
            }
            column.bins.add_to(&mut self.residual[column.axis], value);
        }
    }
}

/// Whether the force goes with an effect's parameters as a straight line: so small a turn of the reference always does.
fn is_linear(effect: usize) -> bool {
    CATALOGUE[effect].is_linear() || CATALOGUE[effect].turns_reference()
}

impl Bench for ForceBench<'_> {
    type Declared = [Declared; 3];

    fn information(&self) -> Information {
        let count = self.parameters.count() + self.unknowns;
        let nothing = Information {
            of_mounting: self.unknowns,
            ..Information::empty(count)
        };
        Information::of_axes(nothing, |axis, part| {
            let weights = self.noise[axis].weights(&self.portion);
            let columns: Vec<(usize, &Regressor)> = columns::on(&self.columns, axis)
                .map(|column| (column.index, &column.bins))
                .collect();
            part.add_axis(&self.joints, &[], &self.residual[axis], &columns, &weights);
        })
    }

    fn at(&self) -> &[Vec<f64>] {
        &self.at
    }

    fn relinearise(&mut self, effect: usize, at: &[f64]) {
        self.at[effect] = at.to_vec();
        columns::renew(
            &mut self.columns,
            (Subject::Accelerometers, self.scene),
            self.parameters,
            &self.portion,
            effect,
            &self.at,
        );
        self.remake_residual();
    }

    fn refit_noise(&mut self, effects: &[usize], declared: &[Declared; 3]) {
        self.fit_noise(effects, declared);
    }
}
