//! `diagnosis.json`: the project's contract, field by field, as serde types.
//!
//! SI units. Names and meanings are fixed by the contract; fields beyond it are additions.

use serde::Serialize;
use std::collections::BTreeMap;

use crate::numbers::SIGNIFICANT_SIGMAS;

/// Verdict of the diagnosis, in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The model explains the recording.
    Matches,
    /// The found effects explain the recording.
    Explained,
    /// The found effects explain the recording in part.
    PartlyExplained,
    /// A mismatch is left and no effect is found.
    Unexplained,
    /// The recording carries too little information.
    Unusable,
}

impl Verdict {
    /// True if no mismatch is left unexplained.
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
    /// Seed of the self-test and the control; the findings use no random numbers.
    pub seed: u64,
    /// Verdict.
    pub verdict: Verdict,
    /// Sentences for the reader.
    pub summary: Vec<String>,
    /// Locations of the mismatch between model and recording.
    pub locations: Vec<LocationEntry>,
    /// Effects missing in the model.
    pub effects: Vec<EffectEntry>,
    /// Addition: alignment of two instruments, for an attitude reference.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub registration: Vec<RegistrationEntry>,
    /// Fit before and after, on held-out rows.
    pub fit: FitEntry,
    /// Kinds not observable in this recording, with the reason.
    pub not_excluded: Vec<String>,
    /// Motion that would separate the indistinguishable kinds.
    pub next_experiment: String,
    /// Addition: predicted benefit of that motion, if computed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub experiment: Option<ExperimentEntry>,
    /// Addition: residual relative to the motion; absent at rest, or where it exceeds the motion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub residual: Option<ResidualEntry>,
    /// Addition: noise of each gyro in the tests.
    pub noise: Vec<NoiseEntry>,
    /// Addition: noise of each accelerometer in the tests.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub accelerometer_noise: Vec<ForceNoiseEntry>,
    /// Addition: number of hypotheses tested, expressions and instants included.
    pub trials: usize,
    /// Addition: rejected kinds, with their ln evidence behind the selected one.
    pub runners_up: Vec<RunnerUp>,
    /// Addition: matched-filter SNR in this recording of each tested kind at its typical size.
    pub sensitivity: Vec<Sensitivity>,
    /// Addition: findings of the same search in the same rows in shuffled order; for units at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub control: Option<ControlEntry>,
    /// Addition: false names and sensitivity of this search on this recording's noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub self_test: Option<SelfTestEntry>,
    /// Addition: thresholds other than the defaults, from `--plan FILE`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub plan: Vec<PlanEntry>,
}

/// A threshold that differs from its default.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlanEntry {
    /// Name, as `rlg plan` prints it with its section: `judgement.naming`.
    pub number: String,
    /// Values used, in the unit that `rlg plan` prints.
    pub value: Vec<f64>,
    /// Default values.
    pub default: Vec<f64>,
}

impl Diagnosis {
    /// Records the thresholds that differ from the defaults, in the summary too.
    pub fn under_plan(&mut self, changed: Vec<PlanEntry>) {
        if changed.is_empty() {
            return;
        }
        let words = |values: &[f64]| {
            let each: Vec<String> = values.iter().map(|value| format!("{value}")).collect();
            each.join(", ")
        };
        let each: Vec<String> = changed
            .iter()
            .map(|one| {
                format!(
                    "{} {} instead of {}",
                    one.number,
                    words(&one.value),
                    words(&one.default)
                )
            })
            .collect();
        self.say_first(vec![format!(
            "With other thresholds than the defaults: {}.",
            each.join("; ")
        )]);
        self.plan = changed;
    }

    /// Adds the self-test and the sensitivity, if they were computed.
    pub fn tell(&mut self, tested: Option<Tested>) {
        if let Some(tested) = tested {
            self.self_test = Some(tested.self_test);
            self.sensitivity = tested.sensitivity;
        }
    }

    /// Inserts sentences into the summary, after the verdict's.
    pub fn say_first(&mut self, sentences: Vec<String>) {
        let at = self.summary.len().min(1);
        self.summary.splice(at..at, sentences);
    }

    /// Diagnosis of an unusable recording, with the reason `why`.
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
            residual: None,
            noise: Vec::new(),
            accelerometer_noise: Vec::new(),
            trials: 0,
            runners_up: Vec::new(),
            sensitivity: Vec::new(),
            control: None,
            self_test: None,
            plan: Vec::new(),
        }
    }
}

