//! Simulation of a dithered ring-laser triad on a moving case, with finer time steps than the recording.
//!
//! From a [`Scenario`] and a seed: a [`Recording`], its [`Model`] without the concealed effects, and the [`Truth`]. SI
//! units, body frame.
//!
//! Data flow: base motion in closed form (`motion`) → isolator (`isolator`) → reaction of the dithers, Earth and gravity,
//! modes of the suspensions (`case`) → rates sensed by the gyros with their errors (`effects`) → exact integrals over each
//! period → beat of the lasers (`lock_in`) → noise, pulses, samples (`triad`, `references`) → faults of the data → rows
//! (`layout`).
//!
//! The tilt −K α is computed from the true angular acceleration at four Gauss–Legendre nodes a period, not from increments.
//! Rows are made one after another ([`Simulator`]): memory does not grow with the recording.
//!
//! Independent of the firmware core and of the f64 reference: it imports neither.
//!
//! Out of scope: travel over the Earth, gradients of temperature inside a block, mode coupling between
//! blocks other than through the case.

pub mod attitude;
pub mod case;
pub mod dither;
pub mod effects;
pub mod entry;
pub mod instrument;
pub mod isolator;
pub mod layout;
pub mod lock_in;
pub mod mode;
pub mod motion;
pub mod references;
mod run;
pub mod scenario;
mod scenario_file;
pub mod slow_channels;
pub mod surroundings;
pub mod triad;
pub mod unit_faults;
pub mod window;

pub use instrument::Seeds;
use layout::{ReferenceKind, TableLayout};
use rlg_model::{EffectValue, Model, ModelEffect, MotionSource};
use rlg_recording::error::InputError;
use rlg_recording::{Channel, Clock, Recording, Segment, Site, Table};
pub use run::{Block, Simulator};
use scenario::Scenario;
use serde_json::json;
use std::path::{Path, PathBuf};
use unit_faults::UnitFaults;

/// Concealed effects, for tests and scores only.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// Seed.
    pub seed: u64,
    /// Concealed effects.
    pub effects: Vec<ModelEffect>,
    /// Faults of the unit.
    pub unit_faults: UnitFaults,
}

impl Truth {
    /// Concealed effects of a scenario.
    pub fn of(scenario: &Scenario, seed: u64) -> Self {
        Self {
            seed,
            effects: scenario.concealed_effects.clone(),
            unit_faults: scenario.unit_faults.clone(),
        }
    }

    /// Serialises to JSON: `seed` and `effects`, each `kind` and `parameters`; with faults of the unit also `faults`, each
    /// with the keys of its `[[fault]]`.
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
        let mut truth = json!({"seed": self.seed, "effects": effects});
        if !self.unit_faults.0.is_empty() {
            truth["faults"] = self.unit_faults.to_json();
        }
        let mut text = format!("{truth:#}");
        text.push('\n');
        text
    }
}

/// Simulated recording with its model and truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// Recorded data.
    pub recording: Recording,
    /// Initial model for a diagnosis of the recording.
    pub model: Model,
    /// The concealed effects.
    pub truth: Truth,
    /// Exact increments of the case over each row, x y z \[rad\]: for tests.
    pub case_increments_rad: Vec<[f64; 3]>,
}

/// The scenario of [`demo_scenario`].
const DEMO_SCENARIO: &str = include_str!("../../scenarios/coning.toml");

/// Coning scenario of the tool; it conceals the flexure of the blocks.
pub fn demo_scenario() -> Result<Scenario, InputError> {
    Scenario::parse(DEMO_SCENARIO, Path::new("scenarios/coning.toml"))
}

/// Runs [`demo_scenario`].
pub fn coning_demo(seed: u64) -> Result<Simulation, InputError> {
    Ok(simulate(&demo_scenario()?, seed, |_| {}))
}

