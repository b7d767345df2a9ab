//! Accelerometer readings that are late.
//!
//! f_i(t − d_i) instead of f_i(t): solved by Gauss–Newton with exact shifts of the predicted force. The same delay on all
//! three is a late reference too; the gyros tell, which are late against it then.

use super::{Card, Hypothesis, Shape, Subject};
use crate::scene::Scene;
use crate::streams::Triad;

/// See the page above.
pub struct AccelDelay;

static CARD: Card = Card {
    kind: "accel_delay",
    equation: "f_i(t - d_i) instead of f_i(t)",
    shape: Shape::Axes,
    unit: "s",
    typical: 1e-3,
    largest: 0.1,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The accelerometer channel is late (or early) against the motion by a fixed time that the model does not know.",
    next_experiment: "Rock or tumble the unit at two speeds, so that gravity moves through its axes: a delay shows in proportion.",
};

impl Hypothesis for AccelDelay {
    fn card(&self) -> &'static Card {
        &CARD
    }

    fn subject(&self) -> Subject {
        Subject::Accelerometers
    }

    fn column(&self, scene: &Scene, at: &[f64], parameter: usize, axis: usize) -> Option<Vec<f64>> {
        CARD.shape.second(parameter, axis)?;
        let felt = scene.felt.as_ref()?;
        let slope = felt.force_ahead(axis, 1, -at[parameter]);
        Some(felt.sensed_from_force(axis, slope.into_iter().map(|slope| -slope)))
    }

    fn prediction(&self, scene: &Scene, at: &[f64]) -> Triad {
        [0, 1, 2].map(|axis| {
            let Some(felt) = scene.felt.as_ref().filter(|_| at[axis] != 0.0) else {
                return vec![0.0; scene.felt.as_ref().map_or(0, |felt| felt.rows.count)];
            };
            let late = felt.force_ahead(axis, 0, -at[axis]);
            let now = felt.force_ahead(axis, 0, 0.0);
            let change = late.iter().zip(now).map(|(late, now)| late - now);
            felt.sensed_from_force(axis, change)
        })
    }

    fn is_linear(&self) -> bool {
        false
    }
}
