//! `docs/files.md`, `docs/plan.md` and `docs/diagnosis.schema.json` equal what the code makes, and the code's tables list the
//! keys of the readers.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;

use rlg::limits_file;
use rlg::model;
use rlg::model::catalogue::{CATALOGUE, Value};
use rlg::recording::Quantity;
use rlg::recording::keys::{self, Key};
use rlg_plan::Plan;
use serde_json::Value as Json;

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

fn limits() -> String {
    let mut table = "| key | values | unit | range | meaning |\n|---|---|---|---|---|\n".to_owned();
    for key in limits_file::KEYS {
        let [low, high] = key.range;
        let (name, values, unit, meaning) = (key.name, key.values, key.unit, key.meaning);
        let _ = writeln!(
            table,
            "| `{name}` | {values} | {unit} | {low} to {high} | {meaning} |"
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
        ("limits", limits()),
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

const SCHEMA: &str = "docs/diagnosis.schema.json";

#[test]
fn the_schema_is_that_of_the_code_and_a_change_that_breaks_readers_has_a_new_format() {
    let path = root().join(SCHEMA);
    let made = rlg_findings::schema::diagnosis().to_value();
    let text = serde_json::to_string_pretty(&made).expect("JSON") + "\n";
    let kept = fs::read_to_string(&path).expect("the schema");
    let before: Json = serde_json::from_str(&kept).expect("JSON");
    if format_of(&before) == format_of(&made) {
        let broken = broken(&before, &made);
        assert!(broken.is_empty(), "raise FORMAT: {broken:?}");
    }
    if std::env::var_os(WRITE).is_some() {
        fs::write(&path, text).expect("the schema can be written");
    } else {
        assert!(
            kept == text,
            "{SCHEMA} is stale: set {WRITE} and run this test, which writes it"
        );
    }
}

fn format_of(schema: &Json) -> &Json {
    &schema["properties"]["format"]["const"]
}

/// Returns the constraints of a schema, by path, on which a reader of its files relies: types, references, permitted words
/// and which fields are always there. Descriptions are for people.
fn relied_on(schema: &Json, path: &str, found: &mut BTreeSet<String>) {
    match schema {
        Json::Object(members) => {
            for (name, member) in members.iter().filter(|(name, member)| {
                !(member.is_string() && (*name == "description" || *name == "title"))
            }) {
                relied_on(member, &format!("{path}/{name}"), found);
            }
        }
        // The order of members carries nothing.
        Json::Array(members) => {
            for member in members {
                relied_on(member, path, found);
            }
        }
        leaf => {
            found.insert(format!("{path} = {leaf}"));
        }
    }
}

/// Returns what a reader of `before` relies on and `after` does not promise.
fn broken(before: &Json, after: &Json) -> Vec<String> {
    let [before, after] = [before, after].map(|schema| {
        let mut found = BTreeSet::new();
        relied_on(schema, "", &mut found);
        found
    });
    before.difference(&after).cloned().collect()
}

#[test]
fn a_field_may_be_added_but_not_taken_away_or_changed() {
    let schema = |fields: Json, required: Json| serde_json::json!({"properties": fields, "required": required});
    let number = || serde_json::json!({"type": "number", "description": "rate"});
    let one = schema(serde_json::json!({"a": number()}), serde_json::json!(["a"]));
    let both = schema(
        serde_json::json!({"a": {"type": "number", "description": "turn rate"}, "b": number()}),
        serde_json::json!(["a", "b"]),
    );
    assert_eq!(broken(&one, &both), [""; 0]);
    assert_eq!(broken(&both, &one).len(), 2, "a field less");
    let text = schema(
        serde_json::json!({"a": {"type": "string"}}),
        serde_json::json!(["a"]),
    );
    assert_eq!(broken(&one, &text), ["/properties/a/type = \"number\""]);
    let optional = schema(serde_json::json!({"a": number()}), serde_json::json!([]));
    assert_eq!(broken(&one, &optional), ["/required = \"a\""]);
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
