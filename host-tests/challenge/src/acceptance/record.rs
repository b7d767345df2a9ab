//! Recording of a trial, its model and its truth.

use rlg_model::Model;
use rlg_recording::Recording;
use rlg_recording::error::InputError;
use serde::{Deserialize, Serialize};

use super::trial::{Source, Trial};
use crate::marks::effects::Strong;
use crate::marks::family::Family;
use crate::marks::rows_record::record_rows;
use crate::marks::setting::Setting;
use crate::{attitude, force, positions, recorded, rest};

pub use crate::marks::effects::Concealed;

/// Truth of a trial: the committed line.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Number of the trial.
    pub trial: u64,
    /// Seed of the challenge.
    pub seed: u64,
    /// Family.
    pub family: Family,
    /// Effects.
    pub effects: Vec<Concealed>,
    /// Instruments and length; `None` for dithered counts.
    pub setting: Option<Setting>,
    /// Scenario of dithered counts for the simulator, effects included.
    pub scenario: Option<String>,
    /// Injected effect of a trial with attitudes or at rest, by its row in the table.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub planted: Option<String>,
    /// Instruments, motion and length of a trial with attitudes or at rest, in words.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub conditions: Vec<String>,
    /// Effects reported for others' recording before the injection.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<Concealed>,
    /// Seed of the noise.
    pub noise_seed: u64,
    /// Random text that prevents guessing the truth from its hash.
    pub salt: String,
}

impl Answer {
    /// Builds the answer of a trial.
    pub fn of(seed: u64, trial: &Trial) -> Self {
        let (mut setting, mut scenario, mut planted, mut conditions) = Default::default();
        let mut beside = Vec::new();
        let effects = match &trial.source {
            Source::Rows(rows) => {
                setting = Some(rows.setting.clone());
                rows.effects.iter().map(Strong::concealed).collect()
            }
            Source::Dithered(dithered) => {
                scenario = Some(dithered.text());
                dithered.effects.iter().map(Strong::concealed).collect()
            }
            Source::Attitude(drawn) => {
                planted = Some(drawn.planted.name());
                conditions = drawn.conditions();
                drawn.concealed()
            }
            Source::Rest(drawn) => {
                planted = Some(drawn.planted.name());
                conditions = drawn.conditions();
                drawn.concealed()
            }
            Source::Force(drawn) => {
                planted = Some(drawn.planted.name());
                conditions = drawn.conditions();
                drawn.concealed()
            }
            Source::Positions(drawn) => {
                planted = Some(drawn.planted.name());
                conditions = drawn.conditions();
                drawn.concealed()
            }
            Source::Recorded(drawn) => {
                planted = Some(drawn.planted.name());
                conditions = drawn.conditions();
                beside.clone_from(&drawn.base.said);
                let strong = |effect| Strong { effect, rho: 0.0 };
                let effect = drawn.effect.clone().map(strong);
                effect.iter().map(Strong::concealed).collect()
            }
        };
        Self {
            trial: trial.number,
            seed,
            family: trial.family,
            effects,
            setting,
            scenario,
            planted,
            conditions,
            beside,
            noise_seed: trial.noise_seed,
            salt: trial.salt.clone(),
        }
    }
}

/// Noise declared by a trial's model.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Declares {
    /// The reference's noise times the drawn factor, the gyros' as drawn.
    #[default]
    AsDrawn,
    /// The reference's noise times a factor.
    Times(f64),
    /// No noise of any instrument.
    Nothing,
}

impl Declares {
    /// Changes the noise declared by `model`.
    fn apply(self, model: &mut Model, drawn: f64) {
        match self {
            Self::AsDrawn => {}
            Self::Times(factor) => {
                if let Some(reference) = &mut model.reference {
                    let scaled = |noise: Option<f64>| noise.map(|noise| noise * factor / drawn);
                    reference.angle_noise_rad = scaled(reference.angle_noise_rad);
                    reference.angle_random_walk_rad_sqrt_s =
                        scaled(reference.angle_random_walk_rad_sqrt_s);
                }
            }
            Self::Nothing => {
                model.reference = None;
                model.gyro.angle_random_walk_rad_sqrt_s = None;
                if let Some(accelerometer) = &mut model.accelerometer {
                    accelerometer.noise_m_s2_sqrt_hz = [0.0; 3];
                }
            }
        }
    }
}

/// Makes the recording of a trial and its model.
pub fn record(trial: &Trial, declares: Declares) -> Result<(Recording, Model), InputError> {
    let (mut recording, mut model, drawn) = match &trial.source {
        Source::Rows(rows) => {
            let (recording, model) = record_rows(rows, trial.noise_seed);
            (recording, model, rows.setting.declared_over_true)
        }
        Source::Dithered(dithered) => {
            let (recording, model) = dithered.record(trial.noise_seed)?;
            (recording, model, dithered.declared_over_true)
        }
        Source::Attitude(drawn) => {
            let (recording, model) = attitude::record::record(drawn, trial.noise_seed);
            (recording, model, 1.0)
        }
        Source::Rest(drawn) => {
            let (recording, model) = rest::record::record(drawn, trial.noise_seed);
            (recording, model, 1.0)
        }
        Source::Force(drawn) => {
            let (recording, model) = force::record::record(drawn, trial.noise_seed);
            (recording, model, drawn.rows.setting.declared_over_true)
        }
        Source::Positions(drawn) => {
            let (recording, model) = positions::record::record(drawn, trial.noise_seed);
            (recording, model, 1.0)
        }
        Source::Recorded(drawn) => {
            let (recording, model) = recorded::record::record(drawn, trial.noise_seed);
            (recording, model, 1.0)
        }
    };
    declares.apply(&mut model, drawn);
    recording.name = format!("trial {}", trial.number);
    Ok((recording, model))
}
