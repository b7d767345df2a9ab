//! A scale error the model lacks.
//!
//! s_i multiplies everything the laser senses: ω_i plus the block's own dither rate.

use super::{Card, Hypothesis, Shape};
use crate::diagnose::scene::Scene;

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
        let mut rate = scene.rate_rad_s[axis].clone();
        if let Some(dither_rad) = scene.dither_increment_rad(axis) {
            let rate_hz = scene.streams.rate_hz;
            rate.iter_mut()
                .zip(dither_rad)
                .for_each(|(rate, dither)| *rate += dither * rate_hz);
        }
        Some(scene.sensed_from_rate(axis, rate.into_iter()))
    }
}
