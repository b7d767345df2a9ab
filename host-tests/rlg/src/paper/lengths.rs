//! How long the experiments last whose errors grow with time; the paper prints no duration.
//!
//! Ratios of errors (what compensation leaves) do not depend on it but for noise, which grows with the square
//! root: a shorter run shows the same with less margin.

/// Durations of the motions \[s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lengths {
    /// Coning of the systems: half a degree an hour becomes 0.04°.
    pub coning_s: f64,
    /// Vibration of a system of the paper's class: errors of the size of its Tables 4 and 5.
    pub vibration_s: f64,
    /// Vibration where flexure is the only thing left out: nothing has to be averaged.
    pub alone_s: f64,
}

impl Lengths {
    /// As `rlg paper` runs them.
    pub const FULL: Self = Self {
        coning_s: 300.0,
        vibration_s: 600.0,
        alone_s: 120.0,
    };

    /// A third: for a first look.
    pub const SHORT: Self = Self {
        coning_s: 120.0,
        vibration_s: 200.0,
        alone_s: 30.0,
    };
}
