//! Frozen attitudes: the reference repeats its last value while the gyros turn.

use rlg_signal::attitude_samples::SlowSample;

use crate::rows::gyro_motion::GyroMotion;
use crate::rows::linearised_rows::Gyros;

/// Marks attitudes that only repeat the one before while the gyros turn.
pub(crate) fn find(gyros: &Gyros, samples: &[SlowSample]) -> Vec<bool> {
    let plan = &gyros.plan.held;
    let mut held = vec![false; samples.len()];
    let runs = runs(samples, plan.least_equal);
    if runs.is_empty() {
        return held;
    }
    let motion = gyros.motion(gyros.sensed_rad.clone());
    for run in &runs {
        let Some(own) = parting_rad(&motion, samples, run.start, run.end - 1) else {
            continue;
        };
        let elsewhere = (0..samples.len()).step_by(run.len()).filter_map(|from| {
            let to = from + run.len() - 1;
            let is_other =
                to < samples.len() && runs.iter().all(|run| to < run.start || from >= run.end);
            is_other
                .then(|| parting_rad(&motion, samples, from, to))
                .flatten()
        });
        let mut elsewhere: Vec<f64> = elsewhere.collect();
        elsewhere.sort_by(f64::total_cmp);
        let usual = elsewhere.get(9 * elsewhere.len() / 10);
        if usual.is_some_and(|usual| own > plan.apart * usual) {
            held[run.start + 1..run.end].fill(true);
        }
    }
    held
}

/// Ranges of `least` consecutive equal attitudes or more.
fn runs(samples: &[SlowSample], least: usize) -> Vec<std::ops::Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 0;
    for stamp in 1..=samples.len() {
        if stamp < samples.len() && samples[stamp].shown.repeats(&samples[stamp - 1].shown) {
            continue;
        }
        if stamp - start >= least {
            runs.push(start..stamp);
        }
        start = stamp;
    }
    runs
}

/// Difference of the angles turned by gyros and reference between two stamps \[rad\].
fn parting_rad(motion: &GyroMotion, samples: &[SlowSample], from: usize, to: usize) -> Option<f64> {
    let at = |stamp: usize| Some(motion.shown(motion.place(samples[stamp].time_s)?));
    let gyros = at(from)?.turn_to(&at(to)?);
    let reference = samples[from].shown.turn_to(&samples[to].shown);
    // Angles alone: the axes are not yet known to agree.
    Some((gyros.norm() - reference.norm()).abs())
}
