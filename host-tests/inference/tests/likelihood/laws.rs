//! The laws of a likelihood hold for each implementation of this package, and a broken one is noticed.

use std::ops::Range;

use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rlg_inference::laws::broken_laws;
use rlg_inference::{
    Columns, Hypothesis, JointLikelihood, Likelihood, NoiseBasis, NoiseLevels, NormalEquations,
    Observations, ZeroLikelihood,
};
use rlg_plan::SearchPlan;

const LEVELS: NoiseLevels = NoiseLevels {
    white: 1.0,
    angle: 0.2,
    flicker: 0.0,
    walk: 0.0,
};

/// Two sines and a constant rate.
struct Shapes(usize);

impl Columns for Shapes {
    fn count(&self) -> usize {
        3
    }

    fn column(&self, place: usize) -> Vec<f64> {
        let turns = [0.05, 0.31, 0.0][place];
        let rows = 0..self.0;
        rows.map(|row| (row as f64 * turns).cos()).collect()
    }
}

fn data(seed: u64, seen: &[bool]) -> NormalEquations {
    let random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let rows = seen.len();
    let record: Vec<f64> = StandardNormal.sample_iter(random).take(rows).collect();
    let observations = Observations::bridged(seen).expect("rows");
    NormalEquations::new(observations, &[record], &Shapes(rows), LEVELS)
}

fn holds(likelihood: &impl Likelihood, columns: usize) {
    let levels = vec![LEVELS; likelihood.record_count()];
    let broken = broken_laws(likelihood, columns, &levels, &SearchPlan::default());
    assert!(broken.is_empty(), "{broken:?}");
}

#[test]
fn whole_records_and_those_with_gaps_keep_the_laws() {
    holds(&data(1, &[true; 4000]), 3);
    let seen: Vec<bool> = (0..4000).map(|row| row % 1000 > 40).collect();
    holds(&data(2, &seen), 3);
}

#[test]
fn joint_data_and_none_keep_the_laws() {
    let (a, b) = (data(3, &[true; 3000]), data(4, &[true; 2000]));
    holds(&JointLikelihood::new(vec![&a, &b]), 3);
    holds(&ZeroLikelihood::new(2), 0);
}

/// Data of which one property is wrong.
struct Broken<'a> {
    sound: &'a NormalEquations,
    wrong: Wrong,
}

#[derive(PartialEq)]
enum Wrong {
    Moment,
    Product,
    Groups,
}

impl Likelihood for Broken<'_> {
    fn record_count(&self) -> usize {
        Likelihood::record_count(self.sound)
    }

    fn basis(&self, record: usize) -> &NoiseBasis {
        self.sound.basis(record)
    }

    fn energy(&self, record: usize) -> &[f64] {
        Likelihood::energy(self.sound, record)
    }

    fn moment(&self, record: usize, bin: usize, column: usize) -> f64 {
        let factor = if self.wrong == Wrong::Moment {
            1e3
        } else {
            1.0
        };
        factor * Likelihood::moment(self.sound, record, bin, column)
    }

    fn product(&self, record: usize, bin: usize, a: usize, b: usize) -> f64 {
        let is_wrong = self.wrong == Wrong::Product && a < b;
        let sign = if is_wrong { -1.0 } else { 1.0 };
        sign * Likelihood::product(self.sound, record, bin, a, b)
    }

    fn scale(&self, record: usize, column: usize) -> f64 {
        Likelihood::scale(self.sound, record, column)
    }

    fn free(&self) -> &[Hypothesis] {
        self.sound.free()
    }

    fn sisters(&self) -> Vec<Range<usize>> {
        match self.wrong {
            Wrong::Groups => Vec::new(),
            _ => self.sound.sisters(),
        }
    }
}

#[test]
fn a_broken_law_is_named() {
    let sound = data(5, &[true; 1000]);
    for (wrong, named) in [
        (Wrong::Moment, "moment"),
        (Wrong::Product, "commute"),
        (Wrong::Groups, "drift groups"),
    ] {
        let sound = &sound;
        let broken = broken_laws(
            &Broken { sound, wrong },
            3,
            &[LEVELS],
            &SearchPlan::default(),
        );
        assert!(
            broken.iter().any(|law| law.contains(named)),
            "{named}: {broken:?}"
        );
    }
}