/// Parameters of the alignment of two instruments.
#[derive(Debug, Clone, Serialize)]
pub struct RegistrationEntry {
    /// Contract's kind.
    pub kind: String,
    /// Estimates beyond the model's values.
    pub parameters: Vec<ParameterEntry>,
    /// Held-out blocks of rows support the parameters.
    pub supported: bool,
}

/// Residual of everything found, relative to the motion.
#[derive(Debug, Clone, Serialize)]
pub struct ResidualEntry {
    /// Ratio of the root mean squares of residual and motion, as turns over 0.1 s \[1\].
    pub share_of_motion: f64,
    /// Coherence of readings and prediction, by octave.
    pub coherence: Vec<CoherenceEntry>,
}

/// Magnitude-squared coherence of readings and prediction in one octave.
#[derive(Debug, Clone, Serialize)]
pub struct CoherenceEntry {
    /// Lower edge \[Hz\].
    pub low_hz: f64,
    /// Upper edge \[Hz\].
    pub high_hz: f64,
    /// Coherence of gyros x, y, z \[1\].
    pub gyros: [f64; 3],
}

/// Self-test of the search: trials with noise alone, and with effects added to it.
#[derive(Debug, Clone, Serialize)]
pub struct SelfTestEntry {
    /// Trials with noise alone: drawn at the fitted levels or, for attitudes, with the residual's scatter in each block.
    pub slides: usize,
    /// Trials with noise alone that named a listed effect.
    pub false_names: usize,
    /// Upper limit of their share, 95 % confidence.
    pub upper_limit_95: f64,
    /// Detections by strength, all kinds together.
    pub curve: Vec<SelfTestPoint>,
    /// Detections by kind.
    pub kinds: Vec<SelfTestKind>,
}

/// One strength of injected effects.
#[derive(Debug, Clone, Serialize)]
pub struct SelfTestPoint {
    /// Matched-filter SNR.
    pub rho: f64,
    /// Effects injected into noise.
    pub injections: usize,
    /// Trials with a detection.
    pub detected: usize,
    /// Trials that named the injected kind, alone or in its class.
    pub named: usize,
    /// Detection probability predicted for the modelled noise.
    pub theory: f64,
}

/// One kind in the self-test.
#[derive(Debug, Clone, Serialize)]
pub struct SelfTestKind {
    /// Kind.
    pub kind: String,
    /// Trials with noise alone that named this kind.
    pub false_names: usize,
    /// Detected injections, in the order of the curve; null for sizes that are not credible.
    pub detected: Vec<Option<usize>>,
    /// Correctly named injections.
    pub named: Vec<Option<usize>>,
}

/// Control with shuffled rows.
#[derive(Debug, Clone, Serialize)]
pub struct ControlEntry {
    /// Lines found in shuffled rows.
    pub lines: usize,
    /// 2 Δ ln L of the strongest.
    pub strongest: f64,
    /// Periodic variations of the noise's power found in shuffled rows.
    pub cycles: usize,
    /// Lines and cycles of the recording rejected because the control shows as many.
    pub dropped: usize,
}

/// Predicted benefit of the next experiment, from the Fisher information of its motion under this recording's noise.
#[derive(Debug, Clone, Serialize)]
pub struct ExperimentEntry {
    /// Description of the experiment.
    pub programme: String,
    /// The moves, in order.
    pub moves: Vec<MoveEntry>,
    /// Number of repetitions of all moves.
    pub repeats: u32,
    /// Sampling interval of the attitudes \[s\], for an attitude reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude_every_s: Option<f64>,
    /// Predicted separations of kinds that are not distinguishable here.
    pub separations: Vec<SeparationEntry>,
    /// Standard deviations of the parameters of the found effects.
    pub precisions: Vec<PrecisionEntry>,
}

/// One move of a table, as in a scenario.
#[derive(Debug, Clone, Serialize)]
pub struct MoveEntry {
    /// `still`, `coning` or `spin`.
    pub kind: &'static str,
    /// Axis of the cone or the spin.
    pub axis: &'static str,
    /// Spin rate \[rad/s\].
    pub rate_rad_s: f64,
    /// Axis of the oscillation.
    pub oscillation_axis: &'static str,
    /// Frequency of the oscillation or the cone \[Hz\].
    pub frequency_hz: f64,
    /// Peak angle of either \[rad\].
    pub angle_rad: f64,
    /// Phase of the oscillation's rate at the beginning \[rad\].
    pub phase_rad: f64,
    /// Ramp at either end \[s\].
    pub ramp_s: f64,
    /// Duration, ramps included \[s\].
    pub duration_s: f64,
}

