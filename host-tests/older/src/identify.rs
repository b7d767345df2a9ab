//! Which combinations of an effect's parameters the data fix (diagnosis road, step 8).
//!
//! Enters: an effect's values and covariance. Leaves: combinations with value and spread, never six numbers
//! where three are known. For pairs (gyro, axis) the physical combinations are the sum and the difference of
//! a gyro's two coefficients: a stationary oscillation shows only the sums (physics §3). For three axes that are known
//! only together they are the covariance's own directions.

use nalgebra::DMatrix;
use std::collections::BTreeMap;

use super::hypotheses::{CATALOGUE, Card, Shape};
use super::result::Identifiable;
use super::select::Chosen;

/// Anti-correlation of a gyro's two coefficients beyond which they are known only together.
const TOGETHER: f64 = -0.5;

/// A combination counts as fixed when its spread is below this share of the effect's typical size, or of
/// its own value.
const FIXED_SHARE: f64 = 0.25;

/// Whether some of three parameters are known only together.
fn are_mixed(covariance: &DMatrix<f64>) -> bool {
    let pairs = [(0, 1), (0, 2), (1, 2)];
    pairs
        .into_iter()
        .any(|(a, b)| correlation(covariance, a, b).abs() > -TOGETHER)
}

fn correlation(covariance: &DMatrix<f64>, a: usize, b: usize) -> f64 {
    covariance[(a, b)] / (covariance[(a, a)] * covariance[(b, b)]).sqrt()
}

/// The fixed combinations.
pub fn identifiable(card: &Card, chosen: &Chosen) -> Vec<Identifiable> {
    let covariance = |a: usize, b: usize| chosen.covariance[(a, b)];
    let mut combinations: Vec<Vec<(usize, f64)>> = Vec::new();
    let shaped = card.shape.count();
    match card.shape {
        Shape::Six => {
            for gyro in 0..3 {
                let (a, b) = (2 * gyro, 2 * gyro + 1);
                let correlation = correlation(&chosen.covariance, a, b);
                if correlation < TOGETHER {
                    combinations.push(vec![(a, 1.0), (b, 1.0)]);
                    combinations.push(vec![(a, 1.0), (b, -1.0)]);
                } else if correlation > -TOGETHER {
                    combinations.push(vec![(a, 1.0), (b, -1.0)]);
                    combinations.push(vec![(a, 1.0), (b, 1.0)]);
                } else {
                    combinations.push(vec![(a, 1.0)]);
                    combinations.push(vec![(b, 1.0)]);
                }
            }
        }
        Shape::Axes if are_mixed(&chosen.covariance) => {
            let root = chosen.covariance.clone().symmetric_eigen();
            for direction in root.eigenvectors.column_iter() {
                // Its largest weight is positive.
                let sign = direction[direction.iamax()].signum();
                combinations.push((0..3).map(|axis| (axis, sign * direction[axis])).collect());
            }
        }
        _ => combinations.extend((0..shaped).map(|parameter| vec![(parameter, 1.0)])),
    }
    let hypothesis = CATALOGUE[chosen.effect];
    combinations.extend(
        (shaped..card.count())
            .filter(|&parameter| hypothesis.has(chosen.values.as_slice(), parameter))
            .map(|parameter| vec![(parameter, 1.0)]),
    );
    combinations
        .into_iter()
        .filter_map(|combination| {
            let value: f64 = combination
                .iter()
                .map(|(p, weight)| weight * chosen.values[*p])
                .sum();
            let variance: f64 = combination
                .iter()
                .flat_map(|(a, wa)| {
                    combination
                        .iter()
                        .map(move |(b, wb)| wa * wb * covariance(*a, *b))
                })
                .sum();
            let std = variance.max(0.0).sqrt();
            (std < FIXED_SHARE * card.typical_of(combination[0].0).max(value.abs())).then(|| {
                Identifiable {
                    combination: combination
                        .iter()
                        .map(|(parameter, weight)| (card.name(*parameter), *weight))
                        .collect::<BTreeMap<_, _>>(),
                    value,
                    std,
                }
            })
        })
        .collect()
}
