//! Monte Carlo self-test in `diagnosis.json`: false names, and detection by kind and strength.

use schemars::JsonSchema;
use serde::Serialize;

/// Self-test of the search: trials with noise alone, and with effects added to it.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SelfTestEntry {
    /// Trials with noise alone: drawn at the fitted levels or, for attitudes, with the residual's scatter in each block.
    pub slides: usize,
    /// Trials with noise alone that named a listed effect.
    pub false_names: usize,
    /// Upper limit of their share, 95 % confidence.
    pub upper_limit_95: f64,
    /// Detections by strength, all kinds together.
    pub curve: Vec<SelfTestPoint>,
    /// Detections by kind.
    pub kinds: Vec<SelfTestKind>,
}

/// One strength of injected effects.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SelfTestPoint {
    /// Matched-filter SNR.
    pub rho: f64,
    /// Effects injected into noise.
    pub injections: usize,
    /// Trials with a detection.
    pub detected: usize,
    /// Trials that named the injected kind, alone or in its class.
    pub named: usize,
    /// Detection probability predicted for the modelled noise.
    pub theory: f64,
}

/// One kind in the self-test.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct SelfTestKind {
    /// Kind.
    pub kind: String,
    /// Trials with noise alone that named this kind.
    pub false_names: usize,
    /// Detected injections, in the order of the curve; null for sizes that are not credible.
    pub detected: Vec<Option<usize>>,
    /// Correctly named injections.
    pub named: Vec<Option<usize>>,
}
