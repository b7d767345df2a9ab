//! Text on the sizes of one effect: the significant ones, in one unit, with the digits justified by their σ.

use rlg_findings::names::{plain, plain_at, spaced};
use rlg_findings::numbers::{Scale, number};
use rlg_findings::result::{EffectEntry, ParameterEntry, number_of, text_of};
use rlg_findings::sentences::combination;

/// Largest number of insignificant sizes that are named; more are counted.
const MOST_BELOW: usize = 3;

/// Parameter of an effect, or an identifiable combination.
#[derive(Debug, Clone)]
struct Size<'a> {
    /// Name in text; "all" for a value common to the whole unit.
    name: String,
    /// Contract name of a parameter in it.
    parameter: &'a str,
    value: f64,
    std: f64,
    unit: &'a str,
}

impl Size<'_> {
    /// Absolute value in standard deviations.
    fn sigmas(&self) -> f64 {
        match self.std > 0.0 {
            true => (self.value / self.std).abs(),
            false => 0.0,
        }
    }
}

/// Name of an effect, and its sizes with units.
pub(super) struct Words {
    pub(super) name: String,
    pub(super) sizes: String,
}

/// Formats an effect's name and significant sizes; a single parameter in any case, and for several insignificant ones a
/// statement of that.
pub(super) fn words(
    kind: &str,
    effect: &[ParameterEntry],
    entry: Option<&EffectEntry>,
    deviations: f64,
) -> Words {
    let mut sizes = entry.map_or_else(Vec::new, fixed);
    if sizes.is_empty() {
        sizes = single(effect);
    }
    let mut below = Vec::new();
    if sizes.len() > 1 {
        let (beyond, others): (Vec<_>, Vec<_>) = sizes
            .into_iter()
            .partition(|size| size.sigmas() > deviations);
        if beyond.is_empty() {
            return Words {
                name: plain(kind),
                sizes: none_alone(&others, deviations),
            };
        }
        sizes = beyond;
        below = others;
    }
    let values: Vec<f64> = sizes.iter().map(|size| size.value).collect();
    let (mut name, sign) = plain_at(kind, &values);
    sizes.iter_mut().for_each(|size| size.value *= sign);
    if let Some(axis) = text_of(effect, "axis") {
        name = format!("{name} {axis}");
    }
    // A single parameter's name becomes part of the effect's name.
    if let [only] = &mut sizes[..] {
        if !matches!(only.name.as_str(), "all" | "size" | "coefficient") {
            name = format!("{name} {}", only.name);
        }
        only.name.clear();
    }
    let mut said = listed(&sizes);
    if let Some((time_s, _)) = number_of(effect, "time_s") {
        said = format!("{said} at {} s", number(time_s));
    }
    let below: Vec<&str> = below.iter().map(|size| size.name.as_str()).collect();
    if let Some(below) = below_significance(&below, deviations) {
        said = format!("{said}; {below}");
    }
    Words { name, sizes: said }
}

/// Names sizes that are not significant by themselves, as "x, y below 3 σ", or counts them if there are many.
pub(crate) fn below_significance(names: &[&str], deviations: f64) -> Option<String> {
    let which = match names {
        [] => return None,
        names if names.len() <= MOST_BELOW => names.join(", "),
        names => format!("{} others", names.len()),
    };
    Some(format!("{which} below {deviations} σ"))
}

