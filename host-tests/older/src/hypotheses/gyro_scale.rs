//! A scale error the model lacks.
//!
//! s_i multiplies everything the laser senses: ω_i plus the block's own dither rate.

use super::{Card, Hypothesis, Shape};
use crate::scene::Scene;
use crate::streams::add;

/// See the page above.
pub struct GyroScale;

static CARD: Card = Card {
    kind: "gyro_scale",
    equation: "omega_i += s_i (omega_i + dither rate_i)",
    shape: Shape::Axes,
    unit: "1",
    typical: 1e-5,
    largest: 0.05,
    positive: false,
    others: &[],
    log_prior_odds: 0.0,
    special_case_of: &[],
    resembles_untested: &[],
    left_out: "The angle of one pulse is not what the model says: the laser senses case motion and dither alike with a scale error.",
    next_experiment: "A slew of whole turns about each axis shows the scale against the turntable.",
};

impl Hypothesis for GyroScale {
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
        CARD.shape.second(parameter, axis)?;
        let case_rad_s = scene.rate_rad_s[axis].iter().copied();
        let mut sensed = scene.sensed_from_rate_at_middles(axis, case_rad_s);
        if let Some(dither_rad) = scene.dither_increment_rad(axis) {
            let rate_hz = scene.streams.rate_hz;
            let dither_rad_s = dither_rad.into_iter().map(|dither| dither * rate_hz);
            add(
                &mut sensed,
                &scene.sensed_from_rate(axis, dither_rad_s),
                1.0,
            );
        }
        Some(sensed)
    }
}
