//! Drift that the noise has and the model does not declare.
//!
//! Enters: what everything found leaves of the fitted rows, and the noise it was judged with. Leaves: for each gyro by how
//! much its rate wanders over the record, where that noise is clearly more likely than the same without drift. No effect of the
//! catalogue: a slow effect that drift explains nearly as well was given no name, and this is what stands in its place.

use super::noise::Noise;
use super::portion::{Bins, Portion};

/// ln of the likelihood by which drift must be ahead of none: flicker and rate random walk are two numbers, and chance
/// gives them this on one gyro in three thousand.
const AHEAD: f64 = 8.0;

/// Standard deviation \[rad/s\] of each gyro's drifting rate over the record; nothing where it does not clearly drift.
pub fn wandering_rad_s(
    portion: &Portion,
    left: &[Bins; 3],
    noise: &[Noise; 3],
) -> [Option<f64>; 3] {
    [0, 1, 2].map(|axis: usize| {
        let likelihood =
            |noise: &Noise| portion.log_likelihood(&left[axis], &noise.weights(portion));
        let ahead = likelihood(&noise[axis]) - likelihood(&noise[axis].steady());
        (ahead > AHEAD).then(|| noise[axis].wander_rad_s(portion.seconds()))
    })
}
