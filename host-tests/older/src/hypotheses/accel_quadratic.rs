//! An accelerometer whose reading bends with the force.
//!
//! f_i + q_i f_i² (10 µg/g² is 1e-6 s²/m). Confused with: a bias and a scale error together, where an axis feels only two
//! forces.

use super::{Card, Hypothesis, Shape, Subject};
use crate::scene::Scene;

/// See the page above.
pub struct AccelQuadratic;

static CARD: Card = Card {
    kind: "accel_quadratic",
    equation: "f_i += q_i f_i^2",
    shape: Shape::Axes,
    unit: "s^2/m",
    typical: 1e-6,
    largest: 1e-3,
    positive: false,
    others: &[],
    log_prior_odds: -1.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The accelerometer is not linear: its error grows with the square of the force, upwards and downwards alike.",
    next_experiment: "Turn each axis slowly from up over level to down: three forces tell the square from bias and scale.",
};

impl Hypothesis for AccelQuadratic {
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
        CARD.shape.second(parameter, axis)?;
        let felt = scene.felt.as_ref()?;
        let force = felt.force_m_s2[axis].iter();
        Some(felt.sensed_from_force(axis, force.map(|force| force * force)))
    }
}
