//! The simulator: a dithered ring-laser triad on a moving case, with finer time than the recording.
//!
//! Enters: a [`Scenario`] and a seed. Leaves: a [`Recording`], the [`Model`] of it that admits only what
//! the scenario does not conceal, and the [`Truth`]. SI units, body frame.
//!
//! Data flow: motion in closed form (`motion`) → Earth and gravity (`attitude`) → rates that the tilted,
//! imperfect gyros sense (`effects`) → exact integrals over each period → dither (`dither`) → noise and
//! pulses (`instrument`).
//!
//! Equation, per period T: sensed increment of gyro i =
//! (∫ \[M⁻¹ω + effects\] dt + b T/(1 − s))_i /(1 − s_i) + block increment, M the matrix of Eq. (7) of the
//! paper with ε_ij0. (This is the contract's form; Eq. (7) gives the case back but for b s T, second order
//! in the errors.) The tilt −K α is computed from the true angular acceleration at four
//! Gauss–Legendre nodes a period, not from increments.
//!
//! Independent of the firmware core and of the f64 reference: it imports neither.
//!
//! Deliberately not here: lock-in, temperature, magnetic field, linear motion of the case, reaction of the
//! dithers on the case, faults of the data. The scenario reader refuses what is not here.

pub mod attitude;
pub mod dither;
pub mod effects;
mod entry;
pub mod instrument;
pub mod motion;
pub mod scenario;

use crate::error::InputError;
use crate::model::{self, EffectValue, Model, ModelEffect, MotionSource};
use crate::recording::{Channel, Clock, Quantity, Recording, Segment, Site, Table};
use attitude::{Attitude, Ground, Quadrature};
use dither::BlockDither;
use instrument::{AngleEncoder, PulseCounter, Stream, normal, stream};
use motion::{BodyMotion, SegmentMotion};
use nalgebra::{Matrix3, Vector3};
use scenario::Scenario;
use serde_json::json;
use std::path::{Path, PathBuf};

/// What the simulator concealed, for tests and scores; nothing else may read it.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The seed.
    pub seed: u64,
    /// The concealed effects.
    pub effects: Vec<ModelEffect>,
}

impl Truth {
    /// As JSON: `seed` and `effects`, each `kind` and `parameters`.
    pub fn to_json(&self) -> String {
        let effects: Vec<_> = self
            .effects
            .iter()
            .map(|effect| {
                let parameters: serde_json::Map<_, _> = effect
                    .parameters
                    .iter()
                    .map(|(name, value)| {
                        let value = match value {
                            EffectValue::Number(number) => json!(number),
                            EffectValue::Text(text) => json!(text),
                        };
                        (name.clone(), value)
                    })
                    .collect();
                json!({"kind": effect.kind, "parameters": parameters})
            })
            .collect();
        let mut text = format!("{:#}", json!({"seed": self.seed, "effects": effects}));
        text.push('\n');
        text
    }
}

/// A simulated recording and what is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// What the instruments stored.
    pub recording: Recording,
    /// What a simulation of it would start from.
    pub model: Model,
    /// What was concealed.
    pub truth: Truth,
    /// Exact increments of the case over each row, x y z \[rad\]: for tests.
    pub case_increments_rad: Vec<[f64; 3]>,
}

/// The scenario of [`demo_scenario`].
const DEMO_SCENARIO: &str = include_str!("../../scenarios/coning.toml");

/// The coning scenario that comes with the tool; it conceals the flexure of the blocks.
pub fn demo_scenario() -> Result<Scenario, InputError> {
    Scenario::parse(DEMO_SCENARIO, Path::new("scenarios/coning.toml"))
}

/// A run of [`demo_scenario`].
pub fn coning_demo(seed: u64) -> Result<Simulation, InputError> {
    Ok(simulate(&demo_scenario()?, seed, |_| {}))
}

/// Rows between two reports of progress: a few hundred reports a second of work.
const ROWS_PER_REPORT: usize = 4096;

/// Runs a scenario. `progress` is told the rows done. The same scenario and seed give the same values.
pub fn simulate(scenario: &Scenario, seed: u64, mut progress: impl FnMut(usize)) -> Simulation {
    let period_s = 1.0 / scenario.rate_hz;
    let quadrature = Quadrature::new();
    let mut case = Case::new(scenario);
    let mut triad = Triad::new(scenario, seed);
    let mut motion_rng = stream(seed, Stream::Motion, 0);
    let mut rows = Rows::new(scenario);
    let mut row = 0;
    for segment in &scenario.segments {
        let mut motion = SegmentMotion::new(
            &segment.profile,
            segment.rows,
            period_s,
            quadrature.nodes,
            &mut motion_rng,
        );
        for _ in 0..segment.rows {
            let period = case.period(&quadrature, &motion.next_period(), period_s);
            triad.read(row, &period, &mut rows);
            row += 1;
            if row % ROWS_PER_REPORT == 0 {
                progress(row);
            }
        }
    }
    progress(row);
    Simulation {
        model: model_of(scenario),
        truth: Truth {
            seed,
            effects: scenario.concealed_effects.clone(),
        },
        case_increments_rad: std::mem::take(&mut rows.case_increments_rad),
        recording: recording_of(scenario, rows),
    }
}

