//! Effects in `diagnosis.json`: parameters, evidence, regimes.

use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// One parameter.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum ParameterEntry {
    /// Estimate with its standard deviation.
    Number {
        /// Contract's name.
        name: String,
        /// Value.
        value: f64,
        /// Standard deviation.
        std: f64,
        /// Unit.
        unit: String,
    },
    /// Text: `axis`, `expression`.
    Text {
        /// Contract's name.
        name: String,
        /// Text.
        value: String,
    },
}

impl ParameterEntry {
    /// Forms an estimate with its standard deviation.
    pub fn number(name: &str, value: f64, std: f64, unit: &str) -> Self {
        Self::Number {
            name: name.to_string(),
            value,
            std,
            unit: unit.to_string(),
        }
    }

    /// Forms a text.
    pub fn text(name: &str, value: &str) -> Self {
        Self::Text {
            name: name.to_string(),
            value: value.to_string(),
        }
    }
}

/// Returns the value of a text parameter among `parameters`.
pub fn text_of<'a>(parameters: &'a [ParameterEntry], name: &str) -> Option<&'a str> {
    parameters.iter().find_map(|one| match one {
        ParameterEntry::Text { name: own, value } if own == name => Some(value.as_str()),
        _ => None,
    })
}

/// Returns value and standard deviation of a numeric parameter among `parameters`.
pub fn number_of(parameters: &[ParameterEntry], name: &str) -> Option<(f64, f64)> {
    parameters.iter().find_map(|one| match one {
        ParameterEntry::Number {
            name: own,
            value,
            std,
            ..
        } if own == name => Some((*value, *std)),
        _ => None,
    })
}

impl EffectEntry {
    /// Returns the value of a text parameter.
    pub fn text(&self, name: &str) -> Option<&str> {
        text_of(&self.parameters, name)
    }

    /// Returns value and standard deviation of a numeric parameter.
    pub fn number(&self, name: &str) -> Option<(f64, f64)> {
        number_of(&self.parameters, name)
    }
}

/// Estimable combination of parameters.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Identifiable {
    /// Parameter → weight.
    pub combination: BTreeMap<String, f64>,
    /// Its value.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// One effect.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EffectEntry {
    /// Contract's kind.
    pub kind: String,
    /// Kinds that the recording cannot distinguish from it; `unlisted` if an effect outside the catalogue explains as
    /// much (`expression`), or if much of the mismatch on the same gyro is only described.
    pub indistinguishable_from: Vec<String>,
    /// Addition: kinds among them that only the gyros cannot distinguish from it, and that the measured gravity
    /// rejects.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gravity_speaks_against: Vec<String>,
    /// Its equation.
    pub equation: String,
    /// Parameters.
    pub parameters: Vec<ParameterEntry>,
    /// Covariance of the numeric parameters, in order.
    pub covariance: Vec<Vec<f64>>,
    /// Estimable combinations.
    pub identifiable: Vec<Identifiable>,
    /// Gain of ln evidence.
    pub log_evidence_gain: f64,
    /// p-value, corrected for the number of trials.
    pub p_value: f64,
    /// Explanation for a navigation engineer.
    pub what_was_left_out: String,
    /// Expression of an unlisted effect; for a listed kind with an unlisted rival (`indistinguishable_from` contains
    /// `unlisted`), the rival's expression.
    pub expression: Option<String>,
    /// Addition: amplitude in each regime (1 = as fitted on all).
    pub regimes: Vec<RegimeEntry>,
    /// Additions: strength of the evidence, if tested on held-out rows.
    #[serde(flatten)]
    pub evidence: Option<EvidenceEntry>,
}

/// Strength of the evidence for an effect.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct EvidenceEntry {
    /// `named`, or `class` if this recording cannot distinguish it from another kind or from drift.
    pub label: &'static str,
    /// Gain of the predictive log score on held-out rows (cross-validation).
    pub confirmed_gain: f64,
    /// Share of the residual's power explained \[1\].
    pub share: f64,
    /// Number of draws of the parametric bootstrap without the effect.
    pub reenactments: usize,
    /// Mean squared estimate per parameter of the absent effect in those draws \[σ²\]: 1 if the likelihood is correct.
    pub inflation: f64,
}

/// Contract's kind of an effect outside the catalogue.
pub const UNLISTED: &str = "unlisted";

/// Note on a listed kind that may be [`UNLISTED`], without a rival expression.
pub const ONLY_DESCRIBED: &str = "Expressions describe most of the residual of the same gyro: both may have one cause outside the catalogue.";

impl EffectEntry {
    /// True if its class contains an effect outside the catalogue.
    pub fn may_be_unlisted(&self) -> bool {
        let mut alike = self.indistinguishable_from.iter();
        alike.any(|kind| kind == UNLISTED)
    }
}

/// Amplitude in a regime.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct RegimeEntry {
    /// Name.
    pub name: String,
    /// Amplitude λ.
    pub amplitude: f64,
    /// Standard deviation.
    pub std: f64,
}