/// Distance between an effect of the estimated size and the nearest effect of a rival kind \[σ\].
#[derive(Debug, Clone, Serialize)]
pub struct SeparationEntry {
    /// Kind assumed true.
    pub truth: String,
    /// Rival kind.
    pub rival: String,
    /// Separation in this recording \[σ\]; null: not computed.
    pub here_sigma: Option<f64>,
    /// Predicted separation in the experiment \[σ\].
    pub promised_sigma: f64,
}

impl SeparationEntry {
    /// Returns the kind that `own` is separated from.
    pub fn other_than(&self, own: &str) -> &str {
        if self.truth == own {
            &self.rival
        } else {
            &self.truth
        }
    }
}

/// Standard deviation of a parameter of a found effect, here and in the experiment.
#[derive(Debug, Clone, Serialize)]
pub struct PrecisionEntry {
    /// The parameter.
    pub name: String,
    /// Standard deviation in this recording.
    pub here_std: f64,
    /// Predicted standard deviation in the experiment.
    pub promised_std: f64,
    /// Unit of both.
    pub unit: String,
}

/// One location.
#[derive(Debug, Clone, Serialize)]
pub struct LocationEntry {
    /// `gyro_x`, ...
    pub channel: String,
    /// Addition, with several recordings: recording whose clock the times refer to.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recording: Option<String>,
    /// Start \[s\].
    pub start_s: f64,
    /// End \[s\].
    pub end_s: f64,
    /// Lower edge of the band \[Hz\].
    pub low_hz: f64,
    /// Upper edge of the band \[Hz\].
    pub high_hz: f64,
    /// Dependence on the motion.
    pub regime: String,
    /// Size in `unit`.
    pub size: f64,
    /// Unit of the size: rad/s.
    pub unit: String,
    /// p-value, corrected for the number of trials.
    pub p_value: f64,
    /// Addition: channels and products of two that are coherent with it in its band, found before any fit.
    pub coherent_with: Vec<CoherentEntry>,
}

/// Channel coherent with a located mismatch.
#[derive(Debug, Clone, Serialize)]
pub struct CoherentEntry {
    /// `gyro_x`, ...
    pub channel: String,
    /// Channel or product, as in expressions.
    pub with: String,
    /// Lag of the mismatch behind the channel \[s\].
    pub lag_s: f64,
    /// Coherence, −1 … 1.
    pub coherence: f64,
    /// p-value, corrected for all expressions and lags.
    pub p_value: f64,
}

/// One parameter.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum ParameterEntry {
    /// Estimate with its standard deviation.
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
    /// Text: `axis`, `expression`.
    Text {
        /// Contract's name.
        name: String,
        /// Text.
        value: String,
    },
}

impl EffectEntry {
    /// Returns the value of a text parameter.
    pub fn text(&self, of: &str) -> Option<&str> {
        self.parameters.iter().find_map(|one| match one {
            ParameterEntry::Text { name, value } if name == of => Some(value.as_str()),
            _ => None,
        })
    }
}

/// Estimable combination of parameters.
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
    /// Kinds that the recording cannot distinguish from it; `unlisted` if an effect outside the catalogue explains as
    /// much (`expression`), or if much of the mismatch on the same gyro is only described.
    pub indistinguishable_from: Vec<String>,
    /// Addition: kinds among them that only the gyros cannot distinguish from it, and that the measured gravity
    /// rejects.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub gravity_speaks_against: Vec<String>,
    /// Its equation.
    pub equation: String,
    /// Parameters.
    pub parameters: Vec<ParameterEntry>,
    /// Covariance of the numeric parameters, in order.
    pub covariance: Vec<Vec<f64>>,
    /// Estimable combinations.
    pub identifiable: Vec<Identifiable>,
    /// Gain of ln evidence.
    pub log_evidence_gain: f64,
    /// p-value, corrected for the number of trials.
    pub p_value: f64,
    /// Explanation for a navigation engineer.
    pub what_was_left_out: String,
    /// Expression of an unlisted effect; for a listed kind with an unlisted rival (`indistinguishable_from` contains
    /// `unlisted`), the rival's expression.
    pub expression: Option<String>,
    /// Addition: amplitude in each regime (1 = as fitted on all).
    pub regimes: Vec<RegimeEntry>,
    /// Additions: strength of the evidence, if tested on held-out rows.
    #[serde(flatten)]
    pub evidence: Option<EvidenceEntry>,
}

