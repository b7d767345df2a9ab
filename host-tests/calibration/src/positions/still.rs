//! Detection of the still positions of a moved unit from its accelerometers alone.
//!
//! Time is divided into blocks. A block is still if no accelerometer's variance exceeds that of the quiet blocks;
//! neighbouring still blocks with one direction of the force are a position (Tedaldi, Pretto and Menegatti 2014, sec.
//! III-C, with the threshold from the recording's own quiet blocks). The rows between positions are not used.

use rlg_plan::PositionPlan;
use std::ops::Range;

use nalgebra::Vector3;
use rlg_signal::accelerometer_rows::Rows;
use rlg_signal::quantiles::quantile;

/// Position: blocks of still rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Position {
    /// Rows from the first to the last still block; disturbed blocks within are left out of `blocks_m_s2`.
    pub rows: Range<usize>,
    /// Mean of each block \[m/s²\], x y z.
    pub blocks_m_s2: Vec<Vector3<f64>>,
}

impl Position {
    /// Mean over the blocks \[m/s²\].
    pub fn mean_m_s2(&self) -> Vector3<f64> {
        mean(&self.blocks_m_s2)
    }

    /// Sum of squared deviations of the blocks from their mean \[m²/s⁴\], x y z.
    pub fn scatter_m2_s4(&self) -> Vector3<f64> {
        squares_about_mean(&self.blocks_m_s2)
    }

    /// Half of the difference between the means of the second and the first half, along the force \[m/s²\]: as uncertain as
    /// the position's mean for white noise, larger by the drift within.
    pub fn half_difference_m_s2(&self) -> f64 {
        let (first, second) = self.blocks_m_s2.split_at(self.blocks_m_s2.len() / 2);
        0.5 * (mean(second) - mean(first)).dot(&self.mean_m_s2().normalize())
    }
}

fn mean(blocks: &[Vector3<f64>]) -> Vector3<f64> {
    let sum: Vector3<f64> = blocks.iter().sum();
    sum / blocks.len().max(1) as f64
}

/// Sum of squared deviations from the mean, by axis.
pub(super) fn squares_about_mean(blocks: &[Vector3<f64>]) -> Vector3<f64> {
    let mean = mean(blocks);
    let squares = blocks.iter().map(|one| (one - mean).map(|v| v * v));
    squares.sum()
}

/// Detected positions.
pub struct Found {
    /// Positions in the order of time.
    pub positions: Vec<Position>,
    /// Rows of a block.
    pub block_rows: usize,
    /// Stretches that were held long enough for a position, with too much scatter or rotation for one.
    pub restless: Vec<Range<usize>>,
}

/// One block.
struct Block {
    mean_m_s2: Vector3<f64>,
    variance: Vector3<f64>,
    rows: usize,
    is_measured: bool,
}

/// Finds the still positions.
pub fn find(rows: &Rows, plan: &PositionPlan) -> Found {
    let block_rows = ((plan.block_s * rows.rate_hz).round() as usize).max(plan.least_block_rows);
    let blocks: Vec<Block> = (0..rows.count / block_rows)
        .map(|block| Block::new(rows, block * block_rows..(block + 1) * block_rows))
        .collect();
    let digit = least_step_m_s2(rows);
    let quiet = quiet_variance(&blocks, plan.quiet_share);
    let quiet = Vector3::from_fn(|axis, _| quiet[axis].max(digit[axis].powi(2) / 12.0));
    let limit =
        plan.restless_ratio + plan.restless_deviations * (2.0 / (block_rows as f64 - 1.0)).sqrt();
    let scatters = |block: &Block| (0..3).any(|axis| block.variance[axis] > limit * quiet[axis]);
    let is_still: Vec<bool> = blocks
        .iter()
        .map(|block| block.is_measured && !scatters(block))
        .collect();
    let mut found = Found {
        positions: Vec::new(),
        block_rows,
        restless: Vec::new(),
    };
    let far = plan.same_direction_rad;
    let mut at: Vec<usize> = Vec::new();
    for (place, next) in blocks.iter().map(Some).chain([None]).enumerate() {
        let next = next.filter(|_| is_still[place]);
        let turns = |at: &[usize]| {
            let mean: Vector3<f64> = at.iter().map(|&one| blocks[one].mean_m_s2).sum();
            next.is_some_and(|next| next.mean_m_s2.angle(&mean) > far)
        };
        let is_over = place == blocks.len()
            || (next.is_some() && !at.is_empty() && turns(&at))
            || (next.is_none()
                && at
                    .last()
                    .is_some_and(|last| place - last > plan.most_knocked));
        if is_over && !at.is_empty() {
            found.take(&blocks, &at, plan);
            at.clear();
        }
        if next.is_some() {
            at.push(place);
        }
    }
    found.restless.extend(
        held(&blocks, &is_still, plan).map(|one| one.start * block_rows..one.end * block_rows),
    );
    found.restless.sort_by_key(|one| one.start);
    found
}

