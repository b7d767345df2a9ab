//! Sentences and units common to all reports of a diagnosis.

use std::collections::BTreeMap;

use rlg_plan::FindingsPlan;

use crate::own_mode::{self, is_own_physics};
use crate::result::{EffectEntry, ONLY_DESCRIBED, ParameterEntry, UNLISTED, Verdict};

pub use crate::numbers::DEG_H;

/// Begins the sentence on an effect that was found and rejected.
pub const REJECTED: &str = "Rejected: ";

/// Begins the sentence on attitudes read in another convention than declared, which a terminal shows, too.
pub const READ_AS: &str = "Channels: the attitudes are ";

/// The verdict as a sentence.
pub fn opening(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Matches => {
            "The model explains this recording: residual within the noise in every band, stretch and gyro."
        }
        Verdict::Explained => "The recording differs from its model; the effects found explain it.",
        Verdict::PartlyExplained => {
            "The recording differs from its model; the effects found explain part of it."
        }
        Verdict::Unexplained => {
            "The recording differs from its model; no effect known to the tool explains it."
        }
        Verdict::Unusable => "This recording cannot be diagnosed.",
    }
}

/// Formats a combination: "xy + xz", or "−0.33 x + 0.95 y" for unequal weights.
pub fn combination(weights: &BTreeMap<String, f64>) -> String {
    /// Smallest weight visible in two digits.
    const LEAST: f64 = 0.005;
    let alike = weights.values().all(|weight| weight.abs() == 1.0);
    let mut text = String::new();
    for (name, weight) in weights.iter().filter(|(_, weight)| weight.abs() > LEAST) {
        let sign = if *weight < 0.0 { "−" } else { "+" };
        let part = match alike {
            true => name.clone(),
            false => format!("{:.2} {name}", weight.abs()),
        };
        text = match (text.is_empty(), sign) {
            (true, "−") => format!("−{part}"),
            (true, _) => part,
            (false, _) => format!("{text} {sign} {part}"),
        };
    }
    text
}

/// Formats an effect, its estimable combinations, and the kinds not distinguishable from it.
pub fn effect_lines(effect: &EffectEntry, plan: &FindingsPlan) -> Vec<String> {
    let equation = match effect.equation.as_str() {
        "" => String::new(),
        equation => format!(" ({equation})"),
    };
    let mut lines = vec![format!(
        "What: {}{equation}. {}",
        effect.kind, effect.what_was_left_out
    )];
    for fixed in &effect.identifiable {
        let unit = effect
            .parameters
            .iter()
            .find_map(|parameter| match parameter {
                ParameterEntry::Number { name, unit, .. }
                    if fixed.combination.contains_key(name) =>
                {
                    Some(unit.as_str())
                }
                _ => None,
            })
            .unwrap_or("");
        lines.push(format!(
            "      {} = {:.3e} ± {:.1e} {unit}",
            combination(&fixed.combination),
            fixed.value,
            fixed.std
        ));
    }
    let against = &effect.gravity_speaks_against;
    let alike = effect.indistinguishable_from.iter();
    let alike: Vec<&str> = alike
        .filter(|kind| !against.contains(kind))
        .filter(|kind| *kind != UNLISTED && !is_own_physics(effect, kind, plan))
        .map(String::as_str)
        .collect();
    if !alike.is_empty() {
        lines.push(format!(
            "      Not distinguishable from {} by this recording.",
            alike.join(", ")
        ));
    }
    lines.extend(own_mode::sentence(effect, plan).map(|said| format!("      {said}")));
    match &effect.expression {
        Some(expression) if effect.kind != UNLISTED => lines.push(format!(
            "      {expression}, outside the catalogue, explains as much with one parameter."
        )),
        None if effect.may_be_unlisted() => lines.push(format!("      {ONLY_DESCRIBED}")),
        _ => {}
    }
    if !against.is_empty() {
        lines.push(format!(
            "      Not distinguishable from {} by the gyros alone; rejected by gravity as the accelerometers measure it.",
            against.join(", ")
        ));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn combinations_read_as_sums_and_say_weights_where_they_differ() {
        let of = |weights: &[(&str, f64)]| {
            let named = weights
                .iter()
                .map(|(name, weight)| ((*name).to_string(), *weight));
            combination(&named.collect())
        };
        assert_eq!(of(&[("xy", 1.0), ("xz", 1.0)]), "xy + xz");
        assert_eq!(of(&[("xy", 1.0), ("xz", -1.0)]), "xy − xz");
        assert_eq!(
            of(&[("x", -0.3258), ("y", 0.9454), ("z", -8e-9)]),
            "−0.33 x + 0.95 y"
        );
    }
}
