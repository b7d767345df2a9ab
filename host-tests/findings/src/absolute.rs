//! Absolute test of a residual: a fitted noise level explains any residual, so the residual counts as noise only if its
//! level is within an instrument's bounds and does not depend on the motion.

use rlg_plan::InstrumentNoisePlan;

use crate::numbers::number;
use crate::result::{Diagnosis, NoiseEntry, Verdict};
use crate::sentences::opening;

/// Performance grade of gyros by angle random walk \[rad/√s\]. Typical values are < 0.002 °/√h (navigation), 0.02 to 0.05
/// (tactical) and several (commercial): El-Sheimy and Youssef, Satellite Navigation 1, 2020, Table 1. Limits are the
/// geometric means between neighbours: 0.006 and 0.4 °/√h.
pub fn grade(walk_rad_sqrt_s: f64) -> &'static str {
    match walk_rad_sqrt_s * DEG_SQRT_H {
        walk if walk <= 0.006 => "navigation",
        walk if walk <= 0.4 => "tactical",
        _ => "commercial",
    }
}

/// Sentence on the fitted noise beside that of instruments; `None` if no noise is known.
///
/// # Inputs
/// `noise`: of each gyro, which includes the reference's.
fn beside_instruments(noise: &[NoiseEntry]) -> Option<String> {
    let largest = noise
        .iter()
        .map(NoiseEntry::walk_rad_sqrt_s)
        .reduce(f64::max)?;
    let angle_rad = noise
        .iter()
        .map(|one| one.angle_noise_rad)
        .fold(0.0, f64::max);
    let each: Vec<String> = noise
        .iter()
        .map(|one| number(one.walk_rad_sqrt_s() * DEG_SQRT_H))
        .collect();
    Some(format!(
        "Noise, gyro and reference together: angle random walk {} \u{b0}/\u{221a}h, as of {}-grade gyros; white angle noise up to {angle_rad:.1e} rad.",
        each.join(", "),
        grade(largest),
    ))
}

/// Conversion factor from rad/√s to °/√h.
pub const DEG_SQRT_H: f64 = 60.0 * 180.0 / std::f64::consts::PI;

impl NoiseEntry {
    /// Angle random walk: of the noise terms if they were estimated, else of the whitening \[rad/√s\].
    pub fn walk_rad_sqrt_s(&self) -> f64 {
        match &self.terms {
            Some(terms) => terms.angle_random_walk_rad_sqrt_s.value,
            None => self.angle_random_walk_rad_sqrt_s,
        }
    }
}

impl Diagnosis {
    /// Compares the noise with that of instruments, and reports noise beyond the bounds as unexplained residual.
    pub fn judge_noise(&mut self, bounds: &InstrumentNoisePlan) {
        self.summary.extend(beside_instruments(&self.noise));
        let said: Vec<String> = self
            .noise
            .iter()
            .filter_map(|one| beyond(one, bounds))
            .collect();
        if !said.is_empty() {
            self.mark_unexplained(said);
        }
    }

    /// Changes the verdict to an unexplained residual, for the reasons `said`.
    pub fn mark_unexplained(&mut self, said: Vec<String>) {
        self.conclude(match self.verdict {
            Verdict::Matches => Verdict::Unexplained,
            Verdict::Explained => Verdict::PartlyExplained,
            other => other,
        });
        self.summary.extend(said);
    }

    /// Replaces the verdict, and the sentence on it in the summary.
    pub fn conclude(&mut self, verdict: Verdict) {
        let was = opening(self.verdict);
        if let Some(line) = self.summary.iter_mut().find(|line| *line == was) {
            *line = opening(verdict).to_string();
        }
        self.verdict = verdict;
    }
}

/// Returns the reason if the noise of a channel exceeds the bounds.
fn beyond(noise: &NoiseEntry, bounds: &InstrumentNoisePlan) -> Option<String> {
    let walk = noise.angle_random_walk_rad_sqrt_s;
    let angle = noise.angle_noise_rad;
    let what = if walk > bounds.most_walk_rad_sqrt_s {
        format!(
            "an angle random walk of {} \u{b0}/\u{221a}h, above the largest of any gyro, {}",
            number(walk * DEG_SQRT_H),
            number(bounds.most_walk_rad_sqrt_s * DEG_SQRT_H)
        )
    } else if angle > bounds.most_angle_rad {
        format!(
            "white angle noise of {} rad, above the largest of any gyro or reference, {}",
            number(angle),
            number(bounds.most_angle_rad)
        )
    } else {
        return None;
    };
    Some(format!(
        "Residual of {}: as noise it would be {what}; it is a mismatch of unknown form, not noise.",
        noise.channel
    ))
}

/// Sentence on a residual that depends on the motion.
///
/// # Inputs
/// `share`: of the motion; `moving_over_still`: power of the residual at the strongest motion over that at the weakest.
pub fn in_step(share: f64, moving_over_still: f64) -> String {
    format!(
        "Residual correlates with the motion: {} % of it, with {:.0} times the power at the largest motion over that at the least. It is a mismatch of unknown form, not noise; a reference computed from these gyros leaves one.",
        share_percent(share),
        moving_over_still
    )
}

/// Sentence on the size of the residual relative to the motion.
pub fn beside_motion(share: f64) -> String {
    format!(
        "Residual: {} % of the motion (root mean square of rotations over 0.1 s).",
        share_percent(share)
    )
}

/// Per cent with two significant digits.
pub fn share_percent(share: f64) -> String {
    let percent = 100.0 * share;
    let digits = (1.0 - percent.max(1e-6).log10().floor()).clamp(0.0, 8.0) as usize;
    format!("{percent:.digits$}")
}
