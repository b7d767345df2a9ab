//! Thresholds of a diagnosis and of a calibration: one tree of numbers, each with unit, permitted range and reason, fixed before the data are seen.
//!
//! A package takes the section that it needs; [`Plan`] has them all. `rlg plan` prints the tree as a file that
//! `rlg diagnose --plan FILE` and `rlg calibrate --plan FILE` read, `docs/plan.md` is its table, and `rlg challenge --marks --vary NAME`
//! evaluates other values of one number.

mod attitude;
mod calibration;
mod catalogue;
mod faults;
mod findings;
mod force;
mod inference;
mod judgement;
mod long;
mod number;
mod positions;
mod rates;
mod rest;
mod section;
mod several;
mod signal;

pub use attitude::*;
pub use calibration::*;
pub use catalogue::*;
pub use faults::*;
pub use findings::*;
pub use force::*;
pub use inference::*;
pub use judgement::*;
pub use long::*;
pub use number::Number;
pub use positions::*;
pub use rates::*;
pub use rest::*;
pub use several::*;
pub use signal::*;

use number::Entry;
use section::{Facts, Field, section};

section! {
    /// All thresholds of a diagnosis and of a calibration.
    Plan {
        /// Preparation of the recorded channels.
        signal: SignalPlan;
        /// Search over a Gaussian likelihood.
        inference: InferencePlan;
        /// Catalogue of effects.
        catalogue: CataloguePlan;
        /// Statement of a finding.
        findings: FindingsPlan;
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
        /// Still positions without a reference.
        positions: PositionPlan;
        /// Flexure coefficients by a programme of motion.
        calibration: CalibrationPlan;
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

    /// Returns the number `name`; `None` for an unknown name.
    pub fn number(&self, name: &str) -> Option<Number> {
        self.numbers()
            .into_iter()
            .find(|number| number.name == name)
    }

    /// Returns the numbers that differ from the defaults, each beside its default.
    pub fn changed(&self) -> Vec<(Number, Number)> {
        let defaults = Plan::default().numbers();
        let numbers = self.numbers().into_iter().zip(defaults);
        numbers
            .filter(|(own, default)| own.values != default.values)
            .collect()
    }

    /// Replaces the number `name`, if there is one, by as many values; counts are rounded.
    pub fn with(mut self, name: &str, values: &[f64]) -> Self {
        self.visit(&mut |mut entry| {
            if entry.name == name {
                entry.set(values);
            }
        });
        self
    }

    /// Scales the number `name` by `factor`, to the next integer where it counts; returns the plan and the new value of its
    /// first element, or `None` for an unknown name.
    pub fn scaled(self, name: &str, factor: f64) -> Option<(Self, f64)> {
        let values = self.number(name)?.values;
        let values: Vec<f64> = values.iter().map(|value| value * factor).collect();
        let plan = self.with(name, &values);
        Some((plan, plan.number(name)?.values[0]))
    }

    fn visit(&mut self, visitor: &mut dyn FnMut(Entry<'_>)) {
        let nowhere = Facts {
            unit: "",
            range: [0.0; 2],
            doc: "",
        };
        self.walk("", nowhere, visitor);
    }
}

#[cfg(test)]
mod tests {
    use super::{Number, Plan};

    #[test]
    fn every_default_lies_in_its_range_and_has_a_reason() {
        let numbers = Plan::default().numbers();
        for (place, number) in numbers.iter().enumerate() {
            let [low, high] = number.range;
            let is_within = |value: &f64| (low..=high).contains(value);
            assert!(number.values.iter().all(is_within), "{number:?}");
            assert!(!number.reason.is_empty(), "{number:?}");
            let is_same = |other: &Number| other.name == number.name;
            assert!(
                !numbers[..place].iter().any(is_same),
                "{} twice",
                number.name
            );
        }
    }

    #[test]
    fn every_number_is_scaled_alone() {
        let before = Plan::default().numbers();
        for (place, number) in before.iter().enumerate() {
            let (plan, _) = Plan::default().scaled(&number.name, 2.0).expect("known");
            for (other, now) in plan.numbers().iter().enumerate() {
                let factor = if other == place { 2.0 } else { 1.0 };
                let expected: Vec<f64> = before[other]
                    .values
                    .iter()
                    .map(|value| value * factor)
                    .collect();
                assert_eq!(now.values, expected, "{} by {}", now.name, number.name);
            }
        }
        assert!(Plan::default().scaled("no number", 2.0).is_none());
    }
}
