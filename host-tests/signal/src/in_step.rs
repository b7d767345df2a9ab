//! Tests if the residual's power depends on the motion: noise is independent of the rate of the unit.
//!
//! Enter: mean squares of residual and motion, by blocks of time. Leaves: [`InStep`], where the residual is larger while the
//! unit moves, with the size of its dependent part as a share of the motion.
//!
//! # Measure
//! The residual has the power a + b m in a block whose motion has the power m, a and b ≥ 0, fitted by maximum likelihood of
//! a gamma law. Blocks are correlated with their neighbours, so significance is that among circular shifts of the motion
//! against the residual in the same record (surrogate test: Theiler et al., Physica D 58, 1992).

use rlg_plan::InStepPlan;
use std::ops::Range;

use crate::axes::Triad;

/// Mean squares of a block of time.
#[derive(Debug, Clone, Copy)]
pub struct Block {
    /// Mean square of the residual \[rad²\].
    pub left: f64,
    /// Mean square of the motion over the same time \[rad²\].
    pub motion: f64,
}

/// Mean squares by blocks of time, of sums of rows.
///
/// # Inputs
/// `left_rad`, `motion_rad`: residual and motion by row of `period_s`, the motion without noise common to the residual;
/// `is_used`: rows with both known.
pub fn blocks(
    left_rad: &Triad,
    motion_rad: &Triad,
    is_used: impl Fn(usize) -> bool,
    period_s: f64,
    plan: &InStepPlan,
) -> Vec<Block> {
    let rows = left_rad[0].len();
    let summed = ((plan.summed_s / period_s).round() as usize).max(1);
    let square = |of: &Triad, rows: &Range<usize>| -> f64 {
        let sums = of.iter().map(|axis| axis[rows.clone()].iter().sum::<f64>());
        sums.map(|sum| sum * sum).sum()
    };
    let sums: Vec<Block> = (0..rows / summed)
        .map(|sum| sum * summed..(sum + 1) * summed)
        .filter(|rows| rows.clone().all(&is_used))
        .map(|rows| Block {
            left: square(left_rad, &rows),
            motion: square(motion_rad, &rows),
        })
        .collect();
    let joined = ((plan.block_s / (period_s * summed as f64)) as usize)
        .max(plan.least_sums)
        .max(sums.len() / plan.most_blocks);
    let blocks = sums.chunks_exact(joined).map(|block| {
        let mean = |of: fn(&Block) -> f64| block.iter().map(of).sum::<f64>() / joined as f64;
        Block {
            left: mean(|one| one.left),
            motion: mean(|one| one.motion),
        }
    });
    blocks.collect()
}

/// Ratio of the root mean squares of residual and motion \[1\]; `None` where the motion is smaller.
pub fn share_left(blocks: &[Block]) -> Option<f64> {
    let sum = |of: fn(&Block) -> f64| blocks.iter().map(of).sum::<f64>();
    let (left, motion) = (sum(|one| one.left), sum(|one| one.motion));
    (motion > left).then(|| (left / motion).sqrt())
}

/// A residual in step with the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InStep {
    /// Root mean square of the part in step over that of the motion \[1\].
    pub share: f64,
    /// Part of the residual's power in step with the motion \[1\].
    pub part: f64,
    /// Residual power in the quarter of the blocks with the largest motion over that in the quarter with the least \[1\].
    pub moving_over_still: f64,
}

