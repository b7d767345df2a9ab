//! A concealed case: motion and effects as scenario text, the recording, its diagnosis, and the measures of comparison for
//! the tests of hidden effects.
//!
//! A [`Case`] comes from text for the workspace's simulator. The instrument is that of `null.toml` (0.4″ pulses, 0.002
//! °/√h, dithers of 150″) without accelerometers, its rows at 1000 Hz.

use rlg::diagnose::diagnose;
use rlg::diagnose::qualify::qualify;
use rlg::diagnose::result::{Diagnosis, EffectEntry, ParameterEntry, Verdict};
use rlg::diagnose::streams::{Streams, Triad};
use rlg::model::Model;
use rlg::recording::{Clock, Quantity, Recording};
use rlg::simulate::scenario::Scenario;
use rlg::simulate::simulate;
use rlg_diagnosis::rows::data::Data;
use rlg_diagnosis::search::passes::residual_of_model;
use rlg_diagnosis::tiles::held_out_figures::validate;
use rlg_diagnosis::tiles::noise_spectrum::Noise;
use rlg_plan::{AlignPlan, Plan};
use rlg_signal::partition::Use;
use std::ops::Range;
use std::path::Path;

pub(super) const STILL_SLEWS_AND_VIBRATION: &str = include_str!("../../../../scenarios/null.toml");

/// Tolerance in standard deviations: of the hundred numbers in this file one in three hundred exceeds three by chance, one
/// in fifteen thousand four.
pub(super) const WITHIN: f64 = 4.0;

pub(super) const FLEXURE: [(&str, f64); 6] = [
    ("xy", 6.9e-8),
    ("xz", 7.1e-8),
    ("yx", 7.5e-8),
    ("yz", 7.3e-8),
    ("zx", 6.7e-8),
    ("zy", 7.6e-8),
];

pub(super) fn still(seconds: f64) -> String {
    format!("[[motion]]\nkind = \"still\"\nduration_s = {seconds:.1}\n")
}

/// Coning at 15 Hz about an axis.
pub(super) fn coning(axis: &str, angle_rad: f64, seconds: f64) -> String {
    format!(
        "[[motion]]\nkind = \"coning\"\naxis = \"{axis}\"\nfrequency_hz = 15.0\nangle_rad = {angle_rad}\n\
         duration_s = {seconds:.1}\nramp_s = 1.0\n"
    )
}

pub(super) fn slew(axis: &str, angle_rad: f64) -> String {
    format!(
        "[[motion]]\nkind = \"slew\"\naxis = \"{axis}\"\nangle_rad = {angle_rad:.1}\nduration_s = 5.0\n"
    )
}

/// Random rates of independent axes in a band.
pub(super) fn vibration(
    name: &str,
    [low_hz, high_hz]: [f64; 2],
    rms_rad_s: f64,
    seconds: f64,
) -> String {
    format!(
        "[[motion]]\nkind = \"vibration\"\nname = \"{name}\"\nlow_hz = {low_hz:.1}\nhigh_hz = {high_hz:.1}\n\
         rate_rms_rad_s = [{rms_rad_s}, {rms_rad_s}, {rms_rad_s}]\nduration_s = {seconds:.1}\nramp_s = 0.5\n"
    )
}

pub(super) fn effect(kind: &str, values: &[(&str, f64)]) -> String {
    let values: String = values
        .iter()
        .map(|(name, value)| format!("{name} = {value:e}\n"))
        .collect();
    format!("[[effect]]\nkind = \"{kind}\"\nconcealed = true\n{values}")
}

pub(super) fn unlisted(axis: &str, coefficient: f64, expression: &str) -> String {
    format!(
        "[[effect]]\nkind = \"unlisted\"\nconcealed = true\naxis = \"{axis}\"\ncoefficient = {coefficient:e}\n\
         expression = \"{expression}\"\n"
    )
}

/// Marks these channels as not recorded.
pub(super) fn lost(channels: &[&str], [start_s, end_s]: [f64; 2]) -> String {
    channels
        .iter()
        .map(|channel| {
            format!(
                "[[effect]]\nkind = \"lost_samples\"\nconcealed = true\nchannel = \"{channel}\"\n\
                 start_s = {start_s:.1}\nend_s = {end_s:.1}\n"
            )
        })
        .collect()
}

