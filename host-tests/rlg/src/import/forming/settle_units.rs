//! Sets the units of columns that no name and no publisher states: by a reference, by gravity, by the range of values; or
//! asks for them.

use super::assemble::Assembled;
use super::evidence::{self, Ratio};
use super::settle::Settled;
use crate::import::files::columns::Block;
use crate::import::mapping::mapped::Plan;
use crate::import::mapping::questions::Question;
use crate::import::mapping::targets::Target;
use crate::recording::Quantity;
use crate::recording::units::{STANDARD_GRAVITY_M_S2, Unit};

/// Largest relative difference of a ratio from a unit that decides it.
const DECIDES: f64 = 0.05;

/// Largest angle in radians \[rad\]: beyond it a column of angles is in degrees.
const ROUND_RAD: f64 = 6.4;

/// Greatest rate of an inertial unit \[rad/s\].
const FASTEST_RAD_S: f64 = 35.0;

/// Temperatures of units in K that are none in °C \[K\].
const KELVIN: std::ops::Range<f64> = 200.0..400.0;

/// Temperature below which a unit at work does not stay \[°C\].
const COLDEST_C: f64 = 15.0;

/// Units of rates.
const RATES: [&str; 5] = ["rad/s", "deg/s", "mrad/s", "mdeg/s", "deg/h"];

/// A set of targets.
type Of<'a> = &'a dyn Fn(&Target) -> bool;

impl Settled {
    /// Sets the units of angles and temperatures by their range.
    pub(super) fn by_range(&mut self, blocks: &mut [Block], open: &mut Plan) {
        let is_angle = |target: &Target| matches!(target, Target::Euler | Target::ReferenceAngle);
        let greatest = |blocks: &[Block], open: &Plan, of: Of| {
            let columns = open
                .mapped
                .iter()
                .filter(|mapped| mapped.is_open && of(&mapped.target));
            let values =
                columns.flat_map(|mapped| &blocks[mapped.block].columns[mapped.column].values);
            values.fold(f64::NAN, |greatest: f64, value| greatest.max(value.abs()))
        };
        let angle = greatest(blocks, open, &is_angle);
        if angle > ROUND_RAD {
            let why = format!("the greatest is {angle:.1}, beyond a turn in rad");
            self.set(blocks, open, &is_angle, "deg", &why);
        }
        let is_temperature = |target: &Target| *target == Target::Stored(Quantity::Temperature);
        let warmest = greatest(blocks, open, &is_temperature);
        if KELVIN.contains(&warmest) {
            let why = format!("{warmest:.1} as the greatest is one of a unit in K alone");
            self.set(blocks, open, &is_temperature, "K", &why);
        } else if warmest.is_finite() && (warmest - 32.0) / 1.8 < COLDEST_C {
            let why = format!(
                "the greatest is {warmest:.1}, in F {:.0} C and colder than a unit at work",
                (warmest - 32.0) / 1.8
            );
            self.set(blocks, open, &is_temperature, "C", &why);
        } else if warmest.is_finite() {
            let evidence = format!(
                "the greatest is {warmest:.1}; in F it would be {:.0} C",
                (warmest - 32.0) / 1.8
            );
            self.ask_unit(blocks, open, &is_temperature, "C", evidence, true);
        }
    }

    /// Sets the unit of forces by the length of gravity.
    pub(super) fn forces(&mut self, blocks: &mut [Block], plan: &mut Plan, assembled: &Assembled) {
        let is_force = |target: &Target| *target == Target::Stored(Quantity::SpecificForce);
        if !plan
            .mapped
            .iter()
            .any(|mapped| mapped.is_open && is_force(&mapped.target))
        {
            return;
        }
        let length = evidence::force_length(&assembled.tables).unwrap_or(f64::NAN);
        let counts = (8..=14).map(|power| f64::from(1 << power));
        let mut units = vec![
            (STANDARD_GRAVITY_M_S2, "m/s^2".to_owned()),
            (1.0, "g".to_owned()),
            (1e3, "mg".to_owned()),
        ];
        units.extend(counts.map(|count| (count, format!("{}*g", 1.0 / count))));
        let away = |unit: &(f64, String)| (length / unit.0).ln().abs();
        units.sort_by(|a, b| away(a).total_cmp(&away(b)));
        let (gravity, unit) = units[0].clone();
        let why = format!("the median length is {length:.4}, gravity in it {gravity}");
        match (length / gravity - 1.0).abs() < DECIDES {
            true => self.set(blocks, plan, &is_force, &unit, &why),
            false => {
                let unit = if length.is_finite() { &unit } else { "m/s^2" };
                self.ask_unit(blocks, plan, &is_force, unit, why, true);
            }
        }
        let is_sum = |target: &Target| *target == Target::Stored(Quantity::VelocityIncrement);
        self.ask_unit(
            blocks,
            plan,
            &is_sum,
            "m/s",
            "nothing decides".to_owned(),
            true,
        );
    }

