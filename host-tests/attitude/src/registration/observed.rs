//! Data of the registration: gyros, attitudes, and the stamps held out for validation.

use rlg_plan::{CataloguePlan, Plan};
use std::path::Path;
use std::sync::Arc;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rlg_model::{DeclaredModel, EffectValue, Model};
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_signal::attitude_samples::{SlowSample, slow_samples};
use rlg_signal::axes::Triad;
use rlg_signal::fault::Fault;
use rlg_signal::own_lines::OwnLine;
use rlg_signal::own_motion::take_own_motion;
use rlg_signal::qualify;
use rlg_signal::residual::body_from_sensing;
use rlg_signal::streams::Streams;

use crate::gyros::channels;
use crate::gyros::gyro_times::{self, Late};
use crate::gyros::physics::Gyro;
use crate::gyros::zeroing::{self, Zeroed};
use crate::likelihood::noise::declared_walk_rad_sqrt_s;
use crate::reference::failures;
use crate::reference::repeated_samples;
use crate::reference::vertical;
use crate::registration::gauss_newton::Records;
use crate::registration::settling::{self, Settling};
use crate::rows::alignment::Alignment;
use crate::rows::conditioned;
use crate::rows::dither::Dither;
use crate::rows::gyro_motion::Reads;
use crate::rows::increments::Stamps;
use crate::rows::linearised_rows::{About, Gyros};

/// A recording prepared for the registration.
pub(crate) struct Observed<'a> {
    pub(crate) recording: &'a Recording,
    pub(crate) model: &'a Model,
    /// File of the model, for messages.
    model_file: &'a Path,
    pub(crate) streams: Streams,
    pub(crate) faults: Vec<Fault>,
    pub(crate) samples: Vec<SlowSample>,
    /// Stamps held out for validation.
    pub(crate) tested: Vec<bool>,
    /// Flags of held-out stamps, and of faults and jumps listed in the model.
    pub(crate) known: Stamps,
    /// Flags of `known`, with frozen attitudes and failed stretches left out.
    pub(crate) stamps: Stamps,
    /// The attitudes are too few for an estimate of their noise.
    pub(crate) is_few: bool,
    pub(crate) gyros: Gyros,
    /// Map from the motion of `gyros` to the gyros as recorded, where a channel is reversed, exchanged or in another unit.
    pub(crate) recorded_from_case: Matrix3<f64>,
    /// Settling of the reference that was removed beyond that of the model.
    pub(crate) settling: Option<Settling>,
    /// High passes that were undone on the gyros beyond those of the model.
    pub(crate) zeroed: Zeroed,
    /// True once the model's effects are subtracted from them.
    pub(crate) is_without_known: bool,
    /// Delays of single gyros by which their rows were moved beyond those of the model.
    pub(crate) late: Late,
    /// Lines that were taken out of them.
    pub(crate) lines: Vec<OwnLine>,
    /// Lines of the motion, of the forces, and those taken out \[Hz\].
    pub(crate) occupied_hz: Vec<f64>,
    /// First bin of the spectrum in which they are known, and half width about each \[bins\].
    pub(crate) line_bins: [usize; 2],
    /// Thresholds of the effects.
    pub(crate) catalogue: CataloguePlan,
}

