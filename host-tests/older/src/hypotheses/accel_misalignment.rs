//! Accelerometers that do not point along the body axes.
//!
//! δ_ij turns the sensing axis of accelerometer i about body axis j (physics §1, as for gyros):
//! x: +δ_xz f_y − δ_xy f_z, and cyclic. The common turn of all three looks like a turned reference; the gyros tell.

use super::{Card, Hypothesis, Shape, Subject};
use crate::scene::{Scene, tilt_senses};

/// See the page above.
pub struct AccelMisalignment;

static CARD: Card = Card {
    kind: "accel_misalignment",
    equation: "f_i += delta_ik f_j - delta_ij f_k, (i, j, k) cyclic",
    shape: Shape::Six,
    unit: "rad",
    typical: 1e-4,
    largest: 0.05,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The accelerometers do not point where the model says: each feels a small share of the forces along the other axes.",
    next_experiment: "Roll the unit about two axes through full turns: each accelerometer must then show gravity along both others.",
};

impl Hypothesis for AccelMisalignment {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn subject(&self) -> Subject {
        Subject::Accelerometers
    }

    fn column(
        &self,
        scene: &Scene,
        _at: &[f64],
        parameter: usize,
        axis: usize,
    ) -> Option<Vec<f64>> {
        let about = CARD.shape.second(parameter, axis)?;
        let (along, sign) = tilt_senses(axis, about);
        let felt = scene.felt.as_ref()?;
        let force = felt.force_m_s2[along].iter();
        Some(felt.sensed_from_force(axis, force.map(|force| sign * force)))
    }
}