/// Integrals over one period, body frame.
struct Period {
    /// ∫ω \[rad\].
    case_rad: Vector3<f64>,
    /// ∫(M⁻¹ω + effects) \[rad\].
    sensed_rad: Vector3<f64>,
    /// Mean specific force \[m/s²\].
    force_m_s2: Vector3<f64>,
}

/// The case: its attitude and what its gyros are exposed to.
struct Case<'a> {
    scenario: &'a Scenario,
    ground: Ground,
    attitude: Attitude,
    gyro_from_body: Matrix3<f64>,
}

impl<'a> Case<'a> {
    fn new(scenario: &'a Scenario) -> Self {
        let eps = &scenario.gyro.installation_rad;
        let body_from_gyro = Matrix3::new(
            1.0, eps.xz, eps.xy, //
            eps.yz, 1.0, eps.yx, //
            eps.zy, eps.zx, 1.0,
        );
        Self {
            scenario,
            ground: scenario.site.map_or_else(Ground::default, |site| {
                Ground::at(site.latitude_rad, site.gravity_m_s2, site.earth_rate)
            }),
            attitude: Attitude::new(scenario.attitude_wxyz),
            // the scenario admits |ε| ≤ 0.1 only, where the matrix is diagonally dominant
            gyro_from_body: body_from_gyro
                .try_inverse()
                .expect("a diagonally dominant matrix has an inverse"),
        }
    }

    fn period(
        &mut self,
        quadrature: &Quadrature,
        motion: &[BodyMotion; 4],
        period_s: f64,
    ) -> Period {
        let relative = motion.map(|node| node.rate_rad_s);
        let seen = self
            .attitude
            .advance(quadrature, &relative, period_s, &self.ground);
        let mut rates = [Vector3::zeros(); 4];
        let mut sensed = [Vector3::zeros(); 4];
        let mut forces = [Vector3::zeros(); 4];
        for node in 0..4 {
            let earth = seen[node].earth_rate_rad_s;
            let turning = motion[node].rate_rad_s;
            let inertial = BodyMotion {
                rate_rad_s: turning + earth,
                // the Earth's rotation is fixed in space: seen from the body it turns the other way
                acceleration_rad_s2: motion[node].acceleration_rad_s2 - turning.cross(&earth),
                jerk_rad_s3: motion[node].jerk_rad_s3
                    - motion[node].acceleration_rad_s2.cross(&earth)
                    + turning.cross(&turning.cross(&earth)),
            };
            forces[node] = seen[node].specific_force_m_s2;
            rates[node] = inertial.rate_rad_s;
            sensed[node] = self.gyro_from_body * inertial.rate_rad_s
                + self.scenario.effects.sensed_rate(
                    &inertial,
                    &forces[node],
                    &-turning.cross(&forces[node]),
                );
        }
        Period {
            case_rad: quadrature.integrate(&rates, period_s),
            sensed_rad: quadrature.integrate(&sensed, period_s),
            force_m_s2: quadrature.integrate(&forces, 1.0),
        }
    }
}

/// The instruments of the triad and their states.
struct Triad<'a> {
    scenario: &'a Scenario,
    period_s: f64,
    counters: Vec<PulseCounter>,
    gyro_rngs: Vec<rand_chacha::ChaCha8Rng>,
    dithers: Vec<BlockDither>,
    pickoff_rngs: Vec<rand_chacha::ChaCha8Rng>,
    block_before_rad: [f64; 3],
    references: Vec<AngleEncoder>,
    accelerometer_rngs: Vec<rand_chacha::ChaCha8Rng>,
}

