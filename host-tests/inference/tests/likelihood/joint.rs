//! Several records of independent data under common hypotheses.

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rlg_inference::evaluate::{Drift, Effort, evaluate};
use rlg_inference::search::DriftPrior;
use rlg_inference::{
    Columns, Hypothesis, JointLikelihood, NoiseLevels, NormalEquations, Observations, Search, Term,
    ZeroLikelihood,
};
use rlg_plan::SearchPlan;

/// A sine, and a shape that nothing follows.
struct Shapes(usize);

impl Columns for Shapes {
    fn count(&self) -> usize {
        2
    }

    fn column(&self, place: usize) -> Vec<f64> {
        let turns = [0.05, 0.31][place];
        (0..self.0).map(|row| (row as f64 * turns).sin()).collect()
    }
}

const WHITE: NoiseLevels = NoiseLevels {
    white: 1.0,
    angle: 0.0,
    flicker: 0.0,
    walk: 0.0,
};

/// One record of white noise of unit power, the sine in it with a size.
fn data(seed: u64, rows: usize, size: f64) -> NormalEquations {
    let random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let noise: Vec<f64> = StandardNormal.sample_iter(random).take(rows).collect();
    let sine = Shapes(rows).column(0);
    let pairs = noise.iter().zip(&sine);
    let record: Vec<f64> = pairs.map(|(noise, sine)| noise + size * sine).collect();
    let observations = Observations::bridged(&vec![true; rows]).expect("rows");
    NormalEquations::new(observations, &[record], &Shapes(rows), WHITE)
}

/// One parameter on column `column` of some records.
fn on(records: &[usize], column: usize, price: f64) -> Hypothesis {
    let term = |&record: &usize| Term {
        parameter: 0,
        record,
        column,
        coefficient: 1.0,
    };
    Hypothesis {
        price,
        ..Hypothesis::of_terms(1, records.iter().map(term).collect())
    }
}

#[test]
fn log_likelihoods_of_independent_data_add_and_each_record_keeps_its_noise() {
    let (a, b) = (data(1, 4096, 0.0), data(2, 3000, 0.0));
    let plan = SearchPlan::default();
    let alone =
        |one: &NormalEquations| evaluate(one, &[], &[WHITE], &[Drift::None], Effort::FULL, &plan);
    let joint = JointLikelihood::new(vec![&a, &b]);
    let both = evaluate(
        &joint,
        &[],
        &[WHITE; 2],
        &[Drift::None; 2],
        Effort::FULL,
        &plan,
    );
    let each = [alone(&a), alone(&b)];
    let sum = each[0].log_likelihood + each[1].log_likelihood;
    assert!((both.log_likelihood - sum).abs() < 0.02, "{sum}");
    for (own, of_both) in each.iter().zip(&both.levels) {
        let ratio = own.levels[0].white / of_both.white;
        assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
    }
}

#[test]
fn four_records_find_together_what_none_finds_alone() {
    const ROWS: [usize; 4] = [4096, 3000, 5000, 3600];
    /// Kinds of a catalogue: what stands out of so many is beyond 3.5 standard deviations.
    const KINDS: usize = 30;
    // 2.3 standard deviations in the mean record.
    let size = 2.3 / (3900.0_f64 / 2.0).sqrt();
    let parts: Vec<NormalEquations> = (0..4).map(|k| data(10 + k as u64, ROWS[k], size)).collect();
    let plan = SearchPlan::default();
    let drift = DriftPrior::Unknown;
    for part in &parts {
        let own = [on(&[0], 0, 0.0), on(&[0], 1, 0.0)];
        let mut search = Search::new(part, &own, KINDS, &plan, &drift, vec![WHITE]);
        assert_eq!(search.run(&[], 2).members, [0_usize; 0]);
    }
    let joint = JointLikelihood::new(parts.iter().collect());
    let all = [0, 1, 2, 3];
    let mut hypotheses = vec![on(&all, 0, 0.0), on(&all, 1, 0.0)];
    hypotheses.extend((0..4).map(|record| on(&[record], 0, 4.0_f64.ln())));
    let mut search = Search::new(&joint, &hypotheses, KINDS, &plan, &drift, vec![WHITE; 4]);
    let best = search.run(&[], 3);
    assert_eq!(best.members, [0]);
    let std = best.covariance[(0, 0)].sqrt();
    let expected = (2.0 / ROWS.iter().sum::<usize>() as f64).sqrt();
    assert!((std / expected - 1.0).abs() < 0.1, "{std} {expected}");
    assert!((best.estimate[0] - size).abs() < 4.0 * std);
}

#[test]
fn without_data_a_set_is_worth_its_prior() {
    let none = ZeroLikelihood::new(3);
    let hypotheses = [on(&[0, 1, 2], 0, 1.5), on(&[1], 1, 0.0)];
    let plan = SearchPlan::default();
    let drift = DriftPrior::Unknown;
    let mut search = Search::new(&none, &hypotheses, 2, &plan, &drift, vec![WHITE; 3]);
    assert_eq!(search.run(&[], 2).members, [0_usize; 0]);
    let fit = evaluate(
        &none,
        &[&hypotheses[1]],
        &[WHITE; 3],
        &[Drift::None; 3],
        Effort::FULL,
        &plan,
    );
    assert!(fit.log_likelihood.abs() < 1e-9, "{}", fit.log_likelihood);
    assert_eq!(fit.levels, [WHITE; 3]);
}
