//! Maps columns of a foreign file to quantities: as stated by the caller, else by their names.
//!
//! A unit comes from the caller, the column's name, the line of units or the documentation of a known form of file, in this
//! order, and from nowhere else: an unstated unit of a gyro, force or reference is asked for.

use super::column_names::{self, Guess};
use super::known_forms::Form;
use super::map_options::{Given, parse, units_of_quantities};
use super::mapped::{Mapped, Plan};
use super::one_attitude;
use super::targets::Target;
use super::time_names;
use crate::error::InputError;
use crate::import::files::columns::{Block, Column};
use crate::recording::Quantity;
use crate::recording::units::{Dimension, Unit};

/// Largest number of column names listed in an error.
const MOST_LISTED: usize = 24;

/// Reason of a column left out by `--map`.
const BY_MAP: &str = "by --map";

/// Maps every column of `blocks`.
///
/// # Inputs
/// `maps` as `COLUMN=QUANTITY:AXIS:UNIT`, `units` as `QUANTITY:UNIT`; `times` are names of columns of stamps.
pub fn plan(
    blocks: &[Block],
    maps: &[String],
    units: &[String],
    times: &[String],
) -> Result<Plan, InputError> {
    let file = &blocks[0].file;
    let mut given = Vec::new();
    for text in maps {
        given.extend(parse(file, text)?);
    }
    let units = units_of_quantities(file, units)?;
    let mut plan = Plan::default();
    let mut named = Vec::new();
    for given in given {
        let place = locate(blocks, &given.column, "--map")?;
        if named.contains(&place) {
            return Err(InputError::new(file, "is mapped twice")
                .channel(&given.column)
                .expected("one --map for each column"));
        }
        named.push(place);
        take_given(blocks, place, given, &units, &mut plan)?;
    }
    for (b, block) in blocks.iter().enumerate() {
        let (guesses, unordered) = guesses(block);
        let empty = one_attitude::empty_orientation(block);
        // Calibrated columns go before raw ones, wherever they stand.
        let (raw, others): (Vec<usize>, Vec<usize>) =
            (0..block.columns.len()).partition(|c| column_names::is_raw(&block.columns[*c].name));
        for c in others.into_iter().chain(raw) {
            let column = &block.columns[c];
            if !named.contains(&(b, c)) && !times.contains(&column.name) {
                if empty.contains(&c) {
                    let reason = one_attitude::EMPTY.to_owned();
                    plan.left_out.push((column.name.clone(), reason));
                    continue;
                }
                let guess = guesses[c].clone();
                let is_known = guess.is_some() || time_names::time_in(block, column).is_some();
                match by_name(blocks, (b, c), guess, &units, &plan)? {
                    Ok(mapped) => plan.mapped.push(mapped),
                    Err(reason) => {
                        plan.left_out.push((column.name.clone(), reason));
                        if !is_known && may_tell(column) {
                            plan.telling.push((b, c));
                        }
                    }
                }
            }
        }
        if unordered.len() == 4 && plan.unordered.is_empty() {
            plan.unordered = unordered.into_iter().map(|c| (b, c)).collect();
        }
    }
    one_attitude::keep(blocks, &mut plan);
    check_gyros(blocks, &plan)?;
    Ok(plan)
}

/// True if a column of numbers, by its name, may be an attitude, an angle or a temperature.
fn may_tell(column: &Column) -> bool {
    let is_number = column.bad_cell.is_none() && column.values.iter().any(|value| !value.is_nan());
    is_number && column_names::reason(&column.name, column.unit.as_deref()).1
}

/// Returns the place of the column `name`, or `FILE:COLUMN`: block and index.
pub fn locate(blocks: &[Block], name: &str, option: &str) -> Result<(usize, usize), InputError> {
    let all = blocks.iter().enumerate().flat_map(|(b, block)| {
        let columns = block.columns.iter().enumerate();
        columns.map(move |(c, column)| ((b, c), column))
    });
    let is_it = |b: usize, column: &Column| {
        let file = blocks[b]
            .file
            .file_name()
            .unwrap_or_default()
            .to_string_lossy();
        let of_file = name
            .strip_prefix(&*file)
            .and_then(|rest| rest.strip_prefix(':'));
        column.name == name || of_file == Some(&column.name)
    };
    let mut found = all.filter(|((b, _), column)| is_it(*b, column));
    match (found.next(), found.next()) {
        (Some((place, _)), None) => Ok(place),
        (Some(((first, _), _)), Some(((second, _), _))) => {
            let of = |b: usize| {
                let file = blocks[b].file.file_name().unwrap_or_default();
                format!("{}:{name}", file.to_string_lossy())
            };
            let fault = InputError::new(&blocks[0].file, "has this column twice").channel(name);
            Err(match first == second {
                true => fault.expected("each column once"),
                false => fault.expected(format!("{} or {}", of(first), of(second))),
            })
        }
        _ => Err(InputError::new(&blocks[0].file, "has no such column")
            .channel(format!("{option} {name}"))
            .expected(format!("one of {}", list(blocks)))),
    }
}

