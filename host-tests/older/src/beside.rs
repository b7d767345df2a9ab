//! What accelerometers show, beside the gyros' outcome.

use rlg_force::Asked;
use rlg_model::Model;
use rlg_signal::streams::Streams;

use crate::Outcome;
use crate::declared::reference_noise;
use crate::motion::RowNoise;
use crate::scene::Scene;

/// Adds what the accelerometers show to the gyros' outcome, or why they show nothing.
pub fn add_force(streams: &Streams, asked: &Asked, found: &mut Outcome, progress: &dyn Fn(&str)) {
    if let Err(reason) = rlg_force::beside(streams, asked, found, progress) {
        rlg_force::say_why_not(&reason, found);
    }
}

/// The same beside what the older stages found.
pub fn add_force_of_scene(
    scene: &Scene,
    (model, left_out): (&Model, &[&str]),
    found: &mut Outcome,
    progress: &dyn Fn(&str),
) {
    let streams = &scene.streams;
    let noise = [0, 1, 2].map(|axis: usize| {
        RowNoise::of(
            &streams.case_rad[axis],
            streams.rate_hz,
            reference_noise(model),
        )
        .levels_rad2()
    });
    let asked = Asked {
        model,
        effects: &found.model.effects.clone(),
        reference_noise: rlg_force::reference::noise_of(noise),
        left_out,
        open: &[],
        plan: rlg_force::ForcePlan::default(),
    };
    add_force(streams, &asked, found, progress);
}
