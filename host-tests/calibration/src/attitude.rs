//! Extracts the information of a recording with attitude samples: the paper's way, attitude before and after (Eqs.
//! 10–17, with the signs of physics §2).
//!
//! The recording has gyros at their rate and `reference_attitude` at any rate, down to one sample before and one after
//! the coning. It gives [`RecordingInformation`], as the rate reference does.
//!
//! The gyros' own increments, compensated by Eq. (7) and by the estimate so far, are integrated to an attitude
//! C (body to navigation frame). Its error e = Log(C C_refᵀ) \[rad, navigation frame\] grows between samples by
//! ∫ C(t) δω(t) dt, linear in every unknown: δω is the column that the hypothesis gives, seen through the matrix
//! of Eq. (7). No small-angle expansion of the motion enters, so spins and cones are treated alike; Eq. (17) is
//! the mean of the K columns over whole turns of a small cone, which leaves the sum K_ij + K_ik.
//!
//! Noise of the steps of e: random walk of gyros and reference over the step, and white noise of angle at
//! either end, shared with the neighbouring step; where the body turns by Δθ a row, Δθ times the gyros' white
//! noise walks too. Its covariance is block tridiagonal and is whitened by a block
//! Cholesky recursion.
//!
//! Assumes gyros whose random walk the model states; where the reference does not contain the Earth's rotation,
//! that its frame turns with the Earth at a constant rate, which is estimated. Out of scope: gaps
//! (steps across one are left out), lever arms, a frame that travels.

use std::path::Path;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::rates::{RecordingInformation, greatest, too_short};
use super::unknowns::{EARTH, RIVAL, Unknowns, effect};
use super::whiten::Whitener;
use rlg_diagnosis::noise_spectrum::Noise;
use rlg_model::Model;
use rlg_older::hypotheses::CATALOGUE;
use rlg_older::information::Information;
use rlg_older::own_noise;
use rlg_older::scene::Scene;
use rlg_older::workbench::Parameters;
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use rlg_signal::attitude_samples::{AttitudeSample, attitude_samples};
use rlg_signal::own_motion::take_own_motion;
use rlg_signal::qualify;
use rlg_signal::residual::body_from_sensing;
use rlg_signal::streams::Streams;

/// A recording prepared to be linearised at any estimate.
pub struct AttitudeRecord {
    scene: Scene,
    samples: Vec<AttitudeSample>,
    body_from_sensing: Matrix3<f64>,
    scale_error: [f64; 3],
    walk_rad2_s: [f64; 3],
    reference_walk_rad2_s: f64,
    white_rad2: [f64; 3],
    reference_white_rad2: f64,
    effects: Vec<usize>,
    earth: bool,
}

/// One step between two attitude samples.
struct Step {
    /// Growth of the attitude error \[rad\].
    growth: Vector3<f64>,
    /// Random walk over the step \[rad²\].
    walk: Matrix3<f64>,
    /// White noise at its end \[rad²\].
    end: Matrix3<f64>,
}

/// Steps without a gap between them, with the rows they cover.
struct Chain {
    steps: Vec<Step>,
    /// White noise at the beginning \[rad²\].
    begin: Matrix3<f64>,
    /// Where each step begins and ends, in rows and fractions of rows.
    bounds: Vec<f64>,
    /// Attitude at the middle of each row from `first_row` on.
    attitude: Vec<UnitQuaternion<f64>>,
    first_row: usize,
}

