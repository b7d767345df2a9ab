//! Whether gyros and attitudes mean the same axes, the same way round and in the same unit: the check of rates, on the
//! rates between the attitudes.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rlg_model::ModelEffect;
use rlg_model::catalogue::NINE;
use rlg_signal::attitude_samples::SlowSample;
use rlg_signal::axes::Triad;
use rlg_signal::known_channels::KINDS;
use rlg_signal::streams::Streams;

/// Increments of the reference on the gyros' rows \[rad\], at an even rate between two attitudes.
pub(crate) fn reference_rows(samples: &[SlowSample], streams: &Streams) -> Triad {
    let mut rows: Triad = std::array::from_fn(|_| vec![0.0; streams.rows]);
    for pair in samples.windows(2) {
        let [from, to] = [0, 1].map(|k: usize| {
            ((pair[k].time_s - streams.start_s) * streams.rate_hz).clamp(0.0, streams.rows as f64)
        });
        if to <= from || pair[1].after_gap {
            continue;
        }
        let by_row = pair[0].shown.turn_to(&pair[1].shown) / (to - from);
        for row in from as usize..(to.ceil() as usize).min(streams.rows) {
            let share = (to.min((row + 1) as f64) - from.max(row as f64)).max(0.0);
            for (axis, values) in rows.iter_mut().enumerate() {
                values[row] += by_row[axis] * share;
            }
        }
    }
    rows
}

/// What gyros read of the reference by the effects of a model.
pub(crate) fn map(effects: &[ModelEffect]) -> Matrix3<f64> {
    let known = effects.iter().filter(|effect| {
        KINDS.contains(&effect.kind.as_str()) && effect.text("channel") != Some("dither")
    });
    known.fold(Matrix3::identity(), |map, effect| {
        Matrix3::from_fn(|gyro, axis| effect.number(NINE[3 * gyro + axis])) * map
    })
}

/// Puts reference and gyros on the same axes: a rotation turns the reference into the gyros' axes; what no rotation does is
/// undone on the gyros.
pub(crate) fn put_right(
    map: &Matrix3<f64>,
    samples: &mut [SlowSample],
    sensed_rad: &mut [Vector3<f64>],
) {
    if *map == Matrix3::identity() {
        return;
    }
    let is_rotation =
        map.determinant() > 0.0 && (map.transpose() * map - Matrix3::identity()).amax() < 1e-3;
    if is_rotation {
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
