//! The likelihood behind gaps against that of the seen rows.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rlg_inference::evaluate::{Effort, evaluate};
use rlg_inference::normal_equations::{Columns, NormalEquations};
use rlg_inference::transform::Transform;
use rlg_inference::{Drift, NoiseBasis, NoiseLevels, Observations};
use rlg_plan::SearchPlan;

const ROWS: usize = 2000;

fn observations() -> Observations {
    let mut seen = vec![true; ROWS];
    for gap in 0..8 {
        seen[250 * gap + 150..250 * gap + 250].fill(false);
    }
    Observations::bridged(&seen).expect("rows")
}

/// A constant, a slow wave and a step in white noise, in white angle a hundred times stronger, and in the latter with a walk:
/// their scores agree with the information, and the power of each octave with noise and counts.
#[test]
fn behind_gaps_scores_and_powers_are_those_of_the_noise() {
    let observations = observations();
    let rows = observations.spans[0].rows.len();
    let wave = |row: usize| (9.0 * row as f64 / rows as f64).cos();
    let columns: [Vec<f64>; 3] = [
        vec![1.0; ROWS],
        (0..ROWS).map(wave).collect(),
        (0..ROWS).map(|row| f64::from(row >= 700)).collect(),
    ];
    for (white, angle) in [(1.0, 0.0), (1e-2, 1.0), (1e-5, 1.0)] {
        let levels = NoiseLevels {
            white,
            angle,
            ..NoiseLevels::default()
        };
        let (transform, basis) = Transform::with_basis(observations.clone(), levels);
        let weights: Vec<f64> = basis
            .by_coefficient(levels)
            .iter()
            .map(|s| 1.0 / s)
            .collect();
        let spectra = columns.each_ref().map(|column| transform.spectrum(column));
        let product = |a: &[f64], b: &[f64]| -> f64 {
            let both = a.iter().zip(b).zip(&weights);
            both.map(|((a, b), weight)| a * b * weight).sum()
        };
        let trials = 800;
        let mut squares = [0.0; 3];
        let mut powers = vec![0.0; basis.bins.len()];
        for seed in 0..trials {
            let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let normals: Vec<f64> = StandardNormal.sample_iter(rng).take(2 * ROWS + 1).collect();
            let (angles, rates) = normals.split_at(ROWS + 1);
            let record: Vec<f64> = (0..ROWS)
                .map(|row| {
                    white.sqrt() * rates[row] + angle.sqrt() * (angles[row + 1] - angles[row])
                })
                .collect();
            let record = transform.spectrum(&record);
            for (square, column) in squares.iter_mut().zip(&spectra) {
                let score = product(column, &record);
                *square += score * score / product(column, column) / f64::from(trials as u32);
            }
            for (power, bin) in powers.iter_mut().zip(&basis.bins) {
                let sum: f64 = record[bin.clone()].iter().map(|c| c * c).sum();
                *power += sum / f64::from(trials as u32);
            }
        }
        for square in squares {
            assert!((square - 1.0).abs() < 0.2, "{white} {angle}: {squares:?}");
        }
        let expected = basis.binned(levels);
        let mut octaves = [[0.0; 2]; 11];
        for (bin, of) in basis.bins.iter().enumerate().skip(1) {
            let [sum, of_noise] = &mut octaves[of.start.ilog2() as usize];
            *sum += powers[bin] / expected[bin];
            *of_noise += basis.counts[bin];
        }
        for [sum, of_noise] in octaves {
            let ratio = sum / of_noise;
            assert!((ratio - 1.0).abs() < 0.15, "{white} {angle}: {octaves:?}");
        }
    }
}

/// Gain of a random walk over none, against the dense likelihood of the seen rows: a walk that gaps interrupt, in white
/// angle and white rate, from seed to seed some ten or twenty.
#[test]
fn what_drift_gains_behind_gaps_is_what_it_gains_in_the_exact_likelihood() {
    const SEEN: usize = 600;
    let mut seen = vec![true; SEEN];
    for gap in 0..5 {
        seen[120 * gap + 72..120 * gap + 120].fill(false);
    }
    let observations = Observations::bridged(&seen).expect("rows");
    let rows: Vec<usize> = (0..SEEN).filter(|&row| seen[row]).collect();
    // Of the whole record drift is diagonal in the transform; of its seen rows it is not.
    let last = rows[rows.len() - 1] + 1;
    let basis = NoiseBasis::new(&Observations::bridged(&vec![true; last]).expect("rows"));
    let waves = DMatrix::from_fn(rows.len(), last, |i, k| {
        let turn = std::f64::consts::PI * k as f64 * (rows[i] as f64 + 0.5) / last as f64;
        turn.cos() * (if k == 0 { 1.0 } else { 2.0 } / last as f64).sqrt()
    });
    let exact = |record: &[f64], levels: NoiseLevels| -> f64 {
        let only = NoiseLevels {
            walk: levels.walk * (last as f64 / SEEN as f64).powi(2),
            ..NoiseLevels::default()
        };
        let mut of_waves = waves.clone();
        for (mut wave, power) in of_waves.column_iter_mut().zip(basis.by_coefficient(only)) {
            wave *= power;
        }
        let mut covariance = of_waves * waves.transpose();
        for i in 0..rows.len() {
            covariance[(i, i)] += levels.white + 2.0 * levels.angle;
            if i > 0 && rows[i] == rows[i - 1] + 1 {
                covariance[(i, i - 1)] -= levels.angle;
                covariance[(i - 1, i)] -= levels.angle;
            }
        }
        let cholesky = covariance.cholesky().expect("a covariance");
        let record = DVector::from_iterator(rows.len(), rows.iter().map(|&row| record[row]));
        let solved = cholesky.solve(&record);
        let logs: f64 = cholesky.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
        -logs - 0.5 * record.dot(&solved)
    };
    for seed in 0..6 {
        let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let normals: Vec<f64> = StandardNormal.sample_iter(rng).take(3 * SEEN + 1).collect();
        let (angles, others) = normals.split_at(SEEN + 1);
        let (rates, steps) = others.split_at(SEEN);
        let mut drift = 0.0;
        let record: Vec<f64> = (0..SEEN)
            .map(|row| {
                drift += 2e-3 * steps[row];
                drift + 0.03 * rates[row] + angles[row + 1] - angles[row]
            })
            .collect();
        let start = NoiseLevels {
            white: 1e-3,
            angle: 1.0,
            ..NoiseLevels::default()
        };
        let equations = NormalEquations::new(
            observations.clone(),
            std::slice::from_ref(&record),
            &Nothing,
            start,
        );
        let [none, walk] = [Drift::None, Drift::Walk].map(|drift| {
            evaluate(
                &equations,
                &[],
                &[start],
                &[drift],
                Effort::FULL,
                &SearchPlan::default(),
            )
        });
        let gained = walk.log_likelihood - none.log_likelihood;
        let expected = exact(&record, walk.levels[0]) - exact(&record, none.levels[0]);
        assert!(
            (gained - expected).abs() < 1.0 + 0.1 * expected.abs(),
            "{seed}: {gained} {expected}"
        );
    }
}

struct Nothing;

impl Columns for Nothing {
    fn count(&self) -> usize {
        0
    }

    fn column(&self, _: usize) -> Vec<f64> {
        unreachable!("there is none")
    }
}