impl AttitudeRecord {
    /// Prepares `recording`; `model` must not contain flexure.
    pub fn new(
        recording: &Recording,
        model: &Model,
        model_file: &Path,
    ) -> Result<Self, InputError> {
        let samples = attitude_samples(recording)?;
        let Some(walk) = model.gyro.angle_random_walk_rad_sqrt_s else {
            return Err(InputError::new(
                model_file,
                "does not state the gyros' random walk, which attitude samples cannot show",
            )
            .channel("gyro.angle_random_walk_rad_sqrt_s")
            .expected("three numbers in rad/sqrt(s)"));
        };
        if walk.iter().any(|walk| *walk <= 0.0) {
            return Err(
                InputError::new(model_file, "leaves an attitude without any noise")
                    .channel("gyro.angle_random_walk_rad_sqrt_s")
                    .expected("positive numbers"),
            );
        }
        let body_from_sensing = body_from_sensing(&model.gyro.installation_rad);
        let mut streams = Streams::align_without_reference(recording, model)?;
        take_own_motion(&mut streams, model, &body_from_sensing);
        qualify::qualify(&mut streams);
        if samples.len() < 2 {
            return Err(too_short(recording, 0.0));
        }
        let white_rad2 = [0, 1, 2].map(|axis: usize| {
            model.gyro.pulse_weight_rad[axis].powi(2) / 12.0 + model.pickoff_white_rad2(axis)
        });
        let own_noise_rad = white_rad2
            .iter()
            .fold(0.0, |most: f64, v| most.max(*v))
            .sqrt();
        let scene = Scene::new(
            streams,
            Some(own_noise(model, own_noise_rad)),
            model.gyro.scale_error,
        );
        let earth = !model.earth_rate_in_reference;
        let mut effects = Unknowns::nuisances_and_flexure(false);
        effects.push(effect(RIVAL));
        effects.retain(|&effect| CATALOGUE[effect].missing(&scene).is_none());
        let reference = model.reference.as_ref();
        Ok(Self {
            scene,
            samples,
            body_from_sensing,
            scale_error: model.gyro.scale_error,
            walk_rad2_s: walk.map(|walk| walk * walk),
            reference_walk_rad2_s: reference
                .and_then(|r| r.angle_random_walk_rad_sqrt_s)
                .map_or(0.0, |walk| walk * walk),
            white_rad2,
            reference_white_rad2: reference
                .and_then(|r| r.angle_noise_rad)
                .map_or(0.0, |noise| noise * noise),
            effects,
            earth,
        })
    }

    /// The information of the recording, linearised where the catalogue's parameters have the values `at`.
    pub fn information(&self, catalogue: &Parameters, at: &[f64]) -> RecordingInformation {
        let chains = self.integrate(catalogue, at);
        let mut information = Information::empty(catalogue.count());
        let earth_columns = if self.earth {
            catalogue.of(effect(EARTH))
        } else {
            0..0
        };
        let (mut seconds, mut degrees) = (0.0, 0.0);
        for chain in &chains {
            let whitener = Whitener::new(
                &chain.begin,
                chain.steps.iter().map(|step| (step.walk, step.end)),
            );
            let mut columns: Vec<(usize, Vec<Vector3<f64>>)> = self
                .effects
                .par_iter()
                .flat_map_iter(|&effect| catalogue.of(effect).map(move |index| (effect, index)))
                .map(|(effect, index)| {
                    let parameter = index - catalogue.of(effect).start;
                    (index, self.column(chain, effect, parameter))
                })
                .collect();
            for (axis, index) in earth_columns.clone().enumerate() {
                let column = chain
                    .bounds
                    .windows(2)
                    .map(|pair| {
                        let mut turn = Vector3::zeros();
                        turn[axis] = (pair[1] - pair[0]) * self.scene.period_s();
                        turn
                    })
                    .collect();
                columns.push((index, column));
            }
            let growth: Vec<Vector3<f64>> = chain.steps.iter().map(|step| step.growth).collect();
            let growth = whitener.whiten(&growth);
            let columns: Vec<(usize, Vec<Vector3<f64>>)> = columns
                .into_iter()
                .map(|(index, column)| (index, whitener.whiten(&column)))
                .collect();
            let dot = |a: &[Vector3<f64>], b: &[Vector3<f64>]| -> f64 {
                a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
            };
            information.power += dot(&growth, &growth);
            for (a, column) in &columns {
                information.right[*a] += dot(column, &growth);
                for (b, other) in &columns {
                    information.fisher[(*a, *b)] += dot(column, other);
                }
            }
            seconds += chain.attitude.len() as f64 * self.scene.period_s();
            degrees += 3.0 * chain.steps.len() as f64;
        }
        // Linear in θ − θ₀: shifted so that a solution is θ itself.
        let at = nalgebra::DVector::from_column_slice(at);
        let pull = &information.fisher * &at;
        information.power += 2.0 * at.dot(&information.right) + at.dot(&pull);
        information.right += pull;
        let rate_hz = self.scene.streams.rate_hz;
        RecordingInformation {
            information,
            noise: [0, 1, 2].map(|axis: usize| Noise {
                theta: [
                    (self.walk_rad2_s[axis] + self.reference_walk_rad2_s) / rate_hz,
                    self.white_rad2[axis] + self.reference_white_rad2,
                    0.0,
                    0.0,
                ],
                rate_hz,
            }),
            seconds,
            degrees,
            rate_hz,
            acceleration_rad_s2: [0, 1, 2].map(|axis: usize| greatest(&self.scene, axis)),
        }
    }

