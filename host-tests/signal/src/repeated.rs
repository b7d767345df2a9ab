//! Finds blocks of rows that repeat earlier rows exactly, from a recorder that wrote a buffer twice.
//!
//! The probability of two equal rows is estimated from the record: coarse gyros at rest repeat short blocks by themselves,
//! and a record that repeats itself throughout is periodic, not faulty.

use rlg_plan::RepeatPlan;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

/// A block with the first row of its original.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Repeat {
    /// Rows of the repetition.
    pub rows: Range<usize>,
    /// First row of the original.
    pub from: usize,
}

/// Finds repeated blocks in channels of one recorder, in rows that are `usable`.
pub fn find(channels: &[&[f64]], usable: &[bool], plan: &RepeatPlan) -> Vec<Repeat> {
    let rows = usable.len();
    let alike = |a: usize, b: usize| {
        usable[a] && usable[b] && channels.iter().all(|values| values[a] == values[b])
    };
    let share = |distance: usize| {
        let pairs = rows.saturating_sub(distance).max(1);
        let count = (distance..rows).filter(|&row| alike(row, row - distance));
        count.count() as f64 / pairs as f64
    };
    let by_chance = plan
        .distances
        .iter()
        .map(|&distance| share(distance))
        .fold(0.0, f64::max);
    if by_chance > plan.most_alike || rows < 2 * plan.least_rows {
        return Vec::new();
    }
    let pairs = (rows as f64).powi(2);
    let needed = |by_chance: f64| {
        // Floor of the estimate: one equal row in the record.
        let by_chance = by_chance.clamp(1.0 / rows as f64, 1.0 - 1.0 / rows as f64);
        let needed = ((plan.chance / pairs).ln() / by_chance.ln()).ceil() as usize;
        needed.max(plan.least_rows)
    };
    let needed_anywhere = needed(by_chance);
    // Largest share of equal rows near a block at any short distance, the block's own rows included.
    let nearby = |block: &Range<usize>| {
        let window = block.start.saturating_sub(plan.around)..(block.end + plan.around).min(rows);
        let share = |distance: usize| {
            let compared = (window.start + distance).min(window.end)..window.end;
            let count = compared.clone().filter(|&row| alike(row, row - distance));
            count.count() as f64 / compared.len().max(1) as f64
        };
        (1..=plan.nearby).map(share).fold(0.0, f64::max)
    };
    // Rows are compared exactly, against hash collisions.
    let key = |row: usize| -> u64 {
        let mut hasher = DefaultHasher::new();
        for row in row..row + plan.least_rows {
            channels
                .iter()
                .for_each(|values| values[row].to_bits().hash(&mut hasher));
        }
        hasher.finish()
    };
    let mut seen: HashMap<u64, usize> = HashMap::new();
    let mut found: Vec<Repeat> = Vec::new();
    let mut row = 0;
    while row + plan.least_rows <= rows {
        let own = key(row);
        if let Some(&from) = seen.get(&own) {
            let length = (0..rows - row)
                .take_while(|&k| alike(row + k, from + k))
                .count();
            let distance = row - from;
            let block = row..row + length;
            let is_block = length >= needed_anywhere
                && length <= distance
                && length >= needed(nearby(&block))
                && share(distance) - length as f64 / rows as f64 <= plan.periodic;
            // The end of a rejected block may begin another.
            row += if is_block {
                length
            } else {
                length.saturating_sub(plan.least_rows).max(1)
            };
            if is_block {
                found.push(Repeat { rows: block, from });
            }
            continue;
        } else {
            seen.insert(own, row);
        }
        row += 1;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use rlg_plan::RepeatPlan;

    /// Three noisy gyros in whole counts.
    fn gyros(size: f64) -> [Vec<f64>; 3] {
        let mut state = 3_u64;
        let mut noise = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / f64::from(1 << 24) - 0.5
        };
        [0, 1, 2].map(|_| (0..5000).map(|_| (size * noise()).round()).collect())
    }

    fn repeats(gyros: &[Vec<f64>; 3]) -> Vec<Repeat> {
        let channels = [0, 1, 2].map(|axis: usize| &gyros[axis][..]);
        find(&channels, &[true; 5000], &RepeatPlan::default())
    }

    #[test]
    fn a_buffer_written_twice_is_found_in_fine_and_coarse_records() {
        for size in [1e6, 20.0, 3.0] {
            let mut gyros = gyros(size);
            assert_eq!(repeats(&gyros), []);
            for values in &mut gyros {
                values.copy_within(1000..1128, 1128);
            }
            let found = repeats(&gyros);
            assert_eq!(found.len(), 1, "{size}");
            assert!(
                found[0].rows.start.abs_diff(1128) <= 2 && found[0].rows.end.abs_diff(1256) <= 2
            );
            assert_eq!(found[0].rows.start - found[0].from, 128);
        }
    }

    #[test]
    fn a_coarse_gyro_that_rests_for_a_while_repeats_nothing() {
        let mut gyros = gyros(20.0);
        for values in &mut gyros {
            for value in &mut values[2000..2400] {
                *value = (*value / 18.0).round();
            }
        }
        assert_eq!(repeats(&gyros), []);
        let steady = |row: usize| (row as f64 * 0.37).floor();
        for values in &mut gyros {
            for (row, value) in values[2000..2400].iter_mut().enumerate() {
                *value = steady(row + 1) - steady(row);
            }
        }
        assert_eq!(repeats(&gyros), []);
    }

    #[test]
    fn silence_and_periods_are_none() {
        assert_eq!(repeats(&gyros(0.4)), []);
        let period: [Vec<f64>; 3] = [0, 1, 2].map(|axis| {
            (0..5000)
                .map(|row| f64::from((row * (axis + 1)) % 100))
                .collect()
        });
        assert_eq!(repeats(&period), []);
    }
}