/// Tests the residual against the motion.
pub fn in_step(blocks: &[Block], plan: &InStepPlan) -> Option<InStep> {
    let count = blocks.len();
    let mean = |of: fn(&Block) -> f64| blocks.iter().map(of).sum::<f64>() / count as f64;
    let (left, motion) = (mean(|one| one.left), mean(|one| one.motion));
    if count < plan.least_blocks || left <= 0.0 || motion <= 0.0 {
        return None;
    }
    let of_left: Vec<f64> = blocks.iter().map(|one| one.left / left).collect();
    let of_motion: Vec<f64> = blocks.iter().map(|one| one.motion / motion).collect();
    let (part, gain) = likeliest(&of_left, &of_motion);
    let share = (part * left / motion).sqrt();
    if part < plan.least_part || share < plan.least_share {
        return None;
    }
    let apart = (count / plan.record_over_turn).max(1);
    let turns = (apart..=count - apart).step_by(count.div_ceil(plan.most_turns));
    let tried = turns.clone().count() as f64;
    let as_much = turns.filter(|turn| {
        let mut turned = of_motion.clone();
        turned.rotate_left(*turn);
        likeliest(&of_left, &turned).1 >= gain
    });
    if as_much.count() as f64 > plan.chance * tried {
        return None;
    }
    let mut by_motion: Vec<&Block> = blocks.iter().collect();
    by_motion.sort_by(|a, b| a.motion.total_cmp(&b.motion));
    let quarter = count / 4;
    let sum = |of: &[&Block]| of.iter().map(|one| one.left).sum::<f64>();
    let still = sum(&by_motion[..quarter]).max(f64::MIN_POSITIVE);
    Some(InStep {
        share,
        part,
        moving_over_still: sum(&by_motion[count - quarter..]) / still,
    })
}

/// Maximum-likelihood part of the power in step with the motion, and its log-likelihood gain over a constant power; both
/// inputs have mean 1.
fn likeliest(left: &[f64], motion: &[f64]) -> (f64, f64) {
    /// Multiplicative updates: monotone from any start.
    const STEPS: usize = 40;
    let [mut level, mut slope] = [0.5, 0.5];
    let pairs = || left.iter().zip(motion);
    let power = |level: f64, slope: f64, motion: f64| level + slope * motion;
    for _ in 0..STEPS {
        let [mut of_level, mut of_slope] = [[0.0; 2]; 2];
        for (left, motion) in pairs() {
            let power = power(level, slope, *motion).max(f64::MIN_POSITIVE);
            let excess = left / (power * power);
            of_level = [of_level[0] + excess, of_level[1] + 1.0 / power];
            of_slope = [of_slope[0] + motion * excess, of_slope[1] + motion / power];
        }
        level *= of_level[0] / of_level[1];
        slope *= of_slope[0] / of_slope[1];
    }
    let each = pairs().map(|(left, motion)| {
        let power = power(level, slope, *motion).max(f64::MIN_POSITIVE);
        1.0 - power.ln() - left / power
    });
    (slope / (level + slope), each.sum())
}

#[cfg(test)]
mod tests {
    use super::{Block, in_step};
    use rlg_plan::InStepPlan;

    /// Sum of six squared uniform numbers, of mean 1, by a congruential generator.
    fn scatter(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        let mut even = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as f64 / f64::from(1_u32 << 31)
        };
        move || (0..6).map(|_| (even() - 0.5).powi(2) * 2.0).sum()
    }

    /// Blocks of a unit that moves for 5 of every 12 s, the more the later.
    fn blocks(level: f64, share: f64, seed: u64) -> Vec<Block> {
        let mut scatter = scatter(seed);
        let block = |second: u32| {
            let moves = if second % 12 < 5 {
                f64::from(second)
            } else {
                0.01
            };
            let motion = moves * scatter();
            Block {
                motion,
                left: (level + share * share * motion) * scatter(),
            }
        };
        (0..120).map(block).collect()
    }

    #[test]
    fn what_moves_with_the_motion_is_found_with_its_share() {
        for seed in 0..20 {
            let found = in_step(&blocks(1e-4, 0.03, seed), &InStepPlan::default());
            let found = found.expect("in step");
            assert!((0.6..1.5).contains(&(found.share / 0.03)), "{found:?}");
            assert!(found.moving_over_still > 10.0, "{found:?}");
        }
    }

    #[test]
    fn noise_of_its_own_is_in_step_with_nothing() {
        let found =
            (0..200).filter_map(|seed| in_step(&blocks(1e-4, 0.0, seed), &InStepPlan::default()));
        assert_eq!(found.count(), 0);
        let steady: Vec<Block> = blocks(1e-4, 0.0, 7)
            .into_iter()
            .map(|one| Block { motion: 1.0, ..one })
            .collect();
        assert_eq!(in_step(&steady, &InStepPlan::default()), None);
    }
}
