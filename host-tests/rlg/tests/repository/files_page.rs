//! `docs/files.md` and `docs/plan.md`: their tables equal the code's, and the code's tables list the keys of the readers.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;

use rlg::model;
use rlg::model::catalogue::{CATALOGUE, Value};
use rlg::recording::Quantity;
use rlg::recording::keys::{self, Key};
use rlg_plan::Plan;

use super::pages::root;

/// If this is set, the tables are written into the page instead of compared.
const WRITE: &str = "RLG_WRITE_TABLES";

/// A row for the parameters of a kind that share a unit.
fn effects() -> String {
    let mut table = "| kind | parameters | unit | absent |\n|---|---|---|---|\n".to_owned();
    for kind in CATALOGUE {
        if kind.groups.is_empty() {
            let _ = writeln!(table, "| `{}` | free | | |", kind.name);
        }
        for (place, group) in kind.groups.iter().chain(kind.compensation).enumerate() {
            let name = if place == 0 {
                format!("`{}`", kind.name)
            } else {
                String::new()
            };
            let names: Vec<String> = group.names.iter().map(|name| format!("`{name}`")).collect();
            let absent = match group.value {
                _ if group.required => "must be there".to_owned(),
                Value::Axis | Value::Channel | Value::Recording | Value::Remark => "–".to_owned(),
                Value::Number | Value::Positive | Value::NotNegative => "0".to_owned(),
                Value::OneOf(words) => format!("`{}`, of `{}`", words[0], words.join("` `")),
                Value::Between([low, high], absent) => format!("{absent}, of {low} to {high}"),
            };
            let _ = writeln!(
                table,
                "| {name} | {} | {} | {absent} |",
                names.join(" "),
                group.unit
            );
        }
    }
    table
}

fn quantities() -> String {
    let mut table = "| quantity | unit | a row holds |\n|---|---|---|\n".to_owned();
    for quantity in Quantity::LISTED {
        let unit = quantity.unit().unwrap_or_default();
        let _ = writeln!(
            table,
            "| `{}` | {unit} | {} |",
            quantity.name(),
            quantity.meaning()
        );
    }
    table
}

fn keys(of: &[Key]) -> String {
    let mut table = "| in | key | unit | absent | meaning |\n|---|---|---|---|---|\n".to_owned();
    for key in of {
        let section = match key.section {
            "" => "the top".to_owned(),
            section => format!("`[{section}]`"),
        };
        let Key {
            name,
            unit,
            default,
            meaning,
            ..
        } = key;
        let _ = writeln!(
            table,
            "| {section} | `{name}` | {unit} | {default} | {meaning} |"
        );
    }
    table
}

/// A table for each section of the plan.
fn plan() -> String {
    let mut tables = String::new();
    for (section, numbers) in Plan::default().sections() {
        let _ = write!(
            tables,
            "\n## `{section}`\n\n| number | default | unit | range | reason |\n|---|---|---|---|---|\n"
        );
        for number in numbers {
            let ([low, high], text) = (number.range, number.text());
            let _ = writeln!(
                tables,
                "| `{}` | {text} | {} | {low} to {high} | {} |",
                number.key(),
                number.unit,
                number.reason
            );
        }
    }
    tables
}

#[test]
fn the_tables_of_the_plan_page_are_those_of_the_code() {
    compare("docs/plan.md", &[("plan", plan())]);
}

#[test]
fn the_tables_of_the_files_page_are_those_of_the_code() {
    let tables = [
        ("recording.toml", keys(keys::KEYS)),
        ("quantities", quantities()),
        ("model.toml", keys(model::keys::KEYS)),
        ("effects", effects()),
    ];
    compare("docs/files.md", &tables);
}

/// Compares the tables of a page with those made from the code, or writes them.
fn compare(page_name: &str, tables: &[(&str, String)]) {
    let path = root().join(page_name);
    let page = fs::read_to_string(&path).expect("the page");
    let mut expected = page.clone();
    for (name, table) in tables {
        let begin = format!("<!-- made from the code: {name} -->\n");
        let (head, rest) = expected
            .split_once(&begin)
            .unwrap_or_else(|| panic!("no {begin}"));
        let (_, tail) = rest.split_once("<!-- end -->").expect("an end");
        expected = format!("{head}{begin}{table}<!-- end -->{tail}");
    }
    if std::env::var_os(WRITE).is_some() {
        fs::write(&path, expected).expect("the page can be written");
    } else {
        assert!(
            page == expected,
            "{page_name} is stale: set {WRITE} and run this test, which writes it"
        );
    }
}

/// Returns section and name of each key in a list, the top's tables apart.
fn listed(of: &[Key]) -> BTreeSet<(&str, &str)> {
    of.iter().map(|key| (key.section, key.name)).collect()
}

fn read<'a>(names: &[(&'a str, &'a [&'a str])]) -> BTreeSet<(&'a str, &'a str)> {
    let tables: BTreeSet<&str> = names
        .iter()
        .filter_map(|(section, _)| section.trim_matches(['[', ']']).split('.').next_back())
        .collect();
    let keys = names
        .iter()
        .flat_map(|(section, keys)| keys.iter().map(|key| (*section, *key)));
    keys.filter(|(_, key)| !tables.contains(key)).collect()
}

#[test]
fn the_lists_of_keys_are_what_the_readers_read() {
    let mut recording = read(&keys::read_names());
    assert!(recording.len() > 12, "{recording:?}");
    // The format is checked before anything else is read.
    recording.insert(("", "format"));
    assert_eq!(listed(keys::KEYS), recording);

    let mut model = read(&model::read_names());
    assert!(model.len() > 12, "{model:?}");
    // An effect is a table of free names, which the catalogue checks.
    model.remove(&("", "effect"));
    model.insert(("", "format"));
    model.insert(("[effect]", "kind"));
    assert_eq!(listed(model::keys::KEYS), model);
}
