//! `diagnosis.json`: the project's contract, field by field, as serde types.
//!
//! SI units. Names and meanings are fixed by the contract; fields beyond it are additions.

use rlg_plan::Plan;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

mod effect;
mod experiment;
mod fit;
mod self_test;

pub use effect::{
    EffectEntry, EvidenceEntry, Identifiable, ONLY_DESCRIBED, ParameterEntry, RegimeEntry,
    UNLISTED, number_of, text_of,
};
pub use experiment::{ExperimentEntry, MoveEntry, PrecisionEntry, SeparationEntry};
pub use fit::{
    ChannelEntry, FiguresEntry, FitEntry, ForceNoiseEntry, ForceTermsEntry, LevelEntry, NoiseEntry,
    NoiseTermsEntry, RecordingEntry, WholeEntry,
};
pub use self_test::{SelfTestEntry, SelfTestKind, SelfTestPoint};

/// Verdict of the diagnosis, in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
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
    /// Verdict of a diagnosis.
    ///
    /// # Inputs
    /// `is_explained`: an effect or a fault is named; `is_consistent`: no mismatch is left beside it.
    pub fn of(is_explained: bool, is_consistent: bool) -> Self {
        match (is_explained, is_consistent) {
            (false, true) => Verdict::Matches,
            (false, false) => Verdict::Unexplained,
            (true, true) => Verdict::Explained,
            (true, false) => Verdict::PartlyExplained,
        }
    }

    /// True if no mismatch is left unexplained.
    pub fn is_consistent(self) -> bool {
        matches!(self, Verdict::Matches | Verdict::Explained)
    }
}

/// Version of the file's form; a reader may rely on every field of its own version.
///
/// It is raised when a field is removed or renamed, or its type, unit or meaning changes. A field or a word that is added
/// does not raise it: readers pass over what they do not know.
pub const FORMAT: u32 = 1;

/// The whole file.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Diagnosis {
    /// Version of this form: raised when a field is removed or renamed, or its type, unit or meaning changes; not when one
    /// is added.
    #[schemars(extend("const" = FORMAT))]
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
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PlanEntry {
    /// Name, as `rlg plan` prints it with its section: `judgement.naming`.
    pub number: String,
    /// Values used, in the unit that `rlg plan` prints.
    pub value: Vec<f64>,
    /// Default values.
    pub default: Vec<f64>,
}

impl PlanEntry {
    /// Numbers of a plan that differ from the defaults.
    pub fn changed(plan: &Plan) -> Vec<Self> {
        let changed = plan.changed().into_iter();
        changed
            .map(|(own, default)| Self {
                number: own.name,
                value: own.values,
                default: default.values,
            })
            .collect()
    }

    /// Sentence on such numbers; `None` without any.
    pub fn sentence(changed: &[Self]) -> Option<String> {
        let words = |values: &[f64]| {
            let each: Vec<String> = values.iter().map(|value| format!("{value}")).collect();
            each.join(", ")
        };
        let each = changed.iter().map(|one| {
            let [own, default] = [&one.value, &one.default].map(|values| words(values));
            format!("{} {own} instead of {default}", one.number)
        });
        let each: Vec<String> = each.collect();
        (!each.is_empty()).then(|| {
            let numbers = each.join("; ");
            format!("Thresholds other than the defaults: {numbers}.")
        })
    }
}

impl Diagnosis {
    /// Records the thresholds that differ from the defaults, in the summary too.
    pub fn under_plan(&mut self, changed: Vec<PlanEntry>) {
        self.prepend(PlanEntry::sentence(&changed).into_iter().collect());
        self.plan = changed;
    }

    /// Thresholds that the diagnosis was made with.
    pub fn thresholds(&self) -> Plan {
        let changed = self.plan.iter();
        changed.fold(Plan::default(), |plan, one| {
            plan.with(&one.number, &one.value)
        })
    }

    /// Adds the self-test and the sensitivity, if they were computed.
    pub fn add_self_test(&mut self, tested: Option<Tested>) {
        if let Some(tested) = tested {
            self.self_test = Some(tested.self_test);
            self.sensitivity = tested.sensitivity;
        }
    }

    /// Inserts sentences into the summary, after the verdict's.
    pub fn prepend(&mut self, sentences: Vec<String>) {
        let at = self.summary.len().min(1);
        self.summary.splice(at..at, sentences);
    }

    /// Diagnosis of an unusable recording, with the reason `why`.
    pub fn unusable(recording: &str, seed: u64, why: &str) -> Self {
        Self {
            format: FORMAT,
            recording: recording.to_string(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            seed,
            verdict: Verdict::Unusable,
            summary: vec![format!("This recording cannot be diagnosed: {why}.")],
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
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct RegistrationEntry {
    /// Contract's kind.
    pub kind: String,
    /// Estimates beyond the model's values.
    pub parameters: Vec<ParameterEntry>,
    /// Held-out blocks of rows support the parameters.
    pub supported: bool,
}

/// Residual of everything found, relative to the motion.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct ResidualEntry {
    /// Ratio of the root mean squares of residual and motion, as turns over 0.1 s \[1\].
    pub share_of_motion: f64,
    /// Coherence of readings and prediction, by octave.
    pub coherence: Vec<CoherenceEntry>,
}

/// Magnitude-squared coherence of readings and prediction in one octave.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct CoherenceEntry {
    /// Lower edge \[Hz\].
    pub low_hz: f64,
    /// Upper edge \[Hz\].
    pub high_hz: f64,
    /// Coherence of gyros x, y, z \[1\].
    pub gyros: [f64; 3],
}

/// Control with shuffled rows.
#[derive(Debug, Clone, Serialize, JsonSchema)]
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

/// One location.
#[derive(Debug, Clone, Serialize, JsonSchema)]
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
#[derive(Debug, Clone, Serialize, JsonSchema)]
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

/// Rejected kind.
#[derive(Debug, Clone, Serialize, JsonSchema)]
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
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Sensitivity {
    /// Kind.
    pub kind: String,
    /// Typical size.
    pub typical: f64,
    /// Unit.
    pub unit: String,
    /// Matched-filter SNR of its most observable parameter alone at that size.
    pub snr: f64,
    /// Matched-filter SNR of its least observable parameter; 0 if it is not detected at any credible size.
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

#[cfg(test)]
mod tests {
    use super::{Diagnosis, PlanEntry};

    #[test]
    fn a_diagnosis_gives_back_the_thresholds_that_it_was_made_with() {
        let changed = |number: &str, value: &[f64]| PlanEntry {
            number: number.to_owned(),
            value: value.to_vec(),
            default: Vec::new(),
        };
        let mut diagnosis = Diagnosis::unusable("log", 0, "");
        assert!(diagnosis.thresholds().changed().is_empty());
        diagnosis.under_plan(vec![
            changed("findings.needed_snr", &[9.0]),
            changed("catalogue.grids.lags_s", &[0.2, 0.4, 1.6, 6.4]),
        ]);
        let plan = diagnosis.thresholds();
        assert_eq!(plan.changed().len(), 2);
        assert_eq!(plan.findings.needed_snr, 9.0);
        assert_eq!(plan.catalogue.grids.lags_s, [0.2, 0.4, 1.6, 6.4]);
    }
}
