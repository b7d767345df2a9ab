//! The search for unlisted physics: products of measured channels.
//!
//! Enters: a bench and the parameters already chosen. Leaves: for every gyro and product, how much the
//! product would still explain, with any chosen effect taken out if wished. One expression is one degree
//! of freedom on one gyro; every expression tried counts as a trial.
//!
//! It serves three ends: to say how a located mismatch goes with the motion, to find physics outside the
//! catalogue, and as the rival that a named effect must beat (a true term missing from the catalogue makes
//! the nearest listed one look good).

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::information::scaled_inverse;
use super::portion::{Room, inner};
use super::regressor::{Regressor, gram, reach};
use super::scene::Scene;
use super::signals::{self, Signal, vocabulary};
use super::workbench::Workbench;

/// Share of a product's whitened power that is left out at its highest frequencies: what a residual of a thousand
/// times its noise has there moves the product's size by a hundredth of its standard error.
const NEGLIGIBLE: f64 = 1e-10;

/// All expressions that are tried, with their factors by index.
pub struct Products<'a> {
    scene: &'a Scene,
    factors: Vec<Signal<'a>>,
    /// Names, in order of trial.
    pub names: Vec<String>,
    pairs: Vec<(usize, Option<usize>)>,
}

/// What one product says on one gyro.
#[derive(Clone)]
pub(super) struct Measured {
    /// Its own weight.
    pub(super) own: f64,
    /// Against the residual.
    pub(super) residual: f64,
    /// Against what is fitted.
    pub(super) known: Vec<f64>,
}

/// What all products say.
pub struct Survey {
    measured: Vec<[Option<Measured>; 3]>,
    axes: [KnownAxis; 3],
    trials: f64,
}

/// The joints and chosen columns on one gyro.
pub(super) struct KnownAxis {
    pub(super) indices: Vec<Option<usize>>,
    pub(super) gram: DMatrix<f64>,
    pub(super) residual: DVector<f64>,
}

/// The best product on a gyro.
#[derive(Debug, Clone)]
pub struct Best {
    /// Which expression.
    pub product: usize,
    /// Likelihood ratio 2 Δ ln L it would add.
    pub ratio: f64,
    /// Its chance, all expressions and gyros counted.
    pub p_value: f64,
}

impl<'a> Products<'a> {
    /// Names every expression of the scene's vocabulary: each signal, and each product of two.
    pub fn new(scene: &'a Scene) -> Self {
        let (factors, alone) = vocabulary(scene);
        let mut names = Vec::new();
        let mut pairs = Vec::new();
        for a in 0..factors.len() {
            names.push(factors[a].name.clone());
            pairs.push((a, None));
            for b in a..factors.len() {
                names.push(format!("{}*{}", factors[a].name, factors[b].name));
                pairs.push((a, Some(b)));
            }
        }
        names.extend(alone);
        Self {
            scene,
            factors,
            names,
            pairs,
        }
    }

    /// A product's value in each row × one row's period, into `values`.
    pub fn evaluate(&self, product: usize, values: &mut Vec<f64>) {
        let period_s = self.scene.period_s();
        values.clear();
        match self.pairs.get(product) {
            None => {
                let alone = signals::evaluate(self.scene, &self.names[product]);
                let alone = alone.unwrap_or_default();
                values.extend(alone.into_iter().map(|value| value * period_s));
            }
            Some((a, None)) => {
                let a = self.factors[*a].values.iter();
                values.extend(a.map(|value| value * period_s));
            }
            Some((a, Some(b))) => {
                let (a, b) = (self.factors[*a].values.iter(), &self.factors[*b].values);
                values.extend(a.zip(b.iter()).map(|(a, b)| a * b * period_s));
            }
        }
    }

