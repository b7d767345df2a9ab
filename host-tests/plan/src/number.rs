//! A number of the tree, by its name.

/// A number with its place in the tree and its facts.
#[derive(Debug, Clone, PartialEq)]
pub struct Number {
    /// Path from the root: `rates.coarse.tie`.
    pub name: String,
    /// Values: one, or the elements of a list of fixed length.
    pub values: Vec<f64>,
    /// True for integers.
    pub is_count: bool,
    /// Unit as written; empty for a ratio or a count, σ for standard deviations.
    pub unit: &'static str,
    /// Smallest and largest permitted value.
    pub range: [f64; 2],
    /// Meaning of the number, and the reason for its value.
    pub reason: String,
}

/// Access to a number during a visit.
pub struct Entry<'a> {
    /// Path from the root.
    pub name: String,
    /// Place of the values.
    pub(crate) slots: Slots<'a>,
    /// Unit.
    pub(crate) unit: &'static str,
    /// Permitted range.
    pub(crate) range: [f64; 2],
    /// Documentation of the field.
    pub(crate) doc: &'static str,
}

/// Place of a number's values.
pub enum Slots<'a> {
    /// Real numbers.
    Reals(&'a mut [f64]),
    /// Counts.
    Counts(&'a mut [usize]),
}

impl Entry<'_> {
    /// Returns name, values and facts.
    pub fn number(&self) -> Number {
        let (values, is_count) = match &self.slots {
            Slots::Reals(values) => (values.to_vec(), false),
            Slots::Counts(values) => (values.iter().map(|&value| value as f64).collect(), true),
        };
        Number {
            name: self.name.clone(),
            values,
            is_count,
            unit: if self.unit == "1" { "" } else { self.unit },
            range: self.range,
            reason: self.doc.split_whitespace().collect::<Vec<_>>().join(" "),
        }
    }

    /// Replaces the values; counts are rounded. The lengths must be equal.
    pub fn set(&mut self, values: &[f64]) {
        match &mut self.slots {
            Slots::Reals(own) => own.copy_from_slice(values),
            Slots::Counts(own) => {
                assert_eq!(own.len(), values.len(), "one value for each element");
                for (own, value) in own.iter_mut().zip(values) {
                    *own = value.round() as usize;
                }
            }
        }
    }
}

impl Number {
    /// Path of the section that holds the number.
    pub fn section(&self) -> &str {
        self.name
            .rsplit_once('.')
            .map_or("", |(section, _)| section)
    }

    /// Name within the section.
    pub fn key(&self) -> &str {
        self.name.rsplit('.').next().unwrap_or(&self.name)
    }

    /// Formats the values as TOML.
    pub fn text(&self) -> String {
        let one = |value: &f64| match self.is_count {
            true => format!("{value:.0}"),
            false => format!("{value:?}"),
        };
        match self.values.as_slice() {
            [value] => one(value),
            values => format!(
                "[{}]",
                values.iter().map(one).collect::<Vec<_>>().join(", ")
            ),
        }
    }
}