    /// Sets the unit of gyros by a ratio that is known.
    pub(super) fn gyros(&mut self, blocks: &mut [Block], plan: &mut Plan, told: Option<Ratio>) {
        let is_rate = |target: &Target| *target == Target::Stored(Quantity::GyroRate);
        let is_sum = |target: &Target| *target == Target::Stored(Quantity::GyroIncrement);
        let is_count = |target: &Target| *target == Target::Stored(Quantity::GyroCount);
        for (of, units) in [
            (&is_rate as Of, &RATES[..]),
            (&is_sum, &["rad", "deg", "mrad", "urad", "arcsec"][..]),
        ] {
            match told.and_then(|told| Some((nearest(told.ratio, units)?, told))) {
                Some((unit, told)) => {
                    let scale = Unit::parse(unit).map_or(1.0, |unit| unit.scale);
                    let why = format!(
                        "its size and that of {} agree to {:.1} %",
                        told.by,
                        100.0 * (told.ratio / scale - 1.0).abs()
                    );
                    self.set(blocks, plan, of, unit, &why);
                }
                None => {
                    let (unit, evidence) = guess_of_range(blocks, plan, of, told);
                    let unit = if units == RATES { unit } else { "rad" };
                    self.ask_unit(blocks, plan, of, unit, evidence, true);
                }
            }
        }
        let weight = "the angle of a pulse stands in the unit's data sheet".to_owned();
        self.ask_unit(blocks, plan, &is_count, "WEIGHT*arcsec", weight, false);
    }

    /// Sets the unit of references by a ratio that is known.
    pub(super) fn references(
        &mut self,
        blocks: &mut [Block],
        plan: &mut Plan,
        of: Of,
        told: Option<Ratio>,
    ) {
        let is_rate = |target: &Target| *target == Target::ReferenceRate;
        let is_angle = |target: &Target| of(target) && !is_rate(target);
        for (of, units) in [
            (&is_rate as Of, &RATES[..]),
            (&is_angle, &["rad", "deg", "mrad", "arcsec"][..]),
        ] {
            match told.and_then(|told| nearest(1.0 / told.ratio, units)) {
                Some(unit) => self.set(blocks, plan, of, unit, "its turns are those of the gyros"),
                None => {
                    let unit = if units == RATES { "deg/s" } else { "rad" };
                    let evidence = "neither the gyros nor its range decide".to_owned();
                    self.ask_unit(blocks, plan, of, unit, evidence, true);
                }
            }
        }
    }

    /// Sets the unit of open columns, with a note.
    fn set(&mut self, blocks: &mut [Block], plan: &mut Plan, of: Of, unit: &str, why: &str) {
        if let Some((names, quantity)) = put(blocks, plan, of, unit) {
            let note = format!("{names} ({quantity}): taken in {unit}: {why}");
            self.notes.push(note);
        }
    }

    /// Asks for the unit of open columns, which get the guess.
    fn ask_unit(
        &mut self,
        blocks: &mut [Block],
        plan: &mut Plan,
        of: Of,
        unit: &str,
        evidence: String,
        is_guess: bool,
    ) {
        if let Some((names, quantity)) = put(blocks, plan, of, unit) {
            self.questions.push(Question {
                asks: format!("{names}: is taken for {quantity}, but its unit stands nowhere"),
                answer: ("--unit", vec![format!("{quantity}:{unit}")]),
                is_guess,
                evidence,
            });
        }
    }
}

/// Writes a unit to the open columns of a target; returns their names and the quantity.
fn put(blocks: &mut [Block], plan: &mut Plan, of: Of, text: &str) -> Option<(String, String)> {
    let (mut names, mut quantity) = (Vec::new(), None);
    for mapped in plan
        .mapped
        .iter_mut()
        .filter(|mapped| mapped.is_open && of(&mapped.target))
    {
        let column = &mut blocks[mapped.block].columns[mapped.column];
        column.unit = Some(text.to_owned());
        names.push(column.name.clone());
        quantity = Some(mapped.target.name().to_owned());
        mapped.is_open = false;
        mapped.unit = Unit::parse(text).unwrap_or(mapped.unit);
    }
    quantity.map(|quantity| (names.join(", "), quantity))
}

/// Returns the unit of rates whose scale is near a ratio.
pub(super) fn nearest_rate(ratio: f64) -> Option<&'static str> {
    nearest(ratio, &RATES)
}

/// Returns the unit whose scale is near a ratio.
fn nearest(ratio: f64, units: &[&'static str]) -> Option<&'static str> {
    let scale = |unit: &str| Unit::parse(unit).map_or(f64::NAN, |unit| unit.scale);
    let mut units = units.iter().copied();
    units.find(|unit| (ratio / scale(unit) - 1.0).abs() < DECIDES)
}

/// Guesses the unit of rates by their range; also returns the reason.
fn guess_of_range(
    blocks: &[Block],
    plan: &Plan,
    of: Of,
    told: Option<Ratio>,
) -> (&'static str, String) {
    let columns = plan
        .mapped
        .iter()
        .filter(|mapped| mapped.is_open && of(&mapped.target));
    let values = columns.flat_map(|mapped| &blocks[mapped.block].columns[mapped.column].values);
    let greatest = values.fold(0.0_f64, |greatest, value| greatest.max(value.abs()));
    let scale = |unit: &str| Unit::parse(unit).map_or(1.0, |unit| unit.scale);
    let mut units = ["rad/s", "deg/s"].into_iter();
    let fits = units.find(|unit| greatest * scale(unit) < FASTEST_RAD_S);
    let unit = fits.unwrap_or("mdeg/s");
    let mut evidence = match unit {
        "rad/s" => format!(
            "the greatest is {greatest:.3}; in rad/s it is {:.1} deg/s",
            greatest.to_degrees()
        ),
        _ => format!("the greatest is {greatest:.1}, in a larger unit beyond any gyro's"),
    };
    if let Some(told) = told {
        evidence += &format!(
            "; {} is {:.4} times its size, no unit's",
            told.by, told.ratio
        );
    }
    (unit, evidence)
}
