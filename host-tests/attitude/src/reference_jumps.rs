//! Jumps of the reference: between two stamps its attitude turned and stayed so, and the gyros sensed nothing.
//!
//! One row of the increments is far from its neighbours. A stamp that is wrong by itself puts as much into the next row,
//! the other way round, and is no jump.

use crate::about::About;
use crate::block_sums::Statistic;
use crate::fitting::Fitting;
use crate::increments::Stamps;
use crate::outliers::{MEDIAN_CHI_SQUARED, Weighted};

/// A jump.
#[derive(Debug, Clone, Copy)]
pub struct Jump {
    /// First stamp after it.
    pub stamp: usize,
    /// Row in which it lies.
    pub row: usize,
    /// Navigation frame \[rad\].
    pub size_rad: [f64; 3],
    /// Standard deviation of each number \[rad\].
    pub std_rad: [f64; 3],
}

/// Most jumps: a reference with more is no reference.
const MOST: usize = 12;

/// Gain in log evidence of a jump over noise, less the price of its place.
const LEAST_GAIN: f64 = 10.0;

/// A jump is so many times larger, squared, than the largest row that is none.
const APART: f64 = 4.0;

/// Rows to either side that say how rough the reference is there.
const AROUND: usize = 20;

/// Marks rows in which the reference jumped; whether there are any.
pub fn find(about: &About, fitting: &Fitting, known: &mut Stamps) -> bool {
    let increments = &about.increments;
    let mut left_rad = fitting.left_rad(&increments.rows_rad);
    increments.silence_free(&mut left_rad, |_| true);
    let rough = roughness(&fitting.weighted(&left_rad, increments));
    let mut seen: Vec<(usize, f64)> = Vec::new();
    for _ in 0..=MOST {
        let weighted = fitting.weighted(&left_rad, increments);
        let deflated = |row: usize| weighted.of_jump(row) / rough[row];
        let rows = (0..increments.rows()).filter(|row| !increments.is_free(*row));
        let Some(row) = rows.max_by(|a, b| deflated(*a).total_cmp(&deflated(*b))) else {
            break;
        };
        let size = weighted.of_jump(row);
        let is_one_stamp = [row, row + 1]
            .into_iter()
            .any(|stamp| weighted.of_stamp(stamp) > size);
        seen.push((row, deflated(row)));
        let statistic = Statistic {
            squared_size: size,
            design_effect: rough[row],
            degrees: f64::INFINITY,
            count: 3,
        };
        let gain = statistic.gained(true) - (increments.rows() as f64).ln();
        if is_one_stamp || gain < LEAST_GAIN {
            break;
        }
        let jump_rad = weighted.jump_rad(row);
        for (left, jump) in left_rad.iter_mut().zip(jump_rad) {
            left[row] -= jump;
        }
    }
    // What goes over into the noise's own tail is noise.
    let apart = seen
        .windows(2)
        .rposition(|pair| pair[0].1 > APART * pair[1].1);
    let count = apart.map_or(0, |last| last + 1);
    for (row, _) in &seen[..count] {
        known.jumped[increments.stamps[row + 1]] = true;
    }
    count > 0
}

/// Sizes of the jumps that are marked, by what the fit leaves of their rows.
pub fn sizes(about: &About, fitting: &Fitting, known: &Stamps) -> Vec<Jump> {
    let increments = &about.increments;
    let left_rad = fitting.left_rad(&increments.rows_rad);
    let pairs = increments.stamps.windows(2).enumerate();
    let jumped = pairs.filter(|(_, pair)| known.jumped[pair[0] + 1..=pair[1]].contains(&true));
    jumped
        .map(|(row, pair)| {
            let mut alone = left_rad.clone();
            increments.silence_free(&mut alone, |free| free != row);
            let weighted = fitting.weighted(&alone, increments);
            Jump {
                stamp: pair[1],
                row,
                size_rad: weighted.jump_rad(row),
                std_rad: weighted.jump_std_rad(row),
            }
        })
        .collect()
}

/// What jumps gain typically about each row, over what noise lets expect; at least 1.
fn roughness(weighted: &Weighted) -> Vec<f64> {
    let rows = weighted.rows();
    let all: Vec<f64> = (0..rows).map(|row| weighted.of_jump(row)).collect();
    (0..rows)
        .map(|row| {
            let from = row.saturating_sub(AROUND);
            let mut near = all[from..(row + AROUND + 1).min(rows)].to_vec();
            let middle = near.len() / 2;
            (*near.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN_CHI_SQUARED).max(1.0)
        })
        .collect()
}