/// Strength of the evidence for an effect.
#[derive(Debug, Clone, Serialize)]
pub struct EvidenceEntry {
    /// `named`, or `class` if this recording cannot distinguish it from another kind or from drift.
    pub label: &'static str,
    /// Gain of the predictive log score on held-out rows (cross-validation).
    pub confirmed_gain: f64,
    /// Share of the residual's power explained \[1\].
    pub share: f64,
    /// Number of draws of the parametric bootstrap without the effect.
    pub reenactments: usize,
    /// Mean squared estimate per parameter of the absent effect in those draws \[σ²\]: 1 if the likelihood is correct.
    pub inflation: f64,
}

/// Contract's kind of an effect outside the catalogue.
pub const UNLISTED: &str = "unlisted";

/// Note on a listed kind that may be [`UNLISTED`], without a rival expression.
pub const ONLY_DESCRIBED: &str = "Much beside it on the same gyro is only described: both may be one cause that is not in the catalogue.";

impl EffectEntry {
    /// True if its class contains an effect outside the catalogue.
    pub fn may_be_unlisted(&self) -> bool {
        let mut alike = self.indistinguishable_from.iter();
        alike.any(|kind| kind == UNLISTED)
    }
}

/// Amplitude in a regime.
#[derive(Debug, Clone, Serialize)]
pub struct RegimeEntry {
    /// Name.
    pub name: String,
    /// Amplitude λ.
    pub amplitude: f64,
    /// Standard deviation.
    pub std: f64,
}

/// Fit before and after.
#[derive(Debug, Clone, Serialize)]
pub struct FitEntry {
    /// Fitted times \[s\].
    pub fitted_on: Vec<[f64; 2]>,
    /// Held-out times \[s\].
    pub held_out: Vec<[f64; 2]>,
    /// Addition, with several recordings: the same on the clock of each; `fitted_on` and `held_out` then continue the
    /// clock of the first recording without a gap.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub recordings: Vec<RecordingEntry>,
    /// Addition, for a recording longer than memory: rows and blocks used. Locations and powers are then of the
    /// stretches alone, parameters and drifts of all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whole: Option<WholeEntry>,
    /// Gyros.
    pub channels: Vec<ChannelEntry>,
}

/// Use of a recording longer than memory.
#[derive(Debug, Clone, Serialize)]
pub struct WholeEntry {
    /// Block rate of the summed rows \[Hz\].
    pub blocks_per_s: f64,
    /// Stretches analysed row by row \[s\]; blocks that contain their rows are left out.
    pub stretches_s: Vec<[f64; 2]>,
    /// Total fitted time in blocks \[s\].
    pub fitted_blocks_s: f64,
    /// Total held-out time in blocks \[s\].
    pub held_out_blocks_s: f64,
    /// Total unusable time \[s\].
    pub unusable_s: f64,
    /// Gyros, on the held-out blocks.
    pub channels: Vec<ChannelEntry>,
}

/// One recording of several.
#[derive(Debug, Clone, Serialize)]
pub struct RecordingEntry {
    /// Its name.
    pub recording: String,
    /// The recording was held out as a whole.
    pub held_out_whole: bool,
    /// Fitted times \[s\].
    pub fitted_on: Vec<[f64; 2]>,
    /// Held-out times \[s\].
    pub held_out: Vec<[f64; 2]>,
    /// Power of the residual over the shared noise in its held-out rows, x, y, z (1 = noise alone).
    pub normalised_power: [Option<f64>; 3],
}

/// One channel before and after.
#[derive(Debug, Clone, Serialize)]
pub struct ChannelEntry {
    /// `gyro_x`, `accel_x`, ...
    pub channel: String,
    /// Addition: unit of the drifts if it is not rad/s (accelerometers: m/s^2).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<&'static str>,
    /// Addition: tested band \[Hz\].
    pub band_hz: [f64; 2],
    /// Figures without the effects.
    pub held_out_before: FiguresEntry,
    /// Figures with the effects.
    pub held_out_after: FiguresEntry,
}