/// Lists the columns' names for an error.
fn list(blocks: &[Block]) -> String {
    let names = blocks
        .iter()
        .flat_map(|block| &block.columns)
        .map(|column| column.name.as_str());
    let names: Vec<&str> = names.collect();
    match names.get(..MOST_LISTED) {
        Some(first) => format!(
            "{} and {} more",
            first.join(", "),
            names.len() - MOST_LISTED
        ),
        None => names.join(", "),
    }
}

/// Returns the unit of a column to be mapped to `target`, with its text; `None` if it is stated nowhere.
fn unit_of(
    block: &Block,
    column: &Column,
    target: &Target,
    written: Option<&String>,
    units: &[(String, String)],
    guess: Option<&Guess>,
) -> Result<Option<(Unit, String)>, InputError> {
    let of_quantity = units.iter().find(|(name, _)| name == target.name());
    let dimension = target.dimension();
    let parse = |text: &str| match dimension {
        Some(dimension) => Unit::parse_for(text, dimension),
        None => Unit::parse(text),
    };
    if let Some(text) = written.or(of_quantity.map(|(_, unit)| unit)) {
        let fault = || {
            InputError::new(&block.file, format!("is no unit of {}", target.name()))
                .channel(&column.name)
                .value(format!("{text:?}"))
                .expected(dimension.map_or("a unit", Dimension::examples))
        };
        return match parse(text) {
            Some(unit) => Ok(Some((unit, text.clone()))),
            None => Err(fault()),
        };
    }
    let in_name = guess.and_then(|guess| guess.unit.clone());
    let by_form = Form::unit_in(block, target.name()).map(|(unit, _)| unit.to_owned());
    let is_plain = matches!(dimension, None | Some(Dimension::Number));
    let plain = is_plain.then(|| "1".to_owned());
    let mut texts = [in_name, column.unit.clone(), by_form, plain]
        .into_iter()
        .flatten();
    Ok(texts.find_map(|text| Some((parse(&text)?, text))))
}

/// Returns the unit of SI of a target, which stands for one that is still open.
fn open(target: &Target) -> (Unit, String) {
    let dimension = target.dimension().unwrap_or(Dimension::Number);
    let unit = Unit {
        dimension,
        scale: 1.0,
        offset: 0.0,
    };
    (unit, "?".to_owned())
}

fn take_given(
    blocks: &[Block],
    (b, c): (usize, usize),
    given: Given,
    units: &[(String, String)],
    plan: &mut Plan,
) -> Result<(), InputError> {
    let (block, column) = (&blocks[b], &blocks[b].columns[c]);
    if given.target == Target::Nothing {
        plan.left_out.push((column.name.clone(), BY_MAP.to_owned()));
        return Ok(());
    }
    column.check(&block.file)?;
    let axis = given.axis.as_deref();
    let guess = column_names::guess_in(block, column);
    let unit = unit_of(
        block,
        column,
        &given.target,
        given.unit.as_ref(),
        units,
        guess.as_ref(),
    )?;
    let is_open = unit.is_none();
    let (unit, unit_text) = unit.unwrap_or_else(|| open(&given.target));
    if let Some(other) = plan.holder(&given.target, axis) {
        let other = &blocks[other.block].columns[other.column].name;
        return Err(
            InputError::new(&block.file, "is mapped to what another column is mapped to")
                .channel(&column.name)
                .value(format!(
                    "{} {} of {other}",
                    given.target.name(),
                    axis.unwrap_or("-")
                ))
                .expected("each quantity and axis once"),
        );
    }
    plan.mapped.push(Mapped {
        block: b,
        column: c,
        target: given.target,
        axis: given.axis,
        unit,
        unit_text,
        is_given: true,
        is_open,
    });
    Ok(())
}

