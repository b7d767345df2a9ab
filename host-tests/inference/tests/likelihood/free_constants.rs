//! A constant of two records whose size nobody knows: it moves no estimate and widens intervals as least squares say.

use nalgebra::{DMatrix, Matrix2};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rlg_inference::evaluate::{Effort, evaluate};
use rlg_inference::normal_equations::{Columns, NormalEquations};
use rlg_inference::{Drift, Fit, Hypothesis, NoiseLevels, Observations, Term};
use rlg_plan::SearchPlan;

const ROWS: usize = 600;
const SHARES: [f64; 2] = [0.6, 0.8];
const COEFFICIENTS: [f64; 2] = [1.0, 0.3];
const SIZE: f64 = 4.0;

/// A warming.
struct Warming;

impl Columns for Warming {
    fn count(&self) -> usize {
        1
    }

    fn column(&self, _: usize) -> Vec<f64> {
        let warming = |row: usize| 1.0 - (-(row as f64) / 100.0).exp();
        (0..ROWS).map(warming).collect()
    }
}

/// Fits the warming beside `constants`, with so much of a constant in the records.
fn fit(added: f64, constants: &[Vec<f64>]) -> Fit {
    let rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    let mut noise = StandardNormal.sample_iter(rng);
    let mut normal = || -> f64 { noise.next().expect("endless") };
    let warming = Warming.column(0);
    let records: Vec<Vec<f64>> = (0..2)
        .map(|record| {
            let of_row =
                |warm: &f64| SIZE * COEFFICIENTS[record] * warm + added * SHARES[record] + normal();
            warming.iter().map(of_row).collect()
        })
        .collect();
    let start = NoiseLevels {
        white: 1.0,
        ..NoiseLevels::default()
    };
    let observations = Observations::bridged(&[true; ROWS]).expect("rows");
    let equations =
        NormalEquations::with_constants(observations, &records, &Warming, start, constants);
    let term = |record: usize| Term {
        parameter: 0,
        record,
        column: 0,
        coefficient: COEFFICIENTS[record],
    };
    let warming = Hypothesis::of_terms(1, vec![term(0), term(1)]);
    let (starts, drift) = ([start; 2], [Drift::None; 2]);
    evaluate(
        &equations,
        &[&warming],
        &starts,
        &drift,
        Effort::FULL,
        &SearchPlan::default(),
    )
}

#[test]
fn a_free_constant_moves_no_estimate_and_widens_its_interval_as_least_squares_say() {
    let free = [SHARES.to_vec()];
    let [without, with] = [0.0, 50.0].map(|added| fit(added, &free));
    let std = without.covariance[(0, 0)].sqrt();
    assert!((without.estimate[0] - with.estimate[0]).abs() < 1e-3 * std);
    assert!((with.estimate[0] - SIZE).abs() < 4.0 * std);
    let moved = fit(50.0, &[]).estimate[0] - SIZE;
    assert!(moved > 20.0 * std, "the constant was none: {moved}");
    let warming = Warming.column(0);
    let design = DMatrix::from_fn(2 * ROWS, 2, |at, column| {
        let (record, row) = (at / ROWS, at % ROWS);
        match column {
            0 => COEFFICIENTS[record] * warming[row],
            _ => SHARES[record],
        }
    });
    let of_record = |record: usize| {
        let rows = design.rows(record * ROWS, ROWS);
        rows.tr_mul(&rows) / without.levels[record].white
    };
    let information = of_record(0) + of_record(1);
    let information = Matrix2::from_fn(|a, b| information[(a, b)]);
    let expected = information.try_inverse().expect("two directions")[(0, 0)].sqrt();
    // The rows at both ends are free of themselves: 2 of 600.
    assert!((std / expected - 1.0).abs() < 0.02, "{std} {expected}");
}
