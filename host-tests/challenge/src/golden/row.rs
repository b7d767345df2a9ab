//! Row of the golden table, from one diagnosis.
//!
//! Columns that describe effects list them in the order of `diagnosis.json`, separated by ` ; `.

use serde_json::Value;

use super::estimate::{estimate, probability};
use crate::acceptance::judge::{Judgement, Score};
use crate::acceptance::record::Answer as MarksAnswer;
use crate::answer::Answer;
use crate::case::Case;
use crate::commit::sha256;
use crate::examine::outcome_of;
use rlg_findings::result::{Diagnosis, EffectEntry, ParameterEntry, UNLISTED};
use rlg_recording::error::InputError;

/// Columns of the table, in their order.
///
/// - `name`: `trial-0017`, or the recording's name.
/// - `family`, `setting`, `concealed`: effects simulated in the trial, with the matched-filter SNR `rho`; `recording`, `-`,
///   `-` for a recording that is not simulated here.
/// - `verdict`: the diagnosis' verdict, or the reason for its absence.
/// - `effects`: the kinds found, each with the kinds of its equivalence class.
/// - `expressions`: their expressions, `-` if none.
/// - `values`: their parameters, value ± σ and unit.
/// - `log_evidence`: the gain of ln evidence by each.
/// - `p`: the p-value of each under noise alone, corrected for the number of trials.
/// - `right`: of a trial `yes` if every concealed kind is named, alone or in its class, and nothing else, `no` if a name is
///   wrong, `silent` if a name is missing; `-` for a recording.
/// - `sigmas`: the largest |value − truth|/σ of the named effects, `-` if none.
/// - `sha256`: see [`diagnosis_sha256`].
pub const COLUMNS: [&str; 13] = [
    "name",
    "family",
    "setting",
    "concealed",
    "verdict",
    "effects",
    "expressions",
    "values",
    "log_evidence",
    "p",
    "right",
    "sigmas",
    SHA256,
];

/// Place of the column `right`.
const RIGHT: usize = 10;

/// Column of the hash.
pub const SHA256: &str = "sha256";

/// Cell that does not apply.
const NONE: &str = "-";

/// Cells of the column `right`.
pub(super) const YES: &str = "yes";
pub(super) const NO: &str = "no";
const SILENT: &str = "silent";

/// Separator between two effects.
const BETWEEN: &str = " ; ";

/// Row: a cell for every column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// Cells, in the order of [`COLUMNS`].
    pub cells: [String; COLUMNS.len()],
}

impl Row {
    /// Makes the row of a simulated trial. `said` is the diagnosis, or the reason for its absence.
    pub fn of_trial(answer: &Answer, said: Result<&Diagnosis, &str>) -> Result<Self, InputError> {
        let concealed: Vec<String> = answer
            .effects
            .iter()
            .map(|effect| format!("{} (rho {:.1})", effect.kind, effect.rho))
            .collect();
        let origin = [
            word(&answer.family)?,
            word(&answer.setting)?,
            joined(&concealed),
        ];
        let judged = said.map_or([NO, NONE].map(str::to_owned), |said| judged(answer, said));
        Self::new(&trial_name(answer.trial), origin, said, judged)
    }

    /// Makes the row of a trial of the marks, with its judgement.
    pub fn of_marks(
        name: &str,
        answer: &MarksAnswer,
        said: Result<&Diagnosis, &str>,
        judgement: &Judgement,
    ) -> Result<Self, InputError> {
        let concealed: Vec<String> = answer.effects.iter().map(|one| one.kind.clone()).collect();
        let origin = [
            answer.family.name(),
            joined(&answer.conditions),
            joined(&concealed),
        ];
        let right = match judgement.score {
            Score::Right | Score::OrDrift => YES,
            Score::Missed => SILENT,
            Score::Wrong | Score::Unanswered => NO,
        };
        let sigmas = largest(judgement.pulls.iter().copied());
        Self::new(name, origin, said, [right.to_owned(), sigmas])
    }

    /// Makes the row of a recording. `said` is the diagnosis, or the reason for its absence.
    pub fn of_recording(name: &str, said: Result<&Diagnosis, &str>) -> Result<Self, InputError> {
        let origin = ["recording", NONE, NONE].map(str::to_owned);
        Self::new(name, origin, said, [NONE, NONE].map(str::to_owned))
    }

    fn new(
        name: &str,
        origin: [String; 3],
        said: Result<&Diagnosis, &str>,
        [right, sigmas]: [String; 2],
    ) -> Result<Self, InputError> {
        let [family, setting, concealed] = origin;
        let findings = match said {
            Ok(diagnosis) => findings(diagnosis)?,
            Err(reason) => {
                let mut cells = [NONE; 7].map(str::to_owned);
                cells[0] = reason.to_owned();
                cells
            }
        };
        let [verdict, effects, expressions, values, evidence, p, hash] = findings;
        let cells = [
            name.to_owned(),
            family,
            setting,
            concealed,
            verdict,
            effects,
            expressions,
            values,
            evidence,
            p,
            right,
            sigmas,
            hash,
        ];
        Ok(Self {
            cells: cells.map(|cell| on_one_line(&cell)),
        })
    }

