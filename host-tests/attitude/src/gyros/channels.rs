//! Agreement of axes, signs and units of gyros and attitudes: the check of rate references, applied to the rates between
//! attitudes.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rlg_model::catalogue::NINE;
use rlg_model::{Model, ModelEffect};
use rlg_plan::{AttitudeRowsPlan, Plan};
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_signal::attitude_samples::{SlowSample, slow_samples};
use rlg_signal::axes::Triad;
use rlg_signal::known_channels::{self, KINDS};
use rlg_signal::quantiles::median;
use rlg_signal::streams::Streams;

/// Reference increments resampled to the gyros' rows.
pub(crate) struct ReferenceRows {
    /// Increments at a constant rate between two attitudes \[rad\].
    pub(crate) increments_rad: Triad,
    /// Rows between attitudes whose angle of rotation differs from the gyros': a jump, a frozen attitude, a gap. The angle
    /// does not depend on the axes.
    pub(crate) doubtful: Vec<bool>,
}

/// Resamples the reference to the gyros' rows.
pub(crate) fn reference_rows(
    samples: &[SlowSample],
    streams: &Streams,
    plan: &AttitudeRowsPlan,
) -> ReferenceRows {
    let mut increments_rad: Triad = std::array::from_fn(|_| vec![0.0; streams.rows]);
    let mut parted: Vec<(std::ops::Range<usize>, f64)> = Vec::new();
    let mut doubtful = vec![false; streams.rows];
    let longest_s = readings_hz(samples).map_or(f64::INFINITY, |hz| plan.gap_periods / hz);
    for pair in samples.windows(2) {
        let [from, to] = [0, 1].map(|k: usize| {
            ((pair[k].time_s - streams.start_s) * streams.rate_hz).clamp(0.0, streams.rows as f64)
        });
        if to <= from {
            continue;
        }
        let between = from as usize..(to.ceil() as usize).min(streams.rows);
        let is_gap = pair[1].time_s - pair[0].time_s > longest_s;
        if is_gap || pair[1].after_gap {
            doubtful[between].fill(true);
            continue;
        }
        let turn_rad = pair[0].shown.turn_to(&pair[1].shown);
        let mut own_rad = Vector3::<f64>::zeros();
        for row in between.clone() {
            let share = (to.min((row + 1) as f64) - from.max(row as f64)).max(0.0);
            for (axis, values) in increments_rad.iter_mut().enumerate() {
                values[row] += turn_rad[axis] / (to - from) * share;
                own_rad[axis] += streams.sensed_rad[axis][row] * share;
            }
        }
        let apart_rad = (turn_rad.norm() - own_rad.norm()).abs();
        parted.push((between, apart_rad / (to - from)));
    }
    let mut sizes: Vec<f64> = parted.iter().map(|(_, apart)| *apart).collect();
    sizes.sort_by(f64::total_cmp);
    let usual = sizes.get(9 * sizes.len() / 10).copied().unwrap_or(0.0);
    for (between, _) in parted
        .into_iter()
        .filter(|(_, apart)| *apart > plan.doubtful * usual)
    {
        doubtful[between].fill(true);
    }
    ReferenceRows {
        increments_rad,
        doubtful,
    }
}

/// Rate of the attitudes, by the median of the times between them \[Hz\].
pub(crate) fn readings_hz(samples: &[SlowSample]) -> Option<f64> {
    let pairs = samples.windows(2);
    let median_s = median(pairs.map(|pair| pair[1].time_s - pair[0].time_s))?;
    (median_s > 0.0).then(|| 1.0 / median_s)
}

/// Returns the gyros' streams with the rates between attitudes, on the gyros' rows.
///
/// # Errors
/// As in the alignment of both.
pub fn beside_gyros(
    recording: &Recording,
    model: &Model,
    plan: &Plan,
) -> Result<Streams, InputError> {
    let samples = slow_samples(recording, &plan.signal.attitude_samples)?;
    let mut streams = Streams::align_without_reference(recording, model, &plan.signal.align)?;
    streams.case_rad = reference_rows(&samples, &streams, &plan.attitude.rows).increments_rad;
    Ok(streams)
}

/// Map from the reference's rate to the gyros' by a model's channel effects.
pub(crate) fn map(effects: &[ModelEffect]) -> Matrix3<f64> {
    let known = effects.iter().filter(|effect| {
        KINDS.contains(&effect.kind.as_str()) && effect.text("channel") != Some("dither")
    });
    known.fold(Matrix3::identity(), |map, effect| {
        Matrix3::from_fn(|gyro, axis| effect.number(NINE[3 * gyro + axis])) * map
    })
}

/// Part of a map that [`apply_map`] inverts on the gyros; the identity for a rotation.
pub(crate) fn on_gyros(map: &Matrix3<f64>) -> Matrix3<f64> {
    match is_rotation(map) {
        true => Matrix3::identity(),
        false => *map,
    }
}

/// Axis of the reference that each gyro follows under a map.
pub(crate) fn followed(map: &Matrix3<f64>) -> [usize; 3] {
    [0, 1, 2].map(|gyro| map.row(gyro).transpose().iamax())
}

/// True if a map rotates, without reflection or scale.
fn is_rotation(map: &Matrix3<f64>) -> bool {
    map.determinant() > 0.0 && (map.transpose() * map - Matrix3::identity()).amax() < 1e-3
}

/// Maps increments of the reference \[rad\] by the model's channel effects, as [`apply_map`] inverts on the gyros alone what is no
/// rotation, and the streams hold the gyros as recorded.
pub(crate) fn map_increments(effects: &[ModelEffect], increments_rad: &mut Triad) {
    if !is_rotation(&map(effects)) {
        known_channels::apply(increments_rad, &mut None, effects);
    }
}

/// Transforms reference and gyros to the same axes: a rotation is applied to the reference, any other map is inverted on the
/// gyros.
pub(crate) fn apply_map(
    map: &Matrix3<f64>,
    samples: &mut [SlowSample],
    sensed_rad: &mut [Vector3<f64>],
) {
    if *map == Matrix3::identity() {
        return;
    }
    if is_rotation(map) {
        let gyros_from_reference = UnitQuaternion::from_matrix(map);
        for sample in samples {
            sample.shown = sample.shown.turned_back(&gyros_from_reference);
        }
    } else if let Some(inverse) = map.try_inverse() {
        for sensed in sensed_rad {
            *sensed = inverse * *sensed;
        }
    }
}
