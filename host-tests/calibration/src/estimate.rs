//! Joint estimate of the six K, its covariance and its principal directions.
//!
//! Takes the [`Information`] on all unknowns, summed over recordings. With F the information, P that of the priors and g
//! the right-hand side, θ = (F + P)⁻¹ g. Everything but K is a nuisance parameter, so the covariance of the six K is their
//! block of the inverse.
//!
//! Units differ by fifteen decades, so the matrix is scaled to a unit diagonal before inversion.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::unknowns::{COEFFICIENTS, Unknowns, flexure_std_s2};
use rlg_inference::Information;
use rlg_plan::{CalibrationPlan, NuisancePlan};

/// Joint estimate of all unknowns, with the uncertainty of the six K.
#[derive(Clone)]
pub struct Estimate {
    /// Values by index of the unknowns; 0 if not fitted.
    pub values: Vec<f64>,
    /// Standard deviations in the same order.
    pub stds: Vec<f64>,
    /// Covariance of the six K \[s⁴\].
    pub covariance: DMatrix<f64>,
    /// Gain of ln likelihood by the six K.
    pub log_likelihood_gain: f64,
    /// Gain of ln evidence by the six K (Laplace approximation).
    pub log_evidence_gain: f64,
    /// p-value of such a gain without flexure (likelihood-ratio test).
    pub p_value: f64,
}

/// Direction in the space of the six K.
pub struct Direction {
    /// Unit vector.
    pub weights: [f64; COEFFICIENTS],
    /// Standard deviation along it \[s²\].
    pub std: f64,
}

/// Eigenvalues of a unit-diagonal matrix below this are rounding errors of sums over 1e6 bins.
const ROUNDING: f64 = 1e-14;

/// Solves for the unknowns of `set`; unknowns without data keep their prior.
pub fn estimate(
    unknowns: &Unknowns,
    information: &Information,
    set: &[usize],
    plan: &NuisancePlan,
) -> Estimate {
    let count = set.len();
    let precision = |index: usize| unknowns.get(index).prior_std(plan).powi(-2);
    let scale: Vec<f64> = set
        .iter()
        .map(|&index| {
            (information.fisher[(index, index)] + precision(index))
                .sqrt()
                .recip()
        })
        .collect();
    let matrix = DMatrix::from_fn(count, count, |a, b| {
        let prior = if a == b { precision(set[a]) } else { 0.0 };
        (information.fisher[(set[a], set[b])] + prior) * scale[a] * scale[b]
    });
    let root = matrix.symmetric_eigen();
    let inverse = &root.eigenvectors
        * DMatrix::from_diagonal(&root.eigenvalues.map(|value| value.max(ROUNDING).recip()))
        * root.eigenvectors.transpose();
    let right = DVector::from_fn(count, |a, _| information.score[set[a]] * scale[a]);
    let solution = &inverse * right;
    let mut values = vec![0.0; unknowns.count()];
    let mut stds = vec![0.0; unknowns.count()];
    for (a, &index) in set.iter().enumerate() {
        values[index] = solution[a] * scale[a];
        stds[index] = inverse[(a, a)].max(0.0).sqrt() * scale[a];
    }
    let place: Vec<usize> = (0..COEFFICIENTS)
        .map(|index| {
            set.iter()
                .position(|&of| of == index)
                .expect("K is always fitted")
        })
        .collect();
    let covariance = DMatrix::from_fn(COEFFICIENTS, COEFFICIENTS, |a, b| {
        let (a, b) = (place[a], place[b]);
        inverse[(a, b)] * scale[a] * scale[b]
    });
    let k = DVector::from_fn(COEFFICIENTS, |a, _| values[a]);
    let log_likelihood_gain = 0.5 * quadratic(&covariance, &k);
    // Volume of the posterior over that of the prior, in units of the prior's width (Occam factor).
    let volume: f64 = directions(&covariance)
        .iter()
        .map(|direction| (direction.std / flexure_std_s2()).min(1.0).ln())
        .sum();
    Estimate {
        log_likelihood_gain,
        log_evidence_gain: log_likelihood_gain + volume,
        p_value: ChiSquared::new(COEFFICIENTS as f64)
            .map_or(1.0, |law| law.sf(2.0 * log_likelihood_gain)),
        values,
        stds,
        covariance,
    }
}

impl Estimate {
    /// Value and standard deviation of a combination of the six K.
    pub fn combination(&self, weights: &[(usize, f64)]) -> (f64, f64) {
        let value = weights
            .iter()
            .map(|(k, weight)| weight * self.values[*k])
            .sum();
        let variance: f64 = weights
            .iter()
            .flat_map(|a| weights.iter().map(move |b| (a, b)))
            .map(|((a, wa), (b, wb))| wa * wb * self.covariance[(*a, *b)])
            .sum();
        (value, variance.max(0.0).sqrt())
    }
}

/// Scales a positive matrix to a unit diagonal: units of its rows differ by decades.
///
/// # Returns
/// The Cholesky factor, if there is one, and the factor of each row.
pub fn at_unit_diagonal(matrix: &DMatrix<f64>) -> (Option<Cholesky<f64, Dyn>>, DVector<f64>) {
    let scale = matrix.diagonal().map(|one| one.sqrt().recip());
    let unit = DMatrix::from_fn(scale.len(), scale.len(), |a, b| {
        matrix[(a, b)] * scale[a] * scale[b]
    });
    (unit.cholesky(), scale)
}

/// Quadratic form vᵀ C⁻¹ v.
pub fn quadratic(covariance: &DMatrix<f64>, vector: &DVector<f64>) -> f64 {
    let (root, scale) = at_unit_diagonal(covariance);
    let vector = vector.component_mul(&scale);
    root.map_or(f64::INFINITY, |root| vector.dot(&root.solve(&vector)))
}

/// Eigenvectors of the covariance, smallest variance first.
pub fn directions(covariance: &DMatrix<f64>) -> Vec<Direction> {
    /// Order of K \[s²\]: the eigenvalue solver then works near one.
    const UNIT: f64 = 1e-7;
    let root = (covariance / (UNIT * UNIT)).symmetric_eigen();
    let mut directions: Vec<Direction> = (0..COEFFICIENTS)
        .map(|k| {
            let vector = root.eigenvectors.column(k);
            // The sign of an eigenvector is arbitrary: the largest component is made positive.
            let largest = vector.iter().copied().fold(0.0, |most: f64, v| {
                if v.abs() > most.abs() + 1e-9 { v } else { most }
            });
            Direction {
                weights: std::array::from_fn(|a| vector[a] * largest.signum()),
                std: root.eigenvalues[k].max(0.0).sqrt() * UNIT,
            }
        })
        .collect();
    directions.sort_by(|a, b| a.std.total_cmp(&b.std));
    directions
}

/// Standard deviation of the worst direction over that of the best; `None` if the worst has the prior's.
pub fn condition_number(covariance: &DMatrix<f64>, plan: &CalibrationPlan) -> Option<f64> {
    let directions = directions(covariance);
    let (best, worst) = (directions.first()?.std, directions.last()?.std);
    (worst < plan.uninformed_share * flexure_std_s2()).then(|| worst / best)
}
