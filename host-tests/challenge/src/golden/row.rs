//! One row of the golden table, from one diagnosis.
//!
//! Columns that describe effects list them in the order of `diagnosis.json`, separated by ` ; `.

use serde_json::Value;

use super::estimate::{estimate, probability};
use crate::answer::Answer;
use crate::commit::sha256;
use rlg_findings::result::{Diagnosis, EffectEntry, ParameterEntry, UNLISTED};
use rlg_recording::error::InputError;

/// Columns of the table, in their order.
///
/// - `name`: `trial-0017`, or the recording's name.
/// - `family`, `setting`, `concealed`: what the simulator put into the trial, with its matched-filter SNR `rho`;
///   `recording`, `-`, `-` of a recording that is not simulated here.
/// - `verdict`: the diagnosis' verdict, or why there is none.
/// - `effects`: the kinds found, each with the kinds it is indistinguishable from.
/// - `expressions`: their expressions, `-` where there is none.
/// - `values`: their parameters, value ± σ and unit.
/// - `log_evidence`: the logarithm of the evidence gained by each.
/// - `p`: the probability of each under noise alone, trials counted.
/// - `sha256`: see [`diagnosis_sha256`].
pub const COLUMNS: [&str; 11] = [
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
    SHA256,
];

/// Column of the hash.
pub const SHA256: &str = "sha256";

/// A cell that does not apply.
const NONE: &str = "-";

/// Stands between two effects.
const BETWEEN: &str = " ; ";

/// One row: a cell for every column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Row {
    /// The cells, in the order of [`COLUMNS`].
    pub cells: [String; COLUMNS.len()],
}

impl Row {
    /// Makes the row of a simulated trial. `said` is the diagnosis, or the reason why there is none.
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
        Self::new(&trial_name(answer.trial), origin, said)
    }

    /// Makes the row of a recording. `said` is the diagnosis, or the reason why there is none.
    pub fn of_recording(name: &str, said: Result<&Diagnosis, &str>) -> Result<Self, InputError> {
        let origin = ["recording", NONE, NONE].map(str::to_owned);
        Self::new(name, origin, said)
    }

    fn new(
        name: &str,
        origin: [String; 3],
        said: Result<&Diagnosis, &str>,
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
            hash,
        ];
        Ok(Self {
            cells: cells.map(|cell| on_one_line(&cell)),
        })
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.cells[0]
    }
}

/// Name of the row of a simulated trial.
pub fn trial_name(trial: u64) -> String {
    format!("trial-{trial:04}")
}

/// The cells that a diagnosis fills, from `verdict` on.
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
/// Of a file on disk: `grep -v '^  "version": ' diagnosis.json | sha256sum`.
pub fn diagnosis_sha256(diagnosis: &Diagnosis) -> Result<String, InputError> {
    let json = serde_json::to_string_pretty(diagnosis).map_err(no_json)?;
    let lines = json
        .lines()
        .filter(|line| !line.starts_with("  \"version\": "));
    let text: String = lines.flat_map(|line| [line, "\n"]).collect();
    Ok(sha256(text.as_bytes()))
}

/// A kind and those it is indistinguishable from.
fn class(effect: &EffectEntry) -> String {
    let others = effect.indistinguishable_from.iter();
    let kinds: Vec<&str> = std::iter::once(effect.kind.as_str())
        .chain(others.map(String::as_str))
        .collect();
    kinds.join(" or ")
}

/// Parameters of an effect. The expression of an unlisted effect has its own column.
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

/// Effects in one cell.
fn joined(effects: &[String]) -> String {
    if effects.is_empty() {
        NONE.to_owned()
    } else {
        effects.join(BETWEEN)
    }
}

/// The JSON name of an enum's variant.
fn word(variant: &impl serde::Serialize) -> Result<String, InputError> {
    match serde_json::to_value(variant).map_err(no_json)? {
        Value::String(word) => Ok(word),
        other => Ok(other.to_string()),
    }
}

/// A cell must not end its row or its column.
fn on_one_line(cell: &str) -> String {
    cell.replace(['\t', '\n', '\r'], " ")
}

fn no_json(error: serde_json::Error) -> InputError {
    InputError::new(
        "diagnosis.json",
        format!("the result has no JSON form ({error})"),
    )
}
