//! A trial's recording, its model and its truth.

use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rlg_model::{Accelerometer, Gyro, Installation, Model, MotionSource, Reference};
use rlg_recording::error::InputError;
use rlg_recording::{Channel, Clock, Quantity, Recording, Table};
use rlg_simulator::instrument::normal;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::case::START_K;
use super::effects::{AXES, Perturbation};
use super::family::Family;
use super::noise::quantised_rad;
use super::setting::Setting;
use super::trial::{Rows, Source, Trial};

/// Noise of a thermometer's reading \[K\].
const THERMOMETER_K: f64 = 2e-3;

/// White noise of the accelerometers \[m/s²/√Hz\].
const ACCELEROMETER_M_S2_SQRT_HZ: f64 = 5e-5;

/// One concealed effect.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Concealed {
    /// The contract's kind.
    pub kind: String,
    /// Its parameters by the contract's names.
    pub parameters: Map<String, Value>,
    /// Matched-filter SNR in the noise that is really added.
    pub rho: f64,
}

/// What a trial conceals: the line that is committed to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// Its number.
    pub trial: u64,
    /// The challenge's seed.
    pub seed: u64,
    /// What it tests.
    pub family: Family,
    /// Effects.
    pub effects: Vec<Concealed>,
    /// Instruments and length; absent for dithered counts.
    pub setting: Option<Setting>,
    /// The simulator's scenario of dithered counts, effects included.
    pub scenario: Option<String>,
    /// Seed of the noise.
    pub noise_seed: u64,
    /// Keeps the commitment from being guessed.
    pub salt: String,
}

impl Answer {
    /// Forms the answer of a trial.
    pub fn of(seed: u64, trial: &Trial) -> Self {
        let effects = trial.effects().iter().map(|strong| {
            let effect = &strong.effect;
            let axis = effect
                .axis
                .map(|axis| ("axis".to_owned(), Value::from(AXES[axis])));
            let numbers = effect
                .values
                .iter()
                .map(|(name, value)| (name.clone(), Value::from(*value)));
            Concealed {
                kind: effect.kind.to_owned(),
                parameters: axis.into_iter().chain(numbers).collect(),
                rho: strong.rho,
            }
        });
        let (setting, scenario) = match &trial.source {
            Source::Rows(rows) => (Some(rows.setting.clone()), None),
            Source::Dithered(dithered) => (None, Some(dithered.text())),
        };
        Self {
            trial: trial.number,
            seed,
            family: trial.family,
            effects: effects.collect(),
            setting,
            scenario,
            noise_seed: trial.noise_seed,
            salt: trial.salt.clone(),
        }
    }
}

/// What the model of a trial declares of noise.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Declares {
    /// The reference's noise times the factor that the trial draws, the gyros' as it draws.
    #[default]
    AsDrawn,
    /// The reference's noise times a factor.
    Times(f64),
    /// Nothing of gyros or reference.
    Nothing,
}

impl Declares {
    /// Changes what `model` declares.
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
            }
        }
    }
}

/// Makes a trial's recording and the model that goes with it.
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
    };
    declares.apply(&mut model, drawn);
    recording.name = format!("trial {}", trial.number);
    Ok((recording, model))
}