impl<'a> Triad<'a> {
    fn new(scenario: &'a Scenario, seed: u64) -> Self {
        let period_s = 1.0 / scenario.rate_hz;
        let duration_s = scenario.rows() as f64 * period_s;
        let streams = |kind| (0..3).map(move |axis| stream(seed, kind, axis));
        let mut gyro_rngs: Vec<_> = streams(Stream::Gyro).collect();
        let counters = gyro_rngs
            .iter_mut()
            .zip(scenario.gyro.pulse_weight_rad)
            .map(|(rng, weight_rad)| PulseCounter::new(weight_rad, rng))
            .collect();
        let dithers = scenario.dither.iter().flat_map(|dither| {
            streams(Stream::Dither)
                .enumerate()
                .map(move |(axis, mut rng)| {
                    BlockDither::new(
                        dither.frequency_hz[axis],
                        dither.amplitude_rad[axis],
                        dither.amplitude_spread,
                        scenario.start_s,
                        duration_s,
                        &mut rng,
                    )
                })
        });
        let references = scenario.reference.iter().flat_map(|reference| {
            streams(Stream::Reference).map(move |rng| {
                AngleEncoder::new(
                    reference.weight_rad,
                    reference.angle_noise_rad,
                    reference.angle_random_walk_rad_sqrt_s * period_s.sqrt(),
                    rng,
                )
            })
        });
        let mut triad = Self {
            scenario,
            period_s,
            counters,
            gyro_rngs,
            dithers: dithers.collect(),
            pickoff_rngs: streams(Stream::Pickoff).collect(),
            block_before_rad: [0.0; 3],
            references: references.collect(),
            accelerometer_rngs: streams(Stream::Accelerometer).collect(),
        };
        triad.block_before_rad = triad.sensed_block_rad(scenario.start_s);
        triad
    }

    fn pickoff_angle_rad(&self, axis: usize, time_s: f64) -> f64 {
        self.dithers
            .get(axis)
            .map_or(0.0, |dither| dither.angle_rad(time_s))
    }

    fn sensed_block_rad(&self, time_s: f64) -> [f64; 3] {
        let Some(dither) = &self.scenario.dither else {
            return [0.0; 3];
        };
        let pickoff = std::array::from_fn(|axis| self.pickoff_angle_rad(axis, time_s));
        let effects = &self.scenario.effects;
        let block = effects.block_angle_rad(dither.pickoff_gain, pickoff);
        effects.sensed_block_angle_rad(block, self.scenario.gyro.scale_error)
    }

    fn read(&mut self, row: usize, period: &Period, rows: &mut Rows) {
        let scenario = self.scenario;
        let effects = &scenario.effects;
        let begin_s = scenario.start_s + row as f64 * self.period_s;
        let end_s = scenario.start_s + (row + 1) as f64 * self.period_s;
        let block_rad = self.sensed_block_rad(end_s);
        let reference_rad = effects.reference_reads(&period.case_rad);
        for axis in 0..3 {
            let keep = 1.0 - scenario.gyro.scale_error[axis];
            let walk =
                effects.angle_random_walk(axis, scenario.gyro.angle_random_walk_rad_sqrt_s[axis]);
            let sensed_rad = (period.sensed_rad[axis]
                + scenario.gyro.bias_rad_s[axis] * self.period_s / keep
                + effects.stepped_angle_rad(axis, begin_s, end_s))
                / keep
                + (block_rad[axis] - self.block_before_rad[axis])
                + effects.slipped_angle_rad(axis, begin_s, end_s)
                + walk * self.period_s.sqrt() * normal(&mut self.gyro_rngs[axis]);
            rows.counts[axis].push(self.counters[axis].count(sensed_rad));
            if let Some(dither) = &scenario.dither {
                let shown_s = end_s - effects.dither_delay_s(axis);
                let angle_rad = self.pickoff_angle_rad(axis, shown_s)
                    + dither.pickoff_noise_rad[axis] * normal(&mut self.pickoff_rngs[axis]);
                let weight_rad = dither.pickoff_weight_rad;
                rows.pickoff_rad[axis].push((angle_rad / weight_rad).round() * weight_rad);
            }
            if let Some(reference) = &scenario.reference {
                let steps = self.references[axis].step(reference_rad[axis]);
                rows.reference_rad[axis].push(steps * reference.weight_rad);
            }
            if let Some(accelerometer) = &scenario.accelerometer {
                // white noise of one-sided density n, averaged over a row
                let noise = accelerometer.noise_m_s2_sqrt_hz * (0.5 * scenario.rate_hz).sqrt();
                let force_m_s2 = (1.0 + accelerometer.scale_error[axis]) * period.force_m_s2[axis]
                    + accelerometer.bias_m_s2[axis]
                    + noise * normal(&mut self.accelerometer_rngs[axis]);
                let weight = accelerometer.weight_m_s2;
                rows.force_m_s2[axis].push((force_m_s2 / weight).round() * weight);
            }
        }
        rows.case_increments_rad.push(period.case_rad.into());
        self.block_before_rad = block_rad;
    }
}

