//! An encoder whose error repeats with the angle of its table.
//!
//! The reference's angle about an axis has + cos · cos nθ + sin · sin nθ, n the order, θ the table's angle since the
//! start (contract): the gyro sees the case, so the residual shows the increments of that error with the other sign.
//! θ is what the reference itself integrates to; where it also shows the Earth turning, θ is off by that turn.
//!
//! Each order on each axis is an effect of its own, and is looked for among all of them; a harmonic that has not
//! turned through half a period cannot be told from a scale error or its square and is not tried. Two terms of
//! [`Term`] stand for one effect, as for a line. The search sees blocks of rows: what repeats with a table's angle is
//! slow, and increments of the error telescope over a block without loss.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

use crate::diagnose::empirical::{Form, Term};
use crate::diagnose::information::stable_inverse;
use crate::diagnose::portion::{Bins, Portion, inner};
use crate::diagnose::scene::Scene;
use crate::diagnose::workbench::Workbench;

/// The contract's kind.
pub const KIND: &str = "reference_harmonic";

/// For a navigation engineer.
pub const LEFT_OUT: &str = "The reference is wrong, not the gyro: the encoder of the turntable has an error that repeats with the table's angle, as eccentricity, pole pairs or the lines of a scale make it.";

/// Encoders are known by few errors a turn: eccentricity (1, 2), magnet poles and gear teeth up to some dozens.
const HIGHEST_ORDER: u32 = 72;

/// Blocks a second, at least: white noise of angle hides everything faster in a pulsed gyro anyway.
const SLOWEST_BLOCKS_HZ: f64 = 50.0;

/// Blocks in one period of the fastest harmonic.
const BLOCKS_A_PERIOD: f64 = 4.0;

/// Angle of the table at the end of each row since its recording's start \[rad\].
fn table_rad(scene: &Scene, axis: usize) -> Vec<f64> {
    let streams = &scene.streams;
    let mut angles = Vec::with_capacity(streams.rows);
    for piece in &streams.pieces {
        let mut angle = 0.0;
        angles.extend(
            streams.case_rad[axis][piece.rows.clone()]
                .iter()
                .map(|increment| {
                    angle += increment;
                    angle
                }),
        );
    }
    angles
}

/// d(sensed increment)/d(cos or sin) of one harmonic.
pub fn column(scene: &Scene, axis: usize, order: u32, cosine: bool) -> Vec<f64> {
    let wave = |angle_rad: f64| {
        let turn = f64::from(order) * angle_rad;
        if cosine { turn.cos() } else { turn.sin() }
    };
    let sensed = -scene.sensing_from_body[(axis, axis)] / (1.0 - scene.scale_error[axis]);
    table_rad(scene, axis)
        .iter()
        .zip(&scene.streams.case_rad[axis])
        .map(|(end, increment)| sensed * (wave(*end) - wave(end - increment)))
        .collect()
}

/// A harmonic that stands out.
pub struct Harmonic {
    /// Its cosine and its sine.
    pub terms: [Term; 2],
    /// 2 Δ ln L.
    pub ratio: f64,
    /// Chance, all orders and axes counted.
    pub p_value: f64,
}

/// The best harmonic on each axis whose table turned far enough, in what is `left`.
pub fn harmonics(bench: &Workbench, left: &[Bins; 3]) -> Vec<Harmonic> {
    (0..3_usize)
        .into_par_iter()
        .filter_map(|axis| best_on(bench, &left[axis], axis))
        .collect()
}

