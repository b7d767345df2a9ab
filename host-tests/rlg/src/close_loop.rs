//! Closes the loop over every kind of effect that a build of the chain can compensate: simulate, diagnose, correct.
//!
//! For each [`Case`] the scenario of its [`Setting`] is simulated with the effect concealed; the diagnosis reads that
//! recording and the model without the effect. The residual error of the chain is computed on two more recordings of the
//! same seed, hence of the same motion and noise: with the effect and without it, both quantised in the steps of `Fine`,
//! because a unit's own steps round the two differently and rounding errors walk. An error is the rms difference of the
//! chain's summed outputs for the two over output periods, for the axis with the largest \[rad\], or \[m/s\] if the
//! accelerometers err. Errors of the dither oscillate: their mean is subtracted. (Before the first pickoff sample there is
//! no dither, a constant angle if a pickoff is late.)
//!
//! Sizes are those of a unit before its calibration, so that a minute's random walk is a hundredth of most.
//!
//! The residual error has two parts: the error of the diagnosis' estimates, and the error of the chain itself. A last column
//! has the chain with the true size, without the first of them.

use std::path::Path;

use serde::Serialize;
use trueaxis::Parameters;

use crate::diagnose::diagnose;
use crate::error::InputError;
use crate::model::{EffectValue, Model, ModelEffect};
use crate::recording::Recording;
use crate::replay::samples::{ReplayInput, Setup, samples_from_recording};
use crate::replay::{Core, replay};
use crate::simulate::scenario::Scenario;
use crate::simulate::{Simulation, simulate};

/// Scenarios without an effect.
const BENCH: &str = include_str!("../../scenarios/close-loop.toml");
const DITHERED: &str = include_str!("../../scenarios/close-loop-dither.toml");

/// A magnetometer, and a coil about the bench.
const COIL: &str = "
[magnetic]
navigation_field_t = [2.0e-5, 0.0, -4.4e-5]
coil_field_t = [2.0e-4, 1.5e-4, 1.0e-4]
coil_frequency_hz = 0.05
sensor_noise_t = 1e-8
sensor_weight_t = 1e-9
rate_hz = 200.0
";

/// Vibration across a suspension's resonance and well below it, about all axes out of phase.
const VIBRATION: &str = "
[[motion]]
kind = \"still\"
duration_s = 4.0

[[motion]]
kind = \"vibration\"
low_hz = 10.0
high_hz = 200.0
rate_rms_rad_s = [0.20, 0.16, 0.20]
axis_phase_rad = [0.0, 0.8, 1.7]
duration_s = 60.0
ramp_s = 0.5

[[motion]]
kind = \"still\"
duration_s = 4.0
";

/// Place and surroundings of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Setting {
    /// On the bench: at rest, rotated, shaken, vibrated, coned, warming up.
    Bench,
    /// On the bench, its motion three times: for kinds with too large a σ after one.
    LongBench,
    /// The same in a coil's magnetic field.
    InCoil,
    /// Vibrated for a minute, over the range of a suspension's mode.
    Vibrated,
    /// Vibrated and at rest, its pulses resampled.
    Dithered,
}

impl Setting {
    fn scenario(self) -> String {
        match self {
            Self::Bench => BENCH.to_owned(),
            Self::LongBench => format!("{BENCH}{0}{0}", &BENCH[unit().len()..]),
            Self::InCoil => format!("{BENCH}{COIL}"),
            Self::Vibrated => format!("{}{VIBRATION}", unit()),
            Self::Dithered => DITHERED.to_owned(),
        }
    }
}

/// Unit of the bench scenario without its motion.
fn unit() -> &'static str {
    BENCH.split("[[motion]]").next().unwrap_or(BENCH)
}

/// A kind at a realistic size.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    /// Name of the kind.
    pub kind: &'static str,
    /// Parameters of the effect, as in a scenario.
    parameters: &'static str,
    /// True if the error is one of velocity.
    of_velocity: bool,
    /// Setting in which the effect is observable.
    pub setting: Setting,
}

const fn gyros(kind: &'static str, parameters: &'static str) -> Case {
    Case {
        kind,
        parameters,
        of_velocity: false,
        setting: Setting::Bench,
    }
}

