//! Lays a fleet out as a table: a row a number, or a run without any.

use super::run::Run;
use super::summary::{Found, Summary};
use crate::recording::{ResultColumn, ResultTable};

/// A run, and one of its numbers if it has any.
type Row<'a> = (&'a Run, Option<&'a Found>);

/// Builds all columns; SI units, `unit` being that of value, std and fleet.
pub fn table(summary: &Summary) -> ResultTable {
    let rows: Vec<Row> = summary
        .lines
        .iter()
        .flat_map(|line| {
            let none = line.found.is_empty().then_some((&line.run, None));
            let found = line.found.iter().map(|found| (&line.run, Some(found)));
            found.chain(none)
        })
        .collect();
    let text = |of: &dyn Fn(&Run, Option<&Found>) -> Option<String>| {
        ResultColumn::Text(rows.iter().map(|(run, found)| of(run, *found)).collect())
    };
    let number = |of: &dyn Fn(&Run, Option<&Found>) -> Option<f64>| {
        ResultColumn::Number(rows.iter().map(|(run, found)| of(run, *found)).collect())
    };
    let told = |run: &Run| Some(run.told.as_ref().ok()?.verdict.clone());
    let columns = [
        (
            "instrument",
            text(&|run, _| Some(run.instrument().to_owned())),
        ),
        ("run", text(&|run, _| Some(run.name.clone()))),
        (
            "recording",
            text(&|run, _| Some(run.about.recording.clone())),
        ),
        ("start", text(&|run, _| run.about.start.clone())),
        ("start_s", number(&|run, _| run.about.start_s)),
        ("temperature_k", number(&|run, _| run.about.temperature_k)),
        ("verdict", text(&|run, _| told(run))),
        ("refused", text(&|run, _| run.told.as_ref().err().cloned())),
        ("kind", text(&|_, found| Some(found?.kind.clone()))),
        ("texts", text(&|_, found| Some(found?.texts.clone()))),
        (
            "parameter",
            text(&|_, found| Some(found?.parameter.clone())),
        ),
        ("value", number(&|_, found| Some(found?.measured.value))),
        ("std", number(&|_, found| Some(found?.measured.std))),
        ("unit", text(&|_, found| Some(found?.unit.clone()))),
        ("label", text(&|_, found| found?.label.clone())),
        (
            "indistinguishable_from",
            text(&|_, found| Some(found?.indistinguishable_from.join(" "))),
        ),
        ("p_value", number(&|_, found| Some(found?.p_value))),
        (
            "fleet_median",
            number(&|_, found| Some(found?.fleet?.median)),
        ),
        (
            "fleet_spread",
            number(&|_, found| Some(found?.fleet?.spread)),
        ),
        ("fleet_z", number(&|_, found| found?.fleet_z)),
        (
            "outlier",
            text(&|_, found| found?.is_outlier.then(|| "outlier".to_owned())),
        ),
        (
            "per_day",
            number(&|_, found| Some(found?.per_day?.measured.value)),
        ),
        (
            "per_day_std",
            number(&|_, found| Some(found?.per_day?.measured.std)),
        ),
        (
            "per_kelvin",
            number(&|_, found| Some(found?.per_kelvin?.measured.value)),
        ),
        (
            "per_kelvin_std",
            number(&|_, found| Some(found?.per_kelvin?.measured.std)),
        ),
    ];
    let named = columns.map(|(name, column)| (name.to_owned(), column));
    ResultTable(named.into())
}
