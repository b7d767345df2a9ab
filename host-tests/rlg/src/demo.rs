//! Runs the whole sequence once: simulate, replay, diagnose, correct, replay.
//!
//! From a seed and a length \[s\] it makes a [`Demo`]: the simulated recording with its model, the diagnosis, the parameters
//! to flash into the firmware, and [`Figures`], the drifts of the chain before and after \[°/h\], body axes.
//!
//! Data flow: scenario → recording → chain with Eq. (7) alone → diagnosis → the found effects as the
//! chain's parameters → chain in f32 and in fixed point, each against the f64 reference chain.
//!
//! The concealed effect reaches [`Figures`] from the simulator directly, for comparison with the finding; neither the
//! diagnosis nor the chain reads it. Out of scope: words and files; the command has them.

use std::path::Path;

use rlg_diagnosis::Outcome;
use rlg_findings::result::{Identifiable, NoiseEntry, ParameterEntry};
use serde::Serialize;
use trueaxis::{ParameterError, Parameters};

use crate::diagnose::diagnose;
use crate::error::InputError;
use crate::recording::{Axis, Recording, Segment};
use crate::replay::drift::{
    DEG_H_PER_RAD_S, drift, mean_difference_deg_h, periods_in, reference_rotations_rad, segments,
};
use crate::replay::samples::{ReplayInput, Setup, samples_from_recording};
use crate::replay::{Core, Replay, replay};
use crate::simulate::scenario::Scenario;
use crate::simulate::{Simulation, Truth, demo_scenario, simulate};

/// The results of the demonstration.
pub struct Demo {
    /// The simulation.
    pub simulation: Simulation,
    /// The diagnosis.
    pub outcome: Outcome,
    /// The firmware's parameters with the findings.
    pub parameters: Parameters,
    /// The result in numbers.
    pub figures: Figures,
}

/// The result in numbers.
#[derive(Debug, Clone, Serialize)]
pub struct Figures {
    /// Format of these figures.
    pub format: u32,
    /// Version of the tool.
    pub version: &'static str,
    /// Seed of the simulation.
    pub seed: u64,
    /// Length of the recording \[s\].
    pub seconds: f64,
    /// Kinds found.
    pub found: Vec<String>,
    /// Best-determined combinations of the parameters, with the concealed values.
    pub fixed: Vec<Fixed>,
    /// Drift while the case cones.
    pub segments: Vec<SegmentDrift>,
    /// Ratio of the largest drift before to the largest after, the worse of both number systems.
    pub times_less: f64,
    /// Found kinds without a term in the chain.
    pub uncompensated: Vec<String>,
    /// Largest mean difference to the f64 reference chain, any axis and segment \[°/h\].
    pub against_reference_deg_h: ByCore,
}

/// Combination of parameters, found and concealed.
#[derive(Debug, Clone, Serialize)]
pub struct Fixed {
    /// Kind of the effect.
    pub kind: String,
    /// The combination with its value and standard deviation.
    #[serde(flatten)]
    pub found: Identifiable,
    /// Unit of the values.
    pub unit: String,
    /// Value of the same combination in the simulator.
    pub concealed: f64,
}

/// The drift of one gyro over one segment \[°/h\].
#[derive(Debug, Clone, Serialize)]
pub struct SegmentDrift {
    /// Name of the segment.
    pub segment: String,
    /// Gyro with the largest drift in the segment.
    pub axis: &'static str,
    /// Drift by Eq. (7) alone, in f32.
    pub before_deg_h: f64,
    /// Drift with the found effects.
    pub after_deg_h: ByCore,
    /// Standard deviation of such a mean due to the random walk of gyro and reference alone.
    pub noise_deg_h: f64,
}

/// One value for each of the firmware's number systems.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ByCore {
    /// Single precision.
    pub f32: f64,
    /// Fixed point.
    pub fixed: f64,
}

impl ByCore {
    /// Returns the value with the larger magnitude.
    pub fn worst(self) -> f64 {
        self.f32.abs().max(self.fixed.abs())
    }
}

/// Callback with the present step and its progress: rows done, of rows.
pub type Progress<'a> = dyn FnMut(&str, Option<(usize, usize)>) + 'a;

/// Returns the demo's scenario, every segment scaled alike to `seconds` in all.
pub fn scenario(seconds: f64) -> Result<Scenario, InputError> {
    let mut scenario = demo_scenario()?;
    let share = seconds * scenario.rate_hz / scenario.rows() as f64;
    for segment in &mut scenario.segments {
        segment.rows = (segment.rows as f64 * share).round() as usize;
    }
    Ok(scenario)
}

