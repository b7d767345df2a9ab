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

use super::hypotheses::{by_expression, find};
use super::information::scaled_inverse;
use super::portion::{Bins, Room, inner};
use super::regressor::{Regressor, gram, reach};
use super::scene::Scene;
use super::signals::{self, Signal, vocabulary};
use super::workbench::Workbench;

/// Share of a product's whitened power that is left out at its highest frequencies: what a residual of a thousand
/// times its noise has there moves the product's size by a hundredth of its standard error.
const NEGLIGIBLE: f64 = 1e-10;

/// What a lag must explain beyond what has none (2 Δ ln L): chance gives one more number, picked among a handful of
/// constants, as much in one case of 10 000.
pub(super) const WORTH_A_LAG: f64 = 20.0;

/// All expressions that are tried, with their factors by index.
pub struct Products<'a> {
    scene: &'a Scene,
    factors: Vec<Signal<'a>>,
    /// Names, in order of trial.
    pub names: Vec<String>,
    /// Effects of the catalogue that each of them is on each gyro.
    pub effects: Vec<[Vec<usize>; 3]>,
    /// Of those behind a lag, the place of the product itself.
    pub before_lag: Vec<Option<usize>>,
    pairs: Vec<(usize, Option<usize>)>,
    /// Whether what was before a row is known.
    has_past: bool,
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
    /// What each product must explain beyond the others.
    handicaps: Vec<f64>,
    /// Credible sizes.
    largest: Vec<f64>,
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

