//! Which combinations of an effect's numbers a recording fixes.

use std::collections::BTreeMap;

use crate::result::Identifiable;

/// Anti-correlation of a gyro's two coefficients beyond which they are known only together.
const TOGETHER: f64 = -0.5;

/// Forms sums of the two coefficients of each gyro where they alone are known, else every number: of a pair that is known
/// mostly by its sum, six numbers would say more than three are worth.
///
/// # Inputs
/// `covariance`: of two numbers, by place.
pub fn identifiable(
    names: &[String],
    values: &[f64],
    covariance: &dyn Fn(usize, usize) -> f64,
) -> Vec<Identifiable> {
    let fixed = |places: &[usize]| {
        let pairs = places
            .iter()
            .flat_map(|a| places.iter().map(move |b| (*a, *b)));
        let variance: f64 = pairs.map(|(a, b)| covariance(a, b)).sum();
        let weights = places.iter().map(|k| (names[*k].clone(), 1.0));
        Identifiable {
            combination: weights.collect::<BTreeMap<_, _>>(),
            value: places.iter().map(|k| values[*k]).sum(),
            std: variance.max(0.0).sqrt(),
        }
    };
    let mut all = Vec::new();
    let mut k = 0;
    while k < names.len() {
        let is_pair = names.len() == 6 && k % 2 == 0;
        let deviations = || (covariance(k, k) * covariance(k + 1, k + 1)).sqrt();
        if is_pair && covariance(k, k + 1) < TOGETHER * deviations() {
            all.push(fixed(&[k, k + 1]));
            k += 2;
        } else {
            all.push(fixed(&[k]));
            k += 1;
        }
    }
    all
}
