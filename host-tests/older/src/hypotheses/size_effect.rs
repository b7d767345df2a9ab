//! Accelerometers away from the point that the model takes the force at.
//!
//! Accelerometer i at r_i feels (α × r_i + ω × (ω × r_i))_i more (Groves 2013, sec. 4.4.1; parameter ij: r_i along body axis
//! j). Arms that all three share are the unit's distance from the axes it is turned about.

use super::{Card, Hypothesis, Shape, Subject};
use crate::scene::Scene;

/// See the page above.
pub struct SizeEffect;

static CARD: Card = Card {
    kind: "size_effect",
    equation: "f_i += (alpha x r_i + omega x (omega x r_i))_i",
    shape: Shape::Nine,
    unit: "m",
    typical: 0.03,
    largest: 1.0,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The accelerometers sit away from the centre of rotation, and feel that the case turns: the model puts all three in one point. Arms that all three share are the distance of the unit from the axes it is turned about.",
    next_experiment: "Oscillate about each axis in turn, and spin about each: angular acceleration shows the arms across an axis, spinning those towards it.",
};

impl Hypothesis for SizeEffect {
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
        let along = CARD.shape.second(parameter, axis)?;
        let felt = scene.felt.as_ref()?;
        Some(felt.sensed_from_velocity(axis, felt.carried.lever_m_s(axis, along)))
    }
}
