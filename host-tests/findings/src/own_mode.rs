//! Static flexure and the resonance implied by its own K: one physics, whose static part is all that a recording far
//! below the resonance shows.

use rlg_model::catalogue::SIX;
use rlg_plan::FindingsPlan;

use crate::names::{capital, plain};
use crate::result::EffectEntry;

const FLEXURE: &str = "axis_flexure";
const MODE: &str = "axis_flexure_mode";

/// Computes the smallest and greatest natural frequency of the blocks of a flexure \[Hz\], f0 = 1/(2π√K) with K the
/// mean of a gyro's two coefficients; `None` without a positive K.
pub fn implied_hz(effect: &EffectEntry) -> Option<[f64; 2]> {
    let value = |wanted: &str| effect.number(wanted).map(|(value, _)| value);
    let of_gyro = |pair: &[&str]| {
        let known: Vec<f64> = pair.iter().filter_map(|name| value(name)).collect();
        rlg_model::implied_hz(known.iter().sum::<f64>() / known.len() as f64)
    };
    SIX.chunks(2).filter_map(of_gyro).fold(None, |range, hz| {
        let [least, most] = range.unwrap_or([hz, hz]);
        Some([hz.min(least), hz.max(most)])
    })
}

/// True if a rival of an effect is the effect's own physics: the resonance of a static flexure, or the static flexure
/// of a resonance at the frequency implied by K.
pub fn is_own_physics(effect: &EffectEntry, rival: &str, plan: &FindingsPlan) -> bool {
    match (effect.kind.as_str(), rival) {
        (FLEXURE, MODE) => implied_hz(effect).is_some(),
        (MODE, FLEXURE) => rings_where_it_implies(effect, plan.own_mode_deviations),
        _ => false,
    }
}

fn rings_where_it_implies(effect: &EffectEntry, within: f64) -> bool {
    let implied = implied_hz(effect).zip(effect.number("frequency_hz"));
    implied.is_some_and(|([least, most], (hz, std))| {
        hz > least - within * std && hz < most + within * std
    })
}

/// Formats the sentence on a rival that is the effect's own physics; `None` without such a rival.
pub fn sentence(effect: &EffectEntry, plan: &FindingsPlan) -> Option<String> {
    let mut rivals = effect.indistinguishable_from.iter();
    let own = rivals.find(|rival| is_own_physics(effect, rival, plan))?;
    let [least, most] = implied_hz(effect)?.map(|hz| format!("{hz:.0}"));
    let hz = match least == most {
        true => least,
        false => format!("{least} to {most}"),
    };
    Some(format!(
        "{} and {} are the same physics: a block with K = J/k resonates at 1/(2π√K), {hz} Hz.",
        capital(&plain(&effect.kind)),
        plain(own)
    ))
}

#[cfg(test)]
mod tests {
    use rlg_plan::FindingsPlan;

    use super::{implied_hz, is_own_physics, sentence};
    use crate::entries::unlisted;
    use crate::result::{EffectEntry, ParameterEntry};

    fn effect(kind: &str, numbers: &[(&str, f64, f64)], alike: &[&str]) -> EffectEntry {
        let of = |&(name, value, std): &(&str, f64, f64)| ParameterEntry::Number {
            name: name.to_owned(),
            value,
            std,
            unit: String::new(),
        };
        EffectEntry {
            kind: kind.to_owned(),
            parameters: numbers.iter().map(of).collect(),
            indistinguishable_from: alike.iter().map(|kind| (*kind).to_owned()).collect(),
            ..unlisted(String::new(), String::new())
        }
    }

    #[test]
    fn a_flexure_and_the_resonance_that_it_implies_are_one_physics() {
        let rivals = ["axis_flexure_cubic", "axis_flexure_mode"];
        let numbers = [
            ("xy", 8e-8, 0.0),
            ("xz", 6e-8, 0.0),
            ("yx", 5e-8, 0.0),
            ("yz", 5e-8, 0.0),
        ];
        let flexure = effect("axis_flexure", &numbers, &rivals);
        let [least, most] = implied_hz(&flexure).expect("positive K");
        assert!((least - 601.5).abs() < 0.1 && (most - 711.8).abs() < 0.1);
        assert!(is_own_physics(
            &flexure,
            "axis_flexure_mode",
            &FindingsPlan::default()
        ));
        assert!(!is_own_physics(
            &flexure,
            "axis_flexure_cubic",
            &FindingsPlan::default()
        ));
        let said = sentence(&flexure, &FindingsPlan::default()).expect("a sentence");
        assert!(
            said.ends_with("resonates at 1/(2π√K), 602 to 712 Hz."),
            "{said}"
        );
        let impossible = effect("axis_flexure", &[("xy", -8e-8, 0.0)], &rivals);
        assert!(sentence(&impossible, &FindingsPlan::default()).is_none());
    }

    #[test]
    fn a_resonance_elsewhere_is_another_physics_than_static_flexure() {
        let mode = |hz: f64| {
            let numbers = [
                ("xy", 7e-8, 0.0),
                ("xz", 7e-8, 0.0),
                ("frequency_hz", hz, 5.0),
            ];
            effect("axis_flexure_mode", &numbers, &["axis_flexure"])
        };
        assert!(is_own_physics(
            &mode(595.0),
            "axis_flexure",
            &FindingsPlan::default()
        ));
        assert!(!is_own_physics(
            &mode(80.0),
            "axis_flexure",
            &FindingsPlan::default()
        ));
        assert!(sentence(&mode(80.0), &FindingsPlan::default()).is_none());
    }
}