impl Found {
    /// Adds blocks as a position, if they are enough and do not rotate.
    fn take(&mut self, blocks: &[Block], at: &[usize], plan: &PositionPlan) {
        let rows = at[0] * self.block_rows..(at[at.len() - 1] + 1) * self.block_rows;
        let touched = plan.touched_blocks;
        let inner = match at.len() > plan.least_blocks + 2 * touched {
            true => &at[touched..at.len() - touched],
            false => at,
        };
        if inner.len() < plan.least_blocks {
            return;
        }
        let blocks_m_s2: Vec<Vector3<f64>> =
            inner.iter().map(|&one| blocks[one].mean_m_s2).collect();
        let ends = blocks_m_s2.len().div_ceil(plan.turning_parts);
        let first = mean(&blocks_m_s2[..ends]);
        let last = mean(&blocks_m_s2[blocks_m_s2.len() - ends..]);
        if first.angle(&last) > plan.turning_share * plan.same_direction_rad {
            self.restless.push(rows);
            return;
        }
        let rows = inner[0] * self.block_rows..(inner[inner.len() - 1] + 1) * self.block_rows;
        self.positions.push(Position { rows, blocks_m_s2 });
    }
}

impl Block {
    /// Standard deviation of the direction of the mean, from the scatter of the rows \[rad\].
    fn unsure_rad(&self) -> f64 {
        (self.variance.sum() / self.rows as f64).sqrt() / self.mean_m_s2.norm()
    }

    fn new(rows: &Rows, own: Range<usize>) -> Self {
        let count = own.len() as f64;
        let of = |axis: usize| rows.sensed_m_s[axis][own.clone()].iter();
        let sum = Vector3::from_fn(|axis, _| of(axis).sum::<f64>());
        let mean_m_s2 = sum / count * rows.rate_hz;
        let variance = Vector3::from_fn(|axis, _| {
            let away = of(axis).map(|one| (one * rows.rate_hz - mean_m_s2[axis]).powi(2));
            away.sum::<f64>() / (count - 1.0)
        });
        Self {
            mean_m_s2,
            variance,
            rows: own.len(),
            is_measured: rows.usable[own].iter().all(|usable| *usable),
        }
    }
}

/// Quantisation step of each accelerometer, x y z: least change from one row to the next \[m/s²\]. A quiet channel of
/// coarse resolution has no variance of its own.
fn least_step_m_s2(rows: &Rows) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| {
        let pairs = rows.sensed_m_s[axis].windows(2);
        let steps = pairs.map(|pair| (pair[1] - pair[0]).abs() * rows.rate_hz);
        // Rounding errors of the sums are no step.
        let steps = steps.filter(|step| *step > 1e-9);
        steps.fold(f64::INFINITY, f64::min)
    })
    .map(|step| if step.is_finite() { step } else { 0.0 })
}

/// Quantile `share` of the blocks' variance for each accelerometer, taken as that of a quiet block.
fn quiet_variance(blocks: &[Block], share: f64) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| {
        let measured = blocks.iter().filter(|block| block.is_measured);
        quantile(measured.map(|block| block.variance[axis]), share).unwrap_or(0.0)
    })
}