impl Observed<'_> {
    /// Forms rows about an alignment; `None` if fewer than two stamps lie within the gyros' record.
    pub(crate) fn about(&self, alignment: &Alignment) -> Option<About> {
        About::new(&self.gyros, &self.samples, &self.stamps, alignment)
    }

    /// Flags held-out stamps, known faults, frozen attitudes and failed stretches.
    fn flag_stamps(&mut self, plan: &Plan) {
        let samples = &self.samples;
        let held_out = if self.is_few {
            0.0
        } else {
            plan.attitude.tested_share
        };
        let fitted = samples.len() - (held_out * samples.len() as f64) as usize;
        (self.known, self.tested) = known_stamps(self.model, samples, fitted);
        self.stamps = self.known.clone();
        let [held, failed] =
            [repeated_samples::find, failures::find].map(|find| find(&self.gyros, samples));
        for stamp in (0..samples.len()).filter(|stamp| held[*stamp] || failed[*stamp]) {
            self.stamps.left_out[stamp] = true;
            self.tested[stamp] = false;
        }
    }

    /// Removes the settling of an attitude filter, whose fast beginning is no failed stretch.
    pub(crate) fn take_settling(&mut self, of_model: &Alignment, plan: &Plan) {
        self.settling = settling::find(
            &self.gyros,
            &self.samples,
            of_model,
            &plan.attitude.settling,
        );
        if let Some(found) = self.settling {
            found.undo(&mut self.samples);
            self.flag_stamps(plan);
        }
    }

    /// Samples without those known to be faulty; held-out ones are among them.
    pub(crate) fn sound_samples(&self) -> Vec<SlowSample> {
        let flags = self.stamps.left_out.iter().zip(&self.tested);
        let sound = self
            .samples
            .iter()
            .zip(flags.map(|(left_out, tested)| !left_out || *tested));
        sound
            .filter(|(_, is_sound)| *is_sound)
            .map(|(sample, _)| *sample)
            .collect()
    }

    /// Moves the rows of the gyros as recorded to when they were sensed.
    pub(crate) fn advance(&mut self, late_s: [f64; 3]) {
        let mut of_axis = [0.0; 3];
        let followed = channels::followed(&self.recorded_from_case);
        for (axis, late_s) in followed.into_iter().zip(late_s) {
            of_axis[axis] += late_s;
        }
        gyro_times::advance(&mut self.gyros, of_axis);
    }

    /// Data of a registration.
    pub(crate) fn records(&self) -> Records<'_> {
        Records {
            gyros: &self.gyros,
            samples: &self.samples,
            stamps: &self.stamps,
        }
    }

    /// Flags of gyro rows that are measured, lie between two fitted stamps and are not `doubtful`.
    pub(crate) fn fitted_rows(&self, doubtful: &[bool]) -> Vec<bool> {
        let (gyros, rows) = (&self.gyros, self.gyros.sensed_rad.len());
        let row_of = |time_s: f64| ((time_s - gyros.start_s) * gyros.rate_hz).max(0.0);
        let mut is_fitted = vec![false; rows];
        for (stamp, pair) in self.samples.windows(2).enumerate() {
            if !self.stamps.left_out[stamp] && !self.stamps.left_out[stamp + 1] {
                let last = (row_of(pair[1].time_s).ceil() as usize).min(rows);
                is_fitted[(row_of(pair[0].time_s) as usize).min(last)..last].fill(true);
            }
        }
        let flags = self.streams.usable.iter().zip(doubtful);
        let each = is_fitted.iter().zip(flags);
        each.map(|(fitted, (usable, doubtful))| *fitted && *usable && !doubtful)
            .collect()
    }

    /// Returns the gyros' signals, for columns about given rows.
    ///
    /// # Errors
    /// The model's installation matrix has no inverse.
    pub(crate) fn gyro(&self, about: &About) -> Result<Gyro, InputError> {
        let off_vertical = vertical::off_vertical(&self.samples, &self.streams);
        let motion = (Arc::clone(&about.conditioned_rad), off_vertical.as_ref());
        let map = &self.recorded_from_case;
        let gyro = Gyro::recorded(&self.streams, self.model, motion, map, &self.catalogue);
        gyro.ok_or_else(|| no_inverse(self.model_file))
    }

    /// Subtracts known effects from the sensed increments \[rad\]; true if there are any.
    pub(crate) fn take_out(&mut self, known_rad: &Triad) -> bool {
        for (row, sensed) in self.gyros.sensed_rad.iter_mut().enumerate() {
            *sensed -= Vector3::from_fn(|axis, _| known_rad[axis][row]);
        }
        known_rad.iter().flatten().any(|value| *value != 0.0)
    }
}

