//! Elastic turning of the block with angular acceleration.
//!
//! ω_i + Σ_j W_ij d²ω_j/dt². Under attitude references alone it imitates flexure in coning (physics §3).

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;

/// See the page above.
pub struct ElasticRateByJerk;

static CARD: Card = Card {
    kind: "elastic_rate_by_jerk",
    equation: "omega_i += sum_j W_ij d2omega_j/dt2",
    shape: Shape::Nine,
    unit: "s^2",
    typical: 1e-7,
    largest: 1e-4,
    positive: false,
    others: &[],
    log_prior_odds: -2.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The block turns elastically about its sensing axis under angular acceleration, so the gyro reports a rate the case does not have.",
    next_experiment: "Reverse the spin of a spin-synchronous oscillation: flexure changes sign, this effect does not.",
};

impl Hypothesis for ElasticRateByJerk {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn column(
        &self,
        scene: &Scene,
        _at: &[f64],
        parameter: usize,
        axis: usize,
    ) -> Option<Vec<f64>> {
        let other = CARD.shape.second(parameter, axis)?;
        Some(scene.sensed_from_rate_at_middles(axis, scene.jerk_rad_s3(other).into_iter()))
    }
}
