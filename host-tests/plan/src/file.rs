//! The tree as a TOML file: written with unit, range and reason of each number, read with every key checked.

use std::fmt::Write as _;

use crate::Plan;

/// Format number of the file, in its key `format`.
const FORMAT: i64 = 1;

/// Least similarity of a misspelt key to a known one (Jaro–Winkler).
const ALIKE: f64 = 0.8;

/// Reason for which a file is refused.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// Key, by its path from the root; `line N` where the file is no TOML.
    pub key: String,
    /// Value found, as written.
    pub value: Option<String>,
    /// Problem, as a clause.
    pub problem: String,
    /// Expected value, as a noun phrase.
    pub expected: Option<String>,
}

impl Refused {
    fn new(key: &str, problem: impl Into<String>) -> Self {
        Self {
            key: key.to_owned(),
            value: None,
            problem: problem.into(),
            expected: None,
        }
    }

    fn value(mut self, value: impl ToString) -> Self {
        self.value = Some(value.to_string());
        self
    }

    fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }
}

impl Plan {
    /// Reads the text of a plan file; numbers that it does not name keep their defaults.
    ///
    /// # Errors
    /// The text is no TOML or of another format; a key is unknown; a value is no number, or out of its range.
    pub fn from_toml(text: &str) -> Result<Self, Refused> {
        let table: toml::Table = toml::from_str(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start.min(text.len()));
            let line = text[..start].matches('\n').count() + 1;
            Refused::new(&format!("line {line}"), error.message().replace('\n', ", "))
        })?;
        let format = format!("format = {FORMAT}");
        match table.get("format") {
            Some(toml::Value::Integer(FORMAT)) => {}
            Some(other) => {
                let refused = Refused::new("format", "is of a format this version does not read");
                return Err(refused.value(other).expected(format));
            }
            None => return Err(Refused::new("format", "is missing").expected(format)),
        }
        let mut given = Vec::new();
        flatten("", &table, &mut given);
        let mut plan = Self::default();
        let numbers = plan.numbers();
        for (key, value) in given.iter().filter(|(key, _)| key != "format") {
            let Some(number) = numbers.iter().find(|number| number.name == *key) else {
                let refused = Refused::new(key, "is no number of the plan");
                let near = nearest(key, numbers.iter().map(|number| number.name.as_str()));
                return Err(match near {
                    Some(near) => refused.expected(near),
                    None => refused,
                });
            };
            let values = read(value, number)?;
            plan.visit(&mut |mut entry| {
                if entry.name == *key {
                    entry.set(&values);
                }
            });
        }
        Ok(plan)
    }

    /// Formats the tree with unit, range and reason of each number, as [`Self::from_toml`] reads it.
    pub fn to_toml(&self) -> String {
        let mut out = format!("format = {FORMAT}\n");
        for (section, numbers) in self.sections() {
            let _ = write!(out, "\n[{section}]\n");
            for number in numbers {
                let [low, high] = number.range;
                let kind = if number.is_count { "Integer" } else { "Number" };
                let _ = writeln!(out, "# {}", number.reason);
                let range = format!("{low} to {high} {}", number.unit);
                let _ = writeln!(out, "# {kind}, {}", range.trim_end());
                let _ = writeln!(out, "{} = {}", number.key(), number.text());
            }
        }
        out
    }
}

/// Lists all values below a table by their paths.
fn flatten<'a>(path: &str, table: &'a toml::Table, into: &mut Vec<(String, &'a toml::Value)>) {
    for (key, value) in table {
        let path = match path {
            "" => key.clone(),
            outer => format!("{outer}.{key}"),
        };
        match value {
            toml::Value::Table(inner) => flatten(&path, inner, into),
            value => into.push((path, value)),
        }
    }
}

