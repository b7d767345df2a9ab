//! Others' recording: its gyros and attitudes, and its diagnosis before any injection.

use std::path::Path;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use rlg_findings::result::{Diagnosis, ParameterEntry};
use rlg_flow::{Settings, diagnose_under};
use rlg_model::catalogue::SIX;
use rlg_model::{EffectValue, Model, ModelEffect};
use rlg_recording::error::InputError;
use rlg_recording::{Clock, Quantity, Recording, Table};
use serde_json::{Map, Value};

use super::path::GyroPath;
use crate::given::MODEL;
use crate::marks::effects::{AXES, Concealed};

/// A stamp and its attitude, body to navigation frame.
pub type Stamp = (f64, UnitQuaternion<f64>);

/// Base recording of trials.
#[derive(Debug)]
pub struct Base {
    /// Recording as read.
    pub recording: Recording,
    /// Model of the recording.
    pub model: Model,
    /// Place of the gyros' table.
    pub gyro_table: usize,
    /// Period of a row \[s\].
    pub period_s: f64,
    /// Gyro increments \[rad by row\].
    pub sensed_rad: Vec<Vector3<f64>>,
    /// Gyro increments without their bias.
    pub sensed_motion_rad: Vec<Vector3<f64>>,
    /// Specific force on the gyros' rows \[m/s²\], 0 without accelerometers.
    pub force_m_s2: Vec<Vector3<f64>>,
    /// Attitudes, by the reference's own stamps \[s\].
    pub stamps: Vec<Stamp>,
    /// Attitudes of the aligned gyros at the faultless stamps.
    pub by_gyros: Vec<Stamp>,
    /// Error of the reference against them, as rotations of the navigation frame \[rad\].
    pub errors_rad: Vec<Vector3<f64>>,
    /// Diagnosis of the unmodified recording: its effects, and all alignment parameters.
    pub said: Vec<Concealed>,
}

impl Base {
    /// Reads a recording with the model in its folder and diagnoses it.
    ///
    /// # Errors
    /// It is no recording of rates or increments with an attitude reference, or the reference is not aligned with the
    /// gyros.
    pub fn read(folder: &Path) -> Result<Self, InputError> {
        let recording = Recording::read(folder)?;
        let model_file = folder.join(MODEL);
        let model = Model::read(&model_file)?;
        let unusable = |problem: &str| {
            InputError::new(folder, problem).expected(
                "gyro_rate or gyro_increment x, y and z in uniform rows, and reference_attitude",
            )
        };
        let gyros = [Quantity::GyroRate, Quantity::GyroIncrement];
        let holds = |table: &&Table| gyros.iter().any(|one| table.channel(one, "x").is_some());
        let gyro_table = recording.tables.iter().position(|table| holds(&table));
        let gyro_table = gyro_table.ok_or_else(|| unusable("has no such gyros"))?;
        let table = &recording.tables[gyro_table];
        let Clock::Uniform { rate_hz, start_s } = table.clock else {
            return Err(unusable("has gyros with stamps of their own"));
        };
        let period_s = 1.0 / rate_hz;
        let of = |quantity: &Quantity| triad(table, quantity);
        let sensed_rad = of(&Quantity::GyroIncrement).or_else(|| {
            let rates = of(&Quantity::GyroRate)?.into_iter();
            Some(rates.map(|rate| rate * period_s).collect())
        });
        let sensed_rad: Vec<Vector3<f64>> = sensed_rad.ok_or_else(|| unusable("lacks a gyro"))?;
        let force_m_s2 =
            of(&Quantity::SpecificForce).unwrap_or_else(|| vec![Vector3::zeros(); table.rows]);
        let stamps = stamps(&recording).ok_or_else(|| unusable("has no attitudes"))?;
        let settings = Settings::default();
        let outcome = diagnose_under(&settings, &recording, &model, &model_file, &|_| {})?;
        let aligned = Aligned::of(&outcome.model, &stamps);
        let bias_rad = aligned.bias_rad_s * period_s;
        let inverse = aligned
            .sensed_from_body
            .try_inverse()
            .unwrap_or_else(Matrix3::identity);
        let sensed_motion_rad: Vec<Vector3<f64>> =
            sensed_rad.iter().map(|row| row - bias_rad).collect();
        let body_rad: Vec<Vector3<f64>> =
            sensed_motion_rad.iter().map(|row| inverse * row).collect();
        let path = GyroPath::new(&body_rad, (start_s, period_s));
        let sound = stamps
            .iter()
            .filter(|(time_s, _)| !aligned.is_wrong(*time_s));
        let pairs = sound.filter_map(|(time_s, attitude)| {
            let by_gyros = path.at(aligned.on_gyros_s(*time_s))?;
            Some((*time_s, by_gyros, attitude * by_gyros.inverse()))
        });
        let pairs: Vec<(f64, UnitQuaternion<f64>, UnitQuaternion<f64>)> = pairs.collect();
        let frame = mean(pairs.iter().map(|(_, _, beyond)| *beyond));
        let errors = pairs
            .iter()
            .map(|(_, _, beyond)| (beyond * frame.inverse()).scaled_axis());
        let base = Self {
            errors_rad: errors.collect(),
            by_gyros: pairs
                .iter()
                .map(|(time_s, by_gyros, _)| (*time_s, frame * by_gyros))
                .collect(),
            said: said(&outcome.diagnosis),
            sensed_motion_rad,
            gyro_table,
            model,
            period_s,
            sensed_rad,
            force_m_s2,
            stamps,
            recording,
        };
        let squares = base
            .errors_rad
            .iter()
            .map(Vector3::norm_squared)
            .sum::<f64>();
        if squares < LARGEST_RAD.powi(2) * base.errors_rad.len() as f64 {
            return Ok(base);
        }
        let problem = "has attitudes that do not move as the gyros do";
        Err(InputError::new(folder, problem).expected("a recording that rlg align aligns"))
    }

