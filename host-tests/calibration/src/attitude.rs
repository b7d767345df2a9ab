//! Information of a recording with attitude samples: the method of Cheng 2023, attitude before and after (Eqs. 10–17, with
//! the signs of physics §2).
//!
//! The recording has gyros at their rate and `reference_attitude` at any rate, down to one sample before and one after the
//! coning. The result is [`RecordInformation`], as with the rate reference.
//!
//! The gyro increments, compensated by Eq. (7) and by the current estimate, are integrated to an attitude C (body to
//! navigation frame; integration.rs). Its error e = Log(C C_refᵀ) \[rad, navigation frame\] grows between samples by ∫ C(t)
//! δω(t) dt, linear in every unknown: δω is the catalogue's column through the matrix of Eq. (7). No small-angle expansion
//! of the motion is used, so spins and cones are treated alike; Eq. (17) is the mean of the K columns over whole turns of a
//! small cone, which is sensitive to the sum K_ij + K_ik alone.
//!
//! Noise of the steps of e: angle random walk of gyros and reference over the step, and white angle noise at either end,
//! shared with the neighbouring step; if the body rotates by Δθ a row, Δθ times the gyros' white noise adds to the walk.
//! The covariance is block tridiagonal and is whitened by a block Cholesky recursion.
//!
//! Assumes that the model states the gyros' random walk; if the reference does not contain the Earth's rotation, that its
//! frame rotates with the Earth at a constant rate, which is estimated. Out of scope: gaps (steps across one are left out),
//! lever arms, a travelling frame.

use std::path::Path;

use nalgebra::{DVector, Matrix3, Vector3};
use rayon::prelude::*;
use rlg_catalogue::entries::LOCK_IN;
use rlg_catalogue::signals::Inputs;
use rlg_catalogue::{Signals, entries};
use rlg_inference::{Information, NoiseBasis, NoiseLevels, Observations};
use rlg_model::{DeclaredModel, Model};
use rlg_plan::Plan;
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_signal::attitude_samples::attitude_samples;
use rlg_signal::axes::{Triad, add_triad, each_axis};
use rlg_signal::own_motion::take_own_motion;
use rlg_signal::qualify;
use rlg_signal::residual::body_from_sensing;
use rlg_signal::shrinkage::{Powers, shrink};
use rlg_signal::streams::Streams;

use super::columns::{DesignColumns, known_rad};
use super::integration::{Chain, Sample, StepNoise, chains};
use super::noise::{of_gyros, of_reference};
use super::record::{RecordInformation, greatest, too_short};
use super::unknowns::{EARTH, RIVAL, Unknowns, names};
use super::whiten::Whitener;

/// Prepared recording, to be linearised at any estimate.
pub struct AttitudeRecord {
    streams: Streams,
    signals: Signals,
    columns: DesignColumns,
    samples: Vec<Sample>,
    /// Case axes from sensing axes, scale errors removed.
    case_from_sensed: Matrix3<f64>,
    noise: StepNoise,
    /// Known effects of the model on each gyro \[rad by row\].
    known_rad: Triad,
    /// The navigation frame rotates with the Earth at an unknown rate.
    earth: bool,
}

impl AttitudeRecord {
    /// Prepares `recording`; `model` must not contain flexure.
    pub fn new(
        recording: &Recording,
        DeclaredModel { model, file }: DeclaredModel<'_>,
        plan: &Plan,
    ) -> Result<Self, InputError> {
        expect_linear(model, file)?;
        let read = attitude_samples(recording, &plan.signal.attitude_samples)?;
        let noise = declared_noise(model, file)?;
        let body_from_sensing = body_from_sensing(&model.gyro.installation_rad);
        let sensing_from_body = body_from_sensing.try_inverse().ok_or_else(|| {
            InputError::new(file, "the installation matrix has no inverse")
                .channel("gyro.installation_rad")
        })?;
        let mut streams = Streams::align_without_reference(recording, model, &plan.signal.align)?;
        take_own_motion(&mut streams, model, &body_from_sensing);
        qualify::qualify(&mut streams, &plan.signal.faults);
        if read.len() < 2 {
            return Err(too_short(recording, 0.0, &plan.calibration));
        }
        let place = |time_s: f64| (time_s - streams.start_s) * streams.rate_hz;
        let samples = read
            .iter()
            .map(|sample| Sample {
                place: place(sample.time_s),
                navigation_from_body: sample.navigation_from_body,
            })
            .filter(|sample| (0.0..=streams.rows as f64).contains(&sample.place))
            .collect();
        let scale_error = model.gyro.scale_error;
        let signals = signals(&streams, &noise, scale_error, sensing_from_body, plan);
        let mut kinds = Unknowns::fitted_kinds(false);
        kinds.push(RIVAL);
        Ok(Self {
            columns: DesignColumns::new(&signals, &kinds),
            known_rad: known_rad(model, &signals),
            case_from_sensed: body_from_sensing
                * Matrix3::from_diagonal(&Vector3::from(scale_error.map(|scale| 1.0 - scale))),
            streams,
            signals,
            samples,
            noise,
            earth: !model.earth_rate_in_reference,
        })
    }