fn no_inverse(model_file: &Path) -> InputError {
    InputError::new(model_file, "the installation matrix has no inverse")
        .channel("gyro.installation_rad")
}

/// Prepares a recording; `None` for fewer than two attitudes.
pub(crate) fn observe<'a>(
    recording: &'a Recording,
    of: DeclaredModel<'a>,
    plan: &Plan,
) -> Result<Option<Observed<'a>>, InputError> {
    let DeclaredModel { model, file } = of;
    let mut samples = slow_samples(recording, &plan.signal.attitude_samples)?;
    let is_few = samples.len() < plan.attitude.least_stamps;
    if samples.len() < 2 {
        return Ok(None);
    }
    let mut streams = Streams::align_without_reference(recording, model, &plan.signal.align)?;
    let from_sensing = body_from_sensing(&model.gyro.installation_rad);
    if from_sensing.try_inverse().is_none() {
        return Err(no_inverse(file));
    }
    let spikes = gyro_spikes(&mut streams, &samples, plan);
    take_own_motion(&mut streams, model, &from_sensing);
    let mut faults = qualify::qualify(&mut streams, &plan.signal.faults);
    faults.extend(spikes);
    let faults = faults
        .into_iter()
        .filter(|fault| !qualify::is_known(fault, &streams, &model.effects))
        .collect();
    let case = std::mem::take(&mut streams.case_rad);
    let sensed_rad: Vec<Vector3<f64>> = (0..streams.rows)
        .map(|row| Vector3::from_fn(|axis, _| case[axis][row]))
        .collect();
    let mut lost_before = Vec::with_capacity(streams.rows + 1);
    lost_before.push(0);
    for usable in &streams.usable {
        let before = lost_before[lost_before.len() - 1];
        lost_before.push(before + usize::from(!usable));
    }
    let white_noise_rad2 = |axis: usize| {
        let values: Vec<f64> = sensed_rad.iter().map(|row| row[axis]).collect();
        conditioned::white_noise_rad2(&values, &plan.attitude.conditioning)
    };
    let mut gyros = Gyros {
        start_s: streams.start_s,
        rate_hz: streams.rate_hz,
        white_noise_rad2: [0, 1, 2].map(white_noise_rad2),
        sensed_rad,
        lost_before,
        reads: Reads::of(&samples),
        plan: plan.attitude,
        declared_walk_rad_sqrt_s: declared_walk_rad_sqrt_s(model),
        dither: Dither::new(&streams, model).map(Arc::new),
    };
    let map = channels::map(&model.effects);
    channels::apply_map(&map, &mut samples, &mut gyros.sensed_rad);
    if let Some(known) = Settling::of_model(model) {
        known.undo(&mut samples);
    }
    let mut observed = Observed {
        recording,
        model,
        model_file: file,
        streams,
        faults,
        tested: Vec::new(),
        known: Stamps::without(&[]),
        stamps: Stamps::without(&[]),
        samples,
        is_few,
        gyros,
        recorded_from_case: channels::on_gyros(&map),
        settling: None,
        zeroed: [None; 3],
        late: Late::default(),
        is_without_known: false,
        lines: Vec::new(),
        occupied_hz: Vec::new(),
        line_bins: [plan.signal.own_lines.first, plan.signal.own_lines.about],
        catalogue: plan.catalogue,
    };
    observed.flag_stamps(plan);
    zeroing::undo(&mut observed.gyros, zeroing::of_model(model));
    observed.advance(gyro_times::of_model(model));
    Ok(Some(observed))
}

