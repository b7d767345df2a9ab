//! Registration: what aligns two instruments before any physics is thought of.
//!
//! Twenty numbers at once, always beside everything else, linear about the last values until those stand still
//! (inference.md, B4).

use nalgebra::Vector3;
use rlg_signal::attitude_samples::AttitudeSample;
use rlg_signal::axes::Triad;

use crate::about::{About, Gyros};
use crate::alignment::{Alignment, COUNT, Free, GROUPS, places};
use crate::fitting::{Fitting, priced};
use crate::increments::Stamps;
use crate::reference_faults;
use crate::reference_jumps::{self, Jump};

/// A registration that stands.
pub struct Registration {
    /// About what.
    pub alignment: Alignment,
    /// Levels of the noise terms.
    pub levels: Vec<f64>,
    /// Rows about it.
    pub about: About,
    /// What is known of the stamps.
    pub known: Stamps,
    /// Jumps of the reference that were found.
    pub jumps: Vec<Jump>,
    /// Log likelihood.
    pub log_likelihood: f64,
    /// Whether a low pass of the gyros explains as much as their delay.
    pub may_be_low_pass: bool,
    /// Standard deviation of the delay \[s\].
    delay_std_s: f64,
    /// Smoothing variances beside it \[s²\], and their standard deviations.
    smoothing_s2: [(f64, f64); 3],
    /// What outliers of single stamps were taken to be, in excess of what noise makes of them: subtracted from the rows.
    pub corrected_rad: Triad,
}

/// Most passes.
const PASSES: usize = 10;

/// Passes with plain noise: a bad start is not called wandering.
const PLAIN_PASSES: usize = 2;

/// A step of this many standard deviations is none.
const SETTLED: f64 = 0.1;

/// Aligns the reference with the gyros; a filter that is too long for its second order is tried as a low pass.
///
/// # Inputs
/// `stamps`: those that serve the last test alone are left out; `model`: what the model says.
pub fn register(
    gyros: &Gyros,
    samples: &[AttitudeSample],
    stamps: &Stamps,
    (model, start, free): (&Alignment, Alignment, &Free),
    progress: &dyn Fn(&str),
) -> Option<Registration> {
    let mut found = settle(gyros, samples, stamps, (model, start, free), progress)?;
    let Some(time_s) = found.low_pass_s(model, free.len() < GROUPS.len()) else {
        return Some(found);
    };
    let start = Alignment {
        low_pass_s: Some(Vector3::repeat(time_s)),
        delay_s: found.alignment.delay_s + time_s,
        ..found.alignment.clone()
    };
    let mut free = free.clone();
    if !free.contains(&"gyro_bandwidth") {
        free.push("gyro_bandwidth");
    }
    let about = (model, start, &free);
    let Some(behind) = settle(gyros, samples, stamps, about, progress) else {
        return Some(found);
    };
    let gain = behind.log_likelihood - found.log_likelihood;
    if gain > LOW_PASS_GAIN {
        return Some(behind);
    }
    found.may_be_low_pass = gain > -LOW_PASS_GAIN;
    Some(found)
}

/// Gain in log likelihood of a low pass over a delay beside a small smoothing.
const LOW_PASS_GAIN: f64 = 5.0;

impl Registration {
    /// Of rows that are too few for passes over their noise and faults.
    pub(crate) fn of_few(
        alignment: Alignment,
        about: About,
        (walk_rad_sqrt_s, angle_rad): (f64, f64),
        known: Stamps,
    ) -> Self {
        let rows = about.increments.rows();
        Self {
            levels: vec![
                walk_rad_sqrt_s.powi(2) * about.increments.period_s,
                angle_rad.powi(2),
            ],
            alignment,
            known,
            jumps: Vec::new(),
            log_likelihood: 0.0,
            may_be_low_pass: false,
            delay_std_s: f64::INFINITY,
            smoothing_s2: [(0.0, f64::INFINITY); 3],
            corrected_rad: std::array::from_fn(|_| vec![0.0; rows]),
            about,
        }
    }

    /// Time constant of a low pass that would smooth as much \[s\], where something is smoothed; or, once it is known what is
    /// called for, that would be as late.
    fn low_pass_s(&self, model: &Alignment, is_known: bool) -> Option<f64> {
        /// Standard deviations of what is worth a second look.
        const SEEN: f64 = 5.0;
        if self.alignment.low_pass_s.is_some() {
            return None;
        }
        let late_s = model.delay_s - self.alignment.delay_s;
        let is_smoothed = self
            .smoothing_s2
            .iter()
            .any(|(variance, std)| *variance > SEEN * std);
        let weights = self.smoothing_s2.map(|(_, std)| std.powi(-2));
        let sums = self.smoothing_s2.iter().zip(weights);
        let mean = sums
            .map(|((variance, _), weight)| variance * weight)
            .sum::<f64>()
            / weights.iter().sum::<f64>();
        let time_s = match is_smoothed && mean > 0.0 {
            true => mean.sqrt(),
            false if is_known => late_s,
            false => return None,
        };
        // A low pass is late, too: one that would need a delay against it is none.
        let is_late = late_s > SEEN * self.delay_std_s && (late_s - time_s).abs() < late_s;
        is_late.then_some(time_s)
    }
}

