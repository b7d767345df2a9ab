//! Normal equations of generalised least squares for a set's parameters under a known noise.
//!
//! For y = Xθ + n, n with covariance S: XᵀS⁻¹X θ = XᵀS⁻¹y (Kay, *Estimation Theory*, 1993, Eq. 4.25). Independent data add.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::assembled::{Assembled, binned};
use crate::hypothesis::Hypothesis;
use crate::likelihood::Likelihood;
use crate::linear::pseudo_inverse_beside;
use crate::noise::NoiseLevels;

/// Share of an effect's power given others, below which it is rounding.
const ROUNDING: f64 = 1e-6;

/// Normal equations of one set of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Information {
    /// XᵀS⁻¹X, the Fisher information \[1 over the units of both parameters\].
    pub fisher: DMatrix<f64>,
    /// XᵀS⁻¹y \[1 over the parameter's unit\].
    pub score: DVector<f64>,
    /// yᵀS⁻¹y.
    pub power: f64,
}

impl Information {
    /// No data on `parameters` parameters.
    pub fn none(parameters: usize) -> Self {
        Self {
            fisher: DMatrix::zeros(parameters, parameters),
            score: DVector::zeros(parameters),
            power: 0.0,
        }
    }

    /// Sums up data under a known noise, the nuisance parameters of gaps and ends projected out.
    ///
    /// # Inputs
    /// `set`: hypotheses, whose parameters follow one another; `levels`: noise of each record.
    pub fn of(data: &impl Likelihood, set: &[&Hypothesis], levels: &[NoiseLevels]) -> Self {
        let assembled = Assembled::new(data, set);
        let powers = binned(data, levels);
        let (information, score) = assembled.sums(&powers);
        let left = assembled.beside_gaps(&information);
        let own = assembled.of_members();
        let of_gaps = score.rows_range(own..).into_owned();
        let of_members = score.rows_range(..own) - left.through() * &of_gaps;
        let by_record = assembled.records.iter().zip(&powers);
        let energy: f64 = by_record
            .flat_map(|(record, powers)| record.energy.iter().zip(powers))
            .map(|(energy, power)| energy / power)
            .sum();
        let scale = &assembled.scale;
        Self {
            fisher: DMatrix::from_fn(own, own, |a, b| {
                left.information[(a, b)] / (scale[a] * scale[b])
            }),
            score: DVector::from_fn(own, |a, _| of_members[a] / scale[a]),
            power: energy - left.power_of_gaps(&of_gaps),
        }
    }

    /// Adds independent data on some of the parameters.
    ///
    /// # Inputs
    /// `places`: place here of each parameter of `part`.
    pub fn add(&mut self, part: &Self, places: &[usize]) {
        self.power += part.power;
        for (a, &to_a) in places.iter().enumerate() {
            self.score[to_a] += part.score[a];
            for (b, &to_b) in places.iter().enumerate() {
                self.fisher[(to_a, to_b)] += part.fisher[(a, b)];
            }
        }
    }

    /// Schur complement of the information on some parameters given free others, and the regression of the others on them.
    ///
    /// # Inputs
    /// `own`: the parameters in question; `beside`: free nuisance parameters, each with the standard deviation of its prior.
    fn beside(&self, own: &[usize], beside: &[(usize, f64)]) -> (DMatrix<f64>, DMatrix<f64>) {
        let fisher = |a: usize, b: usize| self.fisher[(a, b)];
        let free = DMatrix::from_fn(beside.len(), beside.len(), |a, b| {
            let prior = if a == b { beside[a].1.powi(-2) } else { 0.0 };
            fisher(beside[a].0, beside[b].0) + prior
        });
        let across = DMatrix::from_fn(beside.len(), own.len(), |a, b| fisher(beside[a].0, own[b]));
        let spread = pseudo_inverse_beside(&free, &free) * &across;
        let whole = DMatrix::from_fn(own.len(), own.len(), |a, b| fisher(own[a], own[b]));
        (whole - across.tr_mul(&spread), spread)
    }

    /// Distance of an effect from the span of free other parameters, in standard deviations.
    ///
    /// # Inputs
    /// `own`: the parameters; `values`: their values; `beside`: free nuisance parameters, each with the standard deviation
    /// of its prior.
    pub fn separation(&self, own: Range<usize>, values: &[f64], beside: &[(usize, f64)]) -> f64 {
        let own: Vec<usize> = own.collect();
        let values = DVector::from_column_slice(values);
        let whole = DMatrix::from_fn(own.len(), own.len(), |a, b| self.fisher[(own[a], own[b])]);
        let power = values.dot(&(whole * &values));
        let left = values.dot(&(self.beside(&own, beside).0 * &values));
        if left < ROUNDING * power {
            0.0
        } else {
            left.max(0.0).sqrt()
        }
    }

    /// Estimates of the free parameters in the absence of the effect's own parameters (aliasing of the effect).
    ///
    /// # Inputs
    /// As of [`Self::separation`].
    pub fn stand_in(&self, own: Range<usize>, values: &[f64], beside: &[(usize, f64)]) -> Vec<f64> {
        let own: Vec<usize> = own.collect();
        let spread = self.beside(&own, beside).1;
        (spread * DVector::from_column_slice(values))
            .as_slice()
            .to_vec()
    }

