//! Check of the attitude convention: from body to navigation frame, in the order w, x, y, z.

use nalgebra::{Quaternion, UnitQuaternion};
use rlg_recording::error::InputError;
use rlg_signal::attitude_samples::{Shown, SlowSample};

use crate::alignment::Alignment;
use crate::coarse::{self, Likeness};
use crate::observed::Observed;

/// An alternative attitude convention.
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

/// Largest residual power of a better convention, relative to the given one's.
const BETTER: f64 = 0.05;

/// Largest residual power of an equally good convention, relative to the best one's: another order of the components is the
/// inverse between other constant rotations. Of these the convention of smallest rotation of the unit is selected.
const AS_WELL: f64 = 2.0;

/// Residual share of the turns' squares below which a convention is accepted.
const FITS: f64 = 0.01;

/// Converts the attitudes if another convention fits twenty times better, and returns its description; `None` if they are as
/// declared.
///
/// # Errors
/// The attitudes are not as declared, and `anyway` is not set.
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