    /// Information of the recording, linearised at the unknowns `at`.
    pub fn information(&self, at: &[f64]) -> RecordInformation {
        let chains = self.integrate(at);
        let whiteners: Vec<Whitener> = chains.iter().map(Chain::whitener).collect();
        let whitened = |of_chain: &(dyn Fn(&Chain) -> Vec<Vector3<f64>> + Sync)| {
            let pairs = chains.iter().zip(&whiteners);
            let each = pairs.flat_map(|(chain, whitener)| whitener.whiten(&of_chain(chain)));
            let values: Vec<f64> = each.flat_map(|step| [step.x, step.y, step.z]).collect();
            DVector::from_vec(values)
        };
        let count = Unknowns::of(1).count();
        let mut columns: Vec<(usize, DVector<f64>)> = (0..count)
            .into_par_iter()
            .filter_map(|parameter| {
                let unit = self.columns.unit_rad(&self.signals, parameter)?;
                let of_row = |row: usize| {
                    let sensed =
                        [0, 1, 2].map(|gyro| unit[gyro].as_ref().map_or(0.0, |one| one[row]));
                    self.case_from_sensed * Vector3::from(sensed)
                };
                Some((parameter, whitened(&|chain: &Chain| chain.carried(of_row))))
            })
            .collect();
        let period_s = self.signals.period_s();
        for (axis, parameter) in self.earth_parameters().into_iter().enumerate() {
            let turn = |rows: f64| Vector3::ith(axis, rows * period_s);
            let column = whitened(&|chain: &Chain| chain.lengths().map(turn).collect());
            columns.push((parameter, column));
        }
        let growth = whitened(&|chain: &Chain| chain.growth());
        let mut information = Information::none(count);
        information.power = growth.norm_squared();
        for (a, column) in &columns {
            information.score[*a] = column.dot(&growth);
            for (b, other) in &columns {
                information.fisher[(*a, *b)] = column.dot(other);
            }
        }
        RecordInformation {
            information: about(information, at),
            levels: self.levels(),
            seconds: chains.iter().map(Chain::rows).sum::<usize>() as f64 * period_s,
            degrees: 3.0 * chains.iter().map(Chain::steps).sum::<usize>() as f64,
            rate_hz: self.streams.rate_hz,
            acceleration_rad_s2: greatest(&self.signals.independent),
        }
    }

    /// Integrates the gyro increments, less the effects of the model and of the present estimate, and compares them with
    /// every attitude sample.
    fn integrate(&self, at: &[f64]) -> Vec<Chain> {
        let mut sensed = self.columns.sensed_rad(&self.signals, at);
        add_triad(&mut sensed, &self.known_rad, 1.0);
        let mut increments = self.streams.case_rad.clone();
        for row in 0..self.streams.rows {
            let part = self.case_from_sensed * Vector3::from_fn(|gyro, _| sensed[gyro][row]);
            for (axis, increments) in increments.iter_mut().enumerate() {
                increments[row] -= part[axis];
            }
        }
        let mut earth_rad_s = Vector3::zeros();
        for (axis, parameter) in self.earth_parameters().into_iter().enumerate() {
            earth_rad_s[axis] = at[parameter];
        }
        chains(
            &increments,
            &self.streams.usable,
            self.signals.period_s(),
            &self.samples,
            &self.noise,
            &earth_rad_s,
        )
    }