/// Runs the demonstration; `model_file` is the future path of the model, for messages.
pub fn tell(
    seed: u64,
    seconds: f64,
    model_file: &Path,
    progress: &mut Progress,
) -> Result<Demo, InputError> {
    let scenario = scenario(seconds)?;
    let rows = scenario.rows();
    let simulation = simulate(&scenario, seed, |done| {
        progress("simulating", Some((done, rows)))
    });
    let recording = &simulation.recording;

    let setup = Setup::STANDARD;
    let run = |input: &ReplayInput, core: Core| {
        let refused = |error: ParameterError| {
            InputError::new(model_file, format!("does not fit the chain: {error}"))
        };
        replay(input, core, &input.parameters).map_err(refused)
    };
    progress("replaying", None);
    let as_modelled = samples_from_recording(recording, &simulation.model, model_file, setup)?;
    let before = run(&as_modelled, Core::F32)?;

    let outcome = {
        // The diagnosis takes a shared function; the display is a mutable one.
        let shown = std::cell::RefCell::new(&mut *progress);
        let stage = |stage: &str| (shown.borrow_mut())(stage, None);
        diagnose(recording, &simulation.model, model_file, seed, &stage)?
    };

    progress("replaying", None);
    let corrected = samples_from_recording(recording, &outcome.model, model_file, setup)?;
    let after = Cores {
        f32: run(&corrected, Core::F32)?,
        fixed: run(&corrected, Core::Fixed)?,
        f64_chain: run(&corrected, Core::Reference)?,
    };
    let segment_drifts = segment_drifts(
        recording,
        &corrected,
        &before,
        &after,
        &outcome.diagnosis.noise,
    );
    let most =
        |drift: &dyn Fn(&SegmentDrift) -> f64| segment_drifts.iter().map(drift).fold(0.0, f64::max);
    let figures = Figures {
        format: 1,
        version: env!("CARGO_PKG_VERSION"),
        seed,
        seconds: rows as f64 / scenario.rate_hz,
        found: outcome
            .diagnosis
            .effects
            .iter()
            .map(|effect| effect.kind.clone())
            .collect(),
        fixed: fixed(&outcome, &simulation.truth),
        times_less: most(&|drift| drift.before_deg_h.abs())
            / most(&|drift| drift.after_deg_h.worst()),
        uncompensated: corrected.uncompensated.clone(),
        against_reference_deg_h: after.against_reference(recording, &corrected),
        segments: segment_drifts,
    };
    Ok(Demo {
        parameters: corrected.parameters,
        simulation,
        outcome,
        figures,
    })
}

/// Outputs of the chain with the found effects, in every arithmetic.
struct Cores {
    f32: Replay,
    fixed: Replay,
    f64_chain: Replay,
}

impl Cores {
    /// Computes it over the recording and each of its segments.
    fn against_reference(&self, recording: &Recording, input: &ReplayInput) -> ByCore {
        let periods = self.f64_chain.rotations_rad.len();
        let parts = segments(recording, input);
        let parts = parts.iter().map(|part| periods_in(part, input, periods));
        let ranges: Vec<_> = parts.chain(std::iter::once(0..periods)).collect();
        let most = |core: &Replay| {
            let differences = ranges.iter().filter_map(|range| {
                mean_difference_deg_h(
                    &core.rotations_rad,
                    &self.f64_chain.rotations_rad,
                    range.clone(),
                    input,
                )
            });
            differences
                .flatten()
                .fold(0.0, |most: f64, axis| most.max(axis.abs()))
        };
        ByCore {
            f32: most(&self.f32),
            fixed: most(&self.fixed),
        }
    }
}

/// Computes the drifts of the segments in which the case cones, each of the gyro with the largest.
fn segment_drifts(
    recording: &Recording,
    input: &ReplayInput,
    before: &Replay,
    after: &Cores,
    noise: &[NoiseEntry],
) -> Vec<SegmentDrift> {
    let Some(truth) = reference_rotations_rad(input) else {
        return Vec::new();
    };
    let drift_of = |of: &Replay, segment: &Segment| {
        let range = periods_in(segment, input, of.rotations_rad.len());
        Some(drift(&of.rotations_rad, &truth, range, input)?.deg_h)
    };
    let coning = recording
        .segments
        .iter()
        .filter(|segment| segment.kind == "coning");
    let one = |segment: &Segment| {
        let (before, f32, fixed) = (
            drift_of(before, segment)?,
            drift_of(&after.f32, segment)?,
            drift_of(&after.fixed, segment)?,
        );
        let axis = Axis::ALL
            .into_iter()
            .max_by(|a, b| before[a.index()].abs().total_cmp(&before[b.index()].abs()))?;
        Some(SegmentDrift {
            segment: segment.name.clone(),
            axis: axis.label(),
            before_deg_h: before[axis.index()],
            after_deg_h: ByCore {
                f32: f32[axis.index()],
                fixed: fixed[axis.index()],
            },
            noise_deg_h: {
                let walk = noise.get(axis.index())?.angle_random_walk_rad_sqrt_s;
                walk / (segment.end_s - segment.start_s).sqrt() * DEG_H_PER_RAD_S
            },
        })
    };
    coning.filter_map(one).collect()
}

/// Number of combinations shown: one for each gyro.
const SHOWN: usize = 3;

/// Selects the combinations with the largest ratio of value to standard deviation, each with the concealed value.
fn fixed(outcome: &Outcome, truth: &Truth) -> Vec<Fixed> {
    let concealed = |kind: &str, found: &Identifiable| {
        let effects = truth.effects.iter().filter(|effect| effect.kind == kind);
        let one = |effect: &crate::model::ModelEffect| -> f64 {
            found
                .combination
                .iter()
                .map(|(name, weight)| weight * effect.number(name))
                .sum()
        };
        effects.map(one).sum()
    };
    let mut all: Vec<Fixed> = outcome
        .diagnosis
        .effects
        .iter()
        .flat_map(|effect| effect.identifiable.iter().map(move |found| (effect, found)))
        .map(|(effect, found)| Fixed {
            kind: effect.kind.clone(),
            unit: unit(&effect.parameters),
            concealed: concealed(&effect.kind, found),
            found: found.clone(),
        })
        .collect();
    let far = |fixed: &Fixed| (fixed.found.value / fixed.found.std).abs();
    all.sort_by(|a, b| far(b).total_cmp(&far(a)));
    all.truncate(SHOWN);
    all.sort_by(|a, b| a.found.combination.keys().cmp(b.found.combination.keys()));
    all
}

/// Returns the unit of the first number.
fn unit(parameters: &[ParameterEntry]) -> String {
    let number = parameters.iter().find_map(|parameter| match parameter {
        ParameterEntry::Number { unit, .. } => Some(unit.clone()),
        ParameterEntry::Text { .. } => None,
    });
    number.unwrap_or_default()
}
