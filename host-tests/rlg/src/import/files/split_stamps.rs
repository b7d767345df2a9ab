//! Stamps in two columns, whole seconds and nanoseconds, as ROS 2 messages have them, become one.

use super::columns::{Block, Column, Dates};

/// Endings of the seconds' name, and of the nanoseconds'.
const ENDINGS: [(&str, &str); 4] = [
    ("sec", "nanosec"),
    ("secs", "nsecs"),
    ("sec", "nsec"),
    ("seconds", "nanoseconds"),
];

/// Seconds that are dates since 1970: from 2001 on \[s\].
const DATES_S: f64 = 1e9;

/// Joins all such pairs of a block.
pub fn join(block: &mut Block) {
    let mut pairs = Vec::new();
    for (seconds, column) in block.columns.iter().enumerate() {
        let of = |(whole, parts): &(&str, &str)| {
            let stem = column.name.strip_suffix(whole)?;
            let name = format!("{stem}{parts}");
            let mut columns = block.columns.iter();
            Some((stem.to_owned(), columns.position(|one| one.name == name)?))
        };
        if let Some((stem, nanoseconds)) = ENDINGS.iter().find_map(of) {
            pairs.push((seconds, nanoseconds, stem));
        }
    }
    for (seconds, nanoseconds, stem) in &pairs {
        let (whole, parts) = (&block.columns[*seconds], &block.columns[*nanoseconds]);
        let name = stem.trim_end_matches(['.', '_', '/', ' ']);
        let column = joined(if name.is_empty() { "stamp" } else { name }, whole, parts);
        block.columns[*seconds] = column;
    }
    let mut place = 0;
    block.columns.retain(|_| {
        place += 1;
        !pairs.iter().any(|(_, parts, _)| *parts == place - 1)
    });
}

/// Returns stamps, as dates where they count from 1970.
fn joined(name: &str, whole: &Column, parts: &Column) -> Column {
    let first = whole.values.iter().find(|value| value.is_finite());
    let first = first.copied().unwrap_or(0.0);
    let origin_s = if first >= DATES_S { first } else { 0.0 };
    let pairs = whole.values.iter().zip(&parts.values);
    Column {
        unit: Some("s".to_owned()),
        dates: (origin_s > 0.0).then_some(Dates {
            origin_s: origin_s as i64,
            has_zone: true,
            has_day: true,
        }),
        bad_cell: whole.bad_cell.clone().or_else(|| parts.bad_cell.clone()),
        ..Column::new(
            name,
            pairs.map(|(s, ns)| (s - origin_s) + ns * 1e-9).collect(),
        )
    }
}
