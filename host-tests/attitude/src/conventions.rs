//! Whether attitudes are read as they were written: from body to navigation frame, in the order w, x, y, z.

use nalgebra::{Quaternion, UnitQuaternion};
use rlg_recording::error::InputError;
use rlg_signal::attitude_samples::{Shown, SlowSample};

use crate::alignment::Alignment;
use crate::coarse::{self, Likeness};
use crate::observed::Observed;

/// Another way to read an attitude.
struct Reading {
    /// Continues "the attitudes are".
    words: &'static str,
    of: fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>,
}

static READINGS: [Reading; 5] = [
    Reading {
        words: "from navigation frame to body",
        of: |q| q.inverse(),
    },
    Reading {
        words: "in the order x, y, z, w",
        of: scalar_last,
    },
    Reading {
        words: "in the order x, y, z, w and from navigation frame to body",
        of: |q| scalar_last(q).inverse(),
    },
    Reading {
        words: "in the order w, x, y, z, and read as x, y, z, w",
        of: scalar_first,
    },
    Reading {
        words: "in the order w, x, y, z, read as x, y, z, w, and from navigation frame to body",
        of: |q| scalar_first(q).inverse(),
    },
];

fn scalar_last(q: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(q.k, q.w, q.i, q.j))
}

fn scalar_first(q: UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(q.i, q.j, q.k, q.w))
}

/// Another reading fits better where it leaves less than this share of the turns' squares that the given one leaves.
const BETTER: f64 = 0.05;

/// Readings that leave up to so many times what the best leaves fit as well: another order of the components is the inverse
/// between other constant rotations. Of these that is right which needs the smallest rotation of the unit.
const AS_WELL: f64 = 2.0;

/// A reading that leaves less than this share of the turns' squares is right.
const FITS: f64 = 0.01;

/// Reads the attitudes another way where that fits twenty times better, and says so; `None` where they are as declared.
///
/// # Errors
/// They are not as declared, and nobody said to read them so anyway.
pub(crate) fn check(
    observed: &mut Observed,
    of_model: &Alignment,
    anyway: bool,
) -> Result<Option<String>, InputError> {
    let compared = |samples: &[SlowSample]| {
        let left_out = &observed.stamps.left_out;
        coarse::likeness(&observed.gyros, samples, left_out, of_model)
    };
    let Some(given) = compared(&observed.samples).filter(|likeness| likeness.left > FITS) else {
        return Ok(None);
    };
    let read = |reading: &Reading| -> Vec<SlowSample> {
        let samples = observed.samples.iter();
        samples
            .map(|sample| SlowSample {
                shown: match sample.shown {
                    Shown::Attitude(attitude) => Shown::Attitude((reading.of)(attitude)),
                    sum @ Shown::Sum(_) => sum,
                },
                ..*sample
            })
            .collect()
    };
    let others: Vec<(Likeness, &Reading)> = READINGS
        .iter()
        .filter_map(|reading| Some((compared(&read(reading))?, reading)))
        .collect();
    let least = others.iter().map(|(likeness, _)| likeness.left);
    let least = least.fold(BETTER * given.left, f64::min);
    let fitting = others
        .iter()
        .filter(|(likeness, _)| likeness.left < BETTER * given.left)
        .filter(|(likeness, _)| likeness.left <= AS_WELL * least);
    let best = fitting.min_by(|a, b| a.0.turned_rad.total_cmp(&b.0.turned_rad));
    let Some((_, reading)) = best else {
        return Ok(None);
    };
    let said = format!(
        "the attitudes are {}: read so, they follow the gyros",
        reading.words
    );
    if !anyway {
        let file = observed.recording.folder.join("recording.toml");
        return Err(InputError::new(file, said)
            .channel("reference_attitude")
            .expected(
                "body to navigation frame, each component in the channel of its axis; --anyway reads them so and reports it",
            ));
    }
    observed.samples = read(reading);
    Ok(Some(format!("Channels: {said}.")))
}