/// Runs a scenario in memory. `progress` is called with the rows done. The same scenario and seed give the same values.
pub fn simulate(
    scenario: &Scenario,
    seeds: impl Into<Seeds>,
    mut progress: impl FnMut(usize),
) -> Simulation {
    let seeds = seeds.into();
    let mut simulator = Simulator::new(scenario, seeds);
    let mut recording = simulator.recording();
    let mut case_increments_rad = Vec::with_capacity(scenario.rows());
    for (table, layout) in recording.tables.iter_mut().zip(simulator.tables()) {
        let rows = scenario.rows() / layout.gyro_rows;
        for channel in &mut table.channels {
            channel.values.reserve_exact(rows);
        }
    }
    while let Some(block) = simulator.next_block() {
        for (table, columns) in recording.tables.iter_mut().zip(&block.tables) {
            for (channel, column) in table.channels.iter_mut().zip(columns) {
                channel.values.extend_from_slice(column);
            }
        }
        case_increments_rad.extend_from_slice(&block.case_increments_rad);
        progress(block.end_row);
    }
    Simulation {
        model: model_of(scenario),
        truth: Truth::of(scenario, seeds.noise),
        case_increments_rad,
        recording,
    }
}

/// Recording without its values.
fn recording_of(scenario: &Scenario, layouts: &[TableLayout]) -> Recording {
    let tables = layouts.iter().map(|layout| Table {
        file: layout.file.to_owned(),
        clock: Clock::Uniform {
            rate_hz: scenario.rate_hz / layout.gyro_rows as f64,
            start_s: scenario.start_s,
        },
        rows: scenario.rows() / layout.gyro_rows,
        channels: layout
            .columns
            .iter()
            .map(|column| Channel {
                column: column.name.clone(),
                quantity: column.quantity.clone(),
                axis: Some(column.axis.to_owned()).filter(|axis| !axis.is_empty()),
                scale: column.weight.unwrap_or(1.0),
                offset: 0.0,
                values: Vec::new(),
            })
            .collect(),
    });
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
        tables: tables.collect(),
        segments,
    }
}

/// Initial model for a diagnosis of the scenario's recording.
pub fn model_of(scenario: &Scenario) -> Model {
    let gyro = &scenario.gyro;
    let first = layout::references(scenario).next();
    let reference = first.map(|kind| {
        let (angle_noise_rad, angle_random_walk_rad_sqrt_s) = match kind {
            ReferenceKind::Gyro => {
                let entry = scenario.reference.expect("this kind is there");
                (entry.angle_noise_rad, entry.angle_random_walk_rad_sqrt_s)
            }
            ReferenceKind::FibreOptic => {
                let entry = scenario.fibre_optic.expect("this kind is there");
                (entry.angle_noise_rad, entry.angle_random_walk_rad_sqrt_s)
            }
            ReferenceKind::Encoder => {
                let entry = scenario.encoder.expect("this kind is there");
                (entry.angle_noise_rad, 0.0)
            }
        };
        rlg_model::Reference {
            angle_noise_rad: Some(angle_noise_rad),
            angle_random_walk_rad_sqrt_s: Some(angle_random_walk_rad_sqrt_s),
        }
    });
    Model {
        motion: if first.is_some() {
            MotionSource::Reference
        } else {
            MotionSource::Static
        },
        earth_rate_in_reference: first.is_some_and(|kind| kind != ReferenceKind::Encoder),
        gyro: rlg_model::Gyro {
            pulse_weight_rad: gyro.pulse_weight_rad,
            bias_rad_s: gyro.bias_rad_s,
            scale_error: gyro.scale_error,
            angle_random_walk_rad_sqrt_s: Some(gyro.angle_random_walk_rad_sqrt_s),
            rate_random_walk_rad_s_sqrt_s: None,
            flicker_rad_s: None,
            installation_rad: gyro.installation_rad,
        },
        dither: scenario.dither.as_ref().map(|dither| rlg_model::Dither {
            pickoff_gain: dither.pickoff_gain,
            pickoff_noise_rad: dither.pickoff_noise_rad,
        }),
        reference,
        accelerometer: scenario
            .accelerometer
            .map(|entry| rlg_model::Accelerometer {
                bias_m_s2: entry.bias_m_s2,
                scale_error: entry.scale_error,
                noise_m_s2_sqrt_hz: [entry.noise_m_s2_sqrt_hz; 3],
            }),
        effects: scenario.known_effects.clone(),
    }
}
