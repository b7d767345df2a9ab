//! Determines the unit of stamps that no name and no publisher states: by dates since 1970, or by the rows a second.

use super::clocks::{Said, stamps_in, time_unit};
use crate::error::InputError;
use crate::import::files::columns::Block;
use crate::import::files::date_times::origin_since_1970_s;
use crate::import::mapping::mapped::Plan;
use crate::import::mapping::questions::Question;
use crate::recording::units::Unit;
use rlg_signal::quantiles::median;

/// Units of stamps.
const UNITS: [&str; 4] = ["s", "ms", "us", "ns"];

/// Rows a second of loggers, the slowest and the fastest \[Hz\].
const USUAL_HZ: std::ops::Range<f64> = 0.9..20e3;

/// Rows a second of most logs \[Hz\]: the guess among several units is the one nearest to it.
const MOST_HZ: f64 = 100.0;

/// Sets the units of the stamps in use; returns notes of those that the data decide, and questions with a guess.
pub fn settle(
    blocks: &mut [Block],
    plan: &Plan,
    said: &Said,
) -> Result<(Vec<String>, Vec<Question>), InputError> {
    let (mut notes, mut questions) = (Vec::new(), Vec::new());
    let used = plan.mapped.iter();
    let used = used.filter_map(|mapped| Some((mapped.block, stamps_in(blocks, mapped, said)?.0)));
    let mut used: Vec<(usize, usize)> = used.collect();
    used.sort_unstable();
    used.dedup();
    for (b, c) in used {
        if time_unit(&blocks[b], c, said)?.is_some() {
            continue;
        }
        let column = &blocks[b].columns[c];
        let name = column.name.clone();
        let (guess, note) = match by_data(&column.values) {
            Told::Decided(unit, why) => (unit, Some(format!("{name} is taken in {unit}: {why}"))),
            Told::Guessed(unit, why) => {
                // With a rate, stamps of an unknown unit are not needed.
                if said.rate_hz.is_some() {
                    continue;
                }
                let question = Question {
                    asks: format!("{name}: is a time whose unit stands nowhere"),
                    answer: ("--time", vec![format!("{name}:{unit}")]),
                    is_guess: true,
                    evidence: why,
                };
                if !questions.contains(&question) {
                    questions.push(question);
                }
                (unit, None)
            }
        };
        notes.extend(note);
        blocks[b].columns[c].unit = Some(guess.to_owned());
    }
    Ok((notes, questions))
}

/// Returns the likeliest unit of stamps, and the reason.
pub(super) fn unit_of(stamps: &[f64]) -> (&'static str, String) {
    match by_data(stamps) {
        Told::Decided(unit, why) | Told::Guessed(unit, why) => (unit, why),
    }
}

/// A unit, and why.
enum Told {
    Decided(&'static str, String),
    Guessed(&'static str, String),
}

fn by_data(stamps: &[f64]) -> Told {
    let scale = |unit: &str| Unit::parse(unit).map_or(1.0, |unit| unit.scale);
    let known: Vec<f64> = stamps
        .iter()
        .copied()
        .filter(|stamp| stamp.is_finite())
        .collect();
    let (first, last) = match (known.first(), known.last()) {
        (Some(first), Some(last)) => (*first, *last),
        _ => (f64::NAN, f64::NAN),
    };
    let is_date =
        |unit: &&&str| origin_since_1970_s(first * scale(unit), last * scale(unit)).is_some();
    if let Some(unit) = UNITS.iter().find(|unit| is_date(unit)) {
        return Told::Decided(unit, "its values are then dates since 1970".to_owned());
    }
    let steps = known.windows(2).map(|pair| pair[1] - pair[0]);
    let step = median(steps.filter(|step| *step > 0.0)).unwrap_or(f64::NAN);
    let rate_hz = |unit: &str| 1.0 / (step * scale(unit));
    let usual = UNITS
        .iter()
        .filter(|unit| USUAL_HZ.contains(&rate_hz(unit)));
    let mut usual: Vec<&&str> = usual.collect();
    let away = |unit: &str| (rate_hz(unit) / MOST_HZ).ln().abs();
    usual.sort_by(|a, b| away(a).total_cmp(&away(b)));
    let words = |unit: &str| format!("{unit} would be {} rows a second", short(rate_hz(unit)));
    match usual[..] {
        [only] => Told::Decided(
            only,
            format!(
                "{} rows a second; no other unit gives 0.9 to 20 000",
                short(rate_hz(only))
            ),
        ),
        [best, second, ..] => Told::Guessed(best, format!("{}, {}", words(best), words(second))),
        [] => Told::Guessed("s", words("s")),
    }
}

/// Formats a rate with three digits.
fn short(rate_hz: f64) -> String {
    match rate_hz {
        large if large >= 100.0 => format!("{large:.0}"),
        middle if middle >= 1.0 => format!("{middle:.2}"),
        small => format!("{small:.2e}"),
    }
}