    /// Measures every product against the residual and the chosen parameters.
    pub fn survey(&self, bench: &Workbench, chosen: &[usize]) -> Survey {
        let portion = &bench.portion;
        let residual = bench.residual();
        let weights = [0, 1, 2].map(|axis| bench.noise[axis].weights(portion));
        let known: [Vec<(Option<usize>, &Regressor)>; 3] = [0, 1, 2].map(|axis| {
            let chosen = bench
                .columns_of(chosen, axis)
                .into_iter()
                .chain(bench.offsets_of(chosen, axis))
                .map(|(index, column)| (Some(index), column));
            let joints = bench.joints().iter().map(|joint| (None, joint));
            joints.chain(chosen).collect()
        });
        let axes = [0, 1, 2].map(|axis: usize| {
            let columns: Vec<&Regressor> = known[axis].iter().map(|(_, column)| *column).collect();
            let gram = gram(&columns, &residual[axis], &weights[axis]);
            let count = columns.len();
            KnownAxis {
                indices: known[axis].iter().map(|(index, _)| *index).collect(),
                gram: gram.view((0, 0), (count, count)).into_owned(),
                residual: DVector::from_fn(count, |a, _| gram[(count, a)]),
            }
        });
        let measured: Vec<[Option<Measured>; 3]> = (0..self.names.len())
            .into_par_iter()
            .map_init(
                Default::default,
                |(values, room): &mut (Vec<f64>, Room), product| {
                    self.evaluate(product, values);
                    portion.transform_in(room, values);
                    let bins = &room.bins;
                    [0, 1, 2].map(|axis: usize| {
                        let weights = &weights[axis];
                        let power = |bin: usize| bins[bin].norm_sqr() * weights[bin];
                        let bins = &bins[..reach(bins.len(), power, NEGLIGIBLE)];
                        let own = inner(bins, bins, weights);
                        (own > 0.0 && own.is_finite()).then(|| Measured {
                            own,
                            residual: inner(bins, &residual[axis], weights),
                            known: known[axis]
                                .iter()
                                .map(|(_, other)| other.inner(bins, weights))
                                .collect(),
                        })
                    })
                },
            )
            .collect();
        let trials = 3.0 * self.names.len() as f64;
        Survey {
            measured,
            axes,
            trials,
        }
    }
}

impl Survey {
    /// A survey measured elsewhere.
    pub(super) fn of(
        measured: Vec<[Option<Measured>; 3]>,
        axes: [KnownAxis; 3],
        trials: f64,
    ) -> Self {
        Self {
            measured,
            axes,
            trials,
        }
    }

    /// The best product on a gyro when the parameters in `without` are not fitted.
    pub fn best(&self, axis: usize, without: &[usize]) -> Option<Best> {
        let known = &self.axes[axis];
        let kept: Vec<usize> = (0..known.indices.len())
            .filter(|&place| known.indices[place].is_none_or(|index| !without.contains(&index)))
            .collect();
        let gram = DMatrix::from_fn(kept.len(), kept.len(), |a, b| {
            known.gram[(kept[a], kept[b])]
        });
        let inverse = scaled_inverse(&gram);
        let residual = DVector::from_fn(kept.len(), |a, _| known.residual[kept[a]]);
        let fitted = &inverse * residual;
        let mut best: Option<(usize, f64)> = None;
        for (product, measured) in self.measured.iter().enumerate() {
            let Some(measured) = &measured[axis] else {
                continue;
            };
            let cross = DVector::from_fn(kept.len(), |a, _| measured.known[kept[a]]);
            let free = measured.own - cross.dot(&(&inverse * &cross));
            /// A product this much inside what is already fitted says nothing of its own.
            const OWN_SHARE: f64 = 1e-4;
            if free < OWN_SHARE * measured.own {
                continue;
            }
            let ratio = (measured.residual - cross.dot(&fitted)).powi(2) / free;
            if best.is_none_or(|(_, most)| ratio > most) {
                best = Some((product, ratio));
            }
        }
        best.map(|(product, ratio)| {
            let chance = ChiSquared::new(1.0).map_or(1.0, |law| law.sf(ratio));
            Best {
                product,
                ratio,
                p_value: -(self.trials * (-chance).ln_1p()).exp_m1(),
            }
        })
    }
}
