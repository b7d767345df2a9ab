//! Drift of each segment \[°/h\] from rotation vectors and the recording's reference.
//!
//! Takes rotation vectors per output period \[rad\] and the reference's increments at the sample rate \[rad\]. The drift is
//! the slope of their difference over a segment, along body axes, with its standard deviation ([`slope`]).
//!
//! The reference's increments pass through the same f64 coning algorithm to the same output periods, so that a difference
//! is an error of the gyros or of the chain and not of the summation. The first period, with which the chain only primes,
//! counts as no rotation in both.
//!
//! An output period belongs to a segment if it lies wholly within. Output periods that the reference did not measure
//! throughout are left out; a segment without any has no drift (`None`).

use super::samples::ReplayInput;
use super::slope::slope;
use nalgebra::Vector3;
use rlg_recording::{Recording, Segment};
use rlg_reference::coning::Coning;
use std::f64::consts::PI;
use std::ops::Range;

/// °/h in one rad/s.
pub const DEG_H_PER_RAD_S: f64 = 180.0 / PI * 3600.0;

/// Tolerance of a segment's bounds against a sample's \[output periods\], since stamps are decimal numbers.
const BOUND_TOLERANCE_PERIODS: f64 = 1e-3;

/// Segments of the recording, or all of it as one if it names none.
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

/// Rotation vectors of the reference per output period \[rad\]; NaN if not measured.
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

/// Output periods that lie wholly within a segment.
pub fn periods_in(segment: &Segment, input: &ReplayInput, periods: usize) -> Range<usize> {
    let place = |time_s: f64| (time_s - input.start_s) / period_s(input);
    let first = (place(segment.start_s) - BOUND_TOLERANCE_PERIODS).ceil();
    let end = (place(segment.end_s) + BOUND_TOLERANCE_PERIODS).floor();
    // a float to integer cast saturates: times before the first sample become 0
    let end = (end as usize).min(periods);
    (first as usize).min(end)..end
}

/// Drift about the body axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Drift \[°/h\].
    pub deg_h: [f64; 3],
    /// Standard deviation \[°/h\]; `None` if the segment is too short to estimate its noise.
    pub std_deg_h: [Option<f64>; 3],
}

/// Drift of `rotations` − `truth` over the output periods `periods`, by generalised least squares with the noise estimated
/// from the difference; `None` without a measured period.
pub fn drift(
    rotations_rad: &[[f64; 3]],
    truth_rad: &[[f64; 3]],
    periods: Range<usize>,
    input: &ReplayInput,
) -> Option<Drift> {
    let differences = differences(rotations_rad, truth_rad, periods);
    let runs = || differences.split(|difference| !is_measured(difference));
    let to_deg_h = DEG_H_PER_RAD_S / period_s(input);
    let mut drift = Drift {
        deg_h: [0.0; 3],
        std_deg_h: [None; 3],
    };
    for axis in 0..3 {
        let of_axis: Vec<Vec<f64>> = runs()
            .map(|run| run.iter().map(|difference| difference[axis]).collect())
            .collect();
        let slope = slope(of_axis.iter().map(Vec::as_slice))?;
        drift.deg_h[axis] = to_deg_h * slope.value;
        drift.std_deg_h[axis] = slope.std.map(|std| to_deg_h * std);
    }
    Some(drift)
}

/// Mean of `rotations` − `other` over the output periods `periods` \[°/h\]: difference between two computations from the
/// same samples, which contains no noise.
pub fn mean_difference_deg_h(
    rotations_rad: &[[f64; 3]],
    other_rad: &[[f64; 3]],
    periods: Range<usize>,
    input: &ReplayInput,
) -> Option<[f64; 3]> {
    let mut differences = differences(rotations_rad, other_rad, periods);
    differences.retain(is_measured);
    let sum: Vector3<f64> = differences.iter().sum();
    let count = differences.len() as f64;
    (count > 0.0).then(|| (sum * (DEG_H_PER_RAD_S / (count * period_s(input)))).into())
}

fn differences(
    rotations_rad: &[[f64; 3]],
    others_rad: &[[f64; 3]],
    periods: Range<usize>,
) -> Vec<Vector3<f64>> {
    let pairs = rotations_rad.iter().zip(others_rad);
    pairs
        .take(periods.end)
        .skip(periods.start)
        .map(|(rotation, other)| Vector3::from(*rotation) - Vector3::from(*other))
        .collect()
}

fn is_measured(difference: &Vector3<f64>) -> bool {
    difference.iter().all(|value| value.is_finite())
}

/// Length of an output period \[s\].
fn period_s(input: &ReplayInput) -> f64 {
    f64::from(input.parameters.samples_per_output) / input.parameters.sample_rate_hz
}
