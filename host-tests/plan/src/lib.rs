//! Thresholds of a diagnosis: one tree of numbers, each with unit, permitted range and reason, fixed before the data are seen.
//!
//! A package takes the section that it needs; [`Plan`] has them all. `rlg plan` prints the tree as a file that
//! `rlg diagnose --plan FILE` reads ([`file`]), `docs/plan.md` is its table, and `rlg challenge --marks --vary NAME`
//! evaluates other values of one number.

mod attitude;
mod file;
mod force;
mod inference;
mod judgement;
mod long;
mod number;
mod rates;
mod rest;
mod section;
mod several;
mod signal;

pub use attitude::*;
pub use file::Refused;
pub use force::*;
pub use inference::*;
pub use judgement::*;
pub use long::*;
pub use number::{Entry, Number};
pub use rates::*;
pub use rest::*;
pub use section::{Facts, Field};
pub use several::*;
pub use signal::*;

use section::section;

section! {
    /// All thresholds of a diagnosis.
    Plan {
        /// Preparation of the recorded channels.
        signal: SignalPlan;
        /// Search over a Gaussian likelihood.
        inference: InferencePlan;
        /// Decision on what is found.
        judgement: JudgementPlan;
        /// Gyros with a reference on the same rows.
        rates: RatesPlan;
        /// A unit at rest.
        rest: RestPlan;
        /// Several recordings of one unit.
        several: SeveralPlan;
        /// A recording longer than memory.
        long: LongPlan;
        /// Gyros with an attitude reference.
        attitude: AttitudePlan;
        /// Accelerometers.
        force: ForcePlan;
    }
}

impl Plan {
    /// Returns all numbers in the order of the tree, with their present values.
    pub fn numbers(&self) -> Vec<Number> {
        let mut all = Vec::new();
        let mut copy = *self;
        copy.visit(&mut |entry| all.push(entry.number()));
        all
    }

    /// Returns the sections that hold numbers, by their path, each with its own numbers.
    pub fn sections(&self) -> Vec<(String, Vec<Number>)> {
        let mut sections: Vec<(String, Vec<Number>)> = Vec::new();
        for number in self.numbers() {
            let path = number.section().to_owned();
            match sections.iter_mut().find(|(known, _)| *known == path) {
                Some((_, numbers)) => numbers.push(number),
                None => sections.push((path, vec![number])),
            }
        }
        sections
    }

    /// Returns the numbers that differ from the defaults.
    pub fn changed(&self) -> Vec<Number> {
        let defaults = Plan::default().numbers();
        let numbers = self.numbers().into_iter().zip(defaults);
        numbers
            .filter(|(own, default)| own.values != default.values)
            .map(|(own, _)| own)
            .collect()
    }

    /// Scales the number `name` by `factor`, to the next integer where it counts; returns the plan and the new value of its
    /// first element, or `None` for an unknown name.
    pub fn scaled(mut self, name: &str, factor: f64) -> Option<(Self, f64)> {
        let mut scaled = None;
        self.visit(&mut |mut entry| {
            if entry.name == name {
                let values: Vec<f64> = entry
                    .number()
                    .values
                    .iter()
                    .map(|value| value * factor)
                    .collect();
                entry.set(&values);
                scaled = Some(entry.number().values[0]);
            }
        });
        scaled.map(|value| (self, value))
    }
}
