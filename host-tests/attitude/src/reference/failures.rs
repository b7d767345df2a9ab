//! Stretches in which the reference failed: it turned faster than the unit ever did.

use rlg_signal::attitude_samples::SlowSample;
use rlg_signal::quantiles::median;

use crate::rows::linearised_rows::Gyros;

/// Marks the stamps of such stretches.
pub(crate) fn find(gyros: &Gyros, samples: &[SlowSample]) -> Vec<bool> {
    let plan = &gyros.plan.failures;
    let mut failed = vec![false; samples.len()];
    let steps: Vec<(usize, f64)> = (1..samples.len())
        .filter(|&stamp| samples[stamp].time_s > samples[stamp - 1].time_s)
        .map(|stamp| {
            let [from, to] = [&samples[stamp - 1], &samples[stamp]];
            let turned_rad = from.shown.turn_to(&to.shown).norm();
            (stamp, turned_rad / (to.time_s - from.time_s))
        })
        .collect();
    let Some(usual_rad_s) = median(steps.iter().map(|(_, rate)| *rate)) else {
        return failed;
    };
    let own = gyros.sensed_rad.iter().map(|row| row.norm());
    let fastest_rad_s = gyros.rate_hz * own.fold(0.0, f64::max);
    let least_rad_s = (plan.faster * fastest_rad_s).max(plan.unusual * usual_rad_s);
    let impossible: Vec<usize> = steps
        .into_iter()
        .filter(|(_, rate)| *rate > least_rad_s)
        .map(|(stamp, _)| stamp)
        .collect();
    let joined =
        |pair: &usize, next: &usize| samples[*next].time_s - samples[*pair].time_s <= plan.joined_s;
    for stretch in impossible
        .chunk_by(joined)
        .filter(|one| one.len() >= plan.least_steps)
    {
        failed[stretch[0]..=stretch[stretch.len() - 1]].fill(true);
    }
    failed
}
