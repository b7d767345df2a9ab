//! Expressions outside the catalogue that a named accelerometer effect must beat.
//!
//! Enters: a bench that holds the residual with one effect left in, and the force, rates and temperatures of the
//! rows. Leaves: the expression on each accelerometer that explains most, one free number each, all tried ones
//! counted. A true term missing from the catalogue makes the nearest listed one look good (diagnosis road, steps 6
//! and 12): where single expressions explain clearly more than the effect with all its parameters, it has no name.
//!
//! Deliberately not here: modelling with such an expression; it says where to look.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::bench::ForceBench;
use super::felt::Felt;
use crate::bench::Bench as _;
use crate::declare::FAMILY_SIGNIFICANCE;
use crate::hunt::CLEARLY_BETTER;
use crate::hypotheses::no_effects;
use crate::information::scaled_inverse;
use crate::noise::Noise;
use crate::portion::{Bins, Portion, inner};
use crate::regressor::{Regressor, gram};
use crate::scene::Scene;
use crate::select::Choice;
use crate::split::Split;
use crate::streams::{AXES, Triad};
use crate::weigh::prior_width;
use crate::workbench::Parameters;

/// An expression in what is measured, as a velocity per row.
pub struct Expression {
    /// Its name, in the words of the gyros' expressions.
    pub name: String,
    values: Vec<f64>,
}

/// What one expression explains on one accelerometer.
#[derive(Debug, Clone, PartialEq)]
pub struct Best {
    /// Which.
    pub name: String,
    /// Likelihood ratio 2 Δ ln L.
    pub ratio: f64,
    /// Its chance, every expression and accelerometer counted.
    pub p_value: f64,
}

/// Every expression that is tried.
pub fn expressions(scene: &Scene, felt: &Felt) -> Vec<Expression> {
    let rows = &felt.rows;
    let period_s = rows.period_s();
    let share = rows.rate_hz / scene.streams.rate_hz;
    let mean = |values: &[f64]| -> Vec<f64> {
        let sums = rows.gather(values);
        sums.into_iter().map(|sum| sum * share).collect()
    };
    let force = &felt.force_m_s2;
    let omega = [0, 1, 2].map(|axis: usize| mean(&scene.rate_rad_s[axis]));
    let mut found: Vec<Expression> = Vec::new();
    let mut add = |name: String, values: Vec<f64>| {
        let values = values.into_iter().map(|value| value * period_s).collect();
        found.push(Expression { name, values });
    };
    let product =
        |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
    for (i, x) in AXES.iter().enumerate() {
        add(format!("force_{x}"), force[i].clone());
        add(format!("omega_{x}"), omega[i].clone());
        let turned = &felt.carried.turned_rad_s[i];
        add(
            format!("alpha_{x}"),
            turned.iter().map(|turned| turned / period_s).collect(),
        );
        let size: Vec<f64> = force[i].iter().map(|force| force.abs()).collect();
        let square = product(&force[i], &force[i]);
        add(
            format!("force_{x}*abs(force_{x})"),
            product(&force[i], &size),
        );
        add(
            format!("force_{x}*force_{x}*force_{x}"),
            product(&square, &force[i]),
        );
        add(format!("abs(force_{x})"), size);
        for (j, y) in AXES.iter().enumerate() {
            add(
                format!("omega_{x}*force_{y}"),
                product(&omega[i], &force[j]),
            );
            if j >= i {
                add(
                    format!("force_{x}*force_{y}"),
                    product(&force[i], &force[j]),
                );
                add(
                    format!("omega_{x}*omega_{y}"),
                    product(&omega[i], &omega[j]),
                );
            }
        }
        if let Some(warming) = scene.temperature_change_k(i, 0) {
            let warming = mean(&warming);
            add(
                format!("temperature_{x}*force_{x}"),
                product(&warming, &force[i]),
            );
            add(format!("temperature_{x}"), warming);
        }
    }
    let since = (0..rows.count).map(|row| rows.middle_s(row) - rows.start_s);
    add("time".to_string(), since.collect());
    found
}

