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

/// One parameter per axis, uncorrelated, and their covariance.
pub fn by_axis(
    values: [f64; 3],
    stds: [f64; 3],
    unit: &str,
) -> (Vec<ParameterEntry>, Vec<Vec<f64>>) {
    let number = |axis: usize| ParameterEntry::Number {
        name: AXES[axis].to_string(),
        value: values[axis],
        std: stds[axis],
        unit: unit.to_string(),
    };
    let row = |a: usize| {
        let entry = |b: usize| if a == b { stds[a].powi(2) } else { 0.0 };
        (0..3).map(entry).collect()
    };
    ((0..3).map(number).collect(), (0..3).map(row).collect())
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
        evidence: None,
        gravity_speaks_against: Vec::new(),
        kind: excess.kind.to_string(),
        indistinguishable_from: excess
            .indistinguishable_from
            .iter()
            .map(|kind| (*kind).to_string())
            .collect(),
        equation: excess.equation.to_string(),
        parameters,
        covariance,
        identifiable: Vec::new(),
        log_evidence_gain: excess.log_likelihood_gain,
        p_value: excess.p_value,
        what_was_left_out: excess.left_out.to_string(),
        expression: None,
        regimes: Vec::new(),
    }
}
