//! Two golden tables, field by field.

use std::collections::BTreeMap;

use serde::Serialize;

use super::row::{COLUMNS, Row, SHA256};
use super::table::Table;

/// How rows made now differ from the reviewed ones.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Comparison {
    /// Rows that were compared.
    pub compared: usize,
    /// Reviewed rows that were not made now.
    pub not_made: usize,
    /// Whether hashes were left out, because the tables were made with different arithmetic.
    pub hashes_left_out: bool,
    /// Rows made now that the reviewed table does not have.
    pub not_reviewed: Vec<String>,
    /// Rows that differ.
    pub rows: Vec<RowDifference>,
}

/// A row that differs.
#[derive(Debug, Clone, Serialize)]
pub struct RowDifference {
    /// Its name.
    pub name: String,
    /// Fields that differ.
    pub fields: Vec<FieldDifference>,
}

/// A field that differs.
#[derive(Debug, Clone, Serialize)]
pub struct FieldDifference {
    /// Its column.
    pub column: &'static str,
    /// What the reviewed table has.
    pub reviewed: String,
    /// What was made now.
    pub made: String,
}

impl Comparison {
    /// Whether every row made now is as it was reviewed.
    pub fn is_equal(&self) -> bool {
        self.rows.is_empty() && self.not_reviewed.is_empty()
    }

    /// The differences as lines of text.
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