/// The best expression on each accelerometer beside everything on the bench but `without`.
pub fn best(
    bench: &ForceBench,
    expressions: &[Expression],
    without: Option<usize>,
) -> [Option<Best>; 3] {
    let known = [0, 1, 2].map(|axis| Known::new(bench, axis, without));
    let ratios: Vec<[f64; 3]> = expressions
        .par_iter()
        .map(|expression| {
            let bins = bench.portion.transform(&expression.values);
            [0, 1, 2].map(|axis: usize| known[axis].ratio(&bins))
        })
        .collect();
    let trials = 3.0 * expressions.len() as f64;
    [0, 1, 2].map(|axis: usize| {
        let (place, ratio) = ratios
            .iter()
            .enumerate()
            .map(|(place, ratios)| (place, ratios[axis]))
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let chance = ChiSquared::new(1.0).map_or(1.0, |law| law.sf(ratio));
        let p_value = -(trials * (-chance).ln_1p()).exp_m1();
        (p_value < FAMILY_SIGNIFICANCE).then(|| Best {
            name: expressions[place].name.clone(),
            ratio,
            p_value,
        })
    })
}

/// An effect against expressions outside the catalogue.
pub struct Rivalry {
    /// The best expression on each accelerometer.
    pub best: [Option<Best>; 3],
    /// Likelihood ratio of the effect with all its parameters.
    share: f64,
}

impl Rivalry {
    /// The expressions, where they explain clearly more than the effect.
    pub fn beats_effect(&self) -> Option<String> {
        let all: f64 = self.best.iter().flatten().map(|best| best.ratio).sum();
        let names: Vec<&str> = self
            .best
            .iter()
            .flatten()
            .map(|best| best.name.as_str())
            .collect();
        (all > self.share + CLEARLY_BETTER).then(|| names.join(", "))
    }
}

/// Weighs expressions on a residual from which every chosen effect but `open` is taken.
pub fn rivalry(
    scene: &Scene,
    residual: &Triad,
    parameters: &Parameters,
    (choice, split, noise): (&Choice, &Split, [Noise; 3]),
    open: Option<usize>,
    expressions: &[Expression],
) -> Option<Rivalry> {
    let portion = Portion::new(split.fitted.clone(), noise[0].rate_hz)?;
    let set = choice.effects();
    let mut at = no_effects();
    for one in &choice.chosen {
        at[one.effect] = one.values.iter().copied().collect();
    }
    let bench = ForceBench::new(scene, residual, parameters, portion, noise, &set, &at);
    let information = bench.information();
    let gain = |set: &[usize]| {
        let mut indices = parameters.of_all(set);
        indices.extend(bench.unknowns());
        let prior = |index| prior_width(parameters, &information, index);
        information.solve(&indices, &prior).log_likelihood_gain
    };
    let rest: Vec<usize> = set
        .iter()
        .copied()
        .filter(|&kept| Some(kept) != open)
        .collect();
    Some(Rivalry {
        best: best(&bench, expressions, open),
        share: 2.0 * (gain(&set) - gain(&rest)),
    })
}

/// What is fitted beside an expression on one accelerometer.
struct Known<'a> {
    columns: Vec<&'a Regressor>,
    inverse: DMatrix<f64>,
    residual: DVector<f64>,
    bins: &'a Bins,
    weights: Vec<f64>,
}

impl<'a> Known<'a> {
    fn new(bench: &'a ForceBench, axis: usize, without: Option<usize>) -> Self {
        let weights = bench.noise[axis].weights(&bench.portion);
        let bins = bench.residual(axis);
        let columns: Vec<&Regressor> = bench.columns_without(axis, without).collect();
        let count = columns.len();
        let gram = gram(&columns, bins, &weights);
        Self {
            inverse: scaled_inverse(&gram.view((0, 0), (count, count)).into_owned()),
            residual: DVector::from_fn(count, |a, _| gram[(count, a)]),
            columns,
            bins,
            weights,
        }
    }

    /// 2 Δ ln L that `expression` adds.
    fn ratio(&self, expression: &Bins) -> f64 {
        /// An expression this much inside what is already fitted says nothing of its own.
        const OWN_SHARE: f64 = 1e-4;
        let own = inner(expression, expression, &self.weights);
        let cross = DVector::from_iterator(
            self.columns.len(),
            self.columns
                .iter()
                .map(|column| column.inner(expression, &self.weights)),
        );
        let against = &self.inverse * cross.clone();
        let free = own - cross.dot(&against);
        if !(own > 0.0 && free > OWN_SHARE * own) {
            return 0.0;
        }
        let found = inner(expression, self.bins, &self.weights) - against.dot(&self.residual);
        found * found / free
    }
}
