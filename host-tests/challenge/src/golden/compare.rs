//! Comparison of two golden tables, field by field.

use std::collections::BTreeMap;

use serde::Serialize;

use super::row::{COLUMNS, Row, SHA256};
use super::table::Table;

/// Differences between new rows and the reviewed ones.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Comparison {
    /// Number of compared rows.
    pub compared: usize,
    /// Number of reviewed rows without a new one.
    pub not_made: usize,
    /// Hashes were left out, because the tables were made with different arithmetic.
    pub hashes_left_out: bool,
    /// New rows without a reviewed one.
    pub not_reviewed: Vec<String>,
    /// Rows that differ.
    pub rows: Vec<RowDifference>,
}

/// Differing row.
#[derive(Debug, Clone, Serialize)]
pub struct RowDifference {
    /// Name of the row.
    pub name: String,
    /// Differing fields.
    pub fields: Vec<FieldDifference>,
}

/// Differing field.
#[derive(Debug, Clone, Serialize)]
pub struct FieldDifference {
    /// Column.
    pub column: &'static str,
    /// Cell of the reviewed table.
    pub reviewed: String,
    /// New cell.
    pub made: String,
}

impl Comparison {
    /// True if every new row equals its reviewed one.
    pub fn is_equal(&self) -> bool {
        self.rows.is_empty() && self.not_reviewed.is_empty()
    }

    /// Formats the differences as lines of text.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for name in &self.not_reviewed {
            lines.push(format!("{name}: not in the reviewed table"));
        }
        for row in &self.rows {
            lines.push(format!("{}:", row.name));
            for field in &row.fields {
                lines.push(format!("  {}", field.column));
                lines.push(format!("    - {}", field.reviewed));
                lines.push(format!("    + {}", field.made));
            }
        }
        lines
    }
}

/// Compares the rows of `made` with the reviewed rows of the same names.
pub fn compare(reviewed: &Table, made: &Table) -> Comparison {
    let by_name: BTreeMap<&str, &Row> = reviewed.rows.iter().map(|row| (row.name(), row)).collect();
    let same_arithmetic = reviewed.header.arithmetic == made.header.arithmetic;
    let mut comparison = Comparison {
        hashes_left_out: !same_arithmetic,
        ..Comparison::default()
    };
    for row in &made.rows {
        let Some(old) = by_name.get(row.name()) else {
            comparison.not_reviewed.push(row.name().to_owned());
            continue;
        };
        comparison.compared += 1;
        let columns = COLUMNS.iter().zip(old.cells.iter().zip(&row.cells));
        let fields: Vec<FieldDifference> = columns
            .filter(|(column, (old, new))| old != new && (same_arithmetic || **column != SHA256))
            .map(|(column, (old, new))| FieldDifference {
                column,
                reviewed: old.clone(),
                made: new.clone(),
            })
            .collect();
        if !fields.is_empty() {
            comparison.rows.push(RowDifference {
                name: row.name().to_owned(),
                fields,
            });
        }
    }
    comparison.not_made = reviewed.rows.len() - comparison.compared;
    comparison
}
