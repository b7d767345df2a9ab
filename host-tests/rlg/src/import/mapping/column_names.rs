//! Infers from a column's usual name its quantity, axis and unit.

use super::known_forms::Form;
use super::name_table::{self, is_filler};
use super::targets::Target;
use crate::import::files::columns::{Block, Column};
use crate::recording::Quantity;
use crate::recording::units::{Dimension, Unit};

/// Quantity, axis and unit inferred from a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Guess {
    /// Quantity of the column.
    pub target: Target,
    /// Axis; a digit until the columns next to it are known.
    pub axis: Option<String>,
    /// Unit in the name.
    pub unit: Option<String>,
}

/// Splits off the unit in brackets or behind the last blank of a name; returns the name without it, and the unit. Brackets
/// around another text are dropped if they are empty or hold no unit, and a word before the unit goes to the name:
/// `ORIENTATION Z (azimuth °)`.
pub(super) fn bracketed(name: &str) -> (String, Option<String>) {
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some((before, inside)) = name
            .trim_end()
            .strip_suffix(close)
            .and_then(|rest| rest.rsplit_once(open))
        {
            let is_index =
                !inside.is_empty() && inside.chars().all(|letter| letter.is_ascii_digit());
            let is_unit = |text: &str| Unit::parse(text).is_some() || text == "°";
            if is_index {
                continue;
            }
            if is_unit(inside) {
                return (before.trim().to_owned(), Some(inside.to_owned()));
            }
            return match inside.rsplit_once(' ') {
                Some((word, unit)) if is_unit(unit) => {
                    (format!("{before} {word}"), Some(unit.to_owned()))
                }
                _ if inside.len() < 2 => (before.trim().to_owned(), None),
                _ => (name.to_owned(), None),
            };
        }
    }
    if let Some((before, last)) = name.trim().rsplit_once(char::is_whitespace)
        && last.contains(['/', '°'])
        && Unit::parse(last).is_some()
    {
        return (before.trim().to_owned(), Some(last.to_owned()));
    }
    (name.to_owned(), None)
}

/// Splits a name into words: at signs, between a small letter and a capital, and between an acronym and a word: `GPSTime`,
/// but not `GYROx`.
pub(super) fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut small = false;
    let letters: Vec<char> = name.chars().collect();
    let small_behind = |place: usize| {
        let behind = letters[place + 1..].iter().take(2);
        behind.filter(|one| one.is_lowercase()).count() == 2
    };
    for (place, &letter) in letters.iter().enumerate() {
        if !letter.is_alphanumeric() {
            words.push(String::new());
        } else {
            let is_first = words.last().is_none_or(String::is_empty);
            let begins =
                small || (!is_first && letters[place - 1].is_uppercase() && small_behind(place));
            if begins && letter.is_uppercase() {
                words.push(String::new());
            }
            if let Some(word) = words.last_mut() {
                word.push(letter);
            }
        }
        small = letter.is_lowercase();
    }
    words.retain(|word| !word.is_empty());
    words
}

/// The words of a name in lower case.
pub(super) fn lower_words(name: &str) -> Vec<String> {
    words(name).iter().map(|word| word.to_lowercase()).collect()
}

fn axis_of(word: &str) -> Option<&'static str> {
    let labels = ["w", "x", "y", "z", "0", "1", "2", "3", "4"];
    let lower = word.to_lowercase();
    match lower.as_str() {
        "roll" => Some("x"),
        "pitch" => Some("y"),
        "yaw" => Some("z"),
        _ => labels.into_iter().find(|label| *label == lower),
    }
}

