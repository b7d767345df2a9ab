//! Parses the options of columns: `--map` and `--unit`.

use std::path::Path;

use super::targets::Target;
use crate::error::InputError;

/// One `--map COLUMN=QUANTITY:AXIS:UNIT`.
#[derive(Debug, Clone, PartialEq)]
pub struct Given {
    /// The column.
    pub column: String,
    /// Target of the column.
    pub target: Target,
    /// Axis of the target.
    pub axis: Option<String>,
    /// Its unit, if stated by the caller.
    pub unit: Option<String>,
}

/// Parses the entries of one `--map`: several letters of axes are the columns of a matrix.
pub fn parse(file: &Path, text: &str) -> Result<Vec<Given>, InputError> {
    let fault = || {
        InputError::new(file, "cannot be mapped like this")
            .channel("--map")
            .value(format!("{text:?}"))
            .expected("COLUMN=QUANTITY:AXIS:UNIT, as in gx=gyro_rate:x:deg/s")
    };
    let (column, rest) = text.rsplit_once('=').ok_or_else(fault)?;
    let mut parts = rest.splitn(3, ':').map(str::trim);
    let target = parts
        .next()
        .filter(|name| !name.is_empty())
        .ok_or_else(fault)?;
    let target = Target::from_name(target);
    let axis = parts.next().filter(|axis| !matches!(*axis, "" | "-"));
    let unit = parts
        .next()
        .filter(|unit| !unit.is_empty())
        .map(str::to_owned);
    let given = |column: String, axis: Option<String>| Given {
        column,
        target: target.clone(),
        axis,
        unit: unit.clone(),
    };
    let column = column.trim();
    if let Some(axes) =
        axis.filter(|axis| axis.len() > 1 && axis.chars().all(|letter| "wxyz".contains(letter)))
    {
        let entry = |(place, letter): (usize, char)| {
            given(format!("{column}[{place}]"), Some(letter.to_string()))
        };
        return Ok(axes.chars().enumerate().map(entry).collect());
    }
    if !target.takes_axis(axis) {
        return Err(
            InputError::new(file, format!("{} cannot have this axis", target.name()))
                .channel(format!("--map {text}"))
                .value(axis.unwrap_or("none"))
                .expected(match target.is_attitude() && target != Target::Euler {
                    true => "w, x, y or z",
                    false => "x, y or z",
                }),
        );
    }
    Ok(vec![given(column.to_owned(), axis.map(str::to_owned))])
}

/// Parses `--unit QUANTITY:UNIT`.
pub fn units_of_quantities(
    file: &Path,
    units: &[String],
) -> Result<Vec<(String, String)>, InputError> {
    let parse = |text: &String| {
        let (quantity, unit) = text.split_once(':').ok_or_else(|| {
            InputError::new(file, "is no unit of a quantity")
                .channel("--unit")
                .value(format!("{text:?}"))
                .expected("QUANTITY:UNIT, as in gyro_rate:deg/s")
        })?;
        Ok((quantity.trim().to_owned(), unit.trim().to_owned()))
    };
    units.iter().map(parse).collect()
}