/// Reads the value of a number, and checks its form and range.
fn read(value: &toml::Value, number: &crate::Number) -> Result<Vec<f64>, Refused> {
    let [low, high] = number.range;
    let kind = if number.is_count { "integer" } else { "number" };
    let expected = match number.values.len() {
        1 => format!("one {kind} from {low} to {high} {}", number.unit),
        count => format!("{count} {kind}s from {low} to {high} {}", number.unit),
    };
    let refused = |problem: &str| {
        Refused::new(&number.name, problem)
            .value(value)
            .expected(expected.trim_end())
    };
    let elements = match value {
        toml::Value::Array(elements) if number.values.len() > 1 => elements.as_slice(),
        toml::Value::Array(_) => return Err(refused("is a list")),
        one => std::slice::from_ref(one),
    };
    if elements.len() != number.values.len() {
        return Err(refused("has another number of values"));
    }
    elements
        .iter()
        .map(|element| {
            let value = match *element {
                toml::Value::Integer(value) => value as f64,
                toml::Value::Float(value) if !number.is_count => value,
                _ => return Err(refused("is of another type")),
            };
            if value >= low && value <= high {
                Ok(value)
            } else {
                Err(refused("is out of range"))
            }
        })
        .collect()
}

/// Returns the known name most similar to `name`, by its last part where that is known elsewhere.
fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> Option<String> {
    let last = name.rsplit('.').next().unwrap_or(name);
    let same_end = known
        .clone()
        .find(|known| known.rsplit('.').next() == Some(last));
    let similar = || {
        known
            .map(|known| (strsim::jaro_winkler(name, known), known))
            .filter(|(likeness, _)| *likeness > ALIKE)
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, known)| known)
    };
    same_end.or_else(similar).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use crate::Plan;

    #[test]
    fn what_is_written_is_read_back() {
        let (plan, value) = Plan::default()
            .scaled("judgement.naming", 1.5)
            .expect("known");
        assert_eq!(value, 6.0);
        let read = Plan::from_toml(&plan.to_toml()).expect("a plan");
        assert_eq!(read, plan);
        let names: Vec<_> = read
            .changed()
            .into_iter()
            .map(|number| number.name)
            .collect();
        assert_eq!(names, ["judgement.naming"]);
    }

    #[test]
    fn every_default_lies_in_its_range_and_has_a_reason() {
        let numbers = Plan::default().numbers();
        for (place, number) in numbers.iter().enumerate() {
            let [low, high] = number.range;
            let is_within = |value: &f64| (low..=high).contains(value);
            assert!(number.values.iter().all(is_within), "{number:?}");
            assert!(!number.reason.is_empty(), "{number:?}");
            let is_same = |other: &crate::Number| other.name == number.name;
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

    #[test]
    fn faults_of_a_file_are_named() {
        let refused = |text: &str| Plan::from_toml(text).expect_err("refused");
        assert_eq!(refused("").key, "format");
        assert_eq!(refused("format = 2").value.as_deref(), Some("2"));
        assert_eq!(refused("format = 1\n[judgement\n").key, "line 2");
        let of = |line: &str| refused(&format!("format = 1\n[judgement]\n{line}\n"));
        assert_eq!(of("naming = \"4\"").problem, "is of another type");
        assert_eq!(of("naming = -1").problem, "is out of range");
        assert_eq!(of("naming = nan").problem, "is out of range");
        assert_eq!(of("naming = [4, 5]").problem, "is a list");
        assert_eq!(of("reenactments = 7.5").problem, "is of another type");
        assert_eq!(
            of("namming = 4").expected.as_deref(),
            Some("judgement.naming")
        );
        let elsewhere = refused("format = 1\nnaming = 4\n");
        assert_eq!(elsewhere.expected.as_deref(), Some("judgement.naming"));
        let list = refused("format = 1\n[signal.lost_rows]\nstretches = [8]\n");
        assert_eq!(list.problem, "has another number of values");
        assert_eq!(
            list.expected.as_deref(),
            Some("2 integers from 1 to 100000")
        );
    }
}
