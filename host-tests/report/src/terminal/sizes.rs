//! Writes the sizes of one effect: those that are significant, in one unit, with the digits that their σ allow.

use rlg_findings::names::{plain, plain_at, spaced};
use rlg_findings::numbers::{SIGNIFICANT_SIGMAS, Scale, number};
use rlg_findings::result::{EffectEntry, ParameterEntry};
use rlg_findings::sentences::combination;

/// One number of an effect: a parameter, or a combination that the data fix.
#[derive(Debug, Clone)]
struct Size<'a> {
    /// Name as people read it; "all" where there is one for the whole unit.
    name: String,
    /// The contract's name of a parameter in it.
    parameter: &'a str,
    value: f64,
    std: f64,
    unit: &'a str,
}

impl Size<'_> {
    /// Standard deviations from zero.
    fn sigmas(&self) -> f64 {
        match self.std > 0.0 {
            true => (self.value / self.std).abs(),
            false => 0.0,
        }
    }
}

/// What is said of an effect: its name, and its sizes with units.
pub(super) struct Words {
    pub(super) name: String,
    pub(super) sizes: String,
}

/// Names an effect and its significant sizes; of one number that number, and of several of which none is, that none is.
pub(super) fn words(kind: &str, effect: &[ParameterEntry], entry: Option<&EffectEntry>) -> Words {
    let mut sizes = entry.map_or_else(Vec::new, fixed);
    if sizes.is_empty() {
        sizes = single(effect);
    }
    if sizes.len() > 1 {
        let all = sizes.clone();
        sizes.retain(|size| size.sigmas() > SIGNIFICANT_SIGMAS);
        if sizes.is_empty() {
            return Words {
                name: plain(kind),
                sizes: none_alone(&all),
            };
        }
    }
    let values: Vec<f64> = sizes.iter().map(|size| size.value).collect();
    let (mut name, sign) = plain_at(kind, &values);
    sizes.iter_mut().for_each(|size| size.value *= sign);
    if let Some(axis) = text(effect, "axis") {
        name = format!("{name} {axis}");
    }
    // The name of one number belongs to what is named.
    if let [only] = &mut sizes[..] {
        if !matches!(only.name.as_str(), "all" | "size" | "coefficient") {
            name = format!("{name} {}", only.name);
        }
        only.name.clear();
    }
    let mut said = listed(&sizes);
    if let Some(time_s) = value(effect, "time_s") {
        said = format!("{said} at {} s", number(time_s));
    }
    Words { name, sizes: said }
}

/// Says that the data fix none of several sizes by itself, and how well they do.
fn none_alone(sizes: &[Size<'_>]) -> String {
    let widest = |a: &&Size<'_>, b: &&Size<'_>| a.std.total_cmp(&b.std);
    let names: Vec<&str> = sizes.iter().map(|size| size.name.as_str()).collect();
    let alike = sizes.iter().filter(|size| size.unit == sizes[0].unit);
    let Some(widest) = alike.max_by(widest) else {
        return String::new();
    };
    let scale = Scale::of(widest.parameter, widest.unit, widest.std);
    let std = scale.with_unit(&to_two_digits(widest.std * scale.factor));
    format!(
        "{}: none by itself beyond 3 σ (σ up to {std})",
        names.join(", ")
    )
}

/// The sizes, those of one unit together.
fn listed(sizes: &[Size<'_>]) -> String {
    listed_in(sizes, None)
}

/// The same, read in the unit that suits a size, of each unit its own where there is none.
fn listed_in(sizes: &[Size<'_>], suits: Option<f64>) -> String {
    let mut parts: Vec<String> = Vec::new();
    for same in sizes.chunk_by(|a, b| a.unit == b.unit) {
        let largest = same.iter().map(|size| size.value.abs()).fold(0.0, f64::max);
        let largest = suits.unwrap_or(largest);
        let scale = Scale::of(same[0].parameter, same[0].unit, largest);
        // Names of one value stand before it together.
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

/// The combinations that the data fix.
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

/// The parameters, each by itself, save times.
fn single(parameters: &[ParameterEntry]) -> Vec<Size<'_>> {
    let of = |parameter| match parameter {
        &ParameterEntry::Number {
            ref name,
            value,
            std,
            ref unit,
        } if !matches!(name.as_str(), "time_s" | "start_s" | "end_s") => Some(Size {
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

/// Every parameter with its unit, save times.
pub(super) fn all(parameters: &[ParameterEntry]) -> String {
    let sizes = single(parameters);
    let mut largest = 0.0_f64;
    for size in &sizes {
        largest = largest.max(size.value.abs()).max(size.std);
    }
    listed_in(&sizes, Some(largest))
}

/// "x_pole_s" as "x pole": the unit stands behind the value.
fn without_unit(name: &str) -> String {
    let bare = name.strip_suffix("_s").or_else(|| name.strip_suffix("_hz"));
    spaced(bare.unwrap_or(name))
}

/// The number of this name.
pub(super) fn value(parameters: &[ParameterEntry], wanted: &str) -> Option<f64> {
    parameters.iter().find_map(|parameter| match parameter {
        ParameterEntry::Number { name, value, .. } if name == wanted => Some(*value),
        _ => None,
    })
}

/// The text of this name.
pub(super) fn text<'a>(parameters: &'a [ParameterEntry], wanted: &str) -> Option<&'a str> {
    parameters.iter().find_map(|parameter| match parameter {
        ParameterEntry::Text { name, value } if name == wanted => Some(value.as_str()),
        _ => None,
    })
}

/// How large the largest number is against its own spread.
pub(super) fn strength(effect: &EffectEntry) -> f64 {
    let sizes = single(&effect.parameters);
    sizes.iter().map(Size::sigmas).fold(0.0, f64::max)
}

/// A value to two significant digits.
pub(super) fn to_two_digits(value: f64) -> String {
    number(format!("{value:.1e}").parse().unwrap_or(value))
}
