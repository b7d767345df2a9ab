//! Laws of every [`Likelihood`], in one place for the tests of each implementation, as Kalibr has one harness over all its
//! error terms (Furgale et al. 2013).
//!
//! 1. A bin has an energy, a count, and the power of each noise term; drift groups partition the records.
//! 2. Energies, moments and products of a bin are scalar products of the same vectors: products commute, and the
//!    Cauchy–Schwarz inequality holds.
//! 3. A noise fit to the expected powers of some levels recovers these powers.
//! 4. Log-likelihoods of independent data add: twice the same data have twice the log-likelihood.

use crate::evaluate::{Drift, Effort, evaluate};
use crate::likelihood::{JointLikelihood, Likelihood};
use crate::noise::NoiseLevels;
use rlg_plan::SearchPlan;

/// Relative rounding of a sum of products: columns are stored in single precision.
const ROUNDING: f64 = 1e-5;

/// Returns the broken laws as sentences; none for a sound implementation.
///
/// # Inputs
/// `columns`: number of columns of each record; `levels`: a noise of each record.
pub fn broken_laws<L: Likelihood>(
    likelihood: &L,
    columns: usize,
    levels: &[NoiseLevels],
    plan: &SearchPlan,
) -> Vec<String> {
    let mut broken = groups(likelihood);
    for (record, &own) in levels.iter().enumerate() {
        let found = [
            forms(likelihood, record),
            scalar_products(likelihood, record, columns),
            noise_fit(likelihood, record, own),
        ];
        broken.extend(
            found
                .into_iter()
                .flatten()
                .map(|law| format!("record {record}: {law}")),
        );
    }
    broken.extend(addition(likelihood, levels, plan));
    broken
}

fn groups(likelihood: &impl Likelihood) -> Vec<String> {
    let covered: Vec<usize> = likelihood.sisters().into_iter().flatten().collect();
    let all: Vec<usize> = (0..likelihood.record_count()).collect();
    match covered == all {
        true => Vec::new(),
        false => vec![format!(
            "drift groups hold the records {covered:?} of {all:?}"
        )],
    }
}

fn forms(likelihood: &impl Likelihood, record: usize) -> Vec<String> {
    let (basis, energy) = (likelihood.basis(record), likelihood.energy(record));
    let bins = energy.len();
    let mut lengths = basis.power.iter().map(Vec::len).chain([basis.counts.len()]);
    let mut broken = Vec::new();
    if lengths.any(|length| length != bins) {
        broken.push(format!(
            "{bins} energies beside another number of counts or powers"
        ));
    }
    if basis
        .counts
        .iter()
        .chain(energy)
        .any(|value| value.is_nan() || *value < 0.0)
    {
        broken.push("a count or an energy is negative".to_owned());
    }
    broken
}

fn scalar_products(likelihood: &impl Likelihood, record: usize, columns: usize) -> Vec<String> {
    let mut broken = Vec::new();
    for (bin, &energy) in likelihood.energy(record).iter().enumerate() {
        let product = |a: usize, b: usize| likelihood.product(record, bin, a, b);
        let exceeds = |value: f64, both: f64| value * value > both * (1.0 + ROUNDING);
        for a in 0..columns {
            let moment = likelihood.moment(record, bin, a);
            if exceeds(moment, energy * product(a, a)) {
                broken.push(format!("bin {bin}: moment of column {a} exceeds its norm"));
            }
            for b in 0..a {
                let size = (product(a, a) * product(b, b)).sqrt();
                if (product(a, b) - product(b, a)).abs() > ROUNDING * size {
                    broken.push(format!(
                        "bin {bin}: product of columns {a} and {b} does not commute"
                    ));
                }
                if exceeds(product(a, b), size * size) {
                    broken.push(format!(
                        "bin {bin}: product of columns {a} and {b} exceeds their norms"
                    ));
                }
            }
        }
    }
    broken
}

fn noise_fit(likelihood: &impl Likelihood, record: usize, levels: NoiseLevels) -> Vec<String> {
    let basis = likelihood.basis(record);
    let expected = basis.binned(levels);
    let active = levels.as_array().map(|level| level > 0.0);
    let start = NoiseLevels::from_array(levels.as_array().map(|level| 3.0 * level));
    let sums = expected.iter().zip(&basis.counts);
    let sums: Vec<f64> = sums.map(|(power, count)| power * count).collect();
    let fitted = basis.binned(basis.fit(&sums, start, active));
    let pairs = expected.iter().zip(&fitted).zip(&basis.counts);
    let mut counted = pairs.filter(|(_, count)| **count > 0.0);
    match counted.any(|((expected, fitted), _)| (fitted / expected - 1.0).abs() > 0.01) {
        true => vec!["a noise fit to expected powers does not recover them".to_owned()],
        false => Vec::new(),
    }
}

fn addition<L: Likelihood>(
    likelihood: &L,
    levels: &[NoiseLevels],
    plan: &SearchPlan,
) -> Vec<String> {
    let drifts = vec![Drift::None; 2 * levels.len()];
    let once = evaluate(
        likelihood,
        &[],
        levels,
        &drifts[..levels.len()],
        Effort::FULL,
        plan,
    );
    let joint = JointLikelihood::new(vec![likelihood; 2]);
    let twice = evaluate(
        &joint,
        &[],
        &[levels, levels].concat(),
        &drifts,
        Effort::FULL,
        plan,
    );
    let [once, twice] = [once, twice].map(|fit| fit.log_likelihood);
    match (twice - 2.0 * once).abs() > 4.0 * Effort::FULL.tolerance {
        true => vec![format!(
            "log-likelihood {once} alone, {twice} of the same data twice"
        )],
        false => Vec::new(),
    }
}