    /// Mean time between attitudes \[s\].
    pub fn stamp_s(&self) -> f64 {
        let (first, last) = (self.by_gyros[0].0, self.by_gyros[self.by_gyros.len() - 1].0);
        (last - first) / (self.by_gyros.len() - 1) as f64
    }
}

/// Largest root mean square of the reference's errors against the gyros \[rad\]: rotations are additive only if small.
const LARGEST_RAD: f64 = 0.1;

/// Mean of neighbouring rotations, about the first.
fn mean(all: impl Iterator<Item = UnitQuaternion<f64>> + Clone) -> UnitQuaternion<f64> {
    const ROUNDS: usize = 5;
    let mut about = all.clone().next().unwrap_or_default();
    for _ in 0..ROUNDS {
        let (mut sum, mut count) = (Vector3::zeros(), 0.0);
        for one in all.clone() {
            sum += (one * about.inverse()).scaled_axis();
            count += 1.0;
        }
        about = UnitQuaternion::from_scaled_axis(sum / count) * about;
    }
    about
}

/// Largest difference of coinciding times \[s\].
const AT_ONCE_S: f64 = 1e-6;

/// Alignment parameters of the reference, as in a model.
struct Aligned<'a> {
    model: &'a Model,
    bias_rad_s: Vector3<f64>,
    sensed_from_body: Matrix3<f64>,
    middle_s: f64,
}

impl<'a> Aligned<'a> {
    fn of(model: &'a Model, stamps: &[Stamp]) -> Self {
        let axes = |kind: &str| Vector3::from_fn(|axis, _| number(model, kind, AXES[axis]));
        let scale = axes("gyro_scale") - axes("reference_scale");
        let mut map = Matrix3::identity() + Matrix3::from_diagonal(&scale);
        for name in SIX {
            let place = |letter: &str| AXES.iter().position(|axis| *axis == letter).unwrap_or(0);
            let (gyro, about) = (place(&name[..1]), place(&name[1..]));
            let sign = if (about + 1) % 3 == gyro { 1.0 } else { -1.0 };
            map[(gyro, 3 - gyro - about)] += sign * number(model, "installation", name);
        }
        let turn = Rotation3::from_scaled_axis(axes("reference_misalignment"));
        Self {
            bias_rad_s: axes("gyro_bias"),
            sensed_from_body: turn.into_inner() * map,
            middle_s: 0.5 * (stamps[0].0 + stamps[stamps.len() - 1].0),
            model,
        }
    }

