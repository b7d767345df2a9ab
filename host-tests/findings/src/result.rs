//! `diagnosis.json`: the project's contract, field by field, as serde types.
//!
//! SI units. Names and meanings are fixed by the contract; fields beyond it are additions.

use serde::Serialize;
use std::collections::BTreeMap;

use crate::numbers::SIGNIFICANT_SIGMAS;

/// What the tool says in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The model explains the recording.
    Matches,
    /// With the found effects it does.
    Explained,
    /// Something is found and something is left.
    PartlyExplained,
    /// Something is left and nothing is found.
    Unexplained,
    /// The recording carries too little to say.
    Unusable,
}

impl Verdict {
    /// Whether nothing is left to explain.
    pub fn is_told(self) -> bool {
        matches!(self, Verdict::Matches | Verdict::Explained)
    }
}

/// The whole file.
#[derive(Debug, Clone, Serialize)]
pub struct Diagnosis {
    /// Format of this file.
    pub format: u32,
    /// Name of the recording.
    pub recording: String,
    /// Version of the tool.
    pub version: String,
    /// Seed of the self-test and the control; nothing random enters the findings.
    pub seed: u64,
    /// One word.
    pub verdict: Verdict,
    /// One sentence each, for people.
    pub summary: Vec<String>,
    /// Where the model and the recording differ.
    pub locations: Vec<LocationEntry>,
    /// What was left out.
    pub effects: Vec<EffectEntry>,
    /// Addition: what aligns two instruments, where attitudes are the reference.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub registration: Vec<RegistrationEntry>,
    /// Before and after, on rows not fitted.
    pub fit: FitEntry,
    /// Kinds that this recording could not have shown, with the reason.
    pub not_excluded: Vec<String>,
    /// The motion that would separate what is confused.
    pub next_experiment: String,
    /// Addition: what that motion is worth, where it was computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub experiment: Option<ExperimentEntry>,
    /// Addition: the noise each gyro was judged with.
    pub noise: Vec<NoiseEntry>,
    /// Addition: the noise each accelerometer was judged with.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub accelerometer_noise: Vec<ForceNoiseEntry>,
    /// Addition: hypotheses tried, expressions and instants included.
    pub trials: usize,
    /// Addition: kinds that were weighed and lost, ln evidence behind the winner.
    pub runners_up: Vec<RunnerUp>,
    /// Addition: each tested kind's matched-filter SNR in this recording if it had its typical size.
    pub sensitivity: Vec<Sensitivity>,
    /// Addition: what the same search finds in the same rows in shuffled order; for units at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control: Option<ControlEntry>,
    /// Addition: false names and sensitivity of this search on this recording's own noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub self_test: Option<SelfTestEntry>,
}

impl Diagnosis {
    /// Adds how the search answers on this recording, where it was tried.
    pub fn tell(&mut self, tested: Option<Tested>) {
        if let Some(tested) = tested {
            self.self_test = Some(tested.self_test);
            self.sensitivity = tested.sensitivity;
        }
    }

    /// Adds sentences to the summary, right behind the verdict's.
    pub fn say_first(&mut self, sentences: Vec<String>) {
        let at = self.summary.len().min(1);
        self.summary.splice(at..at, sentences);
    }

