//! Compares rotation vectors with the recording's reference, which gives the drift of each segment \[°/h\].
//!
//! It takes rotation vectors per output period \[rad\] and the reference's increments at the sample rate \[rad\]. The
//! drift is the mean difference over a segment, along body axes.
//!
//! Like is compared with like: the reference's increments go through the same f64 coning to the same
//! output periods, so that a difference is an error of the gyros or of the chain and not of the summation.
//! The first period, which the chain only primes with, counts as no rotation in both.
//!
//! An output period belongs to a segment if it lies in it whole. Output periods that the reference did not
//! measure throughout are left out; a segment without any has no drift (`None`).

use super::samples::ReplayInput;
use nalgebra::Vector3;
use rlg_recording::{Recording, Segment};
use rlg_reference::coning::Coning;
use std::f64::consts::PI;
use std::ops::Range;

/// °/h in one rad/s.
pub const DEG_H_PER_RAD_S: f64 = 180.0 / PI * 3600.0;

/// Share of an output period by which a segment's bounds may miss a sample's bounds and still count as on
/// them: stamps are decimal numbers.
const BOUND_TOLERANCE_PERIODS: f64 = 1e-3;

/// The recording's segments, or all of it as one where it names none.
pub fn segments(recording: &Recording, input: &ReplayInput) -> Vec<Segment> {
    if !recording.segments.is_empty() {
        return recording.segments.clone();
    }
    let duration_s = input.samples.len() as f64 / input.parameters.sample_rate_hz;
    vec![Segment {
        name: "recording".to_owned(),
        kind: "whole".to_owned(),
        start_s: input.start_s,
        end_s: input.start_s + duration_s,
    }]
}

/// The reference's rotation vectors per output period \[rad\]; NaN where it was not measured.
pub fn reference_rotations_rad(input: &ReplayInput) -> Option<Vec<[f64; 3]>> {
    let reference = input.reference_rad.as_ref()?;
    let mut coning = Coning::new(usize::from(input.parameters.samples_per_output));
    let mut primed = false;
    Some(
        reference
            .iter()
            .filter_map(|increment| {
                let counts = std::mem::replace(&mut primed, true);
                coning.turn(if counts {
                    Vector3::from(*increment)
                } else {
                    Vector3::zeros()
                })
            })
            .map(Into::into)
            .collect(),
    )
}

/// The output periods that lie in a segment whole.
pub fn periods_in(segment: &Segment, input: &ReplayInput, periods: usize) -> Range<usize> {
    let period_s = f64::from(input.parameters.samples_per_output) / input.parameters.sample_rate_hz;
    let place = |time_s: f64| (time_s - input.start_s) / period_s;
    let first = (place(segment.start_s) - BOUND_TOLERANCE_PERIODS).ceil();
    let end = (place(segment.end_s) + BOUND_TOLERANCE_PERIODS).floor();
    // a float to integer cast saturates: times before the first sample become 0
    let end = (end as usize).min(periods);
    (first as usize).min(end)..end
}

/// Mean of `rotations` − `truth` over the output periods `periods` \[°/h\].
pub fn drift_deg_h(
    rotations_rad: &[[f64; 3]],
    truth_rad: &[[f64; 3]],
    periods: Range<usize>,
    input: &ReplayInput,
) -> Option<[f64; 3]> {
    let period_s = f64::from(input.parameters.samples_per_output) / input.parameters.sample_rate_hz;
    let mut sum = Vector3::zeros();
    let mut count = 0_usize;
    let pairs = rotations_rad.iter().zip(truth_rad);
    for (rotation, truth) in pairs.take(periods.end).skip(periods.start) {
        let difference = Vector3::from(*rotation) - Vector3::from(*truth);
        if difference.iter().all(|value| value.is_finite()) {
            sum += difference;
            count += 1;
        }
    }
    (count > 0).then(|| (sum * (DEG_H_PER_RAD_S / (count as f64 * period_s))).into())
}
