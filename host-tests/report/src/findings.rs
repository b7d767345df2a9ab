//! Section on the effects missing in the model: their size, significance, and the identifiability of the parameters.

use maud::{Markup, html};

use super::cell_marks::error_bar;
use super::correlations;
use super::lines;
use super::terminal::{below_significance, fault_groups, is_time};
use super::words::{Scale, chance, number, plain, rounded, spaced, symbols, with_spread};
use rlg_findings::own_mode;
use rlg_findings::result::{
    Diagnosis, EffectEntry, EvidenceEntry, FitEntry, Identifiable, ONLY_DESCRIBED, ParameterEntry,
    RegimeEntry,
};
use rlg_findings::sentences::combination;
use rlg_plan::FindingsPlan;

/// Largest number of effects and rows on the page; all of them are in the data at its end.
const MOST_ROWS: usize = 24;

/// Largest number of unfolded effects; if there are more, each is folded under its name.
const OPEN: usize = 2;

/// Ratio of standard deviations above which the page states that a combination is known much better than its single values.
const BETTER_KNOWN_RATIO: f64 = 1.5;

fn and_more(rows: usize) -> Markup {
    html! {
        @if rows > MOST_ROWS { p.note { "And " (rows - MOST_ROWS) " more, in the data at the end of this page." } }
    }
}

/// Section with all effects.
pub fn effects(diagnosis: &Diagnosis) -> Markup {
    html! {
        @if !diagnosis.effects.is_empty() {
            section {
                h2 { "Effects found" }
                @let plan = &diagnosis.thresholds().findings;
                @let faults = fault_groups(diagnosis);
                @let is_grouped = |effect: &EffectEntry| faults.iter().any(|(_, all)| all.iter().any(|one| std::ptr::eq(*one, effect)));
                @let effects = diagnosis.effects.iter().filter(|effect| !is_grouped(effect));
                @let (lines, others): (Vec<_>, Vec<_>) = effects.partition(|effect| lines::is_line(effect));
                @for effect in others.iter().take(MOST_ROWS) {
                    @if others.len() > OPEN {
                        details { summary { b { (plain(&effect.kind)) } " " (gist(effect)) } (one(effect, &diagnosis.fit, plan)) }
                    } @else { (one(effect, &diagnosis.fit, plan)) }
                }
                (and_more(others.len()))
                @for (said, members) in &faults { (alike(said, members)) }
                @if !lines.is_empty() { (lines::table(diagnosis)) }
            }
        }
    }
}

/// Many faults of one kind, folded under their line.
fn alike(said: &str, members: &[&EffectEntry]) -> Markup {
    let time = |effect: &EffectEntry, wanted: &str| {
        let known = numbers(effect).into_iter();
        let mut known = known.filter(|one| one.name == wanted);
        known
            .next()
            .map_or_else(String::new, |one| format!("{:.4}", one.value))
    };
    html! {
        details {
            summary { b { (plain(&members[0].kind)) } " " (said) }
            div.scroll { table {
                thead { tr { th { "of" } th { "from [s]" } th { "to [s]" } } }
                tbody { @for effect in members.iter().take(MOST_ROWS) { tr {
                    td { (effect.text("rows_of").or(effect.text("channel")).map(spaced).unwrap_or_default()) }
                    td.number { (time(effect, "start_s")) }
                    td.number { (time(effect, "end_s")) }
                } } }
            } }
            (and_more(members.len()))
        }
    }
}

/// Distinguishing feature of an effect: its axis or channel, then its expression or the first sentence on it.
fn gist(effect: &EffectEntry) -> String {
    let place = effect.text("axis").or(effect.text("channel"));
    let (first, _) = effect
        .what_was_left_out
        .split_once(". ")
        .unwrap_or((&effect.what_was_left_out, ""));
    let said = effect.expression.as_deref().unwrap_or(first);
    format!("{}: {said}", place.unwrap_or_default())
        .trim_start_matches([':', ' '])
        .to_owned()
}

/// Kinds that are not distinguishable from a found one.
fn not_distinguishable<'a>(effect: &'a EffectEntry, plan: &FindingsPlan) -> Vec<&'a str> {
    let alike = effect.indistinguishable_from.iter();
    alike
        .filter(|kind| !effect.gravity_speaks_against.contains(kind))
        .filter(|kind| !own_mode::is_own_physics(effect, kind, plan))
        .map(String::as_str)
        .collect()
}

fn one(effect: &EffectEntry, fit: &FitEntry, plan: &FindingsPlan) -> Markup {
    html! {
        article {
            h3 { (plain(&effect.kind)) " " code { (effect.kind) } }
            div.split {
                div { (words(effect, fit, plan)) (caution(effect)) (regimes(&effect.regimes)) }
                div { (known(effect, plan.significant_deviations)) }
            }
        }
    }
}