/// Figures of one gyro.
#[derive(Debug, Clone, Serialize)]
pub struct FiguresEntry {
    /// Mean rate \[rad/s\].
    pub drift_rad_s: f64,
    /// Addition: standard deviation of the mean rate \[rad/s\].
    pub drift_std_rad_s: f64,
    /// Power over noise in the located bands and times.
    pub normalised_power: f64,
    /// Power over noise in all held-out rows.
    pub normalised_power_all: f64,
    /// p-value of the whiteness test.
    pub white_p_value: f64,
}

/// Noise of one gyro.
#[derive(Debug, Clone, Serialize)]
pub struct NoiseEntry {
    /// `gyro_x`, ...
    pub channel: String,
    /// Angle random walk \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: f64,
    /// White angle noise \[rad\].
    pub angle_noise_rad: f64,
    /// Standard deviation of its rate's drift over the record \[rad/s\], if beyond the drift in the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wandering_rad_s: Option<f64>,
    /// Addition: measured noise terms of IEEE 952; for units at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terms: Option<NoiseTermsEntry>,
}

/// Noise terms of IEEE 952 of one gyro, from a joint fit.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct NoiseTermsEntry {
    /// Angle random walk N \[rad/√s\].
    pub angle_random_walk_rad_sqrt_s: LevelEntry,
    /// Quantisation Q: white angle noise \[rad\].
    pub quantisation_rad: LevelEntry,
    /// Bias instability B \[rad/s\].
    pub bias_instability_rad_s: LevelEntry,
    /// Rate random walk K \[rad/s/√s\].
    pub rate_random_walk_rad_s_sqrt_s: LevelEntry,
}

/// A level with its standard deviation.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct LevelEntry {
    /// Value.
    pub value: f64,
    /// Standard deviation; for a smaller value, the root of the standard deviation of its square.
    pub std: f64,
}

impl LevelEntry {
    /// True if the level exceeds zero by [`SIGNIFICANT_SIGMAS`] standard deviations.
    pub fn is_measured(&self) -> bool {
        self.value > SIGNIFICANT_SIGMAS * self.std
    }

    /// Upper bound of the level: the root of its square plus [`SIGNIFICANT_SIGMAS`] standard deviations of the square.
    pub fn bound(&self) -> f64 {
        (self.value.powi(2) + SIGNIFICANT_SIGMAS * self.std_of_square()).sqrt()
    }

    /// Standard deviation of the square: levels are fitted as squares, which are nearly normal even if the levels are
    /// not.
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
    /// Noise terms of IEEE 952, for a unit at rest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terms: Option<ForceTermsEntry>,
}

/// Noise terms of IEEE 952 of one accelerometer at rest.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct ForceTermsEntry {
    /// Velocity random walk N \[m/s/√s\].
    pub velocity_random_walk_m_s_sqrt_s: LevelEntry,
    /// Quantisation Q: white velocity noise \[m/s\].
    pub quantisation_m_s: LevelEntry,
    /// Bias instability B \[m/s²\].
    pub bias_instability_m_s2: LevelEntry,
    /// Acceleration random walk K \[m/s²/√s\].
    pub acceleration_random_walk_m_s2_sqrt_s: LevelEntry,
}

/// Rejected kind.
#[derive(Debug, Clone, Serialize)]
pub struct RunnerUp {
    /// Kind.
    pub kind: String,
    /// ln evidence behind the selected kind.
    pub behind: f64,
}

impl RunnerUp {
    /// Keeps for each kind the smallest difference of ln evidence, in the order of the names.
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

/// Sensitivity of the recording to a kind.
#[derive(Debug, Clone, Serialize)]
pub struct Sensitivity {
    /// Kind.
    pub kind: String,
    /// Typical size.
    pub typical: f64,
    /// Unit.
    pub unit: String,
    /// Matched-filter SNR of its most observable parameter alone at that size.
    pub snr: f64,
    /// The same of its least observable parameter; 0 if it is not detected at any credible size.
    pub snr_weakest: f64,
}

/// Self-test of a search on its own recording.
#[derive(Debug, Clone)]
pub struct Tested {
    /// Trials with noise alone, and with effects added to it.
    pub self_test: SelfTestEntry,
    /// Sensitivity to each kind, in the order of the catalogue.
    pub sensitivity: Vec<Sensitivity>,
}
