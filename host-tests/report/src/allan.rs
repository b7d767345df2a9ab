//! Overlapping Allan deviation of a rate \[rad/s\] from its integrated angle, and that of a noise model.
//!
//! IEEE Std 952-1997, Annex C: σ²(τ) = ⟨(θ(t+2τ) − 2 θ(t+τ) + θ(t))²⟩ / 2τ², and Eq. (C.21) for the sum of the terms.

use std::f64::consts::{LN_2, PI};

use rlg_findings::result::NoiseEntry;

/// Number of averaging times in a decade.
const PER_DECADE: f64 = 8.0;

/// Least number of averages of a deviation; with fewer its uncertainty is too large.
const LEAST_AVERAGES: usize = 8;

/// Largest relative deviation of a period from the mean for equally spaced angles.
const UNEVEN: f64 = 1e-3;

/// Overlapping Allan deviation \[rad/s\] by averaging time \[s\] of angles \[rad\] sampled every `period_s`.
///
/// `runs`: angles without a gap; the angle between runs is unknown. Differences with a non-finite angle are left out.
pub fn deviation(runs: &[Vec<f64>], period_s: f64) -> Vec<(f64, f64)> {
    let most = runs.iter().map(Vec::len).sum::<usize>() / LEAST_AVERAGES;
    let steps = 0..=(PER_DECADE * (most.max(1) as f64).log10()) as i32;
    let mut rows: Vec<usize> = steps
        .map(|step| 10f64.powf(f64::from(step) / PER_DECADE).round() as usize)
        .filter(|rows| *rows <= most)
        .collect();
    rows.dedup();
    let of = |rows: &usize| {
        let (mut sum, mut count) = (0.0, 0_usize);
        for angle in runs.iter().flat_map(|run| run.windows(2 * rows + 1)) {
            let second = angle[2 * rows] - 2.0 * angle[*rows] + angle[0];
            if second.is_finite() {
                sum += second * second;
                count += 1;
            }
        }
        let tau_s = *rows as f64 * period_s;
        (count >= LEAST_AVERAGES).then(|| (tau_s, (sum / count as f64 / 2.0).sqrt() / tau_s))
    };
    rows.iter().filter_map(of).collect()
}

/// Spacing \[s\] of equally spaced times; `None` if they are not.
pub fn period_s(times_s: &[f64]) -> Option<f64> {
    let (first, last) = (times_s.first()?, times_s.last()?);
    let mean = (last - first) / (times_s.len().checked_sub(1)? as f64);
    let even = |pair: &[f64]| ((pair[1] - pair[0]) / mean - 1.0).abs() < UNEVEN;
    (mean > 0.0 && times_s.windows(2).all(even)).then_some(mean)
}

/// Allan deviation \[rad/s\] of a gyro's noise model at `tau_s`.
pub fn of_model(noise: &NoiseEntry, tau_s: f64) -> f64 {
    let [white, angle, flicker, walk] = match &noise.terms {
        Some(terms) => [
            terms.angle_random_walk_rad_sqrt_s.value,
            terms.quantisation_rad.value,
            terms.bias_instability_rad_s.value,
            terms.rate_random_walk_rad_s_sqrt_s.value,
        ],
        None => [
            noise.angle_random_walk_rad_sqrt_s,
            noise.angle_noise_rad,
            0.0,
            0.0,
        ],
    };
    let variance = 3.0 * (angle / tau_s).powi(2)
        + white * white / tau_s
        + flicker * flicker * 2.0 * LN_2 / PI
        + walk * walk * tau_s / 3.0;
    variance.sqrt()
}
