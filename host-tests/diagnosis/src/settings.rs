//! Input of a diagnosis besides its data.

use rlg_plan::Plan;

/// Thresholds of a search, and the kinds excluded from it.
#[derive(Debug, Clone, Copy)]
pub struct Scope<'a> {
    /// Thresholds.
    pub plan: &'a Plan,
    /// Kinds excluded from the catalogue.
    pub left_out: &'a [&'a str],
}

/// Settings of a diagnosis.
#[derive(Debug, Clone, Copy, Default)]
pub struct Settings<'a> {
    /// Kinds excluded from the catalogue, to test the response to unknown physics.
    pub left_out: &'a [&'a str],
    /// Thresholds.
    pub plan: Plan,
    /// True to correct and report reversed, exchanged or wrongly scaled channels instead of refusing them.
    pub anyway: bool,
    /// Seed of the self-test and of the control, recorded in `diagnosis.json`; no finding depends on it.
    pub seed: u64,
}