    /// Name of the row.
    pub fn name(&self) -> &str {
        &self.cells[0]
    }

    /// Cell of `right`: `yes` if the trial was named correctly, and nothing else; `None` for a recording.
    pub(super) fn right(&self) -> Option<&str> {
        Some(&*self.cells[RIGHT]).filter(|cell| *cell != NONE)
    }

    /// Largest |value − truth|/σ.
    pub(super) fn sigmas(&self) -> Option<f64> {
        self.cells[RIGHT + 1].parse().ok()
    }
}

/// Cells of `right` and `sigmas`.
fn judged(answer: &Answer, said: &Diagnosis) -> [String; 2] {
    let outcome = &outcome_of(answer.trial, said);
    let case = Case { answer, outcome };
    let is_clean = match answer.effects.is_empty() {
        true => !case.is_false(),
        false => case.wrong().next().is_none(),
    };
    let right = match (is_clean, answer.effects.is_empty() || case.is_named()) {
        (false, _) => NO,
        (true, true) => YES,
        (true, false) => SILENT,
    };
    let sigmas = case.deviations().into_iter().map(|[sigmas, _]| sigmas);
    [right.to_owned(), largest(sigmas)]
}

/// Cell of `sigmas`.
fn largest(sigmas: impl Iterator<Item = f64>) -> String {
    let largest = sigmas.map(f64::abs).reduce(f64::max);
    largest.map_or(NONE.to_owned(), |sigmas| format!("{sigmas:.2}"))
}

/// Name of the row of a simulated trial.
pub fn trial_name(trial: u64) -> String {
    format!("trial-{trial:04}")
}

/// Cells filled from a diagnosis, from `verdict` on.
fn findings(diagnosis: &Diagnosis) -> Result<[String; 7], InputError> {
    let each = |cell: fn(&EffectEntry) -> String| {
        joined(&diagnosis.effects.iter().map(cell).collect::<Vec<_>>())
    };
    Ok([
        word(&diagnosis.verdict)?,
        each(class),
        each(|effect| effect.expression.clone().unwrap_or_else(|| NONE.to_owned())),
        each(values),
        each(|effect| format!("{:.1}", effect.log_evidence_gain)),
        each(|effect| probability(effect.p_value)),
        diagnosis_sha256(diagnosis)?,
    ])
}

/// SHA-256 of the file `diagnosis.json` without its line `"version"`.
///
/// For a file on disk: `grep -v '^  "version": ' diagnosis.json | sha256sum`.
pub fn diagnosis_sha256(diagnosis: &Diagnosis) -> Result<String, InputError> {
    let json = serde_json::to_string_pretty(diagnosis).map_err(no_json)?;
    let lines = json
        .lines()
        .filter(|line| !line.starts_with("  \"version\": "));
    let text: String = lines.flat_map(|line| [line, "\n"]).collect();
    Ok(sha256(text.as_bytes()))
}

/// Formats a kind and its equivalence class.
fn class(effect: &EffectEntry) -> String {
    let others = effect.indistinguishable_from.iter();
    let kinds: Vec<&str> = std::iter::once(effect.kind.as_str())
        .chain(others.map(String::as_str))
        .collect();
    kinds.join(" or ")
}

/// Formats the parameters of an effect. The expression of an unlisted effect has its own column.
fn values(effect: &EffectEntry) -> String {
    let parameters = effect.parameters.iter().filter_map(|one| match one {
        ParameterEntry::Number {
            name,
            value,
            std,
            unit,
        } => {
            let unit = if unit == "1" { "" } else { unit };
            let text = format!("{name} = {} {unit}", estimate(*value, *std));
            Some(text.trim_end().to_owned())
        }
        ParameterEntry::Text { name, .. } if effect.kind == UNLISTED && name == "expression" => {
            None
        }
        ParameterEntry::Text { name, value } => Some(format!("{name} = {value}")),
    });
    let parameters: Vec<String> = parameters.collect();
    if parameters.is_empty() {
        NONE.to_owned()
    } else {
        parameters.join(", ")
    }
}

/// Joins effects in one cell.
fn joined(effects: &[String]) -> String {
    if effects.is_empty() {
        NONE.to_owned()
    } else {
        effects.join(BETWEEN)
    }
}

/// JSON name of an enum's variant.
fn word(variant: &impl serde::Serialize) -> Result<String, InputError> {
    match serde_json::to_value(variant).map_err(no_json)? {
        Value::String(word) => Ok(word),
        other => Ok(other.to_string()),
    }
}

/// Replaces characters that would end a row or a column.
fn on_one_line(cell: &str) -> String {
    cell.replace(['\t', '\n', '\r'], " ")
}

fn no_json(error: serde_json::Error) -> InputError {
    InputError::new(
        "diagnosis.json",
        format!("the result has no JSON form ({error})"),
    )
}