const fn long(kind: &'static str, parameters: &'static str) -> Case {
    Case {
        setting: Setting::LongBench,
        ..gyros(kind, parameters)
    }
}

const fn vibrated(kind: &'static str, parameters: &'static str) -> Case {
    Case {
        setting: Setting::Vibrated,
        ..gyros(kind, parameters)
    }
}

const fn dither(kind: &'static str, parameters: &'static str) -> Case {
    Case {
        setting: Setting::Dithered,
        ..gyros(kind, parameters)
    }
}

const fn accelerometers(kind: &'static str, parameters: &'static str) -> Case {
    Case {
        kind,
        parameters,
        of_velocity: true,
        setting: Setting::Bench,
    }
}

/// Every kind that the chain or one of its terms compensates, in the catalogue's order.
pub const CASES: &[Case] = &[
    // 2 °/h.
    gyros("gyro_bias", "x = 1.0e-5\ny = -0.8e-5\nz = 1.2e-5"),
    // 0.5 °/h per K.
    long(
        "gyro_bias_temperature",
        "x = 2.4e-6\ny = -2.0e-6\nz = 3.0e-6",
    ),
    long(
        "gyro_bias_temperature_rate",
        "x = 1.0e-4\ny = -0.8e-4\nz = 1.2e-4",
    ),
    // 1 °/h per g.
    long(
        "gyro_g_bias",
        "xx = 5.0e-7\nxy = -3.0e-7\nyy = 6.0e-7\nyz = 4.0e-7\nzz = -5.0e-7",
    ),
    // 1 °/h per g².
    gyros("gyro_g2_bias", "x = 4e-8\ny = -5e-8\nz = 3e-8"),
    Case {
        setting: Setting::InCoil,
        ..gyros(
            "gyro_bias_magnetic",
            "xx = 0.05\nxy = -0.02\nyy = 0.06\nyz = 0.03\nzx = -0.02\nzz = 0.05",
        )
    },
    gyros("gyro_scale", "x = 200e-6\ny = -150e-6\nz = 250e-6"),
    gyros("gyro_scale_asymmetry", "x = 100e-6\ny = -80e-6\nz = 90e-6"),
    gyros("gyro_scale_quadratic", "x = 100e-6\ny = -80e-6\nz = 90e-6"),
    // The chain's format holds at most 3.9e-6 at 4 kHz.
    gyros("gyro_scale_cubic", "x = 3.5e-6\ny = 3e-6\nz = -3.5e-6"),
    gyros(
        "installation",
        "xy = 2e-4\nxz = -2e-4\nyx = 1.5e-4\nyz = 2.5e-4\nzx = -2e-4\nzy = 2e-4",
    ),
    long(
        "installation_temperature",
        "xy = 1e-5\nxz = -2e-5\nyx = 1.5e-5\nyz = 2e-5\nzx = -1e-5\nzy = 2e-5",
    ),
    vibrated(
        "axis_flexure",
        "xy = 6.9e-8\nxz = 7.1e-8\nyx = 7.5e-8\nyz = 7.3e-8\nzx = 6.7e-8\nzy = 7.6e-8",
    ),
    // The chain's format holds at most 5.2e-13 at 4 kHz.
    vibrated(
        "axis_flexure_cubic",
        "xy = 3e-13\nxz = 3.8e-13\nyx = 3.4e-13\nyz = 3.8e-13\nzx = 3e-13\nzy = 3e-13",
    ),
    vibrated(
        "axis_flexure_mode",
        "xy = 6.9e-8\nxz = 7.1e-8\nyx = 7.5e-8\nyz = 7.3e-8\nzx = 6.7e-8\nzy = 7.6e-8\nfrequency_hz = 160.0\ndamping = 0.05",
    ),
    // 3 to 4 µrad per g.
    long(
        "axis_tilt_by_force",
        "xy = 4e-7\nxz = -4e-7\nyx = 4e-7\nyz = 3e-7\nzx = -4e-7\nzy = 3e-7",
    ),
    // Up to 0.6″ per g.
    gyros(
        "elastic_rate_by_force",
        "xx = 3e-7\nxy = -2e-7\nyy = 3e-7\nyz = 2e-7\nzx = 2e-7\nzz = -3e-7",
    ),
    gyros(
        "elastic_rate_by_jerk",
        "xx = 2e-8\nxy = -6e-8\nyx = 5e-8\nyy = 2e-8\nyz = 6e-8\nzx = 5e-8\nzz = 2e-8",
    ),
    gyros("gyro_delay", "x = 40e-6\ny = 30e-6\nz = 50e-6"),
    gyros("gyro_bandwidth", "x = 1e-8\ny = 0.5e-8\nz = 2e-8"),
    dither("dither_gain", "x = 1e-3\ny = -2e-3\nz = 1.5e-3"),
    dither("dither_delay", "x = 5e-6\ny = -4e-6\nz = 6e-6"),
    dither("dither_cubic", "x = 1e4\ny = -1.2e4\nz = 0.8e4"),
    dither(
        "dither_crosstalk",
        "xy = 5e-3\nxz = -4e-3\nyx = 5e-3\nyz = 6e-3\nzx = -4e-3\nzy = 5e-3",
    ),
    accelerometers("accel_bias", "x = 1e-2\ny = -2e-2\nz = 1.5e-2"),
    accelerometers("accel_scale", "x = 1e-3\ny = -2e-3\nz = 1.5e-3"),
    accelerometers(
        "accel_misalignment",
        "xy = 1e-3\nxz = -2e-3\nyx = 1.5e-3\nyz = 1e-3\nzx = -1e-3\nzy = 2e-3",
    ),
    // 50 µg per g².
    accelerometers("accel_quadratic", "x = 5e-6\ny = -4e-6\nz = 6e-6"),
    accelerometers("accel_delay", "x = 40e-6\ny = 30e-6\nz = 50e-6"),
    accelerometers(
        "size_effect",
        "xx = 0.045\nxy = 0.012\nyy = 0.050\nyz = 0.016\nzx = -0.021\nzz = 0.038",
    ),
];

