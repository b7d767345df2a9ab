//! Levels of a sensor's noise in the terms of IEEE 952, each with its standard deviation.

use rlg_plan::{FindingsPlan, Plan};
use std::f64::consts::{PI, TAU};

use rlg_findings::result::{ForceNoiseEntry, ForceTermsEntry, LevelEntry, NoiseTermsEntry};
use rlg_inference::transform::Transform;
use rlg_inference::{NoiseBasis, NoiseEstimate, NoiseLevels, Observations};
use rlg_recording::units::MICRO_G_PER_M_S2;
use rlg_signal::accelerometer_rows::{Rows, channel_name};

use super::narrowband;
use crate::confirm::goodness::misfits;
use crate::rows::noise_levels::first_levels;

/// Converts levels of increments to N, Q, B, K, in the increments' unit \[u\]: u/√s, u, u/s, u/s/√s.
///
/// # Inputs
/// `rows`: of the whole record, at `rate_hz`.
fn in_units(estimate: &NoiseEstimate, (rows, rate_hz): (usize, f64)) -> [LevelEntry; 4] {
    let record = rows as f64;
    // White increments of variance S have a two-sided density of rate S · rate; flicker's is B²/(2π f), and a walk's
    // increments are K²/rate³.
    let in_unit = [
        rate_hz,
        1.0,
        TAU * rate_hz * rate_hz / record,
        (PI / record).powi(2) * rate_hz.powi(3),
    ];
    let levels = estimate.levels.as_array();
    std::array::from_fn(|term| {
        let [square, spread] = [levels[term], estimate.stds[term]].map(|one| one * in_unit[term]);
        let value = square.sqrt();
        // d√x = dx/(2√x); for an insignificant level the square alone has a spread.
        let std = match square > spread {
            true => 0.5 * spread / value,
            false => spread.sqrt(),
        };
        LevelEntry { value, std }
    })
}

/// Noise terms of one gyro; `None` if its record does not separate them.
///
/// # Inputs
/// `power`: energy of the residual in each bin \[rad²\]; `record`: rows and their rate \[Hz\].
pub(super) fn of_gyro(
    basis: &NoiseBasis,
    power: &[f64],
    record: (usize, f64),
) -> Option<NoiseTermsEntry> {
    let [n, q, b, k] = in_units(&basis.estimate(power)?, record);
    Some(NoiseTermsEntry {
        angle_random_walk_rad_sqrt_s: n,
        quantisation_rad: q,
        bias_instability_rad_s: b,
        rate_random_walk_rad_s_sqrt_s: k,
    })
}

/// Fits the noise of accelerometers at rest; steady lines are removed, and effects of temperature count as noise. `None` if
/// a record does not separate the terms; a record that deviates from such noise has no terms.
pub(super) fn of_accelerometers(rows: &Rows, plan: &Plan) -> Option<Vec<ForceNoiseEntry>> {
    let observations = Observations::bridged(&rows.usable).ok()?.to_fast_length();
    let sensed_m_s = narrowband::without_lines(&rows.sensed_m_s, &observations, &plan.rest.steady);
    let known = NoiseLevels::mean(&first_levels(&sensed_m_s, &observations));
    let (transform, basis) = Transform::with_basis(observations, known);
    let of_axis = |axis: usize| {
        let spectrum = transform.spectrum(&sensed_m_s[axis]);
        let energy = |bin: &std::ops::Range<usize>| -> f64 {
            let of_bin = spectrum[bin.clone()].iter();
            of_bin.map(|c| c * c).sum::<f64>().max(f64::MIN_POSITIVE)
        };
        let power: Vec<f64> = basis.bins.iter().map(energy).collect();
        let estimate = basis.estimate(&power)?;
        let is_noise = misfits(&basis, &spectrum, estimate.levels, axis, plan).is_empty();
        let [n, q, b, k] = in_units(&estimate, (rows.count, rows.rate_hz));
        Some(ForceNoiseEntry {
            channel: channel_name(axis),
            noise_m_s2_sqrt_hz: std::f64::consts::SQRT_2 * n.value,
            velocity_noise_m_s: q.value,
            terms: is_noise.then_some(ForceTermsEntry {
                velocity_random_walk_m_s_sqrt_s: n,
                quantisation_m_s: q,
                bias_instability_m_s2: b,
                acceleration_random_walk_m_s2_sqrt_s: k,
            }),
        })
    };
    (0..3).map(of_axis).collect()
}

/// Sentence on the terms of a gyro, in the units of data sheets.
pub(super) fn sentence(axis: &str, terms: &NoiseTermsEntry, plan: &FindingsPlan) -> String {
    let per_hour = 3600.0_f64.to_degrees();
    let each = [
        (
            "N",
            terms.angle_random_walk_rad_sqrt_s,
            per_hour / 60.0,
            "°/√h",
        ),
        ("Q", terms.quantisation_rad, per_hour, "″"),
        ("B", terms.bias_instability_rad_s, per_hour, "°/h"),
        (
            "K",
            terms.rate_random_walk_rad_s_sqrt_s,
            per_hour * 60.0,
            "°/h/√h",
        ),
    ];
    format!("Noise: gyro {axis}: {}.", in_words(&each, plan))
}

/// Sentence on the terms of an accelerometer.
pub(super) fn sentence_of_force(
    axis: &str,
    terms: &ForceTermsEntry,
    plan: &FindingsPlan,
) -> String {
    let each = [
        ("N", terms.velocity_random_walk_m_s_sqrt_s, 60.0, "m/s/√h"),
        ("Q", terms.quantisation_m_s, 1.0, "m/s"),
        ("B", terms.bias_instability_m_s2, MICRO_G_PER_M_S2, "µg"),
        (
            "K",
            terms.acceleration_random_walk_m_s2_sqrt_s,
            60.0 * MICRO_G_PER_M_S2,
            "µg/√h",
        ),
    ];
    format!("Noise: accelerometer {axis}: {}.", in_words(&each, plan))
}

/// Each term with its interval, or the bound of an insignificant one, as on the page.
fn in_words(each: &[(&str, LevelEntry, f64, &str)], plan: &FindingsPlan) -> String {
    let each = each.iter().map(|(name, level, factor, unit)| {
        if level.is_measured(plan) {
            let (value, std) = (level.value * factor, level.std * factor);
            format!("{name} = {value:.3e} ± {std:.1e} {unit}")
        } else {
            format!("{name} < {:.1e} {unit}", level.bound(plan) * factor)
        }
    });
    each.collect::<Vec<String>>().join(", ")
}
