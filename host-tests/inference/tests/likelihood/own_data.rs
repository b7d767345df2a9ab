//! Data of a kind of its own, from columns to a named effect: the pattern for "a new kind of recording" in CONTRIBUTING.md.
//!
//! A thermometer in an oven: its reading differs from the reference by an offset, by a scale error and by a lag. The three are
//! concealed in turn, and each is found with its size, alone.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rlg_inference::laws::broken_laws;
use rlg_inference::search::DriftPrior;
use rlg_inference::{
    Columns, Hypothesis, NoiseLevels, NormalEquations, Observations, Search, Term,
};
use rlg_plan::SearchPlan;

const ROWS: usize = 4000;

/// White noise of 0.02 K.
const NOISE: NoiseLevels = NoiseLevels {
    white: 4e-4,
    angle: 0.0,
    flicker: 0.0,
    walk: 0.0,
};

/// Names of the hypotheses, in the order of their columns.
const EFFECTS: [&str; 3] = ["offset", "scale error", "lag"];

/// Reference temperature less its mean \[K\], and its rate \[K/row\].
fn oven(row: usize) -> (f64, f64) {
    let (w, t) = (2e-3, row as f64);
    (10.0 * (w * t).sin(), 10.0 * w * (w * t).cos())
}

/// Change of the reading by a unit of each effect: 1 K, 1, 1 row.
struct Oven;

impl Columns for Oven {
    fn count(&self) -> usize {
        EFFECTS.len()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        let of = |row| {
            let (temperature, rate) = oven(row);
            [1.0, temperature, -rate][place]
        };
        (0..ROWS).map(of).collect()
    }
}

/// Residual of the thermometer against the reference, with one effect of size `size` concealed in it.
fn residual(effect: usize, size: f64) -> Vec<f64> {
    let random = rand_chacha::ChaCha8Rng::seed_from_u64(effect as u64);
    let noise = StandardNormal.sample_iter(random).take(ROWS);
    let noise: Vec<f64> = noise.map(|one: f64| 0.02 * one).collect();
    let read = |row: usize| {
        let (temperature, rate) = oven(row);
        match effect {
            0 => size,
            1 => size * temperature,
            // Exact to all orders: the columns are not what made it.
            _ => oven(row).0 * ((2e-3 * size).cos() - 1.0) - rate / 2e-3 * (2e-3 * size).sin(),
        }
    };
    (0..ROWS).map(|row| read(row) + noise[row]).collect()
}

#[test]
fn each_concealed_effect_is_found_alone_with_its_size() {
    let candidates = [0, 1, 2].map(|column| {
        let term = Term {
            parameter: 0,
            record: 0,
            column,
            coefficient: 1.0,
        };
        Hypothesis::of_terms(1, vec![term])
    });
    for (effect, size) in [(0, 0.01), (1, 1e-3), (2, 5.0)] {
        let (plan, drift) = (SearchPlan::default(), DriftPrior::Unknown);
        let record = residual(effect, size);
        let seen = Observations::bridged(&[true; ROWS]).expect("rows");
        let data = NormalEquations::new(seen, &[record], &Oven, NOISE);
        assert_eq!(
            broken_laws(&data, Oven.count(), &[NOISE], &plan),
            Vec::<String>::new()
        );
        let mut search = Search::new(&data, &candidates, 3, &plan, &drift, vec![NOISE]);
        let fit = search.run(&[], plan.most_members);
        let names: Vec<&str> = fit.members.iter().map(|&member| EFFECTS[member]).collect();
        assert_eq!(names, [EFFECTS[effect]]);
        let std = fit.covariance[(0, 0)].sqrt();
        let error = (fit.estimate[0] - size).abs();
        assert!(
            error < 4.0 * std && std < 0.2 * size,
            "{}: {error} ± {std}",
            names[0]
        );
    }
}