/// One line of the table.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    /// Concealed kind.
    pub kind: &'static str,
    /// Kinds that the diagnosis found.
    pub found: Vec<String>,
    /// Unit of the errors: rad or m/s.
    pub unit: &'static str,
    /// Error with the model's parameters, in f32.
    pub before: f64,
    /// Error with the parameters of the diagnosis, in f32.
    pub after_f32: f64,
    /// The same in fixed point.
    pub after_fixed: f64,
    /// Error with the true size, in f32.
    pub with_truth: f64,
}

impl Row {
    /// Returns the larger of both number systems' errors, relative to the error before \[1\].
    pub fn left(&self) -> f64 {
        self.after_f32.max(self.after_fixed) / self.before
    }
}

/// The summed output of a run \[rad, m/s\], a row per output period.
type Sums = Vec<[f64; 6]>;

struct Runner<'a> {
    recording: &'a Recording,
    place: &'a Path,
}

impl Runner<'_> {
    fn input(&self, model: &Model) -> Result<ReplayInput, InputError> {
        samples_from_recording(self.recording, model, self.place, Setup::STANDARD)
    }

    fn sums(&self, model: &Model, core: Core) -> Result<Sums, InputError> {
        let input = self.input(model)?;
        sums(&input, &input.parameters, core, self.place)
    }
}

fn sums(
    input: &ReplayInput,
    parameters: &Parameters,
    core: Core,
    place: &Path,
) -> Result<Sums, InputError> {
    let run = replay(input, core, parameters)
        .map_err(|error| InputError::new(place, format!("does not fit the chain: {error}")))?;
    let mut sum = [0.0; 6];
    let rows = run.rotations_rad.iter().zip(&run.velocities_m_s);
    Ok(rows
        .map(|(rotation, velocity)| {
            for axis in 0..3 {
                sum[axis] += rotation[axis];
                sum[3 + axis] += velocity[axis];
            }
            sum
        })
        .collect())
}

/// Computes the rms difference, for the axis with the largest.
fn apart(one: &Sums, other: &Sums, case: &Case) -> f64 {
    let first = if case.of_velocity { 3 } else { 0 };
    let count = one.len().min(other.len()).max(1) as f64;
    let of_axis = |at: usize| {
        let pairs = one.iter().zip(other);
        let differences: Vec<f64> = pairs.map(|(one, other)| one[at] - other[at]).collect();
        let offset = match case.setting {
            Setting::Dithered => differences.iter().sum::<f64>() / count,
            _ => 0.0,
        };
        let squares = differences.iter().map(|one| (one - offset).powi(2));
        (squares.sum::<f64>() / count).sqrt()
    };
    (first..first + 3).map(of_axis).fold(0.0, f64::max)
}