    /// Case increments of a row minus the effects of the present estimate, in the body frame.
    fn corrected(&self, catalogue: &Parameters, at: &[f64]) -> [Vec<f64>; 3] {
        let mut increments = self.scene.streams.case_rad.clone();
        for &effect in &self.effects {
            let values = &at[catalogue.of(effect)];
            if values.iter().all(|value| *value == 0.0) {
                continue;
            }
            let sensed = CATALOGUE[effect].prediction(&self.scene, values);
            for row in 0..self.scene.streams.rows {
                let part = self.case_from_sensed([0, 1, 2].map(|axis| sensed[axis][row]));
                for axis in 0..3 {
                    increments[axis][row] -= part[axis];
                }
            }
        }
        increments
    }

    /// The error of the case's increments that an error of the sensed ones causes, Eq. (7).
    fn case_from_sensed(&self, sensed: [f64; 3]) -> Vector3<f64> {
        self.body_from_sensing
            * Vector3::from_fn(|axis, _| (1.0 - self.scale_error[axis]) * sensed[axis])
    }

    /// Integrates the gyros and compares with every attitude sample.
    fn integrate(&self, catalogue: &Parameters, at: &[f64]) -> Vec<Chain> {
        let increments = self.corrected(catalogue, at);
        let streams = &self.scene.streams;
        let earth_rad_s = if self.earth {
            Vector3::from_column_slice(&at[catalogue.of(effect(EARTH))])
        } else {
            Vector3::zeros()
        };
        let place = |sample: &AttitudeSample| (sample.time_s - streams.start_s) * streams.rate_hz;
        let inside: Vec<&AttitudeSample> = self
            .samples
            .iter()
            .filter(|sample| (0.0..=streams.rows as f64).contains(&place(sample)))
            .collect();
        let mut chains: Vec<Chain> = Vec::new();
        let mut open: Option<Integration> = None;
        for pair in inside.windows(2) {
            let (from, to) = (place(pair[0]), place(pair[1]));
            let rows = from.floor() as usize..(to.ceil() as usize).min(streams.rows);
            if streams.usable[rows].contains(&false) {
                chains.extend(open.take().map(|open| open.chain));
                continue;
            }
            let mut integration = open.take().unwrap_or_else(|| {
                let end = self.end_noise(&pair[0].navigation_from_body);
                Integration::new(from, pair[0].navigation_from_body, end)
            });
            let mut walk = Matrix3::zeros();
            let white = Matrix3::from_diagonal(&Vector3::from(self.white_rad2));
            let period_s = self.scene.period_s();
            integration.advance(&increments, to, |middle, turn, share| {
                let c = middle.to_rotation_matrix();
                let own = Matrix3::from_diagonal(&Vector3::from(self.walk_rad2_s)) * period_s;
                // White noise of angle does not telescope where the axes turn between readings.
                let cross = turn.cross_matrix();
                let turned = cross * white * cross.transpose();
                walk += c.matrix() * (own + turned) * c.matrix().transpose() * share;
            });
            let step_s = (to - from) * period_s;
            walk += Matrix3::identity() * (self.reference_walk_rad2_s * step_s);
            let since_s = (to - integration.chain.bounds[0]) * period_s;
            let turned = UnitQuaternion::from_scaled_axis(-earth_rad_s * since_s);
            let computed = turned * integration.now;
            let error = (computed * pair[1].navigation_from_body.inverse()).scaled_axis();
            let end = self.end_noise(&pair[1].navigation_from_body);
            integration.chain.steps.push(Step {
                growth: error - integration.error,
                walk,
                end,
            });
            integration.chain.bounds.push(to);
            integration.error = error;
            open = Some(integration);
        }
        chains.extend(open.map(|open| open.chain));
        chains
    }

