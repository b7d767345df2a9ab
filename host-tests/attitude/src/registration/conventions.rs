//! Check of the attitude convention: from body to navigation frame, in the order w, x, y, z.

use rlg_plan::{ConventionPlan, Plan};

use nalgebra::{Quaternion, UnitQuaternion};
use rlg_findings::sentences::READ_AS;
use rlg_model::{DeclaredModel, Model};
use rlg_recording::error::InputError;
use rlg_recording::{Quantity, Recording};
use rlg_signal::attitude_samples::{Shown, SlowSample, has_attitude};

use crate::reference::coarse::{self, Likeness};
use crate::registration::observed::{Observed, observe};
use crate::rows::alignment::Alignment;

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

/// A recording with its attitudes in the project's convention.
pub struct Converted {
    /// The recording.
    pub recording: Recording,
    /// Sentence on the convention found.
    pub sentence: String,
}

/// Converts a recording's attitudes if another convention fits the gyros better; `None` if they are as declared.
///
/// The convention with a plausible mount is taken without asking if no other with one fits as well.
///
/// # Errors
/// The attitudes are not as declared, several conventions fit, and `anyway` is not set; or a channel is missing or invalid.
pub fn converted(
    recording: &Recording,
    of: DeclaredModel<'_>,
    plan: &Plan,
    anyway: bool,
) -> Result<Option<Converted>, InputError> {
    let model = of.model;
    if !has_attitude(recording) {
        return Ok(None);
    }
    let Some(observed) = observe(recording, of, plan)? else {
        return Ok(None);
    };
    if observed.is_few {
        return Ok(None);
    }
    let Some((reading, is_clear)) = other_reading(&observed, model, &plan.attitude.conventions)
    else {
        return Ok(None);
    };
    let words = format!(
        "{}: in this convention they follow the gyros",
        reading.words
    );
    if !is_clear && !anyway {
        let file = recording.folder.join("recording.toml");
        return Err(InputError::new(file, format!("the attitudes are {words}"))
            .channel("reference_attitude")
            .expected("body to navigation frame, each component in the channel of its axis")
            .or_anyway("reads them in that convention and reports it"));
    }
    let mut recording = recording.clone();
    read_as(reading, &mut recording);
    Ok(Some(Converted {
        recording,
        sentence: format!("{READ_AS}{words}."),
    }))
}

/// Another convention that fits better, and true if it is the only one with a plausible mount.
fn other_reading(
    observed: &Observed,
    model: &Model,
    plan: &ConventionPlan,
) -> Option<(&'static Reading, bool)> {
    let of_model = Alignment::of_model(model);
    let compared = |samples: &[SlowSample]| {
        let left_out = &observed.stamps.left_out;
        coarse::likeness(&observed.gyros, samples, left_out, &of_model)
    };
    let given = compared(&observed.samples).filter(|likeness| likeness.left > plan.fits)?;
    let better = match given.turned_rad > plan.implausible_rad {
        true => plan.better,
        false => plan.far_better,
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
    let others: Vec<(Likeness, &'static Reading)> = READINGS
        .iter()
        .filter_map(|reading| Some((compared(&read(reading))?, reading)))
        .collect();
    let is_plausible = |one: &Likeness| one.turned_rad < plan.implausible_rad;
    let least = others.iter().map(|(likeness, _)| likeness.left);
    let least = least.fold(better * given.left, f64::min);
    // A reversed or exchanged channel beside the declared convention needs no other convention, unless that needs no mount.
    let most = |one: &Likeness| {
        given.left_by_any_map
            * if is_plausible(one) {
                plan.as_well
            } else {
                better
            }
    };
    let mut fitting: Vec<&(Likeness, &Reading)> = others
        .iter()
        .filter(|(likeness, _)| likeness.left < better * given.left)
        .filter(|(likeness, _)| likeness.left <= plan.as_well * least)
        .filter(|(likeness, _)| likeness.left <= most(likeness))
        .collect();
    fitting.sort_by(|a, b| a.0.turned_rad.total_cmp(&b.0.turned_rad));
    if let Some((_, best)) = fitting.first() {
        let is_clear = fitting.iter().filter(|one| is_plausible(&one.0)).count() == 1;
        return Some((best, is_clear));
    }
    // Another convention and channels reversed or exchanged, both.
    let (likeness, best) = others
        .iter()
        .min_by(|a, b| a.0.left_by_any_map.total_cmp(&b.0.left_by_any_map))?;
    let is_both = likeness.left_by_any_map < plan.far_better * given.left_by_any_map;
    (is_both && given.left_by_any_map > plan.fits).then_some((best, false))
}

/// Converts the attitude channels of a recording; rows without an attitude stay.
fn read_as(reading: &Reading, recording: &mut Recording) {
    for table in &mut recording.tables {
        let places = ["w", "x", "y", "z"].map(|axis| {
            table.channels.iter().position(|channel| {
                channel.quantity == Quantity::ReferenceAttitude
                    && channel.axis.as_deref() == Some(axis)
            })
        });
        let [Some(w), Some(x), Some(y), Some(z)] = places else {
            continue;
        };
        for row in 0..table.rows {
            let [a, b, c, d] = [w, x, y, z].map(|place| table.channels[place].values[row]);
            let q = Quaternion::new(a, b, c, d);
            // Also false for a component that was not measured.
            if q.norm() > 0.0 {
                let q = (reading.of)(UnitQuaternion::new_unchecked(q));
                for (place, value) in [(w, q.w), (x, q.i), (y, q.j), (z, q.k)] {
                    table.channels[place].values[row] = value;
                }
            }
        }
    }
}
