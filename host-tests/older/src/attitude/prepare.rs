//! Everything before the search over attitudes, and the same again from what a first search found.
//!
//! Enters: a recording and its model. Leaves: [`Prepared`]: the gyros' own motion less what the model knows, the
//! reference's samples, the noise that the model declares.

use std::path::Path as FilePath;

use nalgebra::Vector3;

use super::levels::DeclaredLevels;
use super::own_motion;
use super::record::{Lie, Record};
use super::samples::{self, SlowSample};
use crate::declared::{excess_square, own_noise};
use crate::hunt::Catch;
use crate::hypotheses::CATALOGUE;
use crate::motion::AngleNoise;
use crate::qualify;
use crate::residual::{body_from_sensing, residual_rad};
use crate::scene::Scene;
use crate::streams::{Streams, Triad, add, add_triad};
use rlg_model::{EffectValue, Model};
use rlg_recording::Recording;
use rlg_recording::error::InputError;

/// Everything before the search: the gyros' own motion beside the samples.
pub(super) struct Prepared {
    /// Channels and motion.
    pub(super) scene: Scene,
    /// Faults of the data that the model does not know.
    pub(super) faults: Vec<qualify::Fault>,
    /// What the reference read.
    pub(super) samples: Vec<SlowSample>,
    /// The case by the gyros, less what the model knows of their errors \[rad per row\].
    pub(super) increments_rad: Triad,
    /// Clock and frame of the reference as the model has them.
    pub(super) lie: Lie,
    /// What the model says of the noise.
    pub(super) declared: DeclaredLevels,
    /// Noise of the gyros' own motion.
    pub(super) own_noise: AngleNoise,
}

impl Prepared {
    /// The record with the reference lying so.
    pub(super) fn record(&self, model: &Model, lie: &Lie) -> Record {
        Record::new(
            &self.scene,
            self.increments_rad.clone(),
            &body_from_sensing(&model.gyro.installation_rad),
            &self.samples,
            lie,
            self.declared.gyro_white_rad2,
        )
    }
}

/// Aligns, qualifies and takes the gyros' own motion.
pub(super) fn prepare(
    recording: &Recording,
    model: &Model,
    model_file: &FilePath,
    progress: &dyn Fn(&str),
) -> Result<Prepared, InputError> {
    progress("aligning the channels");
    let samples = samples::slow_samples(recording)?;
    let mut streams = Streams::align_without_reference(recording, model)?;
    let from_sensing = body_from_sensing(&model.gyro.installation_rad);
    own_motion::take_own_motion(&mut streams, model, &from_sensing);
    progress("qualifying the data");
    let faults: Vec<qualify::Fault> = qualify::qualify(&mut streams)
        .into_iter()
        .filter(|fault| !qualify::is_known(fault, &streams, &model.effects))
        .collect();
    progress("deriving the motion");
    let declared = declared_levels(model);
    let own_noise_rad = declared
        .gyro_white_rad2
        .iter()
        .fold(0.0, |most: f64, v| most.max(*v));
    let own_noise = own_noise(model, own_noise_rad.sqrt());
    let sensed_case_rad = streams.case_rad.clone();
    own_motion::without_dither(&mut streams);
    let mut scene = Scene::new(streams, Some(own_noise), model.gyro.scale_error);
    scene.streams.case_rad = sensed_case_rad;
    // The clock and frame of the reference are undone exactly; everything else through its own hypothesis.
    let number = |kind: &str, name: &str| -> f64 {
        let of_kind = model.effects.iter().filter(|effect| effect.kind == kind);
        of_kind
            .filter_map(|effect| match effect.parameters.get(name) {
                Some(EffectValue::Number(value)) => Some(*value),
                _ => None,
            })
            .sum()
    };
    let lie = Lie {
        delay_s: number("reference_delay", "all"),
        turn_rad: Vector3::new(
            number("reference_misalignment", "x"),
            number("reference_misalignment", "y"),
            number("reference_misalignment", "z"),
        ),
    };
    let mut rest = model.clone();
    rest.effects.retain(|effect| {
        !matches!(
            effect.kind.as_str(),
            "reference_delay" | "reference_misalignment"
        )
    });
    // Own motion inverts the model, so what is left of the residual is what the known effects add.
    let known = residual_rad(&scene, &rest, model_file)?;
    let mut increments_rad = scene.streams.case_rad.clone();
    own_motion::add_sensed(&mut increments_rad, &known, model, &from_sensing);
    Ok(Prepared {
        scene,
        faults,
        samples,
        increments_rad,
        lie,
        declared,
        own_noise,
    })
}