    /// What is written of a recording of which nothing can be said, with the reason `why`.
    pub fn unusable(recording: &str, seed: u64, why: &str) -> Self {
        Self {
            format: 1,
            recording: recording.to_string(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            seed,
            verdict: Verdict::Unusable,
            summary: vec![format!("Nothing can be said of this recording: {why}.")],
            locations: Vec::new(),
            effects: Vec::new(),
            registration: Vec::new(),
            fit: FitEntry {
                fitted_on: Vec::new(),
                held_out: Vec::new(),
                recordings: Vec::new(),
                whole: None,
                channels: Vec::new(),
            },
            not_excluded: vec![format!("every kind: {why}")],
            next_experiment: "A longer recording with gyros, pickoffs and reference all measured."
                .to_string(),
            experiment: None,
            noise: Vec::new(),
            accelerometer_noise: Vec::new(),
            trials: 0,
            runners_up: Vec::new(),
            sensitivity: Vec::new(),
            control: None,
            self_test: None,
        }
    }
}

/// Numbers that align two instruments.
#[derive(Debug, Clone, Serialize)]
pub struct RegistrationEntry {
    /// Contract's kind.
    pub kind: String,
    /// Beyond what the model says.
    pub parameters: Vec<ParameterEntry>,
    /// Whether blocks of rows that were not fitted say so.
    pub supported: bool,
}

/// What the search made of noise alone, and of effects added to it.
#[derive(Debug, Clone, Serialize)]
pub struct SelfTestEntry {
    /// Trials with noise alone: drawn at the fitted levels, or what the fit left slid against the regressors.
    pub slides: usize,
    /// Of them, how many named a listed effect.
    pub false_names: usize,
    /// Upper limit of their share, 95 % confidence.
    pub upper_limit_95: f64,
    /// Detection by strength, all kinds together.
    pub curve: Vec<SelfTestPoint>,
    /// The same by kind.
    pub kinds: Vec<SelfTestKind>,
}

/// One strength of injected patterns.
#[derive(Debug, Clone, Serialize)]
pub struct SelfTestPoint {
    /// Matched-filter SNR.
    pub rho: f64,
    /// Effects added to noise.
    pub injections: usize,
    /// Trials that named something.
    pub detected: usize,
    /// Trials that named the kind, alone or in its class.
    pub named: usize,
    /// Share that theory would detect in noise as modelled.
    pub theory: f64,
}

/// One kind in the self-test.
#[derive(Debug, Clone, Serialize)]
pub struct SelfTestKind {
    /// Kind.
    pub kind: String,
    /// Trials with noise alone that named it.
    pub false_names: usize,
    /// Injections detected, in the order of the curve; null where its size would not be credible physics.
    pub detected: Vec<Option<usize>>,
    /// Injections rightly named.
    pub named: Vec<Option<usize>>,
}

/// The shuffled control.
#[derive(Debug, Clone, Serialize)]
pub struct ControlEntry {
    /// Lines found in shuffled rows.
    pub lines: usize,
    /// 2 Δ ln L of the strongest.
    pub strongest: f64,
    /// Cycles of the noise's power found in shuffled rows.
    pub cycles: usize,
    /// Lines and cycles of the recording that were dropped because the control shows as much.
    pub dropped: usize,
}

/// What the next experiment is worth, from the Fisher information of its motion under this recording's noise.
#[derive(Debug, Clone, Serialize)]
pub struct ExperimentEntry {
    /// What is done.
    pub programme: String,
    /// The moves, in order.
    pub moves: Vec<MoveEntry>,
    /// How often all of them are made.
    pub repeats: u32,
    /// Time between attitudes \[s\], where they are the reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude_every_s: Option<f64>,
    /// How far kinds come apart that are one class here.
    pub separations: Vec<SeparationEntry>,
    /// Standard deviations of the numbers of what was found.
    pub precisions: Vec<PrecisionEntry>,
}

/// One move of a table, as a scenario has it.
#[derive(Debug, Clone, Serialize)]
pub struct MoveEntry {
    /// `still`, `coning` or `spin`.
    pub kind: &'static str,
    /// Of the cone or the spin.
    pub axis: &'static str,
    /// Spin \[rad/s\].
    pub rate_rad_s: f64,
    /// Of the oscillation.
    pub oscillation_axis: &'static str,
    /// Of the oscillation or the cone \[Hz\].
    pub frequency_hz: f64,
    /// Peak angle of either \[rad\].
    pub angle_rad: f64,
    /// Phase of the oscillation's rate at the beginning \[rad\].
    pub phase_rad: f64,
    /// Ramp at either end \[s\].
    pub ramp_s: f64,
    /// Ramps included \[s\].
    pub duration_s: f64,
}

/// How far an effect, as large as it was found, lies outside what a rival can make.
#[derive(Debug, Clone, Serialize)]
pub struct SeparationEntry {
    /// The kind taken for true.
    pub truth: String,
    /// The kind it is separated from.
    pub rival: String,
    /// In this recording, in standard deviations; null: not computed.
    pub here_sigma: Option<f64>,
    /// In the experiment.
    pub promised_sigma: f64,
}

impl SeparationEntry {
    /// The kind that one of the two is told from.
    pub fn other_than(&self, own: &str) -> &str {
        if self.truth == own {
            &self.rival
        } else {
            &self.truth
        }
    }
}

/// How well a number of what was found will be known.
#[derive(Debug, Clone, Serialize)]
pub struct PrecisionEntry {
    /// The parameter.
    pub name: String,
    /// Standard deviation in this recording.
    pub here_std: f64,
    /// In the experiment.
    pub promised_std: f64,
    /// Of both.
    pub unit: String,
}

/// One location.
#[derive(Debug, Clone, Serialize)]
pub struct LocationEntry {
    /// `gyro_x`, ...
    pub channel: String,
    /// Addition, where there are several: the recording whose clock the times are read on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recording: Option<String>,
    /// Begin \[s\].
    pub start_s: f64,
    /// End \[s\].
    pub end_s: f64,
    /// Band \[Hz\].
    pub low_hz: f64,
    /// Band \[Hz\].
    pub high_hz: f64,
    /// How it goes with the motion.
    pub regime: String,
    /// Size in `unit`.
    pub size: f64,
    /// rad/s.
    pub unit: String,
    /// Chance, trials counted.
    pub p_value: f64,
    /// Addition: channels and products of two that it goes with in its band, found before any fit.
    pub coherent_with: Vec<CoherentEntry>,
}

/// A channel that a located mismatch goes with.
#[derive(Debug, Clone, Serialize)]
pub struct CoherentEntry {
    /// `gyro_x`, ...
    pub channel: String,
    /// Channel or product, as in expressions.
    pub with: String,
    /// How much later the mismatch does the same \[s\].
    pub lag_s: f64,
    /// −1 … 1.
    pub coherence: f64,
    /// Chance, expressions and lags counted.
    pub p_value: f64,
}

/// One parameter.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum ParameterEntry {
    /// A number with its spread.
    Number {
        /// Contract's name.
        name: String,
        /// Value.
        value: f64,
        /// Standard deviation.
        std: f64,
        /// Unit.
        unit: String,
    },
    /// `axis`, `expression`.
    Text {
        /// Contract's name.
        name: String,
        /// Text.
        value: String,
    },
}

