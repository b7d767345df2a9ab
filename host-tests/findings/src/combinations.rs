//! Estimable combinations of an effect's parameters, and the values written for the others.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use rlg_model::catalogue::SIX;
use rlg_plan::CombinationPlan;

use crate::result::Identifiable;

/// Parameter of an effect.
#[derive(Debug, Clone)]
pub struct Number {
    /// Name in the contract.
    pub name: String,
    /// Estimated value.
    pub value: f64,
    /// Standard deviation of the prior about 0; infinite for a flat prior.
    pub prior_std: f64,
}

impl Number {
    /// Parameter with a flat prior.
    pub fn free(name: &str, value: f64) -> Self {
        Self {
            name: name.to_string(),
            value,
            prior_std: f64::INFINITY,
        }
    }
}

/// Forms the estimable combinations: sums of the two coefficients of each gyro if only these are estimable (six
/// separate values would overstate the information of three sums), with the difference if significant, else single
/// parameters; from the parameters not better known than a priori, the eigenvectors of their scaled covariance that
/// are.
///
/// # Inputs
/// `covariance`: posterior covariance of the parameters.
pub fn identifiable(
    numbers: &[Number],
    covariance: &DMatrix<f64>,
    plan: &CombinationPlan,
) -> Vec<Identifiable> {
    let count = numbers.len();
    let has_pairs =
        count >= SIX.len() && numbers.iter().zip(SIX).all(|(one, name)| one.name == *name);
    let mut all = Vec::new();
    let mut unknown: Vec<usize> = Vec::new();
    let mut k = 0;
    while k < count {
        let is_pair = has_pairs && k < SIX.len() && k % 2 == 0;
        let deviations = || (covariance[(k, k)] * covariance[(k + 1, k + 1)]).sqrt();
        let together = is_pair && covariance[(k, k + 1)] < -plan.anticorrelation * deviations();
        let places: Vec<usize> = (k..k + 1 + usize::from(together)).collect();
        k += places.len();
        let weights: Vec<(usize, f64)> = places.iter().map(|place| (*place, 1.0)).collect();
        let one = combination(numbers, covariance, &weights);
        let prior = weights
            .iter()
            .map(|(place, _)| numbers[*place].prior_std.powi(2));
        if one.std < plan.unknown * prior.sum::<f64>().sqrt() {
            all.push(one);
            if let [first, second] = places[..] {
                let apart = combination(numbers, covariance, &[(first, 1.0), (second, -1.0)]);
                all.extend((apart.value.abs() > plan.apart * apart.std).then_some(apart));
            }
        } else {
            unknown.extend(places);
        }
    }
    if !unknown.is_empty() {
        all.extend(known_together(numbers, covariance, &unknown, plan));
    }
    all
}

/// Values written for an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// Values of the parameters.
    pub values: Vec<f64>,
    /// Text on the parameters that are a choice, for `model.toml`; `None` if all are estimable.
    pub choice: Option<String>,
}

/// Computes the minimum-norm values consistent with the estimable combinations: the expectation of the Gaussian prior
/// given those. The two coefficients of a gyro with only their sum known are then equal (an unequal pair without
/// support of the data costs drift under in-phase vibration), and parameters not better known than a priori are 0.
///
/// # Inputs
/// `known`: combinations of [`identifiable`].
pub fn written(numbers: &[Number], known: &[Identifiable]) -> Written {
    let as_estimated = || Written {
        values: numbers.iter().map(|one| one.value).collect(),
        choice: None,
    };
    let count = numbers.len();
    if known.len() >= count {
        return as_estimated();
    }
    // Parameters with a flat prior are all estimable, so that their width has no effect.
    let width = |one: &Number| match one.prior_std.is_finite() {
        true => one.prior_std,
        false => 1.0,
    };
    let by_width = DMatrix::from_fn(known.len(), count, |row, k| {
        let weight = known[row].combination.get(&numbers[k].name);
        weight.copied().unwrap_or(0.0) * width(&numbers[k])
    });
    let values = DVector::from_fn(known.len(), |row, _| known[row].value);
    let Some(inverse) = (&by_width * by_width.transpose()).try_inverse() else {
        return as_estimated();
    };
    let in_widths = by_width.transpose() * (inverse * values);
    let of = |(k, one): (usize, &Number)| match single(known, &one.name) {
        true => one.value,
        false => in_widths[k] * width(one),
    };
    Written {
        values: numbers.iter().enumerate().map(of).collect(),
        choice: choice(numbers.iter().map(|one| one.name.as_str()), known),
    }
}

/// True if a parameter is estimable by itself.
fn single(known: &[Identifiable], name: &str) -> bool {
    let mut known = known.iter();
    known.any(|one| one.combination.len() == 1 && one.combination.contains_key(name))
}

/// Formats the names of the parameters that are a choice; `None` if all are estimable.
pub fn choice<'a>(names: impl Iterator<Item = &'a str>, known: &[Identifiable]) -> Option<String> {
    let of = |name: &str| -> Vec<&Identifiable> {
        let known = known.iter();
        known
            .filter(|one| one.combination.contains_key(name))
            .collect()
    };
    let (mut even, mut zero, mut least) = (Vec::new(), Vec::new(), Vec::new());
    for name in names.filter(|name| !single(known, name)) {
        match of(name)[..] {
            [] => zero.push(name.to_owned()),
            [sum] if is_sum_of_a_pair(&sum.combination) => {
                let pair: Vec<&str> = sum.combination.keys().map(String::as_str).collect();
                if pair[0] == name {
                    even.push(pair.join(" - "));
                }
            }
            [_, _] if of(name).iter().all(|one| one.combination.len() == 2) => {}
            _ => least.push(name.to_owned()),
        }
    }
    let said: Vec<String> = [
        (even, "not identifiable, set to 0"),
        (zero, "not identifiable, set to 0"),
        (
            least,
            "identifiable only in combination, minimum-norm values",
        ),
    ]
    .into_iter()
    .filter(|(names, _)| !names.is_empty())
    .map(|(names, what)| format!("{}: {what}", names.join(", ")))
    .collect();
    (!said.is_empty()).then(|| said.join("; "))
}