    /// Places of the Earth's rate among the unknowns; empty if the reference contains it.
    fn earth_parameters(&self) -> Vec<usize> {
        let unknowns = Unknowns::of(1);
        let names = names(EARTH).iter().filter(|_| self.earth);
        names
            .filter_map(|name| unknowns.place(EARTH, name))
            .collect()
    }

    /// Noise of gyros and reference a row \[rad²\].
    fn levels(&self) -> [NoiseLevels; 3] {
        let rate_hz = self.streams.rate_hz;
        let reference = self.noise.reference.levels(rate_hz);
        self.noise.gyros.map(|gyro| {
            let own = gyro.levels(rate_hz);
            NoiseLevels {
                white: own.white + reference.white,
                angle: own.angle + reference.angle,
                ..own
            }
        })
    }
}

/// Shifts information on θ − θ₀ so that its solution is θ.
fn about(mut information: Information, at: &[f64]) -> Information {
    let at = DVector::from_column_slice(at);
    let pull = &information.fisher * &at;
    information.power += 2.0 * at.dot(&information.score) + at.dot(&pull);
    information.score += pull;
    information
}

/// Noise declared by the model: attitude samples cannot show that of the gyros.
fn declared_noise(model: &Model, model_file: &Path) -> Result<StepNoise, InputError> {
    let Some(gyros) = of_gyros(model) else {
        return Err(InputError::new(
            model_file,
            "does not state the gyros' random walk, which attitude samples cannot show",
        )
        .channel("gyro.angle_random_walk_rad_sqrt_s")
        .expected("three numbers in rad/sqrt(s)"));
    };
    let walks = model.gyro.angle_random_walk_rad_sqrt_s;
    if walks.is_some_and(|walks| walks.iter().any(|walk| *walk <= 0.0)) {
        return Err(
            InputError::new(model_file, "leaves an attitude without any noise")
                .channel("gyro.angle_random_walk_rad_sqrt_s")
                .expected("positive numbers"),
        );
    }
    Ok(StepNoise {
        gyros,
        reference: of_reference(model),
    })
}

/// Regressors of the columns: the gyros' motion where it exceeds their noise, since products of noise would cause a drift.
fn signals(
    streams: &Streams,
    noise: &StepNoise,
    scale_error: [f64; 3],
    sensing_from_body: Matrix3<f64>,
    plan: &Plan,
) -> Signals {
    let rate_hz = streams.rate_hz;
    let all = vec![true; streams.rows];
    let basis = NoiseBasis::new(&Observations::separate(&all, 1));
    let levels = noise.gyros.map(|gyro| gyro.levels(rate_hz));
    let none = vec![0.0; streams.rows];
    let case_rad: Triad = each_axis(|axis| {
        let own = basis.by_coefficient(levels[axis]);
        let powers = Powers {
            left: &own,
            expected: &own,
            before: &own,
            // An attitude sums the noise of many rows; the motion of one row has a negligible part of it.
            uncertain: &none,
            residual: &own,
        };
        let case_rad = &streams.case_rad[axis];
        shrink(case_rad, &powers, &all, rate_hz, &plan.signal.gate).values
    });
    let inputs = Inputs {
        others: &[],
        ..Inputs::of(streams)
    };
    let motion = (case_rad, streams.dither_rad());
    Signals::of_known(
        motion,
        inputs,
        rate_hz,
        scale_error,
        sensing_from_body,
        &plan.catalogue,
    )
}

/// Checks that every effect of the model can be corrected in attitudes: it is linear, or adds nothing to the gyros.
fn expect_linear(model: &Model, model_file: &Path) -> Result<(), InputError> {
    // Dither turns lock-in into noise.
    let is_noise = |kind: &str| kind == LOCK_IN && model.dither.is_some();
    let is_linear = |kind: &str| entries::card(kind).is_none() || entries::find(kind).is_some();
    let mut kinds = model.effects.iter().map(|effect| &effect.kind);
    match kinds.find(|kind| !is_linear(kind) && !is_noise(kind)) {
        None => Ok(()),
        Some(kind) => Err(InputError::new(
            model_file,
            "this version cannot predict the effect against attitudes",
        )
        .channel(kind.clone())
        .expected("a reference on the gyros' rows, or a model without it")),
    }
}
