//! Durations of the experiments with errors that grow with time; the paper prints none.
//!
//! Ratios of errors (before and after compensation) do not depend on the duration but for noise, which grows with its square
//! root: a shorter run shows the same with less margin.

/// Durations of the motions \[s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lengths {
    /// Coning of the systems: half a degree an hour becomes 0.04°.
    pub coning_s: f64,
    /// Vibration of a system of the paper's class: errors of the size of its Tables 4 and 5.
    pub vibration_s: f64,
    /// Vibration with flexure as the only unmodelled effect: no averaging is needed.
    pub alone_s: f64,
}

impl Lengths {
    /// Durations of `rlg paper`.
    pub const FULL: Self = Self {
        coning_s: 300.0,
        vibration_s: 600.0,
        alone_s: 120.0,
    };

    /// About a third of them: for a first look.
    pub const SHORT: Self = Self {
        coning_s: 120.0,
        vibration_s: 200.0,
        alone_s: 30.0,
    };
}