impl EffectEntry {
    /// A parameter that is a text.
    pub fn text(&self, of: &str) -> Option<&str> {
        self.parameters.iter().find_map(|one| match one {
            ParameterEntry::Text { name, value } if name == of => Some(value.as_str()),
            _ => None,
        })
    }
}

/// A combination of parameters that the data fix.
#[derive(Debug, Clone, Serialize)]
pub struct Identifiable {
    /// Parameter → weight.
    pub combination: BTreeMap<String, f64>,
    /// Its value.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// One effect.
#[derive(Debug, Clone, Serialize)]
pub struct EffectEntry {
    /// Contract's kind.
    pub kind: String,
    /// Other kinds that the recording cannot tell from it; `unlisted` where physics outside the catalogue explains as much
    /// (`expression`), or where much beside it on the same gyro is only described.
    pub indistinguishable_from: Vec<String>,
    /// Addition: those of them that the gyros alone cannot tell from it, and gravity, as the accelerometers feel it, speaks
    /// against.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gravity_speaks_against: Vec<String>,
    /// Its equation.
    pub equation: String,
    /// Parameters.
    pub parameters: Vec<ParameterEntry>,
    /// Covariance of the numeric parameters, in order.
    pub covariance: Vec<Vec<f64>>,
    /// What is fixed.
    pub identifiable: Vec<Identifiable>,
    /// ln evidence gained.
    pub log_evidence_gain: f64,
    /// Chance, trials counted.
    pub p_value: f64,
    /// For a navigation engineer.
    pub what_was_left_out: String,
    /// Expression of unlisted physics; of a listed kind that such physics rivals (`indistinguishable_from` then holds
    /// `unlisted`), the rival.
    pub expression: Option<String>,
    /// Addition: its amplitude in each regime (1 = as fitted on all).
    pub regimes: Vec<RegimeEntry>,
    /// Additions: how sure it is, where rows beside the fitted ones were asked.
    #[serde(flatten)]
    pub evidence: Option<EvidenceEntry>,
}

/// How sure an effect is.
#[derive(Debug, Clone, Serialize)]
pub struct EvidenceEntry {
    /// `named`, or `class` where this recording cannot tell it from another kind or from drift.
    pub label: &'static str,
    /// Predictive log score that it gains on rows that were not fitted.
    pub confirmed_gain: f64,
    /// Share of the residual's power that it explains \[1\].
    pub share: f64,
    /// How often the recording was re-enacted without it.
    pub reenactments: usize,
    /// Mean squared size per number that those showed of it all the same \[σ²\]: 1 where the likelihood is right.
    pub inflation: f64,
}

/// The contract's kind of what has no name in the catalogue.
pub const UNLISTED: &str = "unlisted";

/// Of a listed kind that may be [`UNLISTED`] without an expression that rivals it.
pub const ONLY_DESCRIBED: &str = "Much beside it on the same gyro is only described: both may be one cause that is not in the catalogue.";

impl EffectEntry {
    /// Whether its class holds physics outside the catalogue.
    pub fn may_be_unlisted(&self) -> bool {
        let mut alike = self.indistinguishable_from.iter();
        alike.any(|kind| kind == UNLISTED)
    }
}

/// Amplitude in a regime.
#[derive(Debug, Clone, Serialize)]
pub struct RegimeEntry {
    /// Its name.
    pub name: String,
    /// λ.
    pub amplitude: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// Before and after.
#[derive(Debug, Clone, Serialize)]
pub struct FitEntry {
    /// Fitted times \[s\].
    pub fitted_on: Vec<[f64; 2]>,
    /// Held-out times \[s\].
    pub held_out: Vec<[f64; 2]>,
    /// Addition, where there are several recordings: the same on each one's own clock; `fitted_on` and `held_out`
    /// then count on from the first recording's clock without a gap.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub recordings: Vec<RecordingEntry>,
    /// Addition, where the recording was longer than memory: what was looked at how. Locations and powers are then of the
    /// stretches alone; parameters and drifts are of all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whole: Option<WholeEntry>,
    /// Gyros.
    pub channels: Vec<ChannelEntry>,
}

/// A recording longer than memory.
#[derive(Debug, Clone, Serialize)]
pub struct WholeEntry {
    /// Blocks per second \[Hz\] into which its rows were summed.
    pub blocks_per_s: f64,
    /// Stretches that were looked at row by row \[s\]; blocks that hold rows of them are left out.
    pub stretches_s: Vec<[f64; 2]>,
    /// Fitted in blocks \[s\].
    pub fitted_blocks_s: f64,
    /// Held out in blocks \[s\].
    pub held_out_blocks_s: f64,
    /// Out of use \[s\].
    pub unusable_s: f64,
    /// Gyros, on the held-out blocks.
    pub channels: Vec<ChannelEntry>,
}

/// One recording of several.
#[derive(Debug, Clone, Serialize)]
pub struct RecordingEntry {
    /// Its name.
    pub recording: String,
    /// Whether it was held out as a whole.
    pub held_out_whole: bool,
    /// Fitted times \[s\].
    pub fitted_on: Vec<[f64; 2]>,
    /// Held-out times \[s\].
    pub held_out: Vec<[f64; 2]>,
    /// Power of what is left over the shared noise in its held-out rows, x, y, z (1 = nothing left).
    pub normalised_power: [Option<f64>; 3],
}

/// One gyro before and after.
#[derive(Debug, Clone, Serialize)]
pub struct ChannelEntry {
    /// `gyro_x`, `accel_x`, ...
    pub channel: String,
    /// Addition: unit of the drifts where it is not rad/s (accelerometers: m/s^2).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// Addition: judged band \[Hz\].
    pub band_hz: [f64; 2],
    /// Without the effects.
    pub held_out_before: FiguresEntry,
    /// With them.
    pub held_out_after: FiguresEntry,
}

/// Figures of one gyro.
#[derive(Debug, Clone, Serialize)]
pub struct FiguresEntry {
    /// Mean rate \[rad/s\].
    pub drift_rad_s: f64,
    /// Addition: its standard deviation \[rad/s\].
    pub drift_std_rad_s: f64,
    /// Power over noise where located.
    pub normalised_power: f64,
    /// Power over noise everywhere held out.
    pub normalised_power_all: f64,
    /// Chance of being white.
    pub white_p_value: f64,
}

/// Noise of one gyro.
#[derive(Debug, Clone, Serialize)]
pub struct NoiseEntry {
    /// `gyro_x`, ...
    pub channel: String,
    /// \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: f64,
    /// \[rad\].
    pub angle_noise_rad: f64,
    /// Standard deviation of its drifting rate over the record \[rad/s\], where it drifts beyond what the model declares.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wandering_rad_s: Option<f64>,
    /// Addition: the terms of IEEE 952, as measured; of units at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terms: Option<NoiseTermsEntry>,
}

/// The terms of IEEE 952 of one gyro, fitted together.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct NoiseTermsEntry {
    /// N \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: LevelEntry,
    /// Q: white noise of angle \[rad\].
    pub quantisation_rad: LevelEntry,
    /// B \[rad/s\].
    pub bias_instability_rad_s: LevelEntry,
    /// K \[rad/s/√s\].
    pub rate_random_walk_rad_s_sqrt_s: LevelEntry,
}

/// A level with its standard deviation.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct LevelEntry {
    /// Value.
    pub value: f64,
    /// Standard deviation; where the value is less, that of its square, as a root.
    pub std: f64,
}