/// Infers quantity and axis from words without a unit.
fn meaning(words: &[String]) -> Option<(Target, Option<String>)> {
    let lower: Vec<String> = words.iter().map(|word| word.to_lowercase()).collect();
    if name_table::no_measurement(&lower).is_some() {
        return None;
    }
    let is_reference = lower.iter().any(|word| name_table::is_reference(word));
    // EuRoC: w_RS_S is of the sensor S; p_RS_R of the reference R.
    let is_euroc = lower.iter().any(|word| word == "rs");
    let mut left: Vec<&str> = lower
        .iter()
        .map(String::as_str)
        .filter(|word| !(is_filler(word) || is_euroc && *word == "s"))
        .collect();
    if let Some(found) = matrix_element(&left) {
        return Some((Target::Matrix, Some(found)));
    }
    if left.len() == 1
        && let Some(axis) = angle_axis(left[0])
    {
        return Some((Target::Euler, Some(axis.to_owned())));
    }
    let mut axis = None;
    let mut is_angle = false;
    if left.len() > 1 {
        if let Some(found) = left.last().and_then(|word| axis_of(word)) {
            axis = Some(found);
            is_angle = left.pop().and_then(angle_axis).is_some();
        } else if let Some(found) = left.first().and_then(|word| axis_of(word)) {
            axis = Some(found);
            is_angle = angle_axis(left.remove(0)).is_some();
        }
    }
    let stem = left.concat();
    // A reference with only an axis in its name is an attitude: `Vicon Orientation W` came out as `orientation`.
    let mut target = name_table::target(&stem).filter(|_| axis.is_some() || stem.len() > 1);
    if target.is_none() && axis.is_none() {
        (target, axis) = joined_axis(&stem)?;
    }
    // `attitude.roll` is an angle; `attitude.x` a part of a quaternion.
    if is_angle && target == Some(Target::Stored(Quantity::ReferenceAttitude)) {
        target = Some(Target::Euler);
    }
    // One angle of a table is an encoder's, three of a camera system are a sequence.
    let is_table = lower
        .iter()
        .any(|word| word.ends_with("table") || word == "stage");
    if target == Some(Target::Euler) && is_reference && (is_table || axis.is_none()) {
        target = Some(Target::ReferenceAngle);
    }
    if target == Some(Target::Matrix) {
        return None;
    }
    let target = as_reference(target?, is_reference)?;
    let bare = [
        Target::Stored(Quantity::Temperature),
        Target::ReferenceAngle,
        Target::ReferenceRate,
    ];
    // A table's angle without an axis gets it from the gyros.
    let may_be_bare = bare.contains(&target);
    (axis.is_some() || may_be_bare).then_some((target, axis.map(str::to_owned)))
}

/// Returns target and axis of a name joined with its axis, behind it or, as MAVLink has it, before: `gyrox`, `xgyro`.
fn joined_axis(stem: &str) -> Option<(Option<Target>, Option<&'static str>)> {
    let mut name = stem.to_owned();
    let last = name.pop()?;
    let axis = axis_of(&last.to_string());
    let behind = axis.and_then(|_| name_table::target(&name));
    if behind.is_some() {
        return Some((behind, axis));
    }
    let mut letters = stem.chars();
    let before = letters.next().filter(|first| "xyz".contains(*first))?;
    let target = name_table::target(letters.as_str()).filter(|_| letters.as_str().len() > 2);
    Some((target, axis_of(&before.to_string())))
}

/// Returns the axis of an angle that is a word by itself.
fn angle_axis(word: &str) -> Option<&'static str> {
    match word {
        "roll" | "phi" => Some("x"),
        "pitch" => Some("y"),
        "yaw" | "heading" => Some("z"),
        _ => None,
    }
}

/// Returns row and column of a matrix's element, from 1: `Mat[1][2]`, `R12`, `element 12`.
fn matrix_element(words: &[&str]) -> Option<String> {
    let joined = words.concat();
    let stem = joined.trim_end_matches(|letter: char| letter.is_ascii_digit());
    let digits = &joined[stem.len()..];
    let is_place = digits.len() == 2 && digits.chars().all(|digit| ('1'..='3').contains(&digit));
    (is_place && name_table::target(stem) == Some(Target::Matrix)).then(|| digits.to_owned())
}