/// Quantisation steps of the compared recordings: their rounding is far below the residual errors.
struct Fine;

impl Fine {
    const PULSE_RAD: f64 = 2e-10;
    const PICKOFF_RAD: f64 = 1e-10;
    const FORCE_M_S2: f64 = 1e-9;

    fn read(scenario: &mut Scenario) {
        scenario.gyro.pulse_weight_rad = [Self::PULSE_RAD; 3];
        if let Some(dither) = &mut scenario.dither {
            dither.pickoff_weight_rad = Self::PICKOFF_RAD;
        }
        if let Some(accelerometer) = &mut scenario.accelerometer {
            accelerometer.weight_m_s2 = Self::FORCE_M_S2;
        }
    }
}

/// Parses a setting's scenario with an effect.
fn scenario_with(setting: Setting, effect: &str, place: &Path) -> Result<Scenario, InputError> {
    Scenario::parse(&format!("{}\n{effect}", setting.scenario()), place)
}

/// Simulates the scenario with fine quantisation.
fn finely_read(mut scenario: Scenario, seed: u64) -> Simulation {
    Fine::read(&mut scenario);
    simulate(&scenario, seed, |_| {})
}

/// Output of the chain for a setting's scenario without an effect: once for all its cases.
pub struct Twin {
    setting: Setting,
    seed: u64,
    f32: Sums,
    fixed: Sums,
}

impl Twin {
    /// Simulates the scenario and runs it through the chain.
    pub fn new(setting: Setting, seed: u64) -> Result<Self, InputError> {
        let place = Path::new("close-loop.toml");
        let clean = finely_read(scenario_with(setting, "", place)?, seed);
        let runner = Runner {
            recording: &clean.recording,
            place,
        };
        Ok(Self {
            setting,
            seed,
            f32: runner.sums(&clean.model, Core::F32)?,
            fixed: runner.sums(&clean.model, Core::Fixed)?,
        })
    }

    /// Returns the setting.
    pub fn setting(&self) -> Setting {
        self.setting
    }

    /// Closes the loop over one case of the setting; `stage` is called with the name of each stage of the diagnosis.
    pub fn close(&self, case: &Case, stage: &(dyn Fn(&str) + Sync)) -> Result<Row, InputError> {
        let place = Path::new("close-loop.toml");
        let effect = format!(
            "[[effect]]\nkind = \"{}\"\nconcealed = true\n{}\n",
            case.kind, case.parameters
        );
        let scenario = scenario_with(self.setting, &effect, place)?;
        let seen = simulate(&scenario, self.seed, |_| {});
        let outcome = diagnose(&seen.recording, &seen.model, place, self.seed, &stage)?;
        let compared = finely_read(scenario, self.seed);
        let runner = Runner {
            recording: &compared.recording,
            place,
        };
        let model = &compared.model;
        // A simulated flexure follows the acceleration at once, without the mode implied by its K.
        let with = |effects: &[ModelEffect]| {
            let mut model = model.clone();
            model.effects = effects.to_vec();
            for effect in &mut model.effects {
                if effect.kind == "axis_flexure" {
                    let response = EffectValue::Text("static".to_owned());
                    effect.parameters.insert("response".to_owned(), response);
                }
            }
            model
        };
        let found = with(&outcome.model.effects);
        let truth = with(&[&*model.effects, &compared.truth.effects].concat());
        let off = |model: &Model, core: Core| {
            let twin = if core == Core::F32 {
                &self.f32
            } else {
                &self.fixed
            };
            Ok::<_, InputError>(apart(&runner.sums(model, core)?, twin, case))
        };
        Ok(Row {
            kind: case.kind,
            found: outcome
                .diagnosis
                .effects
                .iter()
                .map(|effect| effect.kind.clone())
                .collect(),
            unit: if case.of_velocity { "m/s" } else { "rad" },
            before: off(model, Core::F32)?,
            after_f32: off(&found, Core::F32)?,
            after_fixed: off(&found, Core::Fixed)?,
            with_truth: off(&truth, Core::F32)?,
        })
    }
}