fn record_rows(rows: &Rows, noise_seed: u64) -> (Recording, Model) {
    let setting = &rows.setting;
    let case = rows.case();
    let (count, period_s) = (case.rows, case.period_s);
    let sensing_from_body = rows.unit.sensing_from_body();
    let mut added = Perturbation::none(count);
    for strong in &rows.effects {
        added.add(&strong.effect.perturbation(&case, &sensing_from_body));
    }
    let mut rng = ChaCha8Rng::seed_from_u64(noise_seed);
    let mut channels = Vec::new();
    for axis in 0..3 {
        // What the contract's model predicts, with the effects beside the case's part.
        let scale = 1.0 / (1.0 - rows.unit.scale_error[axis]);
        let bias_rad = rows.unit.bias_rad_s[axis] * period_s * scale;
        let noise = setting
            .gyro_levels(axis)
            .series_rad(count, period_s, &mut rng);
        let sensed: Vec<f64> = (0..count)
            .map(|row| {
                let case_rad: f64 = (0..3)
                    .map(|body| sensing_from_body[(axis, body)] * case.increments_rad[body][row])
                    .sum();
                scale * (case_rad + bias_rad + added.gyro_rad[axis][row]) + noise[row]
            })
            .collect();
        let read = quantised_rad(&sensed, setting.pulse_rad, &mut rng);
        channels.push(channel("g", axis, Quantity::GyroIncrement, read));
    }
    for axis in 0..3 {
        let mut read = setting
            .reference_levels()
            .series_rad(count, period_s, &mut rng);
        for (row, value) in read.iter_mut().enumerate() {
            *value += case.increments_rad[axis][row] + added.reference_rad[axis][row];
        }
        channels.push(channel("r", axis, Quantity::ReferenceIncrement, read));
    }
    if let Some(warming) = &case.warming_k {
        for (axis, block) in warming.iter().enumerate() {
            let noisy = |kelvin: &f64| START_K + kelvin + THERMOMETER_K * normal(&mut rng);
            let read = block.iter().map(noisy).collect();
            channels.push(channel("t", axis, Quantity::Temperature, read));
        }
    }
    if let Some(force) = &case.force_m_s2 {
        let spread = ACCELEROMETER_M_S2_SQRT_HZ * setting.rate_hz.sqrt();
        for (axis, values) in force.iter().enumerate() {
            let read = values
                .iter()
                .map(|value| value + spread * normal(&mut rng))
                .collect();
            channels.push(channel("a", axis, Quantity::SpecificForce, read));
        }
    }
    let table = Table {
        file: "samples.parquet".to_owned(),
        clock: Clock::Uniform {
            rate_hz: setting.rate_hz,
            start_s: 0.0,
        },
        rows: count,
        channels,
    };
    let recording = Recording {
        name: String::new(),
        folder: std::path::PathBuf::new(),
        site: None,
        tables: vec![table],
        segments: Vec::new(),
    };
    (recording, model_of(rows))
}

fn channel(prefix: &str, axis: usize, quantity: Quantity, values: Vec<f64>) -> Channel {
    Channel {
        column: format!("{prefix}{}", AXES[axis]),
        quantity,
        axis: Some(AXES[axis].to_owned()),
        scale: 1.0,
        offset: 0.0,
        values,
    }
}

fn model_of(rows: &Rows) -> Model {
    let setting = &rows.setting;
    let [xy, xz, yx, yz, zx, zy] = rows.unit.installation_rad;
    let declared = setting.declared_over_true;
    Model {
        motion: MotionSource::Reference,
        earth_rate_in_reference: true,
        gyro: Gyro {
            pulse_weight_rad: [setting.pulse_rad; 3],
            bias_rad_s: rows.unit.bias_rad_s,
            scale_error: rows.unit.scale_error,
            angle_random_walk_rad_sqrt_s: setting
                .declares_gyro_walk
                .then_some(setting.gyro_walk_rad_sqrt_s),
            rate_random_walk_rad_s_sqrt_s: None,
            flicker_rad_s: None,
            installation_rad: Installation {
                xy,
                xz,
                yx,
                yz,
                zx,
                zy,
            },
        },
        dither: None,
        reference: Some(Reference {
            angle_noise_rad: Some(declared * setting.reference_angle_rad),
            angle_random_walk_rad_sqrt_s: Some(declared * setting.reference_walk_rad_sqrt_s),
        }),
        accelerometer: setting.has_force.then_some(Accelerometer {
            bias_m_s2: [0.0; 3],
            scale_error: [0.0; 3],
            noise_m_s2_sqrt_hz: [ACCELEROMETER_M_S2_SQRT_HZ; 3],
        }),
        effects: Vec::new(),
    }
}