/// Maps a column by its name, or returns the reason to leave it out.
fn by_name(
    blocks: &[Block],
    (b, c): (usize, usize),
    guess: Option<Guess>,
    units: &[(String, String)],
    plan: &Plan,
) -> Result<Result<Mapped, String>, InputError> {
    let (block, column) = (&blocks[b], &blocks[b].columns[c]);
    let leave = |reason: &str| Ok(Err(reason.to_owned()));
    let Some(guess) = guess else {
        return leave(column_names::reason(&column.name, column.unit.as_deref()).0);
    };
    let axis = guess.axis.as_deref();
    let name = guess.target.name();
    if axis.is_some() && !guess.target.takes_axis(axis) {
        return leave(&format!("a {name} has no such axis"));
    }
    if matches!(column.bad_cell, Some((0, _))) {
        return leave("it is text");
    }
    if column.values.iter().all(|value| value.is_nan()) {
        return leave("it holds no value");
    }
    let is_other_attitude = |mapped: &&Mapped| {
        mapped.is_given && mapped.target.is_attitude() && guess.target.is_attitude()
    };
    let holder = plan.holder(&guess.target, axis);
    if let Some(other) = holder.or(plan.mapped.iter().find(is_other_attitude)) {
        let other = &blocks[other.block].columns[other.column].name;
        return leave(&format!("{name} {} is {other}", axis.unwrap_or("-")));
    }
    let found = unit_of(block, column, &guess.target, None, units, Some(&guess))?;
    if found.is_none() && guess.target == Target::Stored(Quantity::MagneticField) {
        return leave(&format!(
            "its unit stands nowhere; --unit {name}:UNIT states it"
        ));
    }
    let is_open = found.is_none();
    let (unit, unit_text) = found.unwrap_or_else(|| open(&guess.target));
    column.check(&block.file)?;
    Ok(Ok(Mapped {
        block: b,
        column: c,
        target: guess.target,
        axis: guess.axis,
        unit,
        unit_text,
        is_given: false,
        is_open,
    }))
}

/// Guesses the quantities of a block's columns from their names, with digits turned into axes: 0 1 2 or 1 2 3 are x y z, 0
/// to 3 of a quaternion w x y z. Also the places of counted quaternions, whose scalar is the first or the last.
fn guesses(block: &Block) -> (Vec<Option<Guess>>, Vec<usize>) {
    let mut guesses: Vec<Option<Guess>> = block
        .columns
        .iter()
        .map(|column| column_names::guess_in(block, column))
        .collect();
    let mut unordered = Vec::new();
    for (place, axis) in quaternions(block) {
        let is_other = guesses[place].as_ref().is_some_and(|guess| {
            let rotation = Target::Stored(Quantity::GyroRate);
            ![Target::Euler, rotation].contains(&guess.target)
        });
        if !is_other {
            guesses[place] = Some(Guess {
                target: Target::Stored(Quantity::ReferenceAttitude),
                axis: Some(axis.to_owned()),
                unit: None,
            });
        }
    }
    let digit = |guess: &Guess| {
        guess
            .axis
            .as_deref()
            .and_then(|axis| axis.parse::<usize>().ok())
    };
    let seen: Vec<(Target, usize)> = guesses
        .iter()
        .flatten()
        .filter_map(|guess| Some((guess.target.clone(), digit(guess)?)))
        .collect();
    for (column, place) in guesses.iter_mut().enumerate() {
        if place
            .as_ref()
            .is_some_and(|guess| guess.target == Target::Matrix)
        {
            continue;
        }
        let Some((guess, index)) = place
            .as_ref()
            .and_then(|guess| Some((guess.clone(), digit(guess)?)))
        else {
            continue;
        };
        let is_quaternion = guess.target == Target::Stored(Quantity::ReferenceAttitude);
        let from_zero = seen.contains(&(guess.target.clone(), 0));
        if is_quaternion {
            unordered.push(column);
        }
        // In q1 to q4 some take the first as the scalar and some the last: the gyros decide, or --map.
        let labels: &[&str] = match (is_quaternion, from_zero) {
            (true, true) => &["w", "x", "y", "z"],
            (false, true) => &["x", "y", "z"],
            (false, false) => &["", "x", "y", "z"],
            (true, false) => &[],
        };
        let label = labels.get(index).filter(|label| !label.is_empty());
        *place = label.map(|label| Guess {
            axis: Some((*label).to_owned()),
            ..guess
        });
    }
    (guesses, unordered)
}

