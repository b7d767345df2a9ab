//! Finds blocks of rows that repeat earlier rows exactly, as a recorder that writes a buffer twice leaves them.
//!
//! How often two rows are alike by chance is read from the record: coarse gyros at rest repeat short blocks by
//! themselves, and a record that repeats itself all the time is periodic, not faulty.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

/// What a repeated block looks like.
#[derive(Debug, Clone, Copy)]
pub struct RepeatPlan {
    /// Chance of a block anywhere in the record below which it is a fault.
    pub chance: f64,
    /// Least rows of a block.
    pub least_rows: usize,
    /// Largest share of the other rows that may be alike at the block's own distance \[1\].
    pub periodic: f64,
    /// Largest chance of two rows that are alike \[1\]: a coarser record repeats itself.
    pub most_alike: f64,
}

impl Default for RepeatPlan {
    fn default() -> Self {
        Self {
            chance: 1e-9,
            least_rows: 8,
            periodic: 0.05,
            most_alike: 0.9,
        }
    }
}

/// A block with the row that it repeats.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Repeat {
    /// The second time.
    pub rows: Range<usize>,
    /// First row of the first time.
    pub from: usize,
}

/// Distances at which rows are compared for the chance that they are alike.
const DISTANCES: [usize; 8] = [1, 2, 3, 5, 11, 37, 101, 331];

/// Finds the repeats in channels of one recorder, in rows that are `usable`.
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
    let by_chance = DISTANCES
        .iter()
        .map(|&distance| share(distance))
        .fold(0.0, f64::max);
    if by_chance > plan.most_alike || rows < 2 * plan.least_rows {
        return Vec::new();
    }
    // Even a fine channel is not alike by chance less than once in its rows.
    let by_chance = by_chance.max(1.0 / rows as f64);
    let pairs = (rows as f64).powi(2);
    let needed = ((plan.chance / pairs).ln() / by_chance.ln()).ceil() as usize;
    let needed = needed.max(plan.least_rows);
    // What only hashes alike is none: the rows are compared.
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
            let is_block = length >= needed && length <= distance;
            if is_block && share(distance) - length as f64 / rows as f64 <= plan.periodic {
                found.push(Repeat {
                    rows: row..row + length,
                    from,
                });
                row += length;
                continue;
            }
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
