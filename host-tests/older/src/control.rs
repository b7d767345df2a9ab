//! The same search on the same rows in shuffled order: whatever it still finds is no matter of time.
//!
//! Enters: the residual \[rad per row\] and the seed. Leaves: the strongest line found in it. All three
//! gyros are shuffled alike, and fitted and held-out rows each among themselves, so that only order is lost.

use super::hypotheses::no_effects;
use super::lines;
use super::noise::{Declared, Noise};
use super::portion::Portion;
use super::scene::Scene;
use super::split::Split;
use super::streams::Triad;
use super::workbench::{Parameters, Workbench};

/// What the shuffled rows show.
#[derive(Debug, Clone, PartialEq)]
pub struct Control {
    /// Lines found.
    pub lines: usize,
    /// 2 Δ ln L of the strongest, 0 without any.
    pub strongest: f64,
}

/// Searches the shuffled rows.
pub fn shuffled(
    scene: &Scene,
    residual_rad: &Triad,
    parameters: &Parameters,
    effects: &[usize],
    declared: &[Declared; 3],
    split: &Split,
    seed: u64,
) -> Result<Control, String> {
    let parted = [&split.fitted[..], &split.held_out];
    let shuffled = rlg_diagnosis::at_rest::shuffled(residual_rad, parted, seed);
    let rate_hz = scene.streams.rate_hz;
    let portion = Portion::new(split.fitted.clone(), rate_hz)
        .ok_or_else(|| "nothing to shuffle".to_string())?;
    let mut bench = Workbench::new(
        scene,
        &shuffled,
        parameters,
        portion,
        [Noise::unit(rate_hz); 3],
        effects,
        &no_effects(),
    );
    bench.refit_noise(effects, declared, true);
    let lines = lines::search(&mut bench, parameters, effects, declared)?;
    Ok(Control {
        lines: lines.len(),
        strongest: lines.iter().map(|line| line.ratio).fold(0.0, f64::max),
    })
}