/// States that none of several sizes is significant by itself, with their precision.
fn none_alone(sizes: &[Size<'_>], deviations: f64) -> String {
    let widest = |a: &&Size<'_>, b: &&Size<'_>| a.std.total_cmp(&b.std);
    let names: Vec<&str> = sizes.iter().map(|size| size.name.as_str()).collect();
    let alike = sizes.iter().filter(|size| size.unit == sizes[0].unit);
    let Some(widest) = alike.max_by(widest) else {
        return String::new();
    };
    let scale = Scale::of(widest.parameter, widest.unit, widest.std);
    let std = scale.with_unit(&to_two_digits(widest.std * scale.factor));
    format!(
        "{}: none by itself beyond {deviations} σ (σ up to {std})",
        names.join(", ")
    )
}

/// Formats the sizes, those of one unit together.
fn listed(sizes: &[Size<'_>]) -> String {
    listed_in(sizes, None)
}

/// Formats the sizes in the unit suitable for `suits`, or for the largest of each unit if `None`.
fn listed_in(sizes: &[Size<'_>], suits: Option<f64>) -> String {
    let mut parts: Vec<String> = Vec::new();
    for same in sizes.chunk_by(|a, b| a.unit == b.unit) {
        let largest = same.iter().map(|size| size.value.abs()).fold(0.0, f64::max);
        let largest = suits.unwrap_or(largest);
        let scale = Scale::of(same[0].parameter, same[0].unit, largest);
        // Equal values are written once, after all their names.
        let mut pairs: Vec<(Vec<&str>, String)> = Vec::new();
        for size in same {
            let pair = scale.pair(size.value, size.std);
            match pairs.last_mut() {
                Some((names, known)) if *known == pair => names.push(&size.name),
                _ => pairs.push((vec![&size.name], pair)),
            }
        }
        let pairs: Vec<String> = pairs
            .iter()
            .map(|(names, pair)| format!("{} {pair}", names.join(", ")))
            .collect();
        parts.push(scale.with_unit(pairs.join(", ").trim_start()));
    }
    parts.join("; ")
}

/// Identifiable combinations.
fn fixed(entry: &EffectEntry) -> Vec<Size<'_>> {
    let of = |fixed: &rlg_findings::result::Identifiable| {
        entry
            .parameters
            .iter()
            .find_map(|parameter| match parameter {
                ParameterEntry::Number { name, unit, .. }
                    if fixed.combination.contains_key(name) =>
                {
                    Some(Size {
                        name: without_unit(&combination(&fixed.combination)),
                        parameter: name,
                        value: fixed.value,
                        std: fixed.std,
                        unit,
                    })
                }
                _ => None,
            })
    };
    entry.identifiable.iter().filter_map(of).collect()
}

/// Single parameters, except times.
fn single(parameters: &[ParameterEntry]) -> Vec<Size<'_>> {
    let of = |parameter| match parameter {
        &ParameterEntry::Number {
            ref name,
            value,
            std,
            ref unit,
        } if !is_time(name) => Some(Size {
            name: without_unit(name),
            parameter: name,
            value,
            std,
            unit,
        }),
        _ => None,
    };
    parameters.iter().filter_map(of).collect()
}

/// Formats every parameter with its unit, except times.
pub(super) fn all(parameters: &[ParameterEntry]) -> String {
    let sizes = single(parameters);
    let mut largest = 0.0_f64;
    for size in &sizes {
        largest = largest.max(size.value.abs()).max(size.std);
    }
    listed_in(&sizes, Some(largest))
}

/// True for a parameter that is a time, which is no size.
pub(crate) fn is_time(name: &str) -> bool {
    matches!(name, "time_s" | "start_s" | "end_s")
}

/// Parameter name without its unit suffix ("x_pole_s" as "x pole"): the unit follows the value.
fn without_unit(name: &str) -> String {
    let bare = name.strip_suffix("_s").or_else(|| name.strip_suffix("_hz"));
    spaced(bare.unwrap_or(name))
}

/// Largest ratio of a parameter to its standard deviation.
pub(super) fn strength(effect: &EffectEntry) -> f64 {
    let sizes = single(&effect.parameters);
    sizes.iter().map(Size::sigmas).fold(0.0, f64::max)
}

/// Formats a value to two significant digits.
pub(super) fn to_two_digits(value: f64) -> String {
    number(format!("{value:.1e}").parse().unwrap_or(value))
}
