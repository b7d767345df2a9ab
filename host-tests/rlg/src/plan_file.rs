//! File of the thresholds of a diagnosis: written with unit, range and reason of each number, read with every key checked.

use std::fmt::Write as _;
use std::path::Path;

use rlg_plan::{Number, Plan};
use rlg_recording::nearest;
use rlg_recording::toml_file::{self, FORMAT};

use crate::error::InputError;

/// Reads a file; numbers that it does not name keep their defaults.
///
/// # Errors
/// The file cannot be read, is no TOML or of another format; a key is unknown; a value is no number, or out of its range.
pub fn read(path: &Path) -> Result<Plan, InputError> {
    let (table, _) = toml_file::read::<toml::Table>(path)?;
    from_table(path, &table)
}

fn from_table(path: &Path, table: &toml::Table) -> Result<Plan, InputError> {
    let mut given = Vec::new();
    flatten("", table, &mut given);
    let mut plan = Plan::default();
    let numbers = plan.numbers();
    for (key, value) in given.iter().filter(|(key, _)| key != "format") {
        let Some(number) = numbers.iter().find(|number| number.name == *key) else {
            let refused = InputError::new(path, "is no number of the plan").channel(key);
            return Err(
                refused.expected(similar(key, &numbers).unwrap_or("a key as rlg plan prints it"))
            );
        };
        plan = plan.with(key, &values(path, value, number)?);
    }
    Ok(plan)
}

/// Returns the name of a number similar to `key`, or with the same name in another section.
fn similar<'a>(key: &str, numbers: &'a [Number]) -> Option<&'a str> {
    let elsewhere = || {
        let last = key.rsplit('.').next()?;
        let number = numbers.iter().find(|number| number.key() == last)?;
        Some(number.name.as_str())
    };
    nearest(key, numbers.iter().map(|number| number.name.as_str())).or_else(elsewhere)
}

/// Formats the tree with unit, range and reason of each number, as [`read`] reads it.
pub fn to_toml(plan: &Plan) -> String {
    let mut out = format!("format = {FORMAT}\n");
    for (section, numbers) in plan.sections() {
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
fn values(path: &Path, value: &toml::Value, number: &Number) -> Result<Vec<f64>, InputError> {
    let [low, high] = number.range;
    let kind = if number.is_count { "integer" } else { "number" };
    let expected = match number.values.len() {
        1 => format!("one {kind} from {low} to {high} {}", number.unit),
        count => format!("{count} {kind}s from {low} to {high} {}", number.unit),
    };
    let refused = |problem: &str| {
        InputError::new(path, problem)
            .channel(&number.name)
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use rlg_plan::Plan;
    use rlg_recording::toml_file;

    use super::{from_table, to_toml};
    use crate::error::InputError;

    fn read(text: &str) -> Result<Plan, InputError> {
        let path = Path::new("plan.toml");
        from_table(path, &toml_file::table(path, text)?)
    }

    #[test]
    fn what_is_written_is_read_back() {
        let (plan, value) = Plan::default()
            .scaled("judgement.naming", 1.5)
            .expect("known");
        assert_eq!(value, 6.0);
        let read = read(&to_toml(&plan)).expect("a plan");
        assert_eq!(read, plan);
        let names: Vec<_> = read
            .changed()
            .into_iter()
            .map(|(number, _)| number.name)
            .collect();
        assert_eq!(names, ["judgement.naming"]);
    }

    #[test]
    fn faults_of_a_file_are_named() {
        let refused = |text: &str| read(text).expect_err("refused");
        assert_eq!(refused("").channel.as_deref(), Some("format"));
        assert_eq!(refused("format = 2").value.as_deref(), Some("2"));
        assert_eq!(
            refused("format = 1\n[judgement\n").channel.as_deref(),
            Some("line 2")
        );
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
