//! Settles what names leave open: by a reference, by gravity and by the range of values; and asks the rest.
//!
//! Columns whose unit is open are assembled in SI, compared with what is known, and get their unit by the ratio of the two.
//! A unit that the data decide is taken with a note; another becomes a question with the best guess.

use super::assemble::{Assembled, Values, assemble};
use super::clocks::{Said, stamps_in};
use super::evidence::{self, Ratio};
use super::{repeats, settle_times};
use crate::error::InputError;
use crate::import::files::columns::Block;
use crate::import::mapping::column_map::plan;
use crate::import::mapping::mapped::{Mapped, Plan};
use crate::import::mapping::own_rows;
use crate::import::mapping::questions::Question;
use crate::import::mapping::targets::Target;
use crate::import::mapping::time_names;
use crate::recording::Quantity;

/// Smallest correlation of gyros and what they are compared with.
pub(super) const ALIKE: f64 = 0.95;

/// Largest relative distance of a rate from a whole number for which that is the guess.
const NEAR_WHOLE: f64 = 1e-3;

/// Rate of rows of a unit whose rate is unknown, for comparisons \[Hz\].
const STAND_IN_HZ: f64 = 100.0;

/// Statements of the caller, completed by those that the data decide.
#[derive(Debug, Clone)]
pub struct Settled {
    /// `--map`.
    pub maps: Vec<String>,
    /// `--unit`.
    pub units: Vec<String>,
    /// Names of columns of stamps.
    pub times: Vec<String>,
    /// Clocks and attitudes.
    pub said: Said,
    /// Decisions, as notes.
    pub notes: Vec<String>,
    /// Open questions.
    pub questions: Vec<Question>,
}

impl Settled {
    /// Settles what is open; sets the units of columns in `blocks`, also those that are only guessed.
    pub fn settle(&mut self, blocks: &mut Vec<Block>) -> Result<Plan, InputError> {
        let quaternion = self.guess_unnamed(blocks);
        self.guess_by_units(blocks);
        let mut first = self.plan(blocks)?;
        self.guess_time(blocks, &first);
        first.unordered.extend(quaternion);
        let (notes, questions) = settle_times::settle(blocks, &first, &self.said)?;
        self.notes.extend(notes);
        self.questions.extend(questions);
        self.notes
            .extend(repeats::drop_all(blocks, &first, &self.said));
        let lacks_rate = self.lacks_rate(blocks, &first);
        self.order_quaternion(blocks, &first, lacks_rate)?;
        self.ask_followed(blocks, &first, lacks_rate)?;
        let mut open = self.plan(blocks)?;
        self.by_range(blocks, &mut open);
        let is_bare = |mapped: &Mapped| mapped.axis.is_none() && mapped.target.is_about_one_axis();
        let has_open = open
            .mapped
            .iter()
            .any(|mapped| mapped.is_open || is_bare(mapped));
        if has_open || lacks_rate {
            let assembled = self.provisional(blocks, &open, lacks_rate)?;
            self.compare(blocks, &open, &assembled, lacks_rate);
        }
        self.ask_telling(blocks, &open);
        let settled = self.plan(blocks)?;
        self.order_euler(blocks, &settled)?;
        self.check_form(blocks, settled)
    }

    pub(super) fn plan(&self, blocks: &[Block]) -> Result<Plan, InputError> {
        plan(blocks, &self.maps, &self.units, &self.times)
    }

    /// True if a block has neither stamps nor a rate.
    pub(super) fn lacks_rate(&self, blocks: &[Block], plan: &Plan) -> bool {
        let lacks = |mapped: &Mapped| {
            let is_text = blocks[mapped.block].columns.iter().any(|column| {
                column.bad_cell.is_some() && time_names::time_unit(&column.name).is_some()
            });
            blocks[mapped.block].rate_hz.is_none()
                && !is_text
                && stamps_in(blocks, mapped, &self.said).is_none()
        };
        self.said.rate_hz.is_none() && plan.mapped.iter().any(lacks)
    }

    /// Assembles with open units as those of SI.
    pub(super) fn provisional(
        &self,
        blocks: &mut Vec<Block>,
        open: &Plan,
        lacks_rate: bool,
    ) -> Result<Assembled, InputError> {
        let count = blocks.len();
        let mut open = open.clone();
        for mapped in &mut open.mapped {
            if mapped.axis.is_none() && mapped.target.is_about_one_axis() {
                mapped.axis = Some("z".to_owned());
            }
        }
        let mut said = self.said.clone();
        said.rate_hz = said.rate_hz.or(lacks_rate.then_some(STAND_IN_HZ));
        own_rows::separate(blocks, &mut open, said.rate_hz);
        let assembled = assemble(blocks, &open, &said, Values::Kept);
        blocks.truncate(count);
        assembled
    }