/// Returns the target of a quantity measured by another instrument; `None` if it is of no use.
fn as_reference(target: Target, is_reference: bool) -> Option<Target> {
    if !is_reference {
        return Some(target);
    }
    match target {
        Target::Stored(Quantity::GyroRate) => Some(Target::ReferenceRate),
        Target::Stored(Quantity::GyroIncrement) => {
            Some(Target::Stored(Quantity::ReferenceIncrement))
        }
        // `Table angle z` is an encoder's, and no angle of a sequence of three.
        Target::Stored(Quantity::ReferenceAttitude) | Target::ReferenceAngle | Target::Euler => {
            Some(target)
        }
        _ => None,
    }
}

/// Guesses a column from its `name`; `None` if the name is not usual. A field of a structure may suffice by itself.
pub fn guess(name: &str) -> Option<Guess> {
    let mut fields = name.match_indices('.').map(|(place, _)| &name[place + 1..]);
    guess_whole(name).or_else(|| fields.find_map(guess_whole))
}

/// Guesses a column of a file: by the form of the file, by its name, or, where that is an axis alone, by its unit or by the
/// name of the file.
pub fn guess_in(block: &Block, column: &Column) -> Option<Guess> {
    if let Some(meaning) = Form::takes(block, column) {
        let mut parts = meaning.splitn(3, ':');
        let mut next = || parts.next().filter(|part| *part != "-").map(str::to_owned);
        let (target, axis, unit) = (next()?, next(), next());
        return (target != "time").then(|| Guess {
            target: Target::from_name(&target),
            axis,
            unit,
        });
    }
    guess(&column.name).or_else(|| bare_axis(block, column))
}

/// Guesses a column with only an axis in its name.
fn bare_axis(block: &Block, column: &Column) -> Option<Guess> {
    let (rest, unit) = bracketed(&column.name);
    let words = words(&rest);
    let axis = match &words[..] {
        [word] if ["x", "y", "z"].contains(&word.to_lowercase().as_str()) => axis_of(word)?,
        _ => return None,
    };
    let unit = unit.or_else(|| column.unit.clone());
    let by_unit = || match Unit::parse(unit.as_deref()?)?.dimension {
        Dimension::AngularRate => Some(Target::Stored(Quantity::GyroRate)),
        Dimension::Force => Some(Target::Stored(Quantity::SpecificForce)),
        Dimension::Field => Some(Target::Stored(Quantity::MagneticField)),
        _ => None,
    };
    let by_file = || {
        let stem = block.file.file_stem()?.to_string_lossy().into_owned();
        name_table::of_file(&lower_words(&stem))
    };
    let target = by_unit().or_else(by_file)?;
    Some(Guess {
        target,
        axis: Some(axis.to_owned()),
        unit,
    })
}

/// Returns the reason for which a column of this name and unit is not taken, and true if it might be an attitude, an angle or
/// a temperature, which is not left out without a word of the user's.
pub fn reason(name: &str, unit: Option<&str>) -> (&'static str, bool) {
    let (rest, own) = bracketed(name);
    let unit = own.as_deref().or(unit).and_then(Unit::parse);
    let tells = [Dimension::Angle, Dimension::Temperature];
    let by_unit = unit.is_some_and(|unit| tells.contains(&unit.dimension));
    let lower = lower_words(&rest);
    match name_table::no_measurement(&lower) {
        Some(reason) => (reason, false),
        None => (
            "its name says no quantity and axis; --map states both",
            by_unit || name_table::is_telling(&lower),
        ),
    }
}

/// True if a word is the temperature's: `board temp (°C)`.
fn is_temperature(words: &[String]) -> bool {
    let temperature = Some(Target::Stored(Quantity::Temperature));
    let mut words = words.iter();
    words.any(|word| name_table::target(&word.to_lowercase()) == temperature)
}

/// Returns the axis of a gyro's own temperature.
fn temperature_axis(words: &[String]) -> Option<String> {
    let last = words.last()?.to_lowercase();
    ["x", "y", "z"].contains(&last.as_str()).then_some(last)
}

