//! Infers from a column's usual name its quantity, axis and unit.

use super::targets::Target;
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

/// Words before a quantity that carry no information.
const FILLERS: &[&str] = &[
    "imu",
    "ins",
    "sensor",
    "sensors",
    "raw",
    "cal",
    "calibrated",
    "data",
    "device",
    "motion",
    "body",
    "b",
    "mean",
    "measured",
    "meas",
    "value",
    "values",
];

/// Words that mark a measurement of another instrument.
const REFERENCE_WORDS: &[&str] = &[
    "ref",
    "reference",
    "truth",
    "true",
    "gt",
    "groundtruth",
    "vicon",
    "opt",
    "optical",
    "mocap",
    "optitrack",
    "table",
    "turntable",
];

/// Returns the quantity of a usual name, its words joined in lower case.
fn quantity(stem: &str) -> Option<Target> {
    let quantity = match stem {
        "gyro" | "gyr" | "gyros" | "gyroscope" | "gyrorate" | "g" | "w" | "omega"
        | "angularvelocity" | "angularrate" | "angvel" | "angrate" | "rate" | "rates"
        | "rotationrate" | "rotrate" | "turnrate" | "gyrorad" => Quantity::GyroRate,
        "dtheta" | "deltatheta" | "deltaangle" | "dangle" | "dang" | "gyroincrement"
        | "angleincrement" => Quantity::GyroIncrement,
        "gyrocount" | "gyrocounts" | "gyropulses" | "pulse" | "pulses" | "count" | "counts" => {
            Quantity::GyroCount
        }
        "acc" | "accel" | "accelerometer" | "accelerometers" | "acceleration" | "a" | "f"
        | "sf" | "specificforce" => Quantity::SpecificForce,
        "dvel" | "deltav" | "deltavel" | "deltavelocity" | "dv" | "velocityincrement" => {
            Quantity::VelocityIncrement
        }
        "mag" | "magnetometer" | "magneticfield" | "magfield" | "magnetic" | "m" => {
            Quantity::MagneticField
        }
        "temp" | "temperature" => Quantity::Temperature,
        "q" | "quat" | "quaternion" | "orientation" | "attitude" | "att" => {
            Quantity::ReferenceAttitude
        }
        "dither" | "pickoff" | "ditherangle" => Quantity::DitherAngle,
        "encoder" | "enc" | "encoderangle" | "tableangle" => return Some(Target::ReferenceAngle),
        _ => return None,
    };
    Some(Target::Stored(quantity))
}

/// Splits off the unit in brackets or behind the last blank of a name; returns the name without it, and the unit.
fn bracketed(name: &str) -> (String, Option<String>) {
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some((before, inside)) = name
            .trim_end()
            .strip_suffix(close)
            .and_then(|rest| rest.rsplit_once(open))
        {
            let is_index = inside.chars().all(|letter| letter.is_ascii_digit());
            if !is_index && Unit::parse(inside).is_some() {
                return (before.trim().to_owned(), Some(inside.to_owned()));
            }
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

/// Splits a name into words: at signs, and between a small letter and a capital.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut small = false;
    for letter in name.chars() {
        if !letter.is_alphanumeric() {
            words.push(String::new());
        } else {
            if small && letter.is_uppercase() {
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
    let is_reference = lower
        .iter()
        .any(|word| REFERENCE_WORDS.contains(&word.as_str()));
    let is_filler = |word: &str| {
        let name = word.trim_end_matches(|letter: char| letter.is_ascii_digit());
        REFERENCE_WORDS.contains(&word) || (FILLERS.contains(&name) && (name != "b" || word == "b"))
    };
    let mut left: Vec<&str> = lower
        .iter()
        .map(String::as_str)
        .filter(|word| !is_filler(word))
        .collect();
    let mut axis = None;
    if left.len() > 1 {
        if let Some(found) = left.last().and_then(|word| axis_of(word)) {
            axis = Some(found);
            left.pop();
        } else if let Some(found) = left.first().and_then(|word| axis_of(word)) {
            axis = Some(found);
            left.remove(0);
        }
    }
    let mut stem = left.concat();
    // A reference with only an axis in its name is an attitude: `Vicon Orientation W` came out as `orientation`.
    let mut target = quantity(&stem).filter(|_| axis.is_some() || stem.len() > 1);
    if target.is_none() && axis.is_none() {
        let last = stem.pop()?;
        axis = axis_of(&last.to_string());
        axis?;
        target = quantity(&stem);
    }
    let target = as_reference(target?, is_reference)?;
    let bare = Target::Stored(Quantity::Temperature);
    (axis.is_some() || target == bare).then_some((target, axis.map(str::to_owned)))
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
        Target::Stored(Quantity::ReferenceAttitude) | Target::ReferenceAngle => Some(target),
        _ => None,
    }
}

/// Guesses a column from its `name`; `None` if the name is not usual. A field of a structure may suffice by itself.
pub fn guess(name: &str) -> Option<Guess> {
    let field = || guess_whole(name.rsplit_once('.')?.1);
    guess_whole(name).or_else(field)
}

fn guess_whole(name: &str) -> Option<Guess> {
    let (rest, unit) = bracketed(name);
    let words = words(&rest);
    if let Some(text) = &unit {
        let parsed = Unit::parse(text)?;
        let is_t = words.len() == 1 && words[0].eq_ignore_ascii_case("t");
        let (target, axis) = match parsed.dimension {
            Dimension::Temperature if is_t => (Target::Stored(Quantity::Temperature), None),
            _ => meaning(&words)?,
        };
        return Some(Guess { target, axis, unit });
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

/// Returns the unit text of a column of times, `Some(None)` if the name means time but has no unit.
pub fn time_unit(name: &str) -> Option<Option<String>> {
    let (rest, unit) = bracketed(name);
    let words = words(&rest);
    let is_of_time =
        |unit: &str| Unit::parse(unit).is_some_and(|unit| unit.dimension == Dimension::Time);
    let (first, last) = (words.first()?, words.last()?);
    if let Some(unit) = unit {
        let is_named = is_of_time(&unit) && words.iter().any(|word| is_time(word));
        return is_named.then_some(Some(unit));
    }
    if words.len() > 1 && is_of_time(last) && words.iter().any(|word| is_time(word)) {
        return Some(Some(last.clone()));
    }
    let alone = matches!(words.len(), 1 | 2) && (is_time(first) || is_time(last));
    alone.then_some(None)
}

/// True if a word means time; a capital T is a temperature as often.
fn is_time(word: &str) -> bool {
    let names = [
        "time",
        "times",
        "timestamp",
        "timestamps",
        "stamp",
        "stamps",
    ];
    word == "t" || names.contains(&word.to_lowercase().as_str())
}