impl LevelEntry {
    /// Whether the level stands out from zero by [`SIGNIFICANT_SIGMAS`] of its standard deviations.
    pub fn is_measured(&self) -> bool {
        self.value > SIGNIFICANT_SIGMAS * self.std
    }

    /// The size that the level does not exceed, its square taken [`SIGNIFICANT_SIGMAS`] standard deviations up.
    pub fn bound(&self) -> f64 {
        (self.value.powi(2) + SIGNIFICANT_SIGMAS * self.std_of_square()).sqrt()
    }

    /// Levels are fitted as squares, whose distribution is near normal even where that of the level is not.
    fn std_of_square(&self) -> f64 {
        match self.value > self.std {
            true => 2.0 * self.value * self.std,
            false => self.std.powi(2),
        }
    }
}

/// Noise of one accelerometer.
#[derive(Debug, Clone, Serialize)]
pub struct ForceNoiseEntry {
    /// `accel_x`, ...
    pub channel: String,
    /// White noise of the force, one-sided \[m/s²/√Hz\].
    pub noise_m_s2_sqrt_hz: f64,
    /// White noise of the velocity \[m/s\].
    pub velocity_noise_m_s: f64,
    /// The terms of IEEE 952, of a unit at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terms: Option<ForceTermsEntry>,
}