/// Description of an effect, its equivalence class and significance.
fn words(effect: &EffectEntry, fit: &FitEntry, plan: &FindingsPlan) -> Markup {
    let alike = not_distinguishable(effect, plan);
    html! {
        p { (effect.what_was_left_out) }
        @if !effect.equation.is_empty() { p.equation { (symbols(&effect.equation)) } }
        @if let Some(expression) = &effect.expression {
            @match effect.kind.as_str() {
                "unlisted" => p { "Expression: " code { (expression) } },
                _ => p.caution { "Outside the catalogue, explains as much with one parameter: " code { (expression) } },
            }
        }
        @if effect.expression.is_none() && effect.may_be_unlisted() {
            p.caution { (ONLY_DESCRIBED) }
        }
        @if !alike.is_empty() {
            p.caution {
                b { "Not distinguishable: " }
                "by this recording, from "
                @for (place, kind) in alike.iter().enumerate() {
                    @if place > 0 { ", " }
                    (plain(kind))
                }
                ". Either, or a mixture, fits the data."
            }
        }
        @if let Some(said) = own_mode::sentence(effect, plan) { p.note { (said) } }
        @if !effect.gravity_speaks_against.is_empty() {
            p.note {
                "Not distinguishable by the gyros alone from "
                (effect.gravity_speaks_against.iter().map(|kind| plain(kind)).collect::<Vec<_>>().join(", "))
                "; rejected by gravity as the accelerometers measure it."
            }
        }
        @if effect.log_evidence_gain > 0.0 {
            p.note {
                "Evidence: ln Bayes factor " (number(rounded(effect.log_evidence_gain)))
                "; chance of noise alone " (chance(effect.p_value)) ", all trials counted."
            }
        }
        @if let Some(evidence) = &effect.evidence { (held_against(evidence, share_is_of(fit))) }
    }
}

/// Rows of a share of power: an effect is reported with the first rows that contain it.
fn share_is_of(fit: &FitEntry) -> &'static str {
    if fit.whole.is_some() {
        " in the first stretch that shows it"
    } else if fit.recordings.is_empty() {
        ""
    } else {
        " of the first recording that shows it"
    }
}

/// Cross-validation and parametric bootstrap of an effect.
fn held_against(evidence: &EvidenceEntry, of: &str) -> Markup {
    html! {
        p.note {
            "Explains " (number(rounded(100.0 * evidence.share))) " % of the power of the residual" (of)
            @if evidence.confirmed_gain > 0.0 {
                "; cross-validated over blocks of rows, the log score rises by "
                (number(rounded(evidence.confirmed_gain)))
            }
            "."
            @if evidence.reenactments > 0 {
                " Simulated " (evidence.reenactments)
                @if evidence.reenactments == 1 { " time" } @else { " times" }
                " without it (parametric bootstrap), its squared estimate is " (number(rounded(evidence.inflation)))
                " σ² per parameter; expected is 1."
            }
        }
    }
}

/// Numeric parameter.
struct Parameter<'a> {
    name: &'a str,
    value: f64,
    std: f64,
    unit: &'a str,
}

fn numbers(effect: &EffectEntry) -> Vec<Parameter<'_>> {
    let number = |parameter| match parameter {
        &ParameterEntry::Number {
            ref name,
            value,
            std,
            ref unit,
        } => Some(Parameter {
            name,
            value,
            std,
            unit,
        }),
        ParameterEntry::Text { .. } => None,
    };
    effect.parameters.iter().filter_map(number).collect()
}

/// Table of the identifiable combinations, then of the single values.
fn known(effect: &EffectEntry, deviations: f64) -> Markup {
    let parameters = numbers(effect);
    let texts = effect
        .parameters
        .iter()
        .filter_map(|parameter| match parameter {
            ParameterEntry::Text { name, value } => Some((name, value)),
            ParameterEntry::Number { .. } => None,
        });
    let scale_of = |unit: &str| {
        let alike = parameters.iter().filter(|one| one.unit == unit);
        let largest = alike.clone().map(|one| one.value.abs()).fold(0.0, f64::max);
        alike
            .take(1)
            .map(|first| Scale::of(first.name, unit, largest))
            .next()
    };
    let first = parameters.first().and_then(|first| scale_of(first.unit));
    let (factor, unit) = first.map_or((1.0, String::new()), |scale| (scale.factor, scale.unit));
    let combined = effect
        .identifiable
        .iter()
        .any(|fixed| fixed.combination.len() > 1);
    html! {
        @for (name, value) in texts { p { (name) ": " code { (value) } } }
        @if combined {
            h4 { "Identifiable combinations" }
            (significant(
                effect.identifiable.iter().map(|fixed| (combination(&fixed.combination), fixed.value, fixed.std)),
                (factor, &unit),
                deviations,
            ))
        }
        @if !parameters.is_empty() {
            @let single = parameters.iter().map(|p| {
                let own = scale_of(p.unit).map_or(1.0, |scale| scale.factor);
                (p.name.to_owned(), p.value * own / factor, p.std * own / factor)
            });
            @if combined {
                details { summary { "Single values, as written in the model" } (values(single, (factor, &unit), deviations)) }
            } @else { (significant(single, (factor, &unit), deviations)) }
        }
        (correlations::table(effect))
    }
}

