//! Fill values: a number such as −9999 that a logger writes where nothing was measured.

use super::columns::{Block, Column};

/// Least magnitude of a fill value relative to the largest measured one: a saturated channel comes near its limit before.
const AWAY: f64 = 10.0;

/// Least number of rows with it: one alone is a spike, which a diagnosis leaves out by itself.
const LEAST_ROWS: usize = 2;

/// Least number of different measured values: a column of states has few.
const LEAST_DIFFERENT: usize = 16;

/// Makes fill values missing, with a note on each column.
pub fn take_out(block: &mut Block) {
    let file = block.file.file_name().unwrap_or_default().to_string_lossy();
    for column in &mut block.columns {
        let Some((fill, largest)) = fill_value(column) else {
            continue;
        };
        let is_fill = |value: &&mut f64| **value == fill;
        let filled: Vec<&mut f64> = column.values.iter_mut().filter(is_fill).collect();
        let rows = filled.len();
        filled.into_iter().for_each(|value| *value = f64::NAN);
        block.notes.push(format!(
            "{file}, {}: {fill} in {rows} rows is a fill value and no measurement (the others are within {largest:.4})",
            column.name
        ));
    }
}

/// Fill value of a column of measurements, and the largest magnitude of the others; `None` if it has none.
fn fill_value(column: &Column) -> Option<(f64, f64)> {
    if column.dates.is_some() || column.bad_cell.is_some() {
        return None;
    }
    let measured = || {
        column
            .values
            .iter()
            .copied()
            .filter(|value| value.is_finite())
    };
    let fill = measured().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
    let rows = measured().filter(|value| *value == fill).count();
    if fill.fract() != 0.0 || rows < LEAST_ROWS {
        return None;
    }
    let mut others: Vec<f64> = measured().filter(|value| *value != fill).collect();
    let largest = others
        .iter()
        .fold(0.0, |most: f64, value| most.max(value.abs()));
    if fill.abs() < AWAY * largest {
        return None;
    }
    others.sort_unstable_by(f64::total_cmp);
    others.dedup();
    (others.len() >= LEAST_DIFFERENT).then_some((fill, largest))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken_out(values: Vec<f64>) -> usize {
        let mut block = Block {
            file: "log.csv".into(),
            rows: values.len(),
            columns: vec![Column::new("gx", values)],
            rate_hz: None,
            notes: Vec::new(),
        };
        take_out(&mut block);
        let column = &block.columns[0];
        let missing = column.values.iter().filter(|value| value.is_nan()).count();
        assert_eq!(block.notes.len(), usize::from(missing > 0));
        missing
    }

    #[test]
    fn a_fill_value_is_missing_and_limits_spikes_and_states_are_not() {
        let rate = |row: usize| 40.0 * (0.1 * row as f64).sin();
        let with = |fill: f64, every: usize| -> Vec<f64> {
            let value = |row: usize| if row % every == 3 { fill } else { rate(row) };
            (0..200).map(value).collect()
        };
        assert_eq!(taken_out(with(-9999.0, 20)), 10);
        // Mostly empty: a slow channel in fast rows.
        assert_eq!(
            taken_out(
                (0..200)
                    .map(|row| if row % 5 == 0 { rate(row) } else { 9999.0 })
                    .collect()
            ),
            160
        );
        assert_eq!(taken_out(with(250.0, 20)), 0, "a limit of the channel");
        assert_eq!(taken_out(with(-9999.0, 200)), 0, "one spike");
        assert_eq!(
            taken_out(
                (0..200)
                    .map(|row| f64::from(row / 50 == 2) * 1000.0)
                    .collect()
            ),
            0
        );
        assert_eq!(taken_out((0..200).map(f64::from).collect()), 0, "a counter");
    }
}
