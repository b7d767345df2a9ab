//! Sensing axes that tilt under specific force.
//!
//! δ_ij = τ_ij f_k, k the third axis.

use super::{Card, Hypothesis, Shape};
use crate::scene::{Scene, tilt_senses};
use crate::streams::AXES;

/// See the page above.
pub struct AxisTiltByForce;

static CARD: Card = Card {
    kind: "axis_tilt_by_force",
    equation: "delta_ij = tau_ij f_k",
    shape: Shape::Six,
    unit: "rad per m/s^2",
    typical: 1e-7,
    // 0.3 mrad under gravity: softer than any mount that is told from a loose one.
    largest: 3e-5,
    positive: false,
    others: &[],
    log_prior_odds: -2.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The block bends under specific force, so its sensing axis tilts with gravity and vibration.",
    next_experiment: "Slew about one axis with gravity along each of the others in turn.",
};

impl Hypothesis for AxisTiltByForce {
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
        let (k, sign) = tilt_senses(axis, other);
        // k, the axis across both, is also the axis along which the force bends the block.
        let product = scene.rate_rad_s[k].iter().zip(scene.force_m_s2(k, 0)?);
        Some(
            scene.sensed_from_rate_at_middles(
                axis,
                product.map(|(rate, force)| sign * rate * force),
            ),
        )
    }

    fn expression(&self, parameter: usize, axis: usize) -> Option<String> {
        let other = CARD.shape.second(parameter, axis)?;
        let (k, _) = tilt_senses(axis, other);
        Some(format!("omega_{0}*force_{0}", AXES[k]))
    }

    fn missing(&self, scene: &Scene) -> Option<&'static str> {
        scene
            .streams
            .force_m_s2
            .is_none()
            .then_some("no specific force channels")
    }
}
