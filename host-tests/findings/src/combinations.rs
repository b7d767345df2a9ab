//! Which combinations of an effect's numbers a recording fixes.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, SymmetricEigen};

use crate::result::Identifiable;

/// Anti-correlation of a gyro's two coefficients beyond which they are known only together.
const TOGETHER: f64 = -0.5;

/// Share of the prior's standard deviation from which on a number is no better known than before the recording.
const UNKNOWN: f64 = 0.5;

/// A number of an effect.
#[derive(Debug, Clone)]
pub struct Number {
    /// Its name in the contract.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// What was known of it before: the standard deviation of a prior about 0, infinite where nothing was.
    pub prior_std: f64,
}

impl Number {
    /// Of which nothing was known.
    pub fn free(name: &str, value: f64) -> Self {
        Self {
            name: name.to_string(),
            value,
            prior_std: f64::INFINITY,
        }
    }
}

/// Forms the combinations that are known: sums of the two coefficients of each gyro where they alone are (of a pair that is
/// known mostly by its sum, six numbers would say more than three are worth), else single numbers; of those that are no better
/// known than before, the eigenvectors of their covariance that are.
///
/// # Inputs
/// `covariance`: of the numbers.
pub fn identifiable(numbers: &[Number], covariance: &DMatrix<f64>) -> Vec<Identifiable> {
    let count = numbers.len();
    let mut all = Vec::new();
    let mut unknown: Vec<usize> = Vec::new();
    let mut k = 0;
    while k < count {
        let is_pair = count == 6 && k % 2 == 0;
        let deviations = || (covariance[(k, k)] * covariance[(k + 1, k + 1)]).sqrt();
        let together = is_pair && covariance[(k, k + 1)] < TOGETHER * deviations();
        let places: Vec<usize> = (k..k + 1 + usize::from(together)).collect();
        k += places.len();
        let weights: Vec<(usize, f64)> = places.iter().map(|place| (*place, 1.0)).collect();
        let one = combination(numbers, covariance, &weights);
        let prior = weights
            .iter()
            .map(|(place, _)| numbers[*place].prior_std.powi(2));
        if one.std < UNKNOWN * prior.sum::<f64>().sqrt() {
            all.push(one);
        } else {
            unknown.extend(places);
        }
    }
    if !unknown.is_empty() {
        all.extend(known_together(numbers, covariance, &unknown));
    }
    all
}

/// Eigenvectors of the covariance of numbers that are unknown each by itself, those that the recording fixes, best first.
fn known_together(
    numbers: &[Number],
    covariance: &DMatrix<f64>,
    unknown: &[usize],
) -> Vec<Identifiable> {
    let prior = |k: usize| numbers[unknown[k]].prior_std;
    let by_prior = DMatrix::from_fn(unknown.len(), unknown.len(), |a, b| {
        covariance[(unknown[a], unknown[b])] / (prior(a) * prior(b))
    });
    let eigen = SymmetricEigen::new(by_prior);
    let mut known: Vec<usize> = (0..unknown.len())
        .filter(|k| eigen.eigenvalues[*k] < UNKNOWN * UNKNOWN)
        .collect();
    known.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let of_direction = |direction: usize| {
        let weight = |k: usize| eigen.eigenvectors[(k, direction)] / prior(k);
        // An eigenvector has no scale of its own: the largest weight is 1.
        let largest = (0..unknown.len()).map(weight).fold(0.0, |most: f64, one| {
            if one.abs() > most.abs() { one } else { most }
        });
        let weights = (0..unknown.len()).map(|k| (unknown[k], weight(k) / largest));
        combination(numbers, covariance, &weights.collect::<Vec<_>>())
    };
    known.into_iter().map(of_direction).collect()
}

fn combination(
    numbers: &[Number],
    covariance: &DMatrix<f64>,
    weights: &[(usize, f64)],
) -> Identifiable {
    let pairs = weights
        .iter()
        .flat_map(|a| weights.iter().map(move |b| (*a, *b)));
    let variance: f64 = pairs
        .map(|((a, of_a), (b, of_b))| of_a * of_b * covariance[(a, b)])
        .sum();
    let named = weights
        .iter()
        .map(|(k, weight)| (numbers[*k].name.clone(), *weight));
    Identifiable {
        combination: named.collect::<BTreeMap<_, _>>(),
        value: weights
            .iter()
            .map(|(k, weight)| weight * numbers[*k].value)
            .sum(),
        std: variance.max(0.0).sqrt(),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::{Number, identifiable};

    fn numbers(values: &[f64], prior_std: f64) -> Vec<Number> {
        let of = |(k, value): (usize, &f64)| Number {
            prior_std,
            ..Number::free(&format!("n{k}"), *value)
        };
        values.iter().enumerate().map(of).collect()
    }

    /// Posterior of a prior of 1 and one measurement of a·θ to 0.01.
    fn measured(direction: &[f64]) -> DMatrix<f64> {
        let a = DVector::from_column_slice(direction);
        let information = DMatrix::identity(a.len(), a.len()) + &a * a.transpose() / 1e-4;
        information.try_inverse().expect("a covariance")
    }

    #[test]
    fn what_one_direction_of_motion_shows_of_three_numbers_is_one_combination() {
        let covariance = measured(&[1.0, 2.0, -1.0]);
        let [known] = &identifiable(&numbers(&[0.3, 0.5, -0.2], 1.0), &covariance)[..] else {
            panic!("one combination");
        };
        assert!((known.combination["n0"] - 0.5).abs() < 1e-6);
        assert!((known.combination["n1"] - 1.0).abs() < 1e-6);
        assert!((known.combination["n2"] + 0.5).abs() < 1e-6);
        assert!((known.value - 0.75).abs() < 1e-6 && (known.std - 0.005).abs() < 1e-4);
    }

    #[test]
    fn numbers_at_their_prior_are_not_listed_and_those_that_are_known_stand_alone() {
        let covariance = measured(&[0.0, 1.0, 0.0]);
        let known = identifiable(&numbers(&[0.0, 0.4, 0.0], 1.0), &covariance);
        assert_eq!(known.len(), 1);
        assert_eq!(known[0].combination.keys().collect::<Vec<_>>(), ["n1"]);
    }

    #[test]
    fn without_a_prior_every_number_is_listed() {
        let covariance = measured(&[1.0, 1.0, 0.0]);
        assert_eq!(
            identifiable(&numbers(&[1.0; 3], f64::INFINITY), &covariance).len(),
            3
        );
    }

    #[test]
    fn a_pair_of_six_that_is_known_by_its_sum_is_its_sum() {
        let covariance = measured(&[1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
        let known = identifiable(&numbers(&[1.0; 6], 1.0), &covariance);
        let [sum] = &known[..] else {
            panic!("{known:?}")
        };
        assert_eq!(sum.combination.len(), 2);
        assert!((sum.value - 2.0).abs() < 1e-12 && sum.std < 0.011);
    }
}