/// Noise that the model declares: pulses and pickoff are read with the gyros, gyro and reference walk at random.
fn declared_levels(model: &Model) -> DeclaredLevels {
    let squares = |kind: &str, axis: usize| excess_square(model, kind, axis);
    let reference = model.reference.as_ref();
    let reference_walk = reference
        .and_then(|reference| reference.angle_random_walk_rad_sqrt_s)
        .map_or(0.0, |walk| walk * walk);
    DeclaredLevels {
        walk_rad2_s: [0, 1, 2].map(|axis: usize| {
            let walk = model.gyro.angle_random_walk_rad_sqrt_s?[axis].powi(2);
            Some(walk + reference_walk + squares("angle_random_walk", axis))
        }),
        gyro_white_rad2: [0, 1, 2].map(|axis: usize| {
            let pulses = model.gyro.pulse_weight_rad[axis].powi(2) / 12.0;
            pulses + model.pickoff_white_rad2(axis) + squares("pulse_quantisation", axis) / 12.0
        }),
        reference_white_rad2: reference
            .and_then(|reference| reference.angle_noise_rad)
            .map(|noise| noise * noise),
    }
}

/// The record at what was found: where the gyros' errors turn their attitude far, their own columns turn with it, and
/// the errors are linear in them only nearby. `None` where it makes no difference.
pub(super) fn relinearised(
    prepared: &Prepared,
    model: &Model,
    record: &Record,
    lie: Option<&Lie>,
    catch: &Catch,
) -> Option<Record> {
    /// The square of this is below what any reference reads.
    const FAR_RAD: f64 = 2e-4;
    let scene = &prepared.scene;
    let near = record.error_rad.iter().all(|error| error.norm() < FAR_RAD);
    let linear = || {
        let chosen = catch.choice.chosen.iter();
        chosen.filter(|one| CATALOGUE[one.effect].is_linear())
    };
    if near || (linear().next().is_none() && catch.terms.is_empty()) {
        return None;
    }
    let mut sensed: Triad = [0, 1, 2].map(|_| vec![0.0; scene.streams.rows]);
    for one in linear() {
        let part = CATALOGUE[one.effect].prediction(scene, one.values.as_slice());
        add_triad(&mut sensed, &part, 1.0);
    }
    for found in &catch.terms {
        let column = found.term.column(scene).ok()?;
        add(&mut sensed[found.term.axis], &column, found.size);
    }
    let from_sensing = body_from_sensing(&model.gyro.installation_rad);
    let one_less_scale = Vector3::from(model.gyro.scale_error.map(|scale| 1.0 - scale));
    let mut increments_rad = prepared.increments_rad.clone();
    for row in 0..scene.streams.rows {
        let part = Vector3::from_fn(|axis, _| one_less_scale[axis] * sensed[axis][row]);
        let part = from_sensing * part;
        for axis in 0..3 {
            increments_rad[axis][row] -= part[axis];
        }
    }
    let mut nearer = Record::new(
        scene,
        increments_rad,
        &from_sensing,
        &prepared.samples,
        lie.unwrap_or(&prepared.lie),
        prepared.declared.gyro_white_rad2,
    );
    // Moved so that a linear solution is the whole value, not the rest of it.
    let taken = nearer.push(sensed.each_ref().map(|values| Some(values.as_slice())));
    for (error, part) in nearer.error_rad.iter_mut().zip(taken) {
        *error += part;
    }
    Some(nearer)
}