/// Note if combinations are known much better than the single values.
fn caution(effect: &EffectEntry) -> Markup {
    let parameters = numbers(effect);
    if effect
        .identifiable
        .iter()
        .all(|fixed| fixed.combination.len() < 2)
    {
        return html! {};
    }
    let (better, ratio) = confidence(effect, &parameters);
    html! {
        @if effect.identifiable.len() < parameters.len() {
            p.caution {
                b { "The single values are not identifiable. " }
                "The recording identifies " (effect.identifiable.len()) " combinations of " (parameters.len())
                " parameters; the single values are one choice among many that fit as well, that of minimum norm."
            }
        } @else if ratio > BETTER_KNOWN_RATIO {
            p.caution {
                b { "Use the combinations, not the single values. " }
                "The best of them (" (better) ") is known " (format!("{ratio:.1}"))
                " times better than its single values."
            }
        }
    }
}

/// Best determined combination against its single values, with the ratio of the standard deviation from its parameters' own
/// (as if uncorrelated) to its actual one.
fn confidence(effect: &EffectEntry, parameters: &[Parameter]) -> (String, f64) {
    let ratio = |fixed: &Identifiable| {
        let parts = fixed.combination.iter().filter_map(|(name, weight)| {
            let parameter = parameters
                .iter()
                .find(|parameter| parameter.name == *name)?;
            Some((weight * parameter.std).powi(2))
        });
        parts.sum::<f64>().sqrt() / fixed.std
    };
    let combined = effect
        .identifiable
        .iter()
        .filter(|fixed| fixed.combination.len() > 1);
    let best = combined
        .map(|fixed| (ratio(fixed), fixed))
        .filter(|(ratio, _)| ratio.is_finite())
        .max_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or((String::new(), 0.0), |(ratio, fixed)| {
        (combination(&fixed.combination), ratio)
    })
}

/// Table of the values beyond `deviations` \[σ\], or of all if none is; the others are named below it.
fn significant(
    rows: impl Iterator<Item = (String, f64, f64)>,
    scale: (f64, &str),
    deviations: f64,
) -> Markup {
    let is_beyond =
        |(name, value, std): &(String, f64, f64)| is_time(name) || value.abs() > deviations * std;
    let (beyond, others): (Vec<_>, Vec<_>) = rows.partition(is_beyond);
    let (rows, below) = match beyond.is_empty() {
        true => (others, Vec::new()),
        false => (beyond, others),
    };
    let below: Vec<&str> = below.iter().map(|(name, ..)| name.as_str()).collect();
    html! {
        (values(rows.into_iter(), scale, deviations))
        @if let Some(below) = below_significance(&below, deviations) { p.note { (below) "." } }
    }
}

fn values(
    rows: impl Iterator<Item = (String, f64, f64)>,
    (factor, unit): (f64, &str),
    deviations: f64,
) -> Markup {
    html! {
        div.scroll { table.values {
            thead { tr { th { "parameter" } th { "value ± σ" @if !unit.is_empty() { " [" (unit) "]" } } th { "from zero" } } }
            tbody {
                @for (name, value, std) in rows {
                    tr {
                        td { (name) }
                        td.number { (with_spread(value * factor, std * factor)) }
                        td.number {
                            @if std > 0.0 {
                                (format!("{:.1} σ", (value / std).abs()))
                                @if (value / std).abs() < deviations { ", not distinguishable from 0" }
                            }
                        }
                    }
                }
            }
        } }
    }
}

/// Consistency of the coefficients over the regimes.
fn regimes(regimes: &[RegimeEntry]) -> Markup {
    let mut shown: Vec<&RegimeEntry> = regimes.iter().collect();
    if shown.len() > MOST_ROWS {
        let pull = |regime: &RegimeEntry| ((regime.amplitude - 1.0) / regime.std).abs();
        shown.sort_by(|a, b| pull(b).total_cmp(&pull(a)));
        shown.truncate(MOST_ROWS);
    }
    let reach = shown
        .iter()
        .flat_map(|r| [r.amplitude - r.std, r.amplitude + r.std]);
    let (low, high) = super::plot::ends(reach.chain([0.8, 1.2])).unwrap_or((0.0, 2.0));
    html! {
        @if !shown.is_empty() {
            details {
            summary { "Consistency: its size in " (regimes.len()) " kinds of motion" }
            p.note {
                "Its amplitude in each kind of motion relative to the value above (1, the line); a wrong name would not fit all of them."
                @if shown.len() < regimes.len() {
                    " Shown are the " (shown.len()) " of " (regimes.len()) " that differ most."
                }
            }
            div.scroll { table.bars { tbody {
                @for regime in &shown {
                    tr {
                        td { (regime.name) }
                        td.wide { (error_bar(regime.amplitude, regime.std, low, high, 1.0)) }
                        td.number { (with_spread(regime.amplitude, regime.std)) }
                    }
                }
            } } }
            }
        }
    }
}
