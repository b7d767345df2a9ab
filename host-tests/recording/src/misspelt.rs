//! Tells a misspelt key or quantity of `recording.toml` from one that others added.

use std::path::Path;

use super::Quantity;
use super::keys::KEYS;
use crate::error::InputError;

/// Letters that a misspelt word has wrong, left out, more or exchanged.
const MISSPELT: usize = 2;

/// Shortest word of which a longer one is taken for the same: `rate` for `rate_hz`.
const SHORTEST: usize = 4;

/// The name among `known` that `word` was meant to be; `None` where it is like none of them.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let distance = |name: &&str| strsim::damerau_levenshtein(name, word);
    let is_near = |name: &&str| {
        let (short, long) = match name.len() < word.len() {
            true => (*name, word),
            false => (word, *name),
        };
        let is_part = short.len() >= SHORTEST && long.starts_with(short);
        is_part || (short.len() > MISSPELT && distance(name) <= MISSPELT)
    };
    known.into_iter().filter(is_near).min_by_key(distance)
}

/// Refuses a quantity whose name is nearly that of a listed one.
pub(super) fn check_quantity(path: &Path, channel: &str, name: &str) -> Result<(), InputError> {
    let listed = || Quantity::LISTED.iter().map(Quantity::name);
    match nearest(name, listed()).filter(|near| *near != name) {
        Some(near) => Err(InputError::new(path, "is no quantity")
            .channel(channel)
            .value(format!("{name:?}"))
            .expected(format!(
                "{near:?}; a quantity of your own has a name that is like no listed one: \"custom_{name}\""
            ))),
        None => Ok(()),
    }
}

/// Refuses keys whose names are nearly those of listed ones; others may have been added.
pub(super) fn check_keys(path: &Path, file: &toml::Table) -> Result<(), InputError> {
    check_section(path, "", file)
}

fn check_section(path: &Path, section: &str, table: &toml::Table) -> Result<(), InputError> {
    let bare = section.trim_matches(['[', ']']);
    for (name, value) in table {
        let inner = match bare {
            "" => name.clone(),
            bare => format!("{bare}.{name}"),
        };
        let is_section = KEYS
            .iter()
            .any(|key| key.section.trim_matches(['[', ']']) == inner);
        match value {
            toml::Value::Table(inside) if is_section => check_section(path, &inner, inside)?,
            toml::Value::Array(all) if is_section => {
                let mut tables = all.iter().filter_map(toml::Value::as_table);
                tables.try_for_each(|inside| check_section(path, &inner, inside))?;
            }
            _ if is_section => {}
            _ => check_key(path, bare, name)?,
        }
    }
    Ok(())
}

fn check_key(path: &Path, section: &str, name: &str) -> Result<(), InputError> {
    let of_section = || {
        let keys = KEYS.iter();
        keys.filter(|key| key.section.trim_matches(['[', ']']) == section)
            .map(|key| key.name)
    };
    if of_section().any(|known| known == name) {
        return Ok(());
    }
    match nearest(name, of_section()) {
        Some(near) => Err(InputError::new(path, "is no key here")
            .channel(match section {
                "" => name.to_owned(),
                section => format!("{section}.{name}"),
            })
            .expected(format!("{near:?}"))),
        None => Ok(()),
    }
}
