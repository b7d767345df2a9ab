//! The Earth's rotation, which the reference motion does not contain.
//!
//! A vector fixed in space: its components in the body frame at the start, carried by the attitude that the
//! reference integrates to. Confused with a bias while the attitude stays.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::Triad;
use strapdown::earth::ROTATION_RAD_S;

/// See the page above.
pub struct EarthRate;

static CARD: Card = Card {
    kind: "earth_rate",
    equation: "omega += C(t)^T omega_earth(start)",
    shape: Shape::Axes,
    unit: "rad/s",
    typical: 5e-5,
    largest: 8e-5,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The reference reports motion against the Earth and the gyros against space: the rotation of the Earth is missing from the prediction.",
    next_experiment: "A still record at two attitudes tells the rotation of the Earth from bias.",
};

/// Whether what is left is a rotation in space as fast as the Earth's: a model that says the reference has it is wrong by
/// the whole of it or not at all.
pub fn is_left(scene: &Scene, residual_rad: &Triad) -> bool {
    /// Biases and drift add to it.
    const NEAR: f64 = 0.2;
    let rate = scene.mean_rate_in_space_rad_s(residual_rad).norm();
    (rate / ROTATION_RAD_S - 1.0).abs() < NEAR
}

impl Hypothesis for EarthRate {
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
        let carried = scene.space_vector_in_body(parameter, axis);
        Some(scene.sensed_from_rate(axis, carried.into_iter()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::streams::Streams;

    #[test]
    fn the_whole_rotation_of_the_earth_is_left_or_none_of_it() {
        let rows = 20_000;
        // A turn about z in ten seconds, and back.
        let turn = |row: usize| if row < rows / 2 { 6.3e-4 } else { -6.3e-4 };
        let case: Triad = [
            vec![0.0; rows],
            vec![0.0; rows],
            (0..rows).map(turn).collect(),
        ];
        let scene = Scene::new(Streams::of_motion(1000.0, case), None, [1e-5; 3]);
        let part = |share: f64, bias_rad_s: f64| -> Triad {
            let size = [0.6, 0.0, 0.8].map(|along| share * along * ROTATION_RAD_S);
            let mut left = EarthRate.prediction(&scene, &size);
            for values in &mut left {
                values
                    .iter_mut()
                    .for_each(|value| *value += bias_rad_s / 1000.0);
            }
            left
        };
        assert!(is_left(&scene, &part(1.0, 0.0)) && is_left(&scene, &part(1.0, 5e-6)));
        assert!(!is_left(&scene, &part(0.5, 0.0)) && !is_left(&scene, &part(0.0, 5e-6)));
    }
}
