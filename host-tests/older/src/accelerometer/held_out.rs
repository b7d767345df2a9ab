//! Whether the held-out rows contradict an accelerometer's name (diagnosis road, step 9), as for the gyros
//! (contradiction.rs).
//!
//! Enters: the scene with its vertical, a chosen effect, what everything found leaves \[m/s per row\], the noise. Leaves:
//! why the name is taken back, or nothing. Joints and the vertical are free on those rows, so what remains is the effect's own.

use super::bench::ForceBench;
use super::residual::scene_felt;
use crate::bench::Bench as _;
use crate::contradiction::HeldOut;
use crate::hypotheses::no_effects;
use crate::noise::Noise;
use crate::portion::Portion;
use crate::scene::Scene;
use crate::select::Chosen;
use crate::split::Split;
use crate::streams::Triad;
use crate::weigh::prior_width;
use crate::workbench::Parameters;

/// Asks the held-out rows.
pub(super) fn contradicts(
    scene: &Scene,
    left_m_s: &Triad,
    parameters: &Parameters,
    split: &Split,
    noise: [Noise; 3],
    one: &Chosen,
) -> Option<String> {
    let portion = Portion::new(split.held_out.clone(), scene_felt(scene).rows.rate_hz)?;
    let mut at = no_effects();
    at[one.effect] = one.values.iter().copied().collect();
    let bench = ForceBench::new(
        scene,
        left_m_s,
        parameters,
        portion,
        noise,
        &[one.effect],
        &at,
    );
    let information = bench.information();
    let own = parameters.of_all(&[one.effect]);
    let (fisher, found) = information.whatever(&own, &bench.unknowns(), &|index| {
        prior_width(parameters, &information, index)
    })?;
    let spread = &fisher + &fisher * &one.covariance * &fisher;
    HeldOut::of(&one.values, &fisher, &found, &spread)?.contradicts()
}