/// The largest credible coefficient of a product \[rad/s per unit\]: for products of rates some times what the catalogue
/// allows a gyro's own. Noise of an axis that stands still reaches thousands.
fn largest(name: &str) -> f64 {
    const POWERS: [&str; 3] = ["gyro_scale", "gyro_scale_quadratic", "gyro_scale_cubic"];
    const TIMES: f64 = 10.0;
    let mut factors = signals::factors(name);
    if !factors.all(|factor| factor.trim_start_matches("abs_").starts_with("omega_")) {
        return f64::INFINITY;
    }
    let order = signals::factors(name).count();
    let kind = POWERS.get(order - 1).and_then(|kind| find(kind));
    kind.map_or(f64::INFINITY, |(_, entry)| TIMES * entry.card().largest)
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
                if signals::argument(&factors[b].name, "deviation") == Some(&*factors[a].name) {
                    continue;
                }
                names.push(format!("{}*{}", factors[a].name, factors[b].name));
                pairs.push((a, Some(b)));
            }
        }
        names.extend(alone);
        let known = by_expression();
        let effects = |name: &String| {
            [0, 1, 2].map(|axis| {
                known
                    .get(&(axis, name.clone()))
                    .cloned()
                    .unwrap_or_default()
            })
        };
        let before_lag = |name: &String| {
            let (plain, _) = signals::as_lag(name)?;
            names.iter().position(|name| name == plain)
        };
        Self {
            scene,
            factors,
            effects: names.iter().map(effects).collect(),
            before_lag: names.iter().map(before_lag).collect(),
            names,
            pairs,
            has_past: signals::has_past(scene),
        }
    }

    /// The places of a product's two factors; none of what has no two that stand alone.
    pub fn factors_of(&self, product: usize) -> Vec<usize> {
        let Some((a, Some(b))) = self.pairs.get(product) else {
            return Vec::new();
        };
        let place = |factor: usize| {
            let alone = |pair: &(usize, Option<usize>)| *pair == (factor, None);
            self.pairs.iter().position(alone)
        };
        [*a, *b].into_iter().filter_map(place).collect()
    }

    /// A product's value in each row × one row's period, into `values`.
    pub fn evaluate(&self, product: usize, values: &mut Vec<f64>) {
        let period_s = self.scene.period_s();
        values.clear();
        match self.pairs.get(product) {
            None => {
                let alone = self.alone(&self.names[product]).unwrap_or_default();
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

    /// What has no factors in the list, row by row.
    fn alone(&self, name: &str) -> Option<Vec<f64>> {
        // A channel behind a lag is here already.
        if let Some((channel, constant_s)) = signals::as_lag(name)
            && let Some(factor) = self.factors.iter().find(|factor| factor.name == channel)
        {
            let streams = &self.scene.streams;
            return Some(signals::lagged(streams, &factor.values, constant_s));
        }
        signals::evaluate(self.scene, name).ok()
    }

    /// Measures every product against the residual and the chosen parameters.
    pub fn survey(&self, bench: &Workbench, chosen: &[usize]) -> Survey {
        let against = Against::new(bench, chosen);
        let axes = [0, 1, 2].map(|axis: usize| {
            let known = &against.known[axis];
            let columns: Vec<&Regressor> = known.iter().map(|(_, column)| *column).collect();
            let gram = gram(&columns, &against.residual[axis], &against.weights[axis]);
            let count = columns.len();
            KnownAxis {
                indices: known.iter().map(|(index, _)| *index).collect(),
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
                    bench.portion.transform_in(room, values);
                    [0, 1, 2].map(|axis: usize| against.measure(&room.bins, axis))
                },
            )
            .collect();
        let trials = 3.0 * self.names.len() as f64;
        let handicap = |before_lag: &Option<usize>| before_lag.map_or(0.0, |_| WORTH_A_LAG);
        Survey {
            measured,
            axes,
            trials,
            handicaps: self.before_lag.iter().map(handicap).collect(),
            largest: self.names.iter().map(|name| largest(name)).collect(),
        }
    }

    /// The expression on a gyro as it explains most: a lag with its time constant, a product behind a lag where that is
    /// clearly better, anything else as it is.
    pub fn refined(
        &self,
        bench: &Workbench,
        survey: &Survey,
        (axis, without): (usize, &[usize]),
        name: &str,
    ) -> String {
        /// Steps of the time constant in octaves: the next on the grid is two octaves away.
        const STEPS: [f64; 4] = [0.5, 0.25, 0.125, 0.0625];
        if !self.has_past || name.contains('(') && signals::as_lag(name).is_none() {
            return name.to_string();
        }
        let chosen: Vec<usize> = survey.axes[axis]
            .indices
            .iter()
            .flatten()
            .copied()
            .collect();
        let against = Against::new(bench, &chosen);
        let beside = survey.beside(axis, without);
        let period_s = self.scene.period_s();
        let ratio = |name: &str| -> Option<f64> {
            let mut values = self.alone(name)?;
            values.iter_mut().for_each(|value| *value *= period_s);
            let measured = against.measure(&bench.portion.transform(&values), axis)?;
            beside.ratio(&measured).map(|(ratio, _)| ratio)
        };
        let (product, tried_s) = match signals::as_lag(name) {
            Some((product, constant_s)) => (product, vec![constant_s]),
            None => (name, signals::LAGS_S.to_vec()),
        };
        let behind = |constant_s: f64| format!("lag({product},{constant_s:.4})");
        let tried = tried_s
            .into_iter()
            .map(|constant_s| (ratio(&behind(constant_s)), constant_s));
        let Some((mut best, mut constant_s)) =
            tried.max_by(|a, b| a.0.partial_cmp(&b.0).unwrap_or(std::cmp::Ordering::Equal))
        else {
            return name.to_string();
        };
        for step in STEPS {
            for other_s in [constant_s * step.exp2(), constant_s / step.exp2()] {
                let other = ratio(&behind(other_s));
                if other > best {
                    (best, constant_s) = (other, other_s);
                }
            }
        }
        let needed = match product == name {
            true => ratio(name).map(|alone| alone + WORTH_A_LAG),
            false => None,
        };
        if best > needed {
            behind(constant_s)
        } else {
            name.to_string()
        }
    }
}

/// What a product is measured against.
struct Against<'a> {
    residual: &'a [Bins; 3],
    weights: [Vec<f64>; 3],
    known: [Vec<(Option<usize>, &'a Regressor)>; 3],
}

impl<'a> Against<'a> {
    fn new(bench: &'a Workbench, chosen: &[usize]) -> Self {
        let known = [0, 1, 2].map(|axis| {
            let chosen = bench
                .columns_of(chosen, axis)
                .into_iter()
                .chain(bench.offsets_of(chosen, axis))
                .map(|(index, column)| (Some(index), column));
            let joints = bench.joints().iter().map(|joint| (None, joint));
            joints.chain(chosen).collect()
        });
        Self {
            residual: bench.residual(),
            weights: [0, 1, 2].map(|axis| bench.noise[axis].weights(&bench.portion)),
            known,
        }
    }

    fn measure(&self, bins: &Bins, axis: usize) -> Option<Measured> {
        let weights = &self.weights[axis];
        let power = |bin: usize| bins[bin].norm_sqr() * weights[bin];
        let bins = &bins[..reach(bins.len(), power, NEGLIGIBLE)];
        let own = inner(bins, bins, weights);
        let known = self.known[axis].iter();
        (own > 0.0 && own.is_finite()).then(|| Measured {
            own,
            residual: inner(bins, &self.residual[axis], weights),
            known: known.map(|(_, other)| other.inner(bins, weights)).collect(),
        })
    }
}

impl Survey {
    /// What stands beside a product on a gyro when the parameters in `without` are not fitted.
    fn beside(&self, axis: usize, without: &[usize]) -> Beside {
        let kept = |index: Option<usize>| index.is_none_or(|index| !without.contains(&index));
        self.of_kept(axis, &kept)
    }

    /// The columns of some chosen parameters alone.
    fn columns_of(&self, axis: usize, parameters: &[usize]) -> Beside {
        let kept = |index: Option<usize>| index.is_some_and(|index| parameters.contains(&index));
        self.of_kept(axis, &kept)
    }

    fn of_kept(&self, axis: usize, is_kept: &dyn Fn(Option<usize>) -> bool) -> Beside {
        let known = &self.axes[axis];
        let kept: Vec<usize> = (0..known.indices.len())
            .filter(|&place| is_kept(known.indices[place]))
            .collect();
        let gram = DMatrix::from_fn(kept.len(), kept.len(), |a, b| {
            known.gram[(kept[a], kept[b])]
        });
        let inverse = scaled_inverse(&gram);
        let residual = DVector::from_fn(kept.len(), |a, _| known.residual[kept[a]]);
        Beside {
            fitted: &inverse * residual,
            inverse,
            kept,
        }
    }

    /// The products of which more than `share` lies outside the columns of some chosen parameters on a gyro.
    pub fn apart(&self, axis: usize, from: &[usize], share: f64) -> impl Fn(usize) -> bool {
        let columns = self.columns_of(axis, from);
        move |product| {
            let measured = self.measured[product][axis].as_ref();
            measured.is_some_and(|one| columns.free(one).0 > share * one.own)
        }
    }

    /// The best product on a gyro when the parameters in `without` are not fitted.
    pub fn best(&self, axis: usize, without: &[usize]) -> Option<Best> {
        self.best_of(axis, without, &|_| true)
    }

    /// The best of those that are `wanted`.
    pub fn best_of(
        &self,
        axis: usize,
        without: &[usize],
        wanted: &dyn Fn(usize) -> bool,
    ) -> Option<Best> {
        let beside = self.beside(axis, without);
        let mut best: Option<(usize, f64)> = None;
        let of_wanted = self.measured.iter().enumerate();
        for (product, measured) in of_wanted.filter(|(product, _)| wanted(*product)) {
            let found = measured[axis].as_ref().and_then(|one| beside.ratio(one));
            let most = self.largest.get(product).copied().unwrap_or(f64::INFINITY);
            let credible = found.filter(|(_, size)| size.abs() <= most);
            let ratio = credible.map(|(ratio, _)| ratio);
            let handicap = |product: usize| self.handicaps.get(product).copied().unwrap_or(0.0);
            let ahead = |ratio: &f64| {
                let own = ratio - handicap(product);
                best.is_none_or(|(other, most)| own > most - handicap(other))
            };
            if let Some(ratio) = ratio.filter(ahead) {
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

/// What is fitted beside a product on one gyro.
struct Beside {
    kept: Vec<usize>,
    inverse: DMatrix<f64>,
    fitted: DVector<f64>,
}

impl Beside {
    /// What of a product's weight lies outside these columns, and its products with them.
    fn free(&self, measured: &Measured) -> (f64, DVector<f64>) {
        let cross = DVector::from_fn(self.kept.len(), |a, _| measured.known[self.kept[a]]);
        let inside = cross.dot(&(&self.inverse * &cross));
        (measured.own - inside, cross)
    }

    /// 2 Δ ln L that a product adds, and its size.
    fn ratio(&self, measured: &Measured) -> Option<(f64, f64)> {
        /// A product this much inside what is already fitted says nothing of its own.
        const OWN_SHARE: f64 = 1e-4;
        let (free, cross) = self.free(measured);
        (free >= OWN_SHARE * measured.own)
            .then(|| (measured.residual - cross.dot(&self.fitted)) / free)
            .map(|size| (size * size * free, size))
    }
}
