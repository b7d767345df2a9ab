//! Noise and effects on a recording's own gyros.

use nalgebra::{UnitQuaternion, Vector3};
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;
use rlg_simulator::instrument::normal;

use super::base::Base;
use crate::marks::effects::{AXES, Effect};

/// Time of a block of the residual \[s\].
const BLOCK_S: f64 = 6.0;

/// Lays out a residual anew: contiguous blocks in another order, each turned by a rotation of its own, so that it goes with no
/// motion any more.
pub fn shuffled(
    residual_rad: &[Vector3<f64>],
    period_s: f64,
    rng: &mut ChaCha8Rng,
) -> Vec<Vector3<f64>> {
    let count = (residual_rad.len() as f64 * period_s / BLOCK_S)
        .round()
        .max(1.0);
    let length = (residual_rad.len() as f64 / count).ceil().max(1.0) as usize;
    let mut blocks: Vec<&[Vector3<f64>]> = residual_rad.chunks(length).collect();
    blocks.shuffle(rng);
    let mut all = Vec::with_capacity(residual_rad.len());
    for block in blocks {
        // Four normal numbers point anywhere on the sphere of quaternions.
        let [w, x, y, z] = std::array::from_fn(|_| normal(rng));
        let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        all.extend(block.iter().map(|row| turn * row));
    }
    all
}

/// What an effect adds to what the gyros sense \[rad by row\], by what they measured; nothing of what is the reference's.
pub fn added_rad(effect: &Effect, base: &Base) -> Vec<Vector3<f64>> {
    let motion = &base.sensed_motion_rad;
    let (period_s, rows) = (base.period_s, motion.len());
    let pair = |gyro: usize, other: usize| effect.value(&format!("{}{}", AXES[gyro], AXES[other]));
    // Sign and axis that a gyro senses when it tilts about another (physics.md, 1).
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

/// Rate of change of increments \[rad by row and second\] up to 20 Hz: a differentiator of 0.2 s, whose window is Blackman's.
fn growth(motion_rad: &[Vector3<f64>], period_s: f64) -> Vec<Vector3<f64>> {
    use std::f64::consts::PI;
    const HIGHEST_HZ: f64 = 20.0;
    const HALF_S: f64 = 0.1;
    let half = (HALF_S / period_s).round().max(2.0);
    let cut = 2.0 * PI * (HIGHEST_HZ * period_s).min(0.45);
    // The derivative of a low pass sin(c k)/(π k).
    let weight = |k: f64| {
        let place = PI * k / (half + 1.0);
        let window = 0.42 + 0.5 * place.cos() + 0.08 * (2.0 * place).cos();
        window * ((cut * k).cos() * cut / (PI * k) - (cut * k).sin() / (PI * k * k))
    };
    let weights: Vec<f64> = (1..=half as usize).map(|k| weight(k as f64)).collect();
    // What grows steadily grows by as much a second.
    let steady: f64 = weights
        .iter()
        .zip(1..)
        .map(|(weight, k)| 2.0 * weight * f64::from(k))
        .sum();
    let last = motion_rad.len() - 1;
    (0..=last)
        .map(|row| {
            let each = weights.iter().zip(1..);
            each.map(|(weight, k): (&f64, usize)| {
                let (before, after) = (row.saturating_sub(k), (row + k).min(last));
                (motion_rad[after] - motion_rad[before]) * (weight / steady / period_s)
            })
            .sum()
        })
        .collect()
}