/// Guesses a column of the unit's health, by the name that an export gives it.
fn health(name: &str) -> Option<Guess> {
    let (stem, axis) = match name.rsplit_once('_') {
        Some((stem, axis @ ("x" | "y" | "z"))) => (stem, Some(axis.to_owned())),
        // The unit of a time.
        Some((stem, "s")) => (stem, None),
        _ => (name, None),
    };
    let quantity = Quantity::from_name(stem);
    let is_health = Quantity::HEALTH.contains(&quantity);
    let unit = quantity.unit().map(str::to_owned);
    let target = Target::Stored(quantity);
    let is_whole = is_health && target.takes_axis(axis.as_deref());
    is_whole.then_some(Guess { target, axis, unit })
}

fn guess_whole(name: &str) -> Option<Guess> {
    if let Some(found) = health(name) {
        return Some(found);
    }
    let (rest, unit) = bracketed(name);
    let words = words(&rest);
    if let Some(text) = &unit {
        let parsed = Unit::parse(text)?;
        let is_t = words.len() == 1 && words[0].eq_ignore_ascii_case("t");
        let is_bare = words.len() == 1
            && axis_of(&words[0]).is_some()
            && angle_axis(&words[0].to_lowercase()).is_none();
        let (target, axis) = match parsed.dimension {
            Dimension::Temperature if is_t || is_temperature(&words) => (
                Target::Stored(Quantity::Temperature),
                temperature_axis(&words),
            ),
            _ if is_bare => return None,
            _ => meaning(&words)?,
        };
        // `Temps (s)` is a time.
        let is_other = parsed.dimension == Dimension::Time
            && target.dimension().is_some_and(|own| own != Dimension::Time);
        return (!is_other).then_some(Guess { target, axis, unit });
    }
    // A unit may be the last words, before or behind the axis: `gyro_x_deg_s`, `accelerometer_m_s2[0]`.
    let (body, index) = match words.split_last() {
        Some((last, body)) if axis_of(last).is_some() && body.len() > 1 => (body, Some(last)),
        _ => (&words[..], None),
    };
    for (words, index) in [(&words[..], None), (body, index)] {
        for count in (1..=2.min(words.len().saturating_sub(1))).rev() {
            let (before, last) = words.split_at(words.len() - count);
            let mut before = before.to_vec();
            before.extend(index.cloned());
            // `uT` was split at its capital, `deg_s` at its sign.
            for unit in [last.concat(), last.join("_")] {
                if let (Some(parsed), Some((target, axis))) = (Unit::parse(&unit), meaning(&before))
                    && target.dimension() == Some(parsed.dimension)
                {
                    let unit = Some(unit);
                    return Some(Guess { target, axis, unit });
                }
            }
        }
    }
    let (target, axis) = meaning(&words)?;
    let unit = None;
    Some(Guess { target, axis, unit })
}

/// Returns the unit in a column's name or in its line of units.
pub fn own_unit(column: &Column) -> Option<Unit> {
    let (_, unit) = bracketed(&column.name);
    Unit::parse(unit.as_ref().or(column.unit.as_ref())?)
}

/// Returns the axis that a name ends or begins with: `x-axis`, `vel_z`.
pub fn own_axis(name: &str) -> Option<&'static str> {
    let (rest, _) = bracketed(name);
    let words = words(&rest);
    let letters = ["x", "y", "z"];
    let of = |word: &String| axis_of(word).filter(|axis| letters.contains(axis));
    words
        .last()
        .and_then(of)
        .or_else(|| words.first().and_then(of))
}

/// True if a name is of another instrument's measurement, or of none.
pub fn is_of_another(name: &str) -> bool {
    let lower = lower_words(name);
    name_table::no_measurement(&lower).is_some()
        || lower.iter().any(|word| name_table::is_reference(word))
}

/// True if a name is of values that are not calibrated.
pub fn is_raw(name: &str) -> bool {
    let mut words = lower_words(name).into_iter();
    words.any(|word| ["raw", "uncal", "uncalibrated", "uncomp", "un"].contains(&word.as_str()))
}
