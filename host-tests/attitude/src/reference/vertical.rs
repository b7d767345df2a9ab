//! Vertical of a reference, and its angle to the specific force, the input of an attitude filter's correction.

use nalgebra::{UnitQuaternion, Vector3};
use rlg_signal::attitude_samples::{Shown, SlowSample};
use rlg_signal::axes::Triad;
use rlg_signal::streams::Streams;

/// Computes the turn from the specific force of every row to the vertical by the attitude at its begin, the state of a
/// filter, by body axis: (f/|f|) × up \[1\]; 0 without attitudes on both sides. Up is the axis of the navigation frame
/// nearest to the mean specific force, as in a filter.
///
/// # Returns
/// `None` without accelerometers, or for sums of increments.
pub(crate) fn off_vertical(samples: &[SlowSample], streams: &Streams) -> Option<Triad> {
    let force = streams.force_m_s2.as_ref()?;
    let turned: Option<Vec<(f64, UnitQuaternion<f64>)>> = samples
        .iter()
        .map(|sample| match sample.shown {
            Shown::Attitude(attitude) => Some((sample.time_s, attitude)),
            Shown::Sum(_) => None,
        })
        .collect();
    let turned = turned?;
    let mut after = 0;
    let felt: Vec<Option<(UnitQuaternion<f64>, Vector3<f64>)>> = (0..streams.rows)
        .map(|row| {
            let time_s = streams.begin_s(row);
            while after < turned.len() && turned[after].0 <= time_s {
                after += 1;
            }
            let (from_s, from) = turned.get(after.checked_sub(1)?)?;
            let (to_s, to) = turned.get(after)?;
            let share = (time_s - from_s) / (to_s - from_s);
            let navigation_from_body = from.try_slerp(to, share, 1e-9)?;
            let felt = Vector3::from_fn(|axis, _| force[axis][row]);
            Some((navigation_from_body, felt.try_normalize(f64::MIN_POSITIVE)?))
        })
        .collect();
    let each = felt.iter().flatten();
    let sum: Vector3<f64> = each.map(|(attitude, felt)| attitude * felt).sum();
    let along = sum.iamax();
    let up = Vector3::ith(along, sum[along].signum());
    let mut off = Triad::default();
    for felt in &felt {
        let turn = felt.map_or_else(Vector3::zeros, |(attitude, felt)| {
            felt.cross(&attitude.inverse_transform_vector(&up))
        });
        for (axis, values) in off.iter_mut().enumerate() {
            values.push(turn[axis]);
        }
    }
    Some(off)
}