/// The terms of IEEE 952 of one accelerometer at rest.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ForceTermsEntry {
    /// N \[m/s/√s\].
    pub velocity_random_walk_m_s_sqrt_s: LevelEntry,
    /// Q: white noise of velocity \[m/s\].
    pub quantisation_m_s: LevelEntry,
    /// B \[m/s²\].
    pub bias_instability_m_s2: LevelEntry,
    /// K \[m/s²/√s\].
    pub acceleration_random_walk_m_s2_sqrt_s: LevelEntry,
}

/// A kind that lost.
#[derive(Debug, Clone, Serialize)]
pub struct RunnerUp {
    /// Kind.
    pub kind: String,
    /// ln evidence behind.
    pub behind: f64,
}

impl RunnerUp {
    /// Each kind once, by its nearest: kinds with what each is behind, in the order of their names.
    pub fn nearest<'a>(rivals: impl Iterator<Item = (&'a str, f64)>) -> Vec<Self> {
        let mut nearest: BTreeMap<&str, f64> = BTreeMap::new();
        for (kind, behind) in rivals {
            let entry = nearest.entry(kind).or_insert(behind);
            *entry = entry.min(behind);
        }
        let kinds = nearest.into_iter();
        kinds
            .map(|(kind, behind)| Self {
                kind: kind.to_string(),
                behind,
            })
            .collect()
    }
}

/// A kind's reach.
#[derive(Debug, Clone, Serialize)]
pub struct Sensitivity {
    /// Kind.
    pub kind: String,
    /// Typical size.
    pub typical: f64,
    /// Unit.
    pub unit: String,
    /// Matched-filter SNR of one of its numbers alone at that size, that which shows best.
    pub snr: f64,
    /// The same of the number that shows worst; 0 where no size of it that anybody would believe is found.
    pub snr_weakest: f64,
}

/// How a search answers on the very recording that it searched.
#[derive(Debug, Clone)]
pub struct Tested {
    /// What it made of noise alone, and of effects added to it.
    pub self_test: SelfTestEntry,
    /// How well each kind would show, in the order of the catalogue.
    pub sensitivity: Vec<Sensitivity>,
}