/// Finds single rows of the gyros beyond their neighbours in which the attitude did not turn, and masks them.
fn gyro_spikes(streams: &mut Streams, samples: &[SlowSample], plan: &Plan) -> Vec<Fault> {
    let is_motion = |streams: &Streams, axis: usize, row: usize, excess_rad: f64| {
        let (start_s, rate_hz) = (streams.start_s, streams.rate_hz);
        let sensed_rad = &streams.sensed_rad;
        // Late attitudes turn within some more rows.
        let reach_s = plan.attitude.reference_faults.joined_s;
        let [begin_s, end_s] = [row, row + 1].map(|row| start_s + row as f64 / rate_hz);
        let from = samples.partition_point(|one| one.time_s <= begin_s - reach_s);
        let to = samples.partition_point(|one| one.time_s < end_s + reach_s);
        let (Some(before), Some(after)) = (from.checked_sub(1), samples.get(to)) else {
            return true;
        };
        let before = &samples[before];
        let row_of = |time_s: f64| ((time_s - start_s) * rate_hz).round().max(0.0) as usize;
        let rows = row_of(before.time_s)..row_of(after.time_s).min(sensed_rad[0].len());
        let turned_rad = before.shown.turn_to(&after.shown);
        // The rotation left between both, less an excess of the row.
        let apart_rad = |excess_rad: f64| {
            let of_row = |one: usize| {
                let mut turn = Vector3::from_fn(|axis, _| sensed_rad[axis][one]);
                turn[axis] -= if one == row { excess_rad } else { 0.0 };
                UnitQuaternion::from_scaled_axis(turn)
            };
            let own = rows.clone().map(of_row);
            let own = own.fold(UnitQuaternion::identity(), |turned, turn| turned * turn);
            own.angle_to(&UnitQuaternion::from_scaled_axis(turned_rad))
        };
        // A difference above half of the excess decides for neither.
        apart_rad(excess_rad) >= 0.5 * excess_rad.abs()
    };
    qualify::spikes_beside(streams, &plan.signal.faults, is_motion)
}

/// Flags the stamps by the model's known faults, and those held out for validation, from `fitted` on.
fn known_stamps(model: &Model, samples: &[SlowSample], fitted: usize) -> (Stamps, Vec<bool>) {
    let masked = known_faults(model);
    let mut known = Stamps::without(&vec![false; samples.len()]);
    let mut tested = vec![false; samples.len()];
    for (stamp, sample) in samples.iter().enumerate() {
        let is_within = |span: &[f64; 2]| span[0] <= sample.time_s && sample.time_s <= span[1];
        let is_known = masked.iter().any(is_within);
        tested[stamp] = stamp >= fitted && !is_known;
        known.left_out[stamp] = tested[stamp] || is_known;
        known.jumped[stamp] = sample.after_gap;
    }
    let effects = model.effects.iter();
    for effect in effects.filter(|one| one.kind == "reference_jump") {
        let time_s = effect.number("time_s") - AT_ONCE_S;
        if let Some(stamp) = samples.iter().position(|sample| sample.time_s >= time_s) {
            known.jumped[stamp] = true;
        }
    }
    (known, tested)
}

/// Tolerance of the time of a spike or jump \[s\].
const AT_ONCE_S: f64 = 1e-6;

/// Spans without a usable reference, as listed in the model \[s\].
fn known_faults(model: &Model) -> Vec<[f64; 2]> {
    let of_kind = |kind: &str| matches!(kind, "reference_dropout" | "reference_spike");
    let faults = model.effects.iter().filter(|effect| of_kind(&effect.kind));
    faults
        .filter_map(|effect| {
            let number = |name: &str| match effect.parameters.get(name) {
                Some(EffectValue::Number(value)) => Some(*value),
                _ => None,
            };
            match number("time_s") {
                Some(time_s) => Some([time_s - AT_ONCE_S, time_s + AT_ONCE_S]),
                None => Some([number("start_s")? - AT_ONCE_S, number("end_s")? + AT_ONCE_S]),
            }
        })
        .collect()
}