fn is_sum_of_a_pair(weights: &BTreeMap<String, f64>) -> bool {
    weights.len() == 2
        && weights
            .values()
            .all(|weight| (weight - 1.0).abs() < f64::EPSILON)
}

/// Eigenvectors of the covariance, scaled by the prior, of parameters not estimable singly; those that are estimable,
/// best first.
fn known_together(
    numbers: &[Number],
    covariance: &DMatrix<f64>,
    unknown: &[usize],
    plan: &CombinationPlan,
) -> Vec<Identifiable> {
    let prior = |k: usize| numbers[unknown[k]].prior_std;
    let by_prior = DMatrix::from_fn(unknown.len(), unknown.len(), |a, b| {
        covariance[(unknown[a], unknown[b])] / (prior(a) * prior(b))
    });
    let eigen = SymmetricEigen::new(by_prior);
    let mut known: Vec<usize> = (0..unknown.len())
        .filter(|k| eigen.eigenvalues[*k] < plan.unknown * plan.unknown)
        .collect();
    known.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let of_direction = |direction: usize| {
        let weight = |k: usize| eigen.eigenvectors[(k, direction)] / prior(k);
        // The scale of an eigenvector is arbitrary: the largest weight is set to 1.
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
    use rlg_plan::CombinationPlan;

    use super::{Number, SIX, written};
    use crate::result::Identifiable;

    fn identifiable(numbers: &[Number], covariance: &DMatrix<f64>) -> Vec<Identifiable> {
        super::identifiable(numbers, covariance, &CombinationPlan::default())
    }

    fn numbers(values: &[f64], prior_std: f64) -> Vec<Number> {
        let of = |(k, value): (usize, &f64)| Number {
            prior_std,
            ..Number::free(&format!("n{k}"), *value)
        };
        values.iter().enumerate().map(of).collect()
    }

    fn six(values: [f64; 6], prior_std: f64) -> Vec<Number> {
        let of = |(name, value): (&&str, f64)| Number {
            prior_std,
            ..Number::free(name, value)
        };
        SIX.iter().zip(values).map(of).collect()
    }

    /// Posterior covariance with a unit prior and one measurement of a·θ to 0.01.
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
        let known = identifiable(&six([1.0; 6], 1.0), &covariance);
        let [sum] = &known[..] else {
            panic!("{known:?}")
        };
        assert_eq!(sum.combination.len(), 2);
        assert!((sum.value - 2.0).abs() < 1e-12 && sum.std < 0.011);
    }

    /// Covariance of six parameters, given the standard deviations of the sum and difference of each pair.
    fn pairs(sum_std: f64, difference_std: f64) -> DMatrix<f64> {
        let of = |sign: f64| 0.25 * (sum_std.powi(2) + sign * difference_std.powi(2));
        DMatrix::from_fn(6, 6, |a, b| match (a / 2 == b / 2, a == b) {
            (true, true) => of(1.0),
            (true, false) => of(-1.0),
            _ => 0.0,
        })
    }

    #[test]
    fn a_difference_that_is_not_known_is_written_even_and_one_that_is_stays() {
        let estimated = six([80.0, 63.0, 75.0, 5.0, 40.0, 41.0], 1e4);
        let known = identifiable(&estimated, &pairs(3.0, 20.0));
        let sums: Vec<f64> = known.iter().map(|one| one.value).collect();
        assert_eq!(sums, [143.0, 80.0, 70.0, 81.0]);
        let written = written(&estimated, &known);
        let expected = [71.5, 71.5, 75.0, 5.0, 40.5, 40.5];
        for (value, expected) in written.values.iter().zip(expected) {
            assert!((value - expected).abs() < 1e-9, "{:?}", written.values);
        }
        let choice = written.choice.expect("two pairs are a choice");
        assert_eq!(choice, "xy - xz, zx - zy: not identifiable, set to 0");
    }

    #[test]
    fn single_values_that_are_known_are_written_as_they_are() {
        let estimated = six([80.0, 63.0, 75.0, 5.0, 40.0, 41.0], 1e4);
        let known = identifiable(&estimated, &pairs(3.0, 4.0));
        assert_eq!(known.len(), 6);
        let written = written(&estimated, &known);
        assert!(written.choice.is_none());
        assert_eq!(written.values, [80.0, 63.0, 75.0, 5.0, 40.0, 41.0]);
    }

    #[test]
    fn of_numbers_that_are_known_together_the_least_that_agree_are_written() {
        let covariance = measured(&[1.0, 2.0, -1.0]);
        let estimated = numbers(&[0.9, 0.2, -0.2], 1.0);
        let known = identifiable(&estimated, &covariance);
        let values = written(&estimated, &known).values;
        // 0.9 + 2 · 0.2 + 0.2, distributed along the measured direction.
        for (value, expected) in values.iter().zip([0.25, 0.5, -0.25]) {
            assert!((value - expected).abs() < 1e-6, "{values:?}");
        }
        let covariance = measured(&[0.0, 1.0, 0.0]);
        let known = identifiable(&estimated, &covariance);
        let written = written(&estimated, &known);
        assert_eq!(written.values, [0.0, 0.2, 0.0]);
        let said = written.choice.expect("a choice");
        assert_eq!(said, "n0, n2: not identifiable, set to 0");
    }
}