/// Adds to gyro y of a recording of increments a further sensed rate \[rad/s\], a function of the case's rates about x, y
/// and z and the rows' rate \[Hz\].
pub(super) fn sensing_besides(
    (mut recording, model): (Recording, Model),
    further_rad_s: impl FnOnce(&Triad, f64) -> Vec<f64>,
) -> (Recording, Model) {
    let mut rate_hz = 0.0;
    let rates_rad_s = ["x", "y", "z"].map(|axis| -> Vec<f64> {
        let turned = recording.channel(&Quantity::ReferenceIncrement, axis);
        let (table, turned) = turned.expect("a reference");
        let Clock::Uniform {
            rate_hz: rows_hz, ..
        } = table.clock
        else {
            panic!("the simulator's rows are even");
        };
        rate_hz = rows_hz;
        turned.values.iter().map(|angle| angle * rate_hz).collect()
    });
    let further_rad_s = further_rad_s(&rates_rad_s, rate_hz);
    let gyro_y = recording
        .tables
        .iter_mut()
        .flat_map(|table| &mut table.channels)
        .find(|channel| {
            channel.quantity == Quantity::GyroIncrement && channel.axis.as_deref() == Some("y")
        })
        .expect("gyro y");
    let values = gyro_y.values.iter_mut().zip(further_rad_s);
    values.for_each(|(value, more)| *value += more / rate_hz);
    (recording, model)
}

/// A recording with its model and its diagnosis.
pub(super) struct Case {
    pub(super) recording: Recording,
    pub(super) model: Model,
    pub(super) said: Diagnosis,
    pub(super) explained: Model,
}

impl Case {
    pub(super) fn made(motion: &[String], effects: &[String], seed: u64) -> (Recording, Model) {
        let instrument = STILL_SLEWS_AND_VIBRATION
            .split("[accelerometer]")
            .next()
            .expect("an instrument before its accelerometers")
            .replace("rate_hz = 4000.0", "rate_hz = 1000.0");
        Self::simulated(
            &format!("{instrument}{}{}", motion.concat(), effects.concat()),
            seed,
        )
    }

    /// Simulates motion of an instrument of fine increments at 400 Hz: an effect added behind a coarse pulse would not be
    /// rounded with the rest.
    pub(super) fn of_increments(motion: &[String], seed: u64) -> (Recording, Model) {
        let table = include_str!("../table_programme.toml");
        let instrument = table.split("[[motion]]").next().expect("an instrument");
        Self::simulated(&format!("{instrument}{}", motion.concat()), seed)
    }

    pub(super) fn simulated(text: &str, seed: u64) -> (Recording, Model) {
        let scenario = Scenario::parse(text, Path::new("hidden.toml")).expect("a scenario");
        let simulation = simulate(&scenario, seed, |_| {});
        (simulation.recording, simulation.model)
    }

    pub(super) fn diagnosed((recording, model): (Recording, Model)) -> Self {
        let outcome =
            diagnose(&recording, &model, Path::new("model.toml"), 0, &|_| {}).expect("a diagnosis");
        Self {
            recording,
            model,
            said: outcome.diagnosis,
            explained: outcome.model,
        }
    }

    pub(super) fn kinds(&self) -> Vec<&str> {
        let effects = self.said.effects.iter();
        effects.map(|effect| effect.kind.as_str()).collect()
    }

    /// Returns the finding of this kind, the only one.
    pub(super) fn found(&self, kind: &str) -> &EffectEntry {
        let mut alike = self.said.effects.iter().filter(|one| one.kind == kind);
        let (first, second) = (alike.next(), alike.next());
        assert!(second.is_none(), "{kind} twice: {:#?}", self.said.summary);
        first.unwrap_or_else(|| panic!("no {kind}: {:#?}", self.said.summary))
    }

    /// Checks that these kinds and no others are found, and nothing remains.
    pub(super) fn is_explained_by(&self, kinds: &[&str]) {
        assert_eq!(self.kinds(), kinds, "{:#?}", self.said.summary);
        let summary = &self.said.summary;
        assert_eq!(self.said.verdict, Verdict::Explained, "{summary:#?}");
        let gain = self.held_out_gain();
        // Fitting noise makes held-out rows less likely.
        assert!(gain > 0.0, "2 Δ ln L on held-out rows {gain}");
    }

