//! Guesses of columns whose names are not known, and a check of the unit that a publisher documents.

use super::clocks::TimeOption;
use super::evidence;
use super::settle::{ALIKE, Settled};
use super::{settle_times, settle_units, unnamed};
use crate::error::InputError;
use crate::import::files::columns::{Block, Column};
use crate::import::mapping::column_names;
use crate::import::mapping::known_forms::Form;
use crate::import::mapping::mapped::Plan;
use crate::import::mapping::questions::Question;
use crate::import::mapping::targets::Target;
use crate::import::mapping::time_names;
use crate::recording::units::{Dimension, Unit};
use crate::recording::{AXES, Quantity};

/// Median lengths of a force that holds gravity \[m/s²\].
const GRAVITY_M_S2: std::ops::Range<f64> = 8.0..12.0;

impl Settled {
    /// Guesses the columns of a file without names; returns the places of a quaternion, whose order is open.
    pub(super) fn guess_unnamed(&mut self, blocks: &[Block]) -> Vec<(usize, usize)> {
        let guessed = unnamed::guess(blocks, !self.times.is_empty());
        let Some(guessed) = guessed.filter(|_| self.maps.is_empty()) else {
            return Vec::new();
        };
        self.maps.extend(guessed.maps);
        for option in guessed.time.iter().map(|text| TimeOption::parse(text)) {
            self.times.push(option.column.clone());
            self.said.times.push(option);
        }
        self.questions.extend(guessed.questions);
        let places = guessed
            .quaternion
            .iter()
            .flat_map(|&first| first..first + 4);
        places.map(|column| (0, column)).collect()
    }

    /// Guesses gyros and accelerometers whose names are not known: three columns in a unit of rate or of force.
    pub(super) fn guess_by_units(&mut self, blocks: &[Block]) {
        if self.plan(blocks).is_err() {
            self.guess_in(blocks, Dimension::AngularRate, "gyro_rate");
        }
        let Ok(plan) = self.plan(blocks) else { return };
        let forces = Quantity::FORCES.map(Target::Stored);
        let mut mapped = plan.mapped.iter();
        if !mapped.any(|one| forces.contains(&one.target)) {
            self.guess_in(blocks, Dimension::Force, "specific_force");
        }
    }

    /// Guesses the only three columns in a unit of a dimension.
    fn guess_in<'a>(&mut self, blocks: &'a [Block], dimension: Dimension, quantity: &str) {
        let is_in_it = |column: &&Column| {
            let unit = column_names::own_unit(column);
            column.bad_cell.is_none()
                && unit.is_some_and(|unit| unit.dimension == dimension)
                && !column_names::is_of_another(&column.name)
        };
        let in_block = |block: &'a Block| -> Vec<&'a Column> {
            block.columns.iter().filter(is_in_it).collect()
        };
        let mut found = blocks.iter().map(in_block);
        let Some(columns) = found.find(|columns| columns.len() == 3) else {
            return;
        };
        // Of an acceleration without gravity the length is another.
        let has_gravity =
            || unnamed::length_m_s2(&columns).is_some_and(|length| GRAVITY_M_S2.contains(&length));
        if dimension == Dimension::Force && !has_gravity() {
            return;
        }
        let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
        let own: Vec<&str> = names
            .iter()
            .filter_map(|name| column_names::own_axis(name))
            .collect();
        let is_whole = AXES.iter().all(|axis| own.contains(axis));
        let axes = if is_whole { own } else { AXES.to_vec() };
        let pairs = names.iter().zip(axes);
        let maps: Vec<String> = pairs
            .map(|(name, axis)| format!("{name}={quantity}:{axis}"))
            .collect();
        self.maps.extend(maps.clone());
        self.questions.push(Question {
            asks: format!("{}: have names that are not known", names.join(", ")),
            answer: ("--map", maps),
            is_guess: true,
            evidence: format!("the only three columns in a unit of {quantity}"),
        });
    }

    /// Guesses the stamps of gyros without any: a column that grows evenly, and does not count the rows.
    pub(super) fn guess_time(&mut self, blocks: &[Block], first: &Plan) {
        let Some(gyro) = first.mapped.iter().find(|one| one.target.is_gyro()) else {
            return;
        };
        if !self.lacks_rate(blocks, first) {
            return;
        }
        let mapped: Vec<usize> = first
            .mapped
            .iter()
            .filter(|one| one.block == gyro.block)
            .map(|one| one.column)
            .collect();
        let columns = blocks[gyro.block].columns.iter().enumerate();
        let mut growing = columns.filter(|(place, column)| {
            !mapped.contains(place)
                && time_names::is_even(&column.values)
                && !unnamed::counts_rows(&column.values)
                && !column_names::is_of_another(&column.name)
        });
        let Some((_, column)) = growing.next() else {
            return;
        };
        let (unit, evidence) = settle_times::unit_of(&column.values);
        let option = format!("{}:{unit}", column.name);
        self.times.push(column.name.clone());
        self.said.times.push(TimeOption::parse(&option));
        self.questions.push(Question {
            asks: format!("{}: grows evenly, as stamps do", column.name),
            answer: ("--time", vec![option]),
            is_guess: true,
            evidence,
        });
    }

    /// Replaces the publisher's unit of the gyros by one that a reference or gravity decides against it.
    pub(super) fn check_form(
        &mut self,
        blocks: &mut Vec<Block>,
        plan: Plan,
    ) -> Result<Plan, InputError> {
        let mut gyros = plan.mapped.iter();
        let Some(gyro) = gyros.find(|one| one.target == Target::Stored(Quantity::GyroRate)) else {
            return Ok(plan);
        };
        let (block, column) = (
            &blocks[gyro.block],
            &blocks[gyro.block].columns[gyro.column],
        );
        let by_form = Form::unit_in(block, "gyro_rate");
        let by_name = column_names::guess_in(block, column).and_then(|guess| guess.unit);
        let is_said = by_name.is_some()
            || column.unit.is_some()
            || self.units.iter().any(|unit| unit.starts_with("gyro_rate:"))
            || gyro.is_given;
        let (Some((unit, publisher)), false) = (by_form, is_said) else {
            return Ok(plan);
        };
        if self.lacks_rate(blocks, &plan) {
            return Ok(plan);
        }
        let assembled = self.provisional(blocks, &plan, false)?;
        let measured = evidence::of_reference(&assembled.tables)
            .filter(|one| one.agreement > ALIKE)
            .or_else(|| evidence::of_gravity(&assembled.tables))
            .filter(|one| one.agreement > ALIKE);
        let other = measured.and_then(|ratio| {
            let scale = Unit::parse(unit).map_or(1.0, |unit| unit.scale);
            Some((settle_units::nearest_rate(ratio.ratio * scale)?, ratio))
        });
        match other {
            Some((other, ratio)) if other != unit => {
                self.notes.push(format!(
                    "the gyros are taken in {other}, and not in {unit} as {publisher} has them: their size is then that of {}",
                    ratio.by
                ));
                self.units.push(format!("gyro_rate:{other}"));
                self.plan(blocks)
            }
            _ => Ok(plan),
        }
    }
}