/// Returns the places and axes of four columns that have one name with w, x, y, z behind it, and the length 1 in most rows:
/// `rotation.x` to `rotation.w` of a transform is a quaternion, three of that name are rates.
fn quaternions(block: &Block) -> Vec<(usize, &'static str)> {
    let split = |column: &Column| {
        let (mut stem, _) = column_names::bracketed(&column.name);
        let axis = stem.pop()?.to_ascii_lowercase();
        let axis = ["w", "x", "y", "z"]
            .into_iter()
            .find(|one| one.starts_with(axis))?;
        let is_parted = !stem.ends_with(char::is_alphanumeric);
        is_parted.then_some((stem, axis))
    };
    let columns = block.columns.iter().enumerate();
    let split = columns.filter_map(|(place, column)| Some((place, split(column)?)));
    let split: Vec<(usize, (String, &'static str))> = split.collect();
    let mut found = Vec::new();
    for (_, (stem, _)) in split.iter().filter(|(_, (_, axis))| *axis == "w") {
        let own = split.iter().filter(|(_, (other, _))| other == stem);
        let own: Vec<(usize, &'static str)> =
            own.map(|(place, (_, axis))| (*place, *axis)).collect();
        let length = |row: usize| -> f64 {
            let squares = own
                .iter()
                .map(|(place, _)| block.columns[*place].values[row].powi(2));
            squares.sum()
        };
        let rows = (0..block.rows).step_by((block.rows / LOOKED_AT).max(1));
        let count = rows.clone().count();
        let unit = rows.filter(|row| (length(*row) - 1.0).abs() < UNIT_LENGTH);
        if own.len() == 4 && 2 * unit.count() > count {
            found.extend(own);
        }
    }
    found
}

/// Number of rows that show a quaternion.
const LOOKED_AT: usize = 1000;

/// Largest deviation of a quaternion's squared length from 1.
const UNIT_LENGTH: f64 = 0.02;

impl Plan {
    /// Returns the column already mapped to this quantity about this axis.
    fn holder(&self, target: &Target, axis: Option<&str>) -> Option<&Mapped> {
        let mut mapped = self.mapped.iter();
        mapped.find(|mapped| mapped.target == *target && mapped.axis.as_deref() == axis)
    }
}

/// True if a file holds three accelerometers, neither gyros nor a reference, and no column that might be one of those: still
/// positions identify them by gravity alone.
fn are_accelerometers_alone(plan: &Plan) -> bool {
    let forces = Quantity::FORCES.map(Target::Stored);
    let of_axis = |axis: &str| {
        plan.mapped.iter().any(|mapped| {
            let is_force = forces.contains(&mapped.target);
            is_force && mapped.axis.as_deref() == Some(axis)
        })
    };
    let tells_motion = |mapped: &Mapped| {
        let target = &mapped.target;
        let increments = Target::Stored(Quantity::ReferenceIncrement);
        let is_reference = matches!(target, Target::ReferenceRate | Target::ReferenceAngle);
        target.is_gyro() || target.is_attitude() || is_reference || *target == increments
    };
    let mut left_out = plan.left_out.iter();
    ["x", "y", "z"].into_iter().all(of_axis)
        && !plan.mapped.iter().any(tells_motion)
        && left_out.all(|(name, reason)| reason == BY_MAP || time_names::time_unit(name).is_some())
}

/// Refuses a file without gyros about x, y and z, unless it holds accelerometers alone.
fn check_gyros(blocks: &[Block], plan: &Plan) -> Result<(), InputError> {
    let has = |axis: &str| {
        let mut gyros = plan.mapped.iter().filter(|mapped| mapped.target.is_gyro());
        gyros.any(|mapped| mapped.axis.as_deref() == Some(axis))
    };
    let missing: Vec<&str> = ["x", "y", "z"]
        .into_iter()
        .filter(|axis| !has(axis))
        .collect();
    if missing.is_empty() || are_accelerometers_alone(plan) {
        return Ok(());
    }
    Err(
        InputError::new(&blocks[0].file, "has no column that is known as a gyro's")
            .channel(format!("gyro {}", missing.join(", ")))
            .expected(format!(
                "--map COLUMN=gyro_rate:AXIS:UNIT with a column of {}",
                list(blocks)
            )),
    )
}