    /// Converts a reference stamp to the gyros' clock \[s\].
    fn on_gyros_s(&self, time_s: f64) -> f64 {
        let late_s =
            number(self.model, "reference_delay", "all") - number(self.model, "gyro_delay", "all");
        let parted = number(self.model, "reference_clock_rate", "all");
        time_s - late_s - parted * (time_s - self.middle_s)
    }

    /// True if the reference has a fault at a time \[s\].
    fn is_wrong(&self, time_s: f64) -> bool {
        let faults = ["reference_spike", "reference_dropout"];
        let mut own = self.model.effects.iter();
        own.any(|effect| {
            let from_s = real(effect, "time_s").or_else(|| real(effect, "start_s"));
            let to_s = real(effect, "time_s").or_else(|| real(effect, "end_s"));
            let is_within = |(from_s, to_s): (f64, f64)| {
                from_s - AT_ONCE_S <= time_s && time_s <= to_s + AT_ONCE_S
            };
            faults.contains(&effect.kind.as_str()) && from_s.zip(to_s).is_some_and(is_within)
        })
    }
}

fn real(effect: &ModelEffect, name: &str) -> Option<f64> {
    match effect.parameters.get(name) {
        Some(EffectValue::Number(value)) => Some(*value),
        _ => None,
    }
}

fn number(model: &Model, kind: &str, name: &str) -> f64 {
    let effects = model.effects.iter().filter(|effect| effect.kind == kind);
    effects.filter_map(|effect| real(effect, name)).sum()
}

/// Values of a quantity about x, y and z; missing ones are replaced by those of the previous row.
fn triad(table: &Table, quantity: &Quantity) -> Option<Vec<Vector3<f64>>> {
    let [x, y, z] = AXES.map(|axis| table.channel(quantity, axis));
    let channels = [x?, y?, z?];
    let mut before = Vector3::zeros();
    let row = |row: usize| {
        for (axis, channel) in channels.iter().enumerate() {
            if channel.values[row].is_finite() {
                before[axis] = channel.values[row];
            }
        }
        before
    };
    Some((0..table.rows).map(row).collect())
}

/// Measured attitudes, with their times: the ends of uniform rows.
fn stamps(recording: &Recording) -> Option<Vec<Stamp>> {
    let quantity = Quantity::ReferenceAttitude;
    let (table, w) = recording.channel(&quantity, "w")?;
    let [x, y, z] = AXES.map(|axis| table.channel(&quantity, axis));
    let (x, y, z) = (x?, y?, z?);
    let time_s = |row: usize| match &table.clock {
        Clock::Uniform { rate_hz, start_s } => start_s + (row + 1) as f64 / rate_hz,
        Clock::Stamped { stamps_s, .. } => stamps_s[row],
    };
    let all = (0..table.rows).map(|row| {
        let parts = [w, x, y, z].map(|channel| channel.values[row]);
        (time_s(row), parts)
    });
    let measured = all.filter(|(_, parts)| parts.iter().all(|part| part.is_finite()));
    let stamps: Vec<Stamp> = measured
        .map(|(time_s, [w, x, y, z])| {
            let attitude = nalgebra::Quaternion::new(w, x, y, z);
            (time_s, UnitQuaternion::from_quaternion(attitude))
        })
        .collect();
    (stamps.len() > 3).then_some(stamps)
}

/// Reported effects of a recording: all alignment parameters from the joint fit, and its other effects.
fn said(diagnosis: &Diagnosis) -> Vec<Concealed> {
    let of = |kind: &str, parameters: &[ParameterEntry]| {
        let each = parameters.iter().map(|parameter| match parameter {
            ParameterEntry::Number { name, value, .. } => (name.clone(), Value::from(*value)),
            ParameterEntry::Text { name, value } => (name.clone(), Value::from(value.clone())),
        });
        Concealed {
            kind: kind.to_owned(),
            parameters: each.collect::<Map<String, Value>>(),
            rho: 0.0,
        }
    };
    let registration = diagnosis.registration.iter();
    let mut all: Vec<Concealed> = registration
        .map(|one| of(&one.kind, &one.parameters))
        .collect();
    for effect in &diagnosis.effects {
        if all.iter().all(|one| one.kind != effect.kind) {
            all.push(of(&effect.kind, &effect.parameters));
        }
    }
    all
}