/// Passes until the alignment no longer changes.
fn settle(
    gyros: &Gyros,
    samples: &[AttitudeSample],
    stamps: &Stamps,
    (model, start, free): (&Alignment, Alignment, &Free),
    progress: &dyn Fn(&str),
) -> Option<Registration> {
    let kept: Vec<usize> = free.iter().flat_map(|kind| places(kind)).collect();
    let mut alignment = start;
    let mut levels: Option<Vec<f64>> = None;
    let mut pass = 0;
    loop {
        progress("aligning the reference");
        let is_plain = pass < PLAIN_PASSES;
        if pass == PLAIN_PASSES {
            levels = None;
        }
        let fitted = |known: &Stamps, levels: Option<Vec<f64>>| {
            let about = About::new(gyros, samples, known, &alignment)?;
            let all = priced(about.columns(gyros.rate_hz), &alignment, model);
            let own = all.into_iter().enumerate();
            let own = own.filter(|(place, _)| kept.contains(place));
            let columns = own.map(|(_, column)| column).collect();
            let fitting = Fitting::new(&about.increments, columns, is_plain, levels);
            Some((about, fitting))
        };
        // What the last pass left out is looked at anew: far off, an error of the gyros looks like one of the reference.
        let mut known = stamps.clone();
        let (mut about, mut fitting) = fitted(&known, levels.take())?;
        let searches = [
            reference_faults::spikes,
            reference_faults::rough_stretches,
            reference_jumps::find,
        ];
        for search in searches.iter().filter(|_| pass > 0) {
            if search(&about, &fitting, &mut known) {
                let levels = fitting.fit.levels.clone();
                (about, fitting) = fitted(&known, Some(levels))?;
            }
        }
        let mut corrected_rad: Triad = std::array::from_fn(|_| vec![0.0; about.increments.rows()]);
        if pass > 0 {
            for _ in 0..2 {
                fitting.shrink_outliers(&about.increments, &mut corrected_rad);
            }
        }
        let steps = Steps::new(&kept, &fitting.fit.estimate, &fitting.fit.std);
        pass += 1;
        if (pass > PLAIN_PASSES + 1 && steps.largest() < SETTLED) || pass == PASSES {
            return Some(Registration {
                log_likelihood: fitting.fit.log_likelihood,
                smoothing_s2: steps.smoothing_s2(),
                delay_std_s: steps.std[places("reference_delay").start],
                may_be_low_pass: false,
                alignment,
                levels: fitting.fit.levels.clone(),
                jumps: reference_jumps::sizes(&about, &fitting, &known),
                about,
                known,
                corrected_rad,
            });
        }
        alignment = alignment.moved(&steps.estimate);
        levels = Some(fitting.fit.levels);
    }
}

/// Estimates of all numbers, those that stay at 0.
pub(crate) struct Steps {
    /// By place.
    pub(crate) estimate: [f64; COUNT],
    std: [f64; COUNT],
}

impl Steps {
    /// # Inputs
    /// `kept`: places that are moved, with their estimates and standard deviations.
    pub(crate) fn new(kept: &[usize], estimate: &[f64], std: &[f64]) -> Self {
        let mut steps = Self {
            estimate: [0.0; COUNT],
            std: [f64::INFINITY; COUNT],
        };
        for (place, (estimate, std)) in kept.iter().zip(estimate.iter().zip(std)) {
            steps.estimate[*place] = *estimate;
            steps.std[*place] = *std;
        }
        steps
    }

    /// The largest step of what the rows are linear about \[σ\].
    pub(crate) fn largest(&self) -> f64 {
        let is_linear = |k: &usize| {
            let kinds = ["reference_clock_rate", "earth_rate", "gyro_bandwidth"];
            kinds.iter().any(|kind| places(kind).contains(k))
        };
        let moved = (0..COUNT).filter(|k| !is_linear(k));
        moved
            .map(|k| self.estimate[k].abs() / self.std[k])
            .fold(0.0, f64::max)
    }

    fn smoothing_s2(&self) -> [(f64, f64); 3] {
        let first = places("gyro_bandwidth").start;
        std::array::from_fn(|axis| (self.estimate[first + axis], self.std[first + axis]))
    }
}
