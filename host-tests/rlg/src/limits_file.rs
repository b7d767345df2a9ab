//! File of the limits of a unit's health: `rlg params --limits`, `rlg inspect --limits`.
//!
//! TOML with `format = 1` and any of [`KEYS`] gives checked [`HealthLimits`]; a limit that is absent is not watched. A
//! parameter block that holds limits is read in its place.

use std::path::Path;

use rlg_recording::nearest;
use rlg_recording::toml_file;
use trueaxis::{HealthLimits, Parameters};

use crate::error::InputError;

/// First bytes of a parameter block.
pub const BLOCK_MAGIC: &[u8] = b"RLGP";

/// Key of the file.
#[derive(Debug, Clone, Copy)]
pub struct LimitKey {
    /// Name.
    pub name: &'static str,
    /// Number of values.
    pub values: usize,
    /// Range of each value.
    pub range: [f64; 2],
    /// Unit of the values.
    pub unit: &'static str,
    /// Meaning, for `docs/files.md`.
    pub meaning: &'static str,
    set: fn(&mut HealthLimits, &[f64]),
}

impl LimitKey {
    /// True if the values are a least and a largest one.
    fn is_pair(&self) -> bool {
        self.values == 2
    }
}

/// All keys. Ranges are those of [`HealthLimits`].
pub const KEYS: [LimitKey; 6] = [
    LimitKey {
        name: "temperature_k",
        values: 2,
        range: [150.0, 450.0],
        unit: "K",
        meaning: "least and largest temperature of a block",
        set: |limits, values| limits.temperature_k = Some([values[0], values[1]]),
    },
    LimitKey {
        name: "intensity_least",
        values: 3,
        range: [0.01, 1.0],
        unit: "of nominal",
        meaning: "least laser intensity of gyros x, y, z",
        set: |limits, values| limits.intensity_least = Some([values[0], values[1], values[2]]),
    },
    LimitKey {
        name: "path_length_step",
        values: 1,
        range: [0.001, 1.0],
        unit: "of its range",
        meaning: "largest change of a path-length control's drive from one reading to the next; a reset counts as one",
        set: |limits, values| limits.path_length_step = Some(values[0]),
    },
    LimitKey {
        name: "dither_drive",
        values: 2,
        range: [0.0, 2.0],
        unit: "of nominal",
        meaning: "least and largest dither drive",
        set: |limits, values| limits.dither_drive = Some([values[0], values[1]]),
    },
    LimitKey {
        name: "dither_amplitude",
        values: 2,
        range: [0.2, 1.9],
        unit: "of nominal",
        meaning: "least and largest dither amplitude, about 1",
        set: |limits, values| limits.dither_amplitude = [values[0], values[1]],
    },
    LimitKey {
        name: "pulse_silence_s",
        values: 1,
        range: [1.001, 1.04],
        unit: "s",
        meaning: "time since a pulse per second after which the next one is lost",
        set: |limits, values| limits.pulse_silence_s = Some(values[0]),
    },
];

/// Reads the limits of a TOML file.
///
/// # Errors
/// The file cannot be read, is no TOML or of another format; a key is unknown, a value is of another type or out of its
/// range; or no limit is there.
pub fn read(path: &Path) -> Result<HealthLimits, InputError> {
    let (table, _) = toml_file::read::<toml::Table>(path)?;
    from_table(path, &table)
}

/// Reads the limits of a TOML file, or those that a parameter block holds.
///
/// # Errors
/// As [`read`]; or the block is damaged, or holds no limits.
pub fn read_either(path: &Path) -> Result<HealthLimits, InputError> {
    let bytes = std::fs::read(path).map_err(|error| InputError::unreadable(path, &error))?;
    if !bytes.starts_with(BLOCK_MAGIC) {
        return read(path);
    }
    let (parameters, _) = Parameters::from_block(&bytes)
        .map_err(|error| InputError::new(path, format!("is no usable block: {error}")))?;
    parameters.limits.ok_or_else(|| {
        InputError::new(path, "is a parameter block without limits")
            .expected("a block of rlg params --limits, or the file of limits itself")
    })
}

fn from_table(path: &Path, table: &toml::Table) -> Result<HealthLimits, InputError> {
    let mut limits = HealthLimits::default();
    let given = || table.iter().filter(|(key, _)| *key != "format");
    for (name, value) in given() {
        let Some(key) = KEYS.iter().find(|key| key.name == name) else {
            let names = KEYS.map(|key| key.name);
            let refused = InputError::new(path, "is no limit").channel(name);
            return Err(refused.expected(match nearest(name, names) {
                Some(near) => near.to_owned(),
                None => format!("one of {}", names.join(", ")),
            }));
        };
        (key.set)(&mut limits, &values(path, value, key)?);
    }
    if given().next().is_none() {
        let names = KEYS.map(|key| key.name);
        return Err(InputError::new(path, "holds no limit")
            .expected(format!("at least one of {}", names.join(", "))));
    }
    limits
        .check()
        .map_err(|error| InputError::new(path, format!("does not fit the firmware: {error}")))?;
    Ok(limits)
}

/// Reads the values of a key, and checks their type, number, range and order.
fn values(path: &Path, value: &toml::Value, key: &LimitKey) -> Result<Vec<f64>, InputError> {
    let [low, high] = key.range;
    let expected = match key.values {
        1 => format!("a number from {low} to {high} {}", key.unit),
        2 => format!(
            "[least, largest], numbers from {low} to {high} {}",
            key.unit
        ),
        _ => format!("[x, y, z], numbers from {low} to {high} {}", key.unit),
    };
    let refused = |problem: &str| {
        InputError::new(path, problem)
            .channel(key.name)
            .value(value)
            .expected(&expected)
    };
    let elements = match value {
        toml::Value::Array(elements) if key.values > 1 => elements.as_slice(),
        toml::Value::Array(_) => return Err(refused("is a list")),
        one => std::slice::from_ref(one),
    };
    if elements.len() != key.values {
        return Err(refused("has another number of values"));
    }
    let mut numbers = Vec::with_capacity(key.values);
    for element in elements {
        let number = match *element {
            toml::Value::Integer(number) => number as f64,
            toml::Value::Float(number) => number,
            _ => return Err(refused("is of another type")),
        };
        // A value that is not a number is in no range.
        if !(low..=high).contains(&number) {
            return Err(refused("is out of range"));
        }
        numbers.push(number);
    }
    if key.is_pair() && numbers[0] >= numbers[1] {
        return Err(refused("has its larger value first, or twice the same"));
    }
    if key.name == "dither_amplitude" && !(numbers[0] < 1.0 && numbers[1] > 1.0) {
        return Err(refused(
            "does not have the nominal amplitude, 1, between its values",
        ));
    }
    Ok(numbers)
}
