//! The noise under columns that take most of the lowest frequencies with them: what is left there looks quiet.

use std::f64::consts::PI;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rlg_inference::evaluate::{Effort, evaluate};
use rlg_inference::normal_equations::{Columns, NormalEquations};
use rlg_inference::{Drift, Hypothesis, NoiseLevels, Observations, Term};
use rlg_plan::SearchPlan;

const ROWS: usize = 40_000;
/// Random walk of angle and white noise of angle \[row⁻¹\]: they cross at a seventieth of the row rate.
const WALK: f64 = 1.0;
const WHITE: f64 = 120.0;

/// Slow waves.
struct Waves;

impl Columns for Waves {
    fn count(&self) -> usize {
        60
    }

    fn column(&self, place: usize) -> Vec<f64> {
        let turn = PI * (place + 1) as f64 / ROWS as f64;
        (0..ROWS).map(|row| (turn * row as f64).sin()).collect()
    }
}

#[test]
fn the_noise_does_not_come_out_low_under_sixty_columns() {
    let rng = rand_chacha::ChaCha8Rng::seed_from_u64(9);
    let mut noise = StandardNormal.sample_iter(rng);
    let mut normal = || -> f64 { noise.next().expect("endless") };
    let mut before = normal() * WHITE.sqrt();
    let record: Vec<f64> = (0..ROWS)
        .map(|_| {
            let now = normal() * WHITE.sqrt();
            let increment = normal() * WALK.sqrt() + now - before;
            before = now;
            increment
        })
        .collect();
    let start = NoiseLevels {
        white: 2.0 * WALK,
        angle: 0.5 * WHITE,
        ..NoiseLevels::default()
    };
    let observations = Observations::bridged(&[true; ROWS]).expect("rows");
    let equations = NormalEquations::new(observations, &[record], &Waves, start);
    let waves: Vec<Hypothesis> = (0..Waves.count())
        .map(|column| {
            Hypothesis::of_terms(
                1,
                vec![Term {
                    parameter: 0,
                    record: 0,
                    column,
                    coefficient: 1.0,
                }],
            )
        })
        .collect();
    let set: Vec<&Hypothesis> = waves.iter().collect();
    let fit = evaluate(
        &equations,
        &set,
        &[start],
        &[Drift::None],
        Effort::FULL,
        &SearchPlan::default(),
    );
    // Some 1100 free coefficients lie below the corner: the walk is known to 4 %; three of that. The white level has 40 000.
    let levels = fit.levels[0];
    assert!((levels.white / WALK - 1.0).abs() < 0.13, "{levels:?}");
    assert!((levels.angle / WHITE - 1.0).abs() < 0.022, "{levels:?}");
}