    /// Compares gyros, forces and references, and sets the units, the rate and the axis that follow.
    fn compare(
        &mut self,
        blocks: &mut [Block],
        open: &Plan,
        assembled: &Assembled,
        lacks_rate: bool,
    ) {
        let is_open = |of: &dyn Fn(&Target) -> bool| {
            let mut mapped = open.mapped.iter();
            mapped.any(|mapped| mapped.is_open && of(&mapped.target))
        };
        let mut plan = open.clone();
        self.forces(blocks, &mut plan, assembled);
        self.table_axis(blocks, &mut plan, assembled);
        let reference = evidence::of_reference(&assembled.tables).filter(|_| !lacks_rate);
        let by_reference = reference.filter(|one| one.agreement > ALIKE);
        if is_open(&Target::is_gyro) {
            let known = by_reference.filter(|_| !is_open(&Target::is_reference));
            let gravity = evidence::of_gravity(&assembled.tables);
            let by_gravity = gravity.filter(|one| one.agreement > ALIKE && !lacks_rate);
            self.gyros(blocks, &mut plan, known.or(by_gravity));
        }
        if is_open(&Target::is_reference) {
            let gyros_known = !is_open(&Target::is_gyro);
            let ratio = by_reference.filter(|_| gyros_known);
            self.references(blocks, &mut plan, &Target::is_reference, ratio);
        }
        if lacks_rate {
            let told = evidence::of_reference(&assembled.tables);
            self.rate(told.filter(|one| one.agreement > ALIKE && !is_open(&Target::is_gyro)));
        }
    }

    /// Sets the axis of a table's only angle.
    fn table_axis(&mut self, blocks: &mut [Block], plan: &mut Plan, assembled: &Assembled) {
        let bare = plan
            .mapped
            .iter()
            .find(|mapped| mapped.axis.is_none() && mapped.target.is_about_one_axis());
        let Some(bare) = bare else { return };
        let name = &blocks[bare.block].columns[bare.column].name;
        let map = |axis: &str| format!("{name}={}:{axis}", bare.target.name());
        match evidence::axis_of_reference(&assembled.tables) {
            Some((axis, found)) if found.abs() > ALIKE => {
                let sign = if found < 0.0 {
                    ", which reads it with the other sign"
                } else {
                    ""
                };
                self.notes.push(format!(
                    "{name} is taken about {axis}: it follows gyro {axis} (correlation {found:.3}){sign}"
                ));
                self.maps.push(map(axis));
            }
            found => {
                let axis = found.map_or("z", |(axis, _)| axis);
                let evidence =
                    found.map_or("no column turns like it".to_owned(), |(axis, found)| {
                        format!("nearest is gyro {axis}, with a correlation of {found:.2}")
                    });
                self.questions.push(Question {
                    asks: format!("{name}: is an angle about an axis that stands nowhere"),
                    answer: ("--map", vec![map(axis)]),
                    is_guess: true,
                    evidence,
                });
                self.maps.push(map(axis));
            }
        }
    }

    fn rate(&mut self, told: Option<Ratio>) {
        let (answer, evidence) = match told {
            Some(told) => (
                whole_if_near(STAND_IN_HZ / told.ratio),
                format!(
                    "then the gyros turn as far as {} (correlation {:.3})",
                    told.by, told.agreement
                ),
            ),
            None => (
                "HZ".to_owned(),
                "no column shows the rows a second".to_owned(),
            ),
        };
        self.said.rate_hz = answer.parse().ok();
        self.questions.push(Question {
            asks: "the file does not say when its rows were taken".to_owned(),
            is_guess: told.is_some(),
            answer: ("--rate", vec![answer]),
            evidence,
        });
    }

    /// Asks for columns that may be an attitude, an angle or a temperature, unless there is one of these.
    fn ask_telling(&mut self, blocks: &[Block], open: &Plan) {
        let has =
            |of: &dyn Fn(&Target) -> bool| open.mapped.iter().any(|mapped| of(&mapped.target));
        let is_temperature = |target: &Target| *target == Target::Stored(Quantity::Temperature);
        let warm = has(&is_temperature);
        let turned = has(&Target::is_reference);
        let telling = open
            .telling
            .iter()
            .map(|(b, c)| &blocks[*b].columns[*c].name);
        let names = telling.filter(|name| match name.to_lowercase().contains("temp") {
            true => !warm,
            false => !turned,
        });
        let names: Vec<String> = names.map(|name| format!("{name}=none")).collect();
        if names.is_empty() {
            return;
        }
        let each: Vec<&str> = names
            .iter()
            .map(|name| name.trim_end_matches("=none"))
            .collect();
        self.questions.push(Question {
            asks: format!("{}: may be an angle, an attitude or a temperature", each.join(", ")),
            evidence: format!(
                "{} that open; left out, unless mapped to reference_euler, reference_angle, reference_attitude or temperature",
                if names.len() == 1 { "its name leaves" } else { "their names leave" }
            ),
            answer: ("--map", names),
            is_guess: true,
        });
    }
}

/// Writes a rate, a whole one if it is near.
fn whole_if_near(rate_hz: f64) -> String {
    match (rate_hz / rate_hz.round() - 1.0).abs() < NEAR_WHOLE {
        true => format!("{}", rate_hz.round()),
        false => format!("{rate_hz:.4}"),
    }
}