/// Runs of measured blocks that are too restless for a position although the force keeps its direction.
fn held<'a>(
    blocks: &'a [Block],
    is_still: &'a [bool],
    plan: &'a PositionPlan,
) -> impl Iterator<Item = Range<usize>> + 'a {
    let mut place = 0;
    let mut all = Vec::new();
    while place < blocks.len() {
        let first = &blocks[place];
        let stays = |block: &Block| {
            let turn_rad = block.mean_m_s2.angle(&first.mean_m_s2);
            turn_rad < plan.same_direction_rad + first.unsure_rad() + block.unsure_rad()
        };
        let run = blocks[place..].iter().zip(&is_still[place..]);
        let count = run
            .take_while(|(block, still)| block.is_measured && !**still && stays(block))
            .count();
        if count >= plan.least_blocks.max(plan.most_knocked + 1) {
            all.push(place..place + count);
        }
        place += count.max(1);
    }
    all.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rlg_plan::{AccelerometerRowsPlan, PositionPlan};
    use rlg_recording::{Channel, Clock, Quantity, Recording, Table};

    /// Rows of a recording at 20 Hz; samples by row, x y z.
    fn rows(of: impl Fn(usize) -> [f64; 3], count: usize) -> Rows {
        let channel = |axis: usize| Channel {
            column: String::new(),
            quantity: Quantity::SpecificForce,
            axis: Some(["x", "y", "z"][axis].to_string()),
            scale: 1.0,
            offset: 0.0,
            values: (0..count).map(|row| of(row)[axis]).collect(),
        };
        let (rate_hz, start_s) = (20.0, 0.0);
        let recording = Recording {
            name: String::new(),
            folder: std::path::PathBuf::new(),
            site: None,
            tables: vec![Table {
                file: String::new(),
                clock: Clock::Uniform { rate_hz, start_s },
                rows: count,
                channels: [0, 1, 2].map(channel).to_vec(),
            }],
            segments: Vec::new(),
        };
        let plan = AccelerometerRowsPlan::default();
        Rows::new(&recording, (rate_hz, start_s, count), &plan).expect("three accelerometers")
    }

    /// Deterministic noise: fractional parts of multiples of an irrational number.
    fn noise(row: usize, axis: usize) -> f64 {
        let digits = (row as f64 * 0.754_877_666 + axis as f64 * 0.569_840_29).fract();
        (digits - 0.5) * 0.01
    }

    /// Ten seconds up, two of motion, ten down with a knock of half a second in the middle.
    fn turned_over(row: usize) -> [f64; 3] {
        let force = match row {
            0..200 => 9.8,
            200..240 => (row as f64 * 1.3).sin() * 5.0,
            340..350 => -9.8 + (row as f64 * 1.3).sin() * 5.0,
            _ => -9.8,
        };
        [0, 1, 2].map(|axis| noise(row, axis) + if axis == 2 { force } else { 0.0 })
    }

    #[test]
    fn positions_are_found_with_what_is_knocked_left_out() {
        let plan = PositionPlan::default();
        let found = find(&rows(turned_over, 440), &plan);
        let [up, down] = found.positions.as_slice() else {
            panic!("{:?}", found.positions);
        };
        assert!(up.rows.end <= 200 && up.rows.len() >= 160, "{:?}", up.rows);
        assert!(
            down.rows.start >= 240 && down.rows.len() >= 160,
            "{:?}",
            down.rows
        );
        assert!((up.mean_m_s2().z - 9.8).abs() < 2e-3);
        // The knock is in no block.
        assert!(
            (down.mean_m_s2().z + 9.8).abs() < 2e-3,
            "{}",
            down.mean_m_s2()
        );
        assert!(found.restless.is_empty(), "{:?}", found.restless);
    }

    #[test]
    fn channels_of_few_digits_have_positions_too() {
        let digits = |row: usize| turned_over(row).map(|value| (value / 0.05).round() * 0.05);
        let found = find(&rows(digits, 440), &PositionPlan::default());
        assert_eq!(found.positions.len(), 2, "{:?}", found.positions);
    }

    #[test]
    fn what_is_held_and_shaken_is_restless_and_what_turns_is_no_position() {
        let shaken = |row: usize| {
            let mut read = turned_over(row);
            read[0] += if row >= 240 {
                (row as f64 * 2.0).sin()
            } else {
                0.0
            };
            read
        };
        let found = find(&rows(shaken, 440), &PositionPlan::default());
        assert_eq!(found.positions.len(), 1, "{:?}", found.positions);
        assert_eq!(found.restless.len(), 1, "{:?}", found.restless);
        assert!(found.restless[0].contains(&300), "{:?}", found.restless);
        // A degree and a half in ten seconds.
        let turning = |row: usize| {
            let mut read = turned_over(row);
            read[0] += if row >= 240 {
                (row as f64 - 240.0) * 1.3e-3
            } else {
                0.0
            };
            read
        };
        let found = find(&rows(turning, 440), &PositionPlan::default());
        let whole = found.positions.iter().filter(|one| one.rows.len() > 120);
        assert_eq!(whole.count(), 1, "{:?}", found.positions);
    }
}
