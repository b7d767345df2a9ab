//! Permutation of a reference's own errors, and effects on a recording's own gyros.

use nalgebra::{UnitQuaternion, Vector3};
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;
use rlg_simulator::instrument::normal;

use super::base::Base;
use crate::marks::effects::{AXES, Effect};

/// Length of a block of errors, and of its ends, which are joined to those of its neighbours \[s\].
const BLOCK_S: f64 = 6.0;
const END_S: f64 = 0.3;

/// Permutes attitude errors in contiguous blocks, each with a random rotation, so that they are uncorrelated with the
/// motion (block permutation). Blocks are offset so that the means of their ends are equal.
pub fn shuffled(
    errors_rad: &[Vector3<f64>],
    stamp_s: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<Vector3<f64>> {
    let count = (errors_rad.len() as f64 * stamp_s / BLOCK_S)
        .round()
        .max(1.0);
    let length = (errors_rad.len() as f64 / count).ceil().max(1.0) as usize;
    let end = ((END_S / stamp_s).round() as usize).clamp(1, length);
    let mean = |rows: &[Vector3<f64>]| rows.iter().sum::<Vector3<f64>>() / rows.len() as f64;
    let mut blocks: Vec<&[Vector3<f64>]> = errors_rad.chunks(length).collect();
    blocks.shuffle(rng);
    let mut all: Vec<Vector3<f64>> = Vec::with_capacity(errors_rad.len());
    for block in blocks {
        // Four normal numbers give a uniform direction on the unit quaternion sphere.
        let [w, x, y, z] = std::array::from_fn(|_| normal(rng));
        let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        let turned: Vec<Vector3<f64>> = block.iter().map(|row| turn * row).collect();
        let begins = mean(&turned[..end.min(turned.len())]);
        let ends = match all.len() {
            0 => begins,
            laid => mean(&all[laid.saturating_sub(end)..]),
        };
        all.extend(turned.iter().map(|row| row + ends - begins));
    }
    all
}

/// Effect on the gyros' increments \[rad by row\], from the measured ones; zero for an effect of the reference.
pub fn added_rad(effect: &Effect, base: &Base) -> Vec<Vector3<f64>> {
    let motion = &base.sensed_motion_rad;
    let (period_s, rows) = (base.period_s, motion.len());
    let pair = |gyro: usize, other: usize| effect.value(&format!("{}{}", AXES[gyro], AXES[other]));
    // Sign and axis sensed by a gyro tilted about another axis.
    let tilts = |gyro: usize| {
        let others = (0..3).filter(move |about| *about != gyro);
        others.map(move |about| {
            let sign = if (about + 1) % 3 == gyro { 1.0 } else { -1.0 };
            (about, sign, 3 - gyro - about)
        })
    };
    match effect.kind {
        "gyro_scale" => motion
            .iter()
            .map(|row| row.component_mul(&effect.by_axis()))
            .collect(),
        "installation" => {
            let sensed = |row: &Vector3<f64>, gyro| -> f64 {
                tilts(gyro)
                    .map(|(about, sign, k)| sign * pair(gyro, about) * row[k])
                    .sum()
            };
            motion
                .iter()
                .map(|row| Vector3::from_fn(|gyro, _| sensed(row, gyro)))
                .collect()
        }
        "gyro_g_bias" => {
            let force = base.force_m_s2.iter();
            let sensed = |force: &Vector3<f64>, gyro| -> f64 {
                (0..3)
                    .map(|axis| pair(gyro, axis) * force[axis])
                    .sum::<f64>()
                    * period_s
            };
            force
                .map(|force| Vector3::from_fn(|gyro, _| sensed(force, gyro)))
                .collect()
        }
        "axis_flexure" => {
            let growth = growth(motion, period_s);
            let sensed = |row: usize, gyro| -> f64 {
                let each = tilts(gyro);
                each.map(|(about, sign, k)| {
                    -sign * pair(gyro, about) * growth[row][about] / period_s * motion[row][k]
                })
                .sum()
            };
            (0..rows)
                .map(|row| Vector3::from_fn(|gyro, _| sensed(row, gyro)))
                .collect()
        }
        _ => vec![Vector3::zeros(); rows],
    }
}

/// Derivative of increments \[rad per row and second\], by central differences of the fourth order.
fn growth(motion_rad: &[Vector3<f64>], period_s: f64) -> Vec<Vector3<f64>> {
    let last = motion_rad.len() - 1;
    let across = |row: usize, by: usize| {
        motion_rad[(row + by).min(last)] - motion_rad[row.saturating_sub(by)]
    };
    (0..=last)
        .map(|row| (8.0 * across(row, 1) - across(row, 2)) / (12.0 * period_s))
        .collect()
}
