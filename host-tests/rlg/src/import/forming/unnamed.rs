//! Guesses the columns of a file without names by their values: stamps grow evenly, a force has gravity's length, a quaternion
//! the length 1, and gyros stand beside the accelerometers.

use std::borrow::Borrow;

use super::settle_times;
use crate::import::files::columns::{Block, Column};
use crate::import::mapping::column_names;
use crate::import::mapping::questions::Question;
use crate::import::mapping::time_names::{is_even, median, steps};
use crate::recording::AXES;
use crate::recording::units::{STANDARD_GRAVITY_M_S2, Unit};

/// Largest median deviation of a force's length from its median, relative.
const STEADY: f64 = 0.2;

/// Median deviation of a length below which another is no steadier, relative.
const AS_STEADY: f64 = 0.02;

/// Largest relative distance of a length from gravity's in a usual unit.
const NEAR: f64 = 0.1;

/// Largest deviation of a quaternion's length from 1.
const UNIT_LENGTH: f64 = 1e-2;

/// Guesses with their questions.
#[derive(Debug, Default)]
pub struct Guessed {
    /// As of `--map`.
    pub maps: Vec<String>,
    /// As of `--time`.
    pub time: Option<String>,
    /// Place of the first component of a quaternion.
    pub quaternion: Option<usize>,
    /// One for each group of columns.
    pub questions: Vec<Question>,
}

/// Guesses the columns of a single block without names; `None` unless gyros and accelerometers, or a quaternion and gyros, are
/// recognised.
pub fn guess(blocks: &[Block], has_time: bool) -> Option<Guessed> {
    let [block] = blocks else { return None };
    let mut names = block.columns.iter().enumerate();
    if !names.all(|(place, column)| column.name == (place + 1).to_string()) {
        return None;
    }
    let mut guessed = Guessed::default();
    let mut used: Vec<bool> = block
        .columns
        .iter()
        .map(|one| one.dates.is_some() || !is_measured(one))
        .collect();
    let stamps = stamps(&block.columns).filter(|_| !has_time);
    let step_s = stamps.map(|place| {
        used[place] = true;
        guessed.time(&block.columns[place])
    });
    let quaternion = (0..block.columns.len().saturating_sub(3))
        .find(|&first| is_free(&used, first, 4) && is_quaternion(&block.columns[first..first + 4]));
    if let Some(first) = quaternion {
        used[first..first + 4].fill(true);
    }
    let mut force = force(&block.columns, &used);
    let without_force = used.clone();
    if let Some((first, _)) = force {
        used[first..first + 3].fill(true);
    }
    let gyros = match gyros(&block.columns, &used) {
        Some(gyros) => gyros,
        // Beside a quaternion the only three are the gyros, whatever their length.
        None => {
            force = None;
            quaternion.and_then(|_| gyros(&block.columns, &without_force))?
        }
    };
    let is_sum = match (force, step_s) {
        (Some((_, Length { median, .. })), Some(step_s)) => {
            is_near(median, STANDARD_GRAVITY_M_S2 * step_s)
        }
        _ => false,
    };
    if let Some((first, length)) = force {
        let quantity = if is_sum {
            "velocity_increment"
        } else {
            "specific_force"
        };
        guessed.triple(
            first,
            quantity,
            format!(
                "their length stays within {:.1} % of {:.4}{}",
                100.0 * length.spread,
                length.median,
                if is_sum {
                    ", gravity times the rows' period"
                } else {
                    ""
                }
            ),
        );
    }
    let quantity = if is_sum {
        "gyro_increment"
    } else {
        "gyro_rate"
    };
    guessed.triple(
        gyros,
        quantity,
        "three columns side by side whose length varies".to_owned(),
    );
    guessed.quaternion = quaternion;
    (force.is_some() || quaternion.is_some()).then_some(guessed)
}

impl Guessed {
    /// Takes a column as stamps; returns their step \[s\].
    fn time(&mut self, column: &Column) -> f64 {
        let (unit, evidence) = settle_times::unit_of(&column.values);
        let option = format!("{}:{unit}", column.name);
        self.questions.push(Question {
            asks: format!(
                "column {}: has no name and grows evenly, as stamps do",
                column.name
            ),
            answer: ("--time", vec![option.clone()]),
            is_guess: true,
            evidence,
        });
        self.time = Some(option);
        let scale = Unit::parse(unit).map_or(1.0, |unit| unit.scale);
        scale * median(steps(&column.values))
    }

    fn triple(&mut self, first: usize, quantity: &str, evidence: String) {
        let maps = AXES.iter().enumerate();
        let maps = maps.map(|(axis, name)| format!("{}={quantity}:{name}", first + axis + 1));
        self.map(maps.collect(), evidence);
    }