    /// Standard deviations of parameters given free others; infinite for unobserved ones.
    ///
    /// # Inputs
    /// `own`: the parameters, each with the standard deviation of its prior; `beside`: the free ones alike.
    pub fn deviations(&self, own: &[(usize, f64)], beside: &[(usize, f64)]) -> Vec<f64> {
        let places: Vec<usize> = own.iter().map(|one| one.0).collect();
        let (mut left, _) = self.beside(&places, beside);
        for (k, (_, std)) in own.iter().enumerate() {
            left[(k, k)] += std.powi(-2);
        }
        let covariance = pseudo_inverse_beside(&left, &left);
        let variance = |k: usize| covariance[(k, k)];
        (0..own.len())
            .map(|k| match variance(k) > 0.0 {
                true => variance(k).sqrt(),
                false => f64::INFINITY,
            })
            .collect()
    }

    /// Weighted residual sum of squares for given parameter values, (y − Xθ)ᵀS⁻¹(y − Xθ).
    pub fn power_left(&self, values: &DVector<f64>) -> f64 {
        self.power - 2.0 * values.dot(&self.score) + values.dot(&(&self.fisher * values))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use super::Information;
    use crate::{Columns, Hypothesis, NoiseLevels, NormalEquations, Observations, Term};

    const ROWS: usize = 120;

    struct Waves;

    impl Columns for Waves {
        fn count(&self) -> usize {
            2
        }

        fn column(&self, place: usize) -> Vec<f64> {
            let wave = |row: usize| (0.3 * (place + 1) as f64 * row as f64).sin();
            (0..ROWS).map(wave).collect()
        }
    }

    /// Two parameters on one record, the second on its column and on half of the first's.
    fn set() -> Hypothesis {
        let term = |(parameter, column, coefficient)| Term {
            parameter,
            record: 0,
            column,
            coefficient,
        };
        Hypothesis::of_terms(
            2,
            [(0, 0, 3.0), (1, 1, 1.0), (1, 0, 0.5)].map(term).to_vec(),
        )
    }

    #[test]
    fn it_is_weighted_least_squares_beside_rows_that_nobody_saw() {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut record: Vec<f64> = (0..ROWS)
            .map(|_| StandardNormal.sample(&mut random))
            .collect();
        let white = 0.25;
        let levels = NoiseLevels {
            white,
            ..NoiseLevels::default()
        };
        let mut seen = vec![true; ROWS];
        seen[50] = false;
        record[50] = 1e6;
        let observations = Observations::bridged(&seen).expect("rows");
        let records = [record.clone()];
        let equations = NormalEquations::new(observations, &records, &Waves, levels);
        let found = Information::of(&equations, &[&set()], &[levels]);
        // The unseen row is free, as are the two ends.
        let rows: Vec<usize> = (1..ROWS - 1).filter(|row| *row != 50).collect();
        let [one, two] = [0, 1].map(|place| Waves.column(place));
        let x = DMatrix::from_fn(rows.len(), 2, |row, column| match column {
            0 => 3.0 * one[rows[row]],
            _ => two[rows[row]] + 0.5 * one[rows[row]],
        });
        let y = DVector::from_fn(rows.len(), |row, _| record[rows[row]]);
        let expected = Information {
            fisher: x.tr_mul(&x) / white,
            score: x.tr_mul(&y) / white,
            power: y.norm_squared() / white,
        };
        assert!((&found.fisher - &expected.fisher).norm() < 1e-5 * expected.fisher.norm());
        assert!((&found.score - &expected.score).norm() < 1e-5 * expected.score.norm());
        assert!((found.power - expected.power).abs() < 1e-5 * expected.power);
    }

    /// Columns (1, 0), (c, s) and their sum, of white noise.
    fn of_three(angle: f64) -> Information {
        let x = DMatrix::from_row_slice(
            2,
            3,
            &[
                1.0,
                angle.cos(),
                1.0 + angle.cos(),
                0.0,
                angle.sin(),
                angle.sin(),
            ],
        );
        Information {
            fisher: x.tr_mul(&x),
            ..Information::none(3)
        }
    }

    #[test]
    fn an_effect_is_apart_by_its_part_across_the_others() {
        let angle = 0.3_f64;
        let known = of_three(angle);
        let apart = known.separation(0..1, &[5.0], &[(1, f64::INFINITY)]);
        assert!((apart - 5.0 * angle.sin()).abs() < 1e-9);
        // An effect within the span of the others has no distance.
        assert_eq!(
            known.separation(0..1, &[5.0], &[(1, f64::INFINITY), (2, f64::INFINITY)]),
            0.0
        );
        // A prior prevents aliasing with the other.
        assert!((known.separation(0..1, &[5.0], &[(1, 1e-6)]) - 5.0).abs() < 1e-6);
        let instead = known.stand_in(0..1, &[5.0], &[(1, f64::INFINITY)]);
        assert!((instead[0] - 5.0 * angle.cos()).abs() < 1e-9);
        let std = known.deviations(&[(0, f64::INFINITY)], &[(1, f64::INFINITY)]);
        assert!((std[0] * angle.sin() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_left_by_parts_is_the_sum_of_what_each_leaves() {
        let part = Information {
            fisher: DMatrix::from_row_slice(1, 1, &[4.0]),
            score: DVector::from_row_slice(&[2.0]),
            power: 3.0,
        };
        let mut sum = Information::none(2);
        sum.add(&part, &[0]);
        sum.add(&part, &[1]);
        let values = DVector::from_row_slice(&[0.5, -1.0]);
        // 3 − 2 · ½ · 2 + ¼ · 4 = 2 and 3 + 2 · 2 + 4 = 11.
        assert!((sum.power_left(&values) - 13.0).abs() < 1e-12);
    }
}