    /// Computes the decrease of the residual's power over declared noise from the given model to the found one, summed over
    /// the gyros, on the test rows.
    pub(super) fn held_out_gain(&self) -> f64 {
        let [before, after] =
            [&self.model, &self.explained].map(|model| residual(&self.recording, model));
        let walk = self.model.gyro.angle_random_walk_rad_sqrt_s;
        let walk = walk.expect("declared");
        let noise = [0, 1, 2].map(|axis: usize| {
            let pulses = self.model.gyro.pulse_weight_rad[axis].powi(2) / 12.0;
            let white = pulses + self.model.pickoff_white_rad2(axis);
            Noise {
                theta: [walk[axis].powi(2) / before.rate_hz, white, 0.0, 0.0],
                rate_hz: before.rate_hz,
            }
        });
        let channels = validate(
            &before.left_rad,
            &after.left_rad,
            &noise,
            (&before.tested, [0.0, before.rate_hz / 2.0]),
            &[],
            before.rate_hz,
            &rlg_plan::HeldOutPlan::default(),
        );
        assert_eq!(channels.len(), 3);
        let falls = channels
            .iter()
            .map(|one| one.before.normalised_power_all - one.after.normalised_power_all);
        falls.sum()
    }
}

/// Residual of a model.
struct Residual {
    left_rad: Triad,
    /// Test rows.
    tested: Vec<Range<usize>>,
    start_s: f64,
    rate_hz: f64,
}

fn residual(recording: &Recording, model: &Model) -> Residual {
    let plan = Plan::default();
    let mut streams = Streams::align(recording, model, &AlignPlan::default()).expect("it aligns");
    qualify(&mut streams, &plan.signal.faults);
    let (start_s, rate_hz) = (streams.start_s, streams.rate_hz);
    let mut data = Data::new(&mut streams, model, &plan, Path::new("model.toml")).expect("data");
    let left_rad = residual_of_model(&mut data, &plan).expect("rows");
    let tested = data.ranges_of(&[Use::Test]);
    Residual {
        left_rad,
        tested,
        start_s,
        rate_hz,
    }
}

/// Computes the mean rate of a model's residual from `from_s` to `to_s` \[rad/s\].
pub(super) fn mean_rad_s(
    recording: &Recording,
    model: &Model,
    [from_s, to_s]: [f64; 2],
) -> [f64; 3] {
    let Residual {
        left_rad,
        start_s,
        rate_hz,
        ..
    } = residual(recording, model);
    let last = left_rad[0].len();
    let row_at = |time_s: f64| (((time_s - start_s) * rate_hz).round() as usize).min(last);
    let rows = row_at(from_s)..row_at(to_s);
    left_rad.map(|values| values[rows.clone()].iter().sum::<f64>() / rows.len() as f64 * rate_hz)
}

pub(super) fn number(effect: &EffectEntry, wanted: &str) -> (f64, f64) {
    let numbers = effect.parameters.iter();
    numbers
        .filter_map(|parameter| match parameter {
            ParameterEntry::Number {
                name, value, std, ..
            } => (name == wanted).then_some((*value, *std)),
            ParameterEntry::Text { .. } => None,
        })
        .next()
        .unwrap_or_else(|| panic!("no {wanted} in {:?}", effect.parameters))
}

pub(super) fn text<'a>(effect: &'a EffectEntry, wanted: &str) -> Option<&'a str> {
    effect
        .parameters
        .iter()
        .find_map(|parameter| match parameter {
            ParameterEntry::Text { name, value } if name == wanted => Some(value.as_str()),
            _ => None,
        })
}

/// Checks that every number of a finding is the concealed one, absent ones 0.
pub(super) fn holds(effect: &EffectEntry, concealed: &[(&str, f64)]) {
    for parameter in &effect.parameters {
        let ParameterEntry::Number {
            name, value, std, ..
        } = parameter
        else {
            continue;
        };
        let truth = concealed.iter().find(|(known, _)| known == name);
        let truth = truth.map_or(0.0, |(_, value)| *value);
        assert!(
            (value - truth).abs() < WITHIN * std,
            "{} {name}: {value:e} ± {std:e}, {truth:e}",
            effect.kind
        );
    }
}

/// Computes √(vᵀ C⁻¹ v).
pub(super) fn strength(effect: &EffectEntry) -> f64 {
    let values: Vec<f64> = effect
        .parameters
        .iter()
        .filter_map(|parameter| match parameter {
            ParameterEntry::Number { value, .. } => Some(*value),
            ParameterEntry::Text { .. } => None,
        })
        .collect();
    let count = values.len();
    let covariance = nalgebra::DMatrix::from_fn(count, count, |a, b| effect.covariance[a][b]);
    let values = nalgebra::DVector::from_vec(values);
    let inverse = covariance.try_inverse().expect("a proper covariance");
    values.dot(&(inverse * &values)).sqrt()
}