    fn map(&mut self, maps: Vec<String>, evidence: String) {
        let name = |map: &String| map.split('=').next().unwrap_or_default().to_owned();
        let names: Vec<String> = maps.iter().map(name).collect();
        self.maps.extend(maps.iter().cloned());
        self.questions.push(Question {
            asks: format!("columns {}: have no names", names.join(", ")),
            answer: ("--map", maps),
            is_guess: true,
            evidence,
        });
    }
}

/// Returns the median length of three columns in a unit of force \[m/s²\].
pub fn length_m_s2(columns: &[&Column]) -> Option<f64> {
    let scale = column_names::own_unit(columns.first()?)?.scale;
    Some(scale * Length::of(columns).median)
}

/// Length of three columns taken as a vector.
#[derive(Debug, Clone, Copy)]
struct Length {
    median: f64,
    /// Median deviation from the median, relative.
    spread: f64,
}

impl Length {
    fn of(columns: &[impl Borrow<Column>]) -> Self {
        let rows = columns[0].borrow().values.len();
        let square = |row: usize| {
            columns
                .iter()
                .map(|one| one.borrow().values[row].powi(2))
                .sum::<f64>()
        };
        let lengths: Vec<f64> = (0..rows).map(|row| square(row).sqrt()).collect();
        let middle = median(lengths.clone());
        let off = lengths.iter().map(|length| (length - middle).abs());
        Self {
            median: middle,
            spread: median(off.collect()) / middle,
        }
    }

    fn is_gravity(self) -> bool {
        let usual = [STANDARD_GRAVITY_M_S2, 1.0, 1e3];
        usual.iter().any(|&gravity| is_near(self.median, gravity))
    }
}

fn is_near(value: f64, other: f64) -> bool {
    (value / other - 1.0).abs() < NEAR
}

/// True if a column holds numbers that are not all the same.
fn is_measured(column: &Column) -> bool {
    let mut known = column.values.iter().filter(|value| value.is_finite());
    let first = known.next();
    column.bad_cell.is_none() && known.any(|value| Some(value) != first)
}

fn is_free(used: &[bool], first: usize, count: usize) -> bool {
    used[first..first + count].iter().all(|used| !used)
}

fn is_quaternion(columns: &[Column]) -> bool {
    let length = Length::of(columns);
    is_near(length.median, 1.0) && length.spread < UNIT_LENGTH
}

/// Returns the first column that grows evenly; a count of the rows only if there is no other.
fn stamps(columns: &[Column]) -> Option<usize> {
    let growing: Vec<usize> = (0..columns.len())
        .filter(|&place| columns[place].dates.is_none() && is_even(&columns[place].values))
        .collect();
    let mut stamps = growing.iter().copied();
    let found = stamps.find(|&place| !counts_rows(&columns[place].values));
    found.or(growing.first().copied())
}

/// Returns the three columns side by side whose length is steadiest, of those that have gravity's where there are any; of
/// several that are nearly as steady the first: a magnetometer stands behind the accelerometers.
fn force(columns: &[Column], used: &[bool]) -> Option<(usize, Length)> {
    let mut steady: Vec<(usize, Length)> = triples(columns, used)
        .filter(|(_, length)| length.spread < STEADY)
        .collect();
    if steady.iter().any(|(_, length)| length.is_gravity()) {
        steady.retain(|(_, length)| length.is_gravity());
    }
    let spreads = steady.iter().map(|(_, length)| length.spread);
    let least = spreads.fold(f64::INFINITY, f64::min);
    let near = |(_, length): &(usize, Length)| length.spread <= (3.0 * least).max(AS_STEADY);
    steady.into_iter().find(near)
}

/// Returns the three columns side by side whose length varies most.
fn gyros(columns: &[Column], used: &[bool]) -> Option<usize> {
    let widest = triples(columns, used).max_by(|a, b| a.1.spread.total_cmp(&b.1.spread));
    widest.map(|(first, _)| first)
}

/// Returns every three columns side by side that begin a run of free columns, or follow three of it.
fn triples<'a>(
    columns: &'a [Column],
    used: &'a [bool],
) -> impl Iterator<Item = (usize, Length)> + 'a {
    let begins = |first: usize| {
        let before = used[..first]
            .iter()
            .rev()
            .take_while(|used| !**used)
            .count();
        before.is_multiple_of(3)
    };
    (0..columns.len().saturating_sub(2))
        .filter(move |&first| is_free(used, first, 3) && begins(first))
        .map(|first| (first, Length::of(&columns[first..first + 3])))
}

/// True if values count the rows.
pub fn counts_rows(values: &[f64]) -> bool {
    steps(values).iter().all(|step| *step == 1.0)
}