    fn end_noise(&self, navigation_from_body: &UnitQuaternion<f64>) -> Matrix3<f64> {
        let c = navigation_from_body.to_rotation_matrix();
        let own = Matrix3::from_diagonal(&Vector3::from(self.white_rad2));
        c.matrix() * own * c.matrix().transpose() + Matrix3::identity() * self.reference_white_rad2
    }

    /// ∫ C · (column in the case's increments) over every step of a chain.
    fn column(&self, chain: &Chain, effect: usize, parameter: usize) -> Vec<Vector3<f64>> {
        let nothing = vec![0.0; CATALOGUE[effect].card().count()];
        let sensed: [Option<Vec<f64>>; 3] =
            [0, 1, 2].map(|axis| CATALOGUE[effect].column(&self.scene, &nothing, parameter, axis));
        let in_row = |row: usize| -> Vector3<f64> {
            let sensed =
                [0, 1, 2].map(|axis| sensed[axis].as_ref().map_or(0.0, |s: &Vec<f64>| s[row]));
            chain.attitude[row - chain.first_row] * self.case_from_sensed(sensed)
        };
        chain
            .bounds
            .windows(2)
            .map(|pair| {
                let mut sum = Vector3::zeros();
                for_rows(pair[0], pair[1], |row, share| sum += in_row(row) * share);
                sum
            })
            .collect()
    }
}

/// Calls `each` with every row between two places and the share of it that lies there.
fn for_rows(from: f64, to: f64, mut each: impl FnMut(usize, f64)) {
    /// Stamps are rounded: less than this share of a row is no row.
    const NOTHING: f64 = 1e-6;
    let mut row = from.floor() as usize;
    while (row as f64) < to - NOTHING {
        let share = to.min(row as f64 + 1.0) - from.max(row as f64);
        if share > NOTHING {
            each(row, share);
        }
        row += 1;
    }
}

/// A chain of steps under construction.
struct Integration {
    chain: Chain,
    now: UnitQuaternion<f64>,
    error: Vector3<f64>,
    before: Vector3<f64>,
}

impl Integration {
    fn new(from: f64, start: UnitQuaternion<f64>, begin: Matrix3<f64>) -> Self {
        Self {
            chain: Chain {
                steps: Vec::new(),
                begin,
                bounds: vec![from],
                attitude: Vec::new(),
                first_row: from.floor() as usize,
            },
            now: start,
            error: Vector3::zeros(),
            before: Vector3::zeros(),
        }
    }

    /// Integrates the attitude up to the place `to`; `each` is called with the attitude at each row's middle, the row's
    /// rotation and the share.
    fn advance(
        &mut self,
        increments: &[Vec<f64>; 3],
        to: f64,
        mut each: impl FnMut(&UnitQuaternion<f64>, &Vector3<f64>, f64),
    ) {
        let from = *self.chain.bounds.last().expect("a chain has a beginning");
        let (now, before, chain) = (&mut self.now, &mut self.before, &mut self.chain);
        for_rows(from, to, |row, share| {
            let turn = Vector3::from_fn(|axis, _| increments[axis][row]);
            // Coning within a row: the second-order term of two neighbouring increments.
            let vector = (turn + before.cross(&turn) / 12.0) * share;
            let middle = *now * UnitQuaternion::from_scaled_axis(vector * 0.5);
            *now *= UnitQuaternion::from_scaled_axis(vector);
            *before = turn;
            if chain.attitude.len() + chain.first_row == row {
                chain.attitude.push(middle);
            }
            each(&middle, &turn, share);
        });
    }
}
