//! Distinguishes a misspelt key of `recording.toml` from an additional one.

use std::path::Path;

use super::keys::KEYS;
use super::nearest::nearest;
use crate::error::InputError;

/// Rejects keys with names similar to listed ones; other keys may be additions.
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