/// The columns under way.
#[derive(Default)]
struct Rows {
    counts: [Vec<f64>; 3],
    pickoff_rad: [Vec<f64>; 3],
    reference_rad: [Vec<f64>; 3],
    force_m_s2: [Vec<f64>; 3],
    case_increments_rad: Vec<[f64; 3]>,
}

impl Rows {
    fn new(scenario: &Scenario) -> Self {
        let mut rows = Self::default();
        let columns = rows.counts.iter_mut().chain(
            [
                (&mut rows.pickoff_rad, scenario.dither.is_some()),
                (&mut rows.reference_rad, scenario.reference.is_some()),
                (&mut rows.force_m_s2, scenario.accelerometer.is_some()),
            ]
            .into_iter()
            .filter(|(_, wanted)| *wanted)
            .flat_map(|(columns, _)| columns.iter_mut()),
        );
        columns.for_each(|column| column.reserve_exact(scenario.rows()));
        rows.case_increments_rad.reserve_exact(scenario.rows());
        rows
    }
}

fn recording_of(scenario: &Scenario, rows: Rows) -> Recording {
    let kinds = [
        ("g", Quantity::GyroCount, Some(1.0), rows.counts),
        (
            "d",
            Quantity::DitherAngle,
            scenario.dither.as_ref().map(|d| d.pickoff_weight_rad),
            rows.pickoff_rad,
        ),
        (
            "r",
            Quantity::ReferenceIncrement,
            scenario.reference.map(|r| r.weight_rad),
            rows.reference_rad,
        ),
        (
            "a",
            Quantity::SpecificForce,
            scenario.accelerometer.map(|a| a.weight_m_s2),
            rows.force_m_s2,
        ),
    ];
    let mut channels = Vec::new();
    for (letter, quantity, scale, columns) in kinds {
        let Some(scale) = scale else { continue };
        for (axis, values) in ["x", "y", "z"].into_iter().zip(columns) {
            channels.push(Channel {
                column: format!("{letter}{axis}"),
                quantity: quantity.clone(),
                axis: Some(axis.to_owned()),
                scale,
                offset: 0.0,
                values,
            });
        }
    }
    let mut begin = 0;
    let time_s = |row: usize| scenario.start_s + row as f64 / scenario.rate_hz;
    let segments = scenario
        .segments
        .iter()
        .map(|segment| {
            let start_s = time_s(begin);
            begin += segment.rows;
            Segment {
                name: segment.name.clone(),
                kind: segment.kind.clone(),
                start_s,
                end_s: time_s(begin),
            }
        })
        .collect();
    Recording {
        name: scenario.name.clone(),
        folder: PathBuf::new(),
        site: scenario.site.map(|site| Site {
            latitude_rad: site.latitude_rad,
            gravity_m_s2: site.gravity_m_s2,
        }),
        tables: vec![Table {
            file: "samples.parquet".to_owned(),
            clock: Clock::Uniform {
                rate_hz: scenario.rate_hz,
                start_s: scenario.start_s,
            },
            rows: scenario.rows(),
            channels,
        }],
        segments,
    }
}

fn model_of(scenario: &Scenario) -> Model {
    let gyro = &scenario.gyro;
    Model {
        motion: if scenario.reference.is_some() {
            MotionSource::Reference
        } else {
            MotionSource::Static
        },
        earth_rate_in_reference: scenario.reference.is_some(),
        gyro: model::Gyro {
            pulse_weight_rad: gyro.pulse_weight_rad,
            bias_rad_s: gyro.bias_rad_s,
            scale_error: gyro.scale_error,
            angle_random_walk_rad_sqrt_s: Some(gyro.angle_random_walk_rad_sqrt_s),
            installation_rad: gyro.installation_rad.into(),
        },
        dither: scenario.dither.as_ref().map(|dither| model::Dither {
            pickoff_gain: dither.pickoff_gain,
            pickoff_noise_rad: dither.pickoff_noise_rad,
        }),
        reference: scenario.reference.map(|reference| model::Reference {
            angle_noise_rad: reference.angle_noise_rad,
            angle_random_walk_rad_sqrt_s: reference.angle_random_walk_rad_sqrt_s,
        }),
        accelerometer: scenario.accelerometer.map(|entry| model::Accelerometer {
            bias_m_s2: entry.bias_m_s2,
            scale_error: entry.scale_error,
            noise_m_s2_sqrt_hz: entry.noise_m_s2_sqrt_hz,
        }),
        effects: scenario.known_effects.clone(),
    }
}