fn best_on(bench: &Workbench, left: &Bins, axis: usize) -> Option<Harmonic> {
    let scene = bench.scene();
    let rate_hz = scene.streams.rate_hz;
    let angle_rad = table_rad(scene, axis);
    let seen = bench
        .portion
        .ranges
        .iter()
        .flat_map(|rows| &angle_rad[rows.clone()]);
    let (low, high) = seen.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), angle| {
        (low.min(*angle), high.max(*angle))
    });
    // Half a period of the order within what was turned through.
    let lowest_order = (PI / (high - low)).ceil();
    if lowest_order > f64::from(HIGHEST_ORDER) {
        return None;
    }
    let fastest_rad_s = scene.rate_rad_s[axis]
        .iter()
        .fold(0.0, |most: f64, rate| most.max(rate.abs()));
    let needed_hz = BLOCKS_A_PERIOD * f64::from(HIGHEST_ORDER) * fastest_rad_s / TAU;
    let block = (rate_hz / needed_hz.max(SLOWEST_BLOCKS_HZ))
        .floor()
        .max(1.0) as usize;
    let blocks = Blocks::new(bench, left, axis, block)?;
    let orders: Vec<u32> = (lowest_order as u32..=HIGHEST_ORDER).collect();
    let (order, ratio) = orders
        .iter()
        .map(|&order| (order, blocks.ratio(&angle_rad, order)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let trials = 3.0 * orders.len() as f64;
    let chance = (-0.5 * ratio).exp();
    Some(Harmonic {
        terms: [true, false].map(|cosine| Term {
            axis,
            form: Form::Harmonic { order, cosine },
        }),
        ratio,
        p_value: -(trials * (-chance).ln_1p()).exp_m1(),
    })
}

/// The residual of one gyro summed over blocks of rows.
struct Blocks {
    /// The rows at whose ends blocks begin and end, by stretch.
    edges: Vec<Vec<usize>>,
    portion: Portion,
    left: Bins,
    joints: Vec<Bins>,
    weights: Vec<f64>,
}

impl Blocks {
    fn new(bench: &Workbench, left: &Bins, axis: usize, block: usize) -> Option<Self> {
        let rows = bench.portion.rows_of(left);
        let mut edges = Vec::new();
        let mut sums = Vec::new();
        let mut ranges = Vec::new();
        let mut first = 0;
        for range in &bench.portion.ranges {
            let count = range.len() / block;
            ranges.push(sums.len()..sums.len() + count);
            for k in 0..count {
                let from = first + k * block;
                sums.push(rows[from..from + block].iter().sum::<f64>());
            }
            // A block begins where the row before it ends; the very first row of all stands in for its own beginning.
            let before = |k: usize| (range.start + k * block).saturating_sub(1);
            edges.push((0..=count).map(before).collect());
            first += range.len();
        }
        let noise = &bench.noise[axis];
        let portion = Portion::new(ranges, noise.rate_hz / block as f64)?;
        let portion = portion.within(bench.portion.band_hz);
        let weights = noise.of_blocks(block).weights(&portion);
        Some(Self {
            left: portion.transform(&sums),
            joints: portion.joints(),
            edges,
            weights,
            portion,
        })
    }

    /// 2 Δ ln L of the two waves of one order, jumps at the joints fitted away.
    fn ratio(&self, angle_rad: &[f64], order: u32) -> f64 {
        let waves = [f64::cos, f64::sin].map(|wave| {
            let rows: Vec<f64> = self
                .edges
                .iter()
                .flat_map(|edges| {
                    edges.windows(2).map(|ends| {
                        let at = |row: usize| wave(f64::from(order) * angle_rad[row]);
                        at(ends[1]) - at(ends[0])
                    })
                })
                .collect();
            self.portion.transform(&rows)
        });
        let columns: Vec<&Bins> = self.joints.iter().chain(&waves).collect();
        let gain = |columns: &[&Bins]| {
            let scale: Vec<f64> = columns
                .iter()
                .map(|bins| {
                    inner(bins, bins, &self.weights)
                        .max(f64::MIN_POSITIVE)
                        .sqrt()
                        .recip()
                })
                .collect();
            let gram = DMatrix::from_fn(columns.len(), columns.len(), |a, b| {
                inner(columns[a], columns[b], &self.weights) * scale[a] * scale[b]
            });
            let right = DVector::from_fn(columns.len(), |a, _| {
                inner(columns[a], &self.left, &self.weights) * scale[a]
            });
            right.dot(&(stable_inverse(&gram) * &right))
        };
        gain(&columns) - gain(&columns[..self.joints.len()])
    }
}
