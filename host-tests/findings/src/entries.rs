//! Findings common to both engines, as entries of `diagnosis.json`.

use nalgebra::DMatrix;
use rlg_recording::AXES;

use crate::excess::Excess;
use crate::result::{EffectEntry, ParameterEntry, UNLISTED};

/// Entry of an effect outside the catalogue.
pub fn unlisted(equation: String, what_was_left_out: String) -> EffectEntry {
    EffectEntry {
        evidence: None,
        gravity_speaks_against: Vec::new(),
        kind: UNLISTED.to_string(),
        indistinguishable_from: Vec::new(),
        equation,
        parameters: Vec::new(),
        covariance: Vec::new(),
        identifiable: Vec::new(),
        log_evidence_gain: 0.0,
        p_value: 0.0,
        what_was_left_out,
        expression: None,
        regimes: Vec::new(),
    }
}

/// True if the values of three sensors differ pairwise by at most `deviations` \[σ\].
pub fn are_equal(values: &[f64], covariance: &DMatrix<f64>, deviations: f64) -> bool {
    values.len() == 3
        && (0..3).all(|a| {
            let b = (a + 1) % 3;
            let variance = covariance[(a, a)] + covariance[(b, b)] - 2.0 * covariance[(a, b)];
            (values[a] - values[b]).abs() <= deviations * variance.max(0.0).sqrt()
        })
}

/// Forms parameters of one unit, and the rows of their covariance.
pub fn correlated<N: AsRef<str>>(
    names: &[N],
    values: &[f64],
    covariance: &DMatrix<f64>,
    unit: &str,
) -> (Vec<ParameterEntry>, Vec<Vec<f64>>) {
    let number = |(k, name): (usize, &N)| {
        let std = covariance[(k, k)].max(0.0).sqrt();
        ParameterEntry::number(name.as_ref(), values[k], std, unit)
    };
    let numbers = names.iter().enumerate().map(number);
    (numbers.collect(), rows(covariance))
}

/// Rows of a covariance.
pub fn rows(covariance: &DMatrix<f64>) -> Vec<Vec<f64>> {
    let rows = covariance.row_iter();
    rows.map(|row| row.iter().copied().collect()).collect()
}

/// Rows of the covariance of uncorrelated parameters.
pub fn uncorrelated(stds: &[f64]) -> Vec<Vec<f64>> {
    let row = |a: usize| {
        let entry = |b: usize| if a == b { stds[a].powi(2) } else { 0.0 };
        (0..stds.len()).map(entry).collect()
    };
    (0..stds.len()).map(row).collect()
}

/// One parameter per axis, uncorrelated, and their covariance.
pub fn by_axis(
    values: [f64; 3],
    stds: [f64; 3],
    unit: &str,
) -> (Vec<ParameterEntry>, Vec<Vec<f64>>) {
    let number = |axis: usize| ParameterEntry::number(AXES[axis], values[axis], stds[axis], unit);
    ((0..3).map(number).collect(), uncorrelated(&stds))
}

/// Appends a number that is independent of the others to parameters and their covariance.
pub fn append(
    parameters: &mut Vec<ParameterEntry>,
    covariance: &mut Vec<Vec<f64>>,
    number: ParameterEntry,
) {
    let ParameterEntry::Number { std, .. } = number else {
        return parameters.push(number);
    };
    covariance.iter_mut().for_each(|row| row.push(0.0));
    let mut row = vec![0.0; covariance.len()];
    row.push(std * std);
    covariance.push(row);
    parameters.push(number);
}

/// Entry of noise beyond the model's.
pub fn noise(excess: &Excess) -> EffectEntry {
    let (parameters, covariance) = by_axis(excess.values, excess.stds, excess.unit);
    EffectEntry {
        kind: excess.kind.to_string(),
        indistinguishable_from: excess
            .indistinguishable_from
            .iter()
            .map(|kind| (*kind).to_string())
            .collect(),
        parameters,
        covariance,
        log_evidence_gain: excess.log_likelihood_gain,
        p_value: excess.p_value,
        ..unlisted(excess.equation.to_string(), excess.left_out.to_string())
    }
}
