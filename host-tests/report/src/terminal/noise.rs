//! Text on the noise of a unit at rest in the terms of IEEE 952, in one line.

use rlg_findings::numbers::Scale;
use rlg_findings::result::{Diagnosis, LevelEntry, NoiseEntry, NoiseTermsEntry};
use rlg_recording::AXES;

use super::sizes::to_two_digits;

/// Term of IEEE 952: its letter, its unit, its field, and true if an upper bound is reported too.
type Term = (
    &'static str,
    &'static str,
    fn(&NoiseTermsEntry) -> LevelEntry,
    bool,
);

/// Terms in the order of their slopes. Data sheets state N, B and K, so their upper bounds are reported too.
const TERMS: [Term; 4] = [
    ("Q", "rad", |terms| terms.quantisation_rad, false),
    (
        "N",
        "rad/√s",
        |terms| terms.angle_random_walk_rad_sqrt_s,
        true,
    ),
    ("B", "rad/s", |terms| terms.bias_instability_rad_s, true),
    (
        "K",
        "rad/s/√s",
        |terms| terms.rate_random_walk_rad_s_sqrt_s,
        true,
    ),
];

/// Terms of every gyro with estimates: value ± σ, or the upper bound of an insignificant term.
pub(super) fn noise(diagnosis: &Diagnosis) -> Option<String> {
    let said = TERMS.iter().filter_map(|term| one_term(diagnosis, term));
    let mut said: Vec<String> = said.collect();
    if said.is_empty() && diagnosis.effects.is_empty() && !diagnosis.noise.is_empty() {
        said.push(judged_with(&diagnosis.noise));
    }
    (!said.is_empty()).then(|| format!("Noise: {}.", said.join("; ")))
}

/// One term of all gyros; `None` if it is unknown or not worth reporting.
fn one_term(diagnosis: &Diagnosis, (letter, unit, of, is_bounded): &Term) -> Option<String> {
    let known = diagnosis.noise.iter().filter_map(|noise| {
        let axis = noise.channel.rsplit('_').next()?;
        Some((axis, of(noise.terms.as_ref()?)))
    });
    let known: Vec<(&str, LevelEntry)> = known.collect();
    let bound = |(_, level): &(&str, LevelEntry)| level.bound();
    let largest = known.iter().map(bound).fold(0.0, f64::max);
    let scale = Scale::of("noise", unit, largest);
    let is_bound_alone = known.iter().all(|(_, level)| !level.is_measured());
    if is_bound_alone {
        let below = format!("{letter} < {}", to_two_digits(largest * scale.factor));
        return (*is_bounded && !known.is_empty()).then(|| scale.with_unit(&below));
    }
    let each = known.iter().filter_map(|(axis, level)| {
        if level.is_measured() {
            return Some(format!("{axis} {}", scale.pair(level.value, level.std)));
        }
        is_bounded.then(|| {
            let below = to_two_digits(level.bound() * scale.factor);
            format!("{axis} < {below}")
        })
    });
    let each: Vec<String> = each.collect();
    Some(format!("{letter} {}", scale.with_unit(&each.join(", "))))
}

/// Noise used for the whitening, reported for a recording without findings.
fn judged_with(noise: &[NoiseEntry]) -> String {
    let walks: Vec<f64> = noise
        .iter()
        .map(|one| one.angle_random_walk_rad_sqrt_s)
        .collect();
    let scale = Scale::of("noise", "rad/√s", walks.iter().copied().fold(0.0, f64::max));
    let each = AXES.iter().zip(walks);
    let each = each.map(|(axis, walk)| format!("{axis} {}", to_two_digits(walk * scale.factor)));
    let each: Vec<String> = each.collect();
    format!("N {}", scale.with_unit(&each.join(", ")))
}
