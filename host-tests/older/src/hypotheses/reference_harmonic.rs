//! An encoder whose error repeats with the angle of its table.
//!
//! The reference's angle about an axis has + cos · cos nθ + sin · sin nθ, n the order, θ the table's angle since the
//! start (contract): the gyro sees the case, so the residual shows the increments of that error with the other sign.
//! θ is what the reference itself integrates to; where it also shows the Earth turning, θ is off by that turn.
//!
//! Each order on each axis is an effect of its own, and is looked for among all of them. A harmonic that has not turned
//! through half a period is the angle and its square, whatever its order: a scale error explains the first as well, so
//! one is in the other's class, and the order has a spread. Two terms of [`Term`] stand for one effect, as for a line. The
//! order is searched for in blocks of rows, over which increments of the error telescope: what repeats with a table's
//! angle is slow. Their edges are soft, as those of wander.rs; the best is weighed by rows.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::f64::consts::TAU;

use crate::empirical::{Form, Term};
use crate::information::stable_inverse;
use crate::portion::{Bins, Portion, inner};
use crate::scene::Scene;
use crate::wander::{soft, sums_between_soft_edges};
use crate::workbench::Workbench;

/// The contract's kind.
pub const KIND: &str = "reference_harmonic";

/// For a navigation engineer.
pub const LEFT_OUT: &str = "The reference is wrong, not the gyro: the encoder of the turntable has an error that repeats with the table's angle, as eccentricity, pole pairs or the lines of a scale make it.";

/// Encoders are known by few errors a turn: eccentricity (1, 2), magnet poles and gear teeth up to some dozens.
const HIGHEST_ORDER: u32 = 72;

/// No encoder's reading goes wrong by more than a hundredth of what its table turns: `order` times its waves \[rad\].
const MOST: f64 = 1e-2;

/// The largest wave of an order \[rad\].
pub fn most_rad(order: u32) -> f64 {
    MOST / f64::from(order)
}

/// Blocks a second, at least, where the order is looked for; the best is then weighed by rows.
const SEARCHED_HZ: f64 = 50.0;

/// The same where orders are weighed against each other.
const WEIGHED_HZ: f64 = 400.0;

/// Blocks in one period of the fastest harmonic.
const BLOCKS_A_PERIOD: f64 = 4.0;

/// What a table turns by in each row, and its angle at the row's end since its recording's start \[rad\]: read as the
/// motion is for every effect, or the reference's own noise would pass for a wave.
fn turned_rad(scene: &Scene, axis: usize) -> (Vec<f64>, Vec<f64>) {
    let increments = scene.case_ahead_rad(axis, 0, 0.0);
    let mut ends = Vec::with_capacity(increments.len());
    for piece in &scene.streams.pieces {
        let mut angle = 0.0;
        ends.extend(increments[piece.rows.clone()].iter().map(|increment| {
            angle += increment;
            angle
        }));
    }
    (increments, ends)
}

/// Increments of one wave of the table's angle \[1\]: what the reference reads beyond the case, per rad of `cos` or
/// `sin`.
pub fn wave(scene: &Scene, axis: usize, order: u32, cosine: bool) -> Vec<f64> {
    let wave = |angle_rad: f64| {
        let turn = f64::from(order) * angle_rad;
        if cosine { turn.cos() } else { turn.sin() }
    };
    let (increments, ends) = turned_rad(scene, axis);
    let rows = ends.iter().zip(&increments);
    rows.map(|(end, increment)| wave(*end) - wave(end - increment))
        .collect()
}

/// d(sensed increment)/d(cos or sin) of one harmonic.
pub fn column(scene: &Scene, axis: usize, order: u32, cosine: bool) -> Vec<f64> {
    let sensed = -scene.sensing_from_body[(axis, axis)] / (1.0 - scene.scale_error[axis]);
    let mut column = wave(scene, axis, order, cosine);
    column.iter_mut().for_each(|value| *value *= sensed);
    column
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

/// The best harmonic on each axis, in what is `left`.
pub fn harmonics(bench: &Workbench, left: &[Bins; 3]) -> Vec<Harmonic> {
    (0..3_usize)
        .into_par_iter()
        .filter_map(|axis| best_on(bench, &left[axis], axis))
        .collect()
}

fn best_on(bench: &Workbench, left: &Bins, axis: usize) -> Option<Harmonic> {
    let table = Table::new(bench, left, axis)?;
    let searched = table.blocks(bench, SEARCHED_HZ)?;
    let ratios = (1..=HIGHEST_ORDER).map(|order| (order, searched.ratio(&table, order)));
    let (best, _) = ratios.max_by(|a, b| a.1.total_cmp(&b.1))?;
    // By rows: vibration is faster than blocks are; what it turns through is small, and all orders are alike.
    let weighed = Blocks::new(bench, &table.left_rad, axis, 1)?;
    let (order, ratio) = [best, 1]
        .map(|order| (order, weighed.ratio(&table, order)))
        .into_iter()
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let trials = 3.0 * f64::from(HIGHEST_ORDER);
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

/// Spread of the order \[1\] about `order`, all orders as probable before: `left` still holds the harmonic.
pub fn spread_of_order(bench: &Workbench, left: &Bins, axis: usize, order: u32) -> f64 {
    let Some(table) = Table::new(bench, left, axis) else {
        return 0.0;
    };
    let Some(blocks) = table.blocks(bench, WEIGHED_HZ) else {
        return 0.0;
    };
    let of = |other| (other, blocks.ratio(&table, other));
    let ratios: Vec<(u32, f64)> = (1..=HIGHEST_ORDER).map(of).collect();
    let best = ratios.iter().fold(0.0, |best: f64, one| best.max(one.1));
    let [mut whole, mut squares] = [0.0; 2];
    for (other, ratio) in ratios {
        let weight = (0.5 * (ratio - best)).exp();
        whole += weight;
        squares += weight * (f64::from(other) - f64::from(order)).powi(2);
    }
    (squares / whole.max(f64::MIN_POSITIVE)).sqrt()
}

/// One axis of the table, and what is left of its gyro.
struct Table {
    axis: usize,
    /// By row of the scene \[rad\].
    angle_rad: Vec<f64>,
    fastest_rad_s: f64,
    /// By row of the portion \[rad\].
    left_rad: Vec<f64>,
}

impl Table {
    /// `None` where the table does not turn.
    fn new(bench: &Workbench, left: &Bins, axis: usize) -> Option<Self> {
        let scene = bench.scene();
        let fastest_rad_s = scene.rate_rad_s[axis]
            .iter()
            .fold(0.0, |most: f64, rate| most.max(rate.abs()));
        (fastest_rad_s > 0.0).then(|| Self {
            axis,
            angle_rad: turned_rad(scene, axis).1,
            fastest_rad_s,
            left_rad: bench.portion.rows_of(left),
        })
    }

    /// Blocks of which there are `least_hz`, or as many as the fastest wave needs.
    fn blocks(&self, bench: &Workbench, least_hz: f64) -> Option<Blocks> {
        let needed_hz = BLOCKS_A_PERIOD * f64::from(HIGHEST_ORDER) * self.fastest_rad_s / TAU;
        let rate_hz = bench.scene().streams.rate_hz;
        let block = (rate_hz / needed_hz.max(least_hz)).floor().max(1.0) as usize;
        Blocks::new(bench, &self.left_rad, self.axis, block)
    }
}

/// The residual of one gyro summed over blocks of rows.
struct Blocks {
    /// The rows at whose ends blocks begin and end, by stretch.
    edges: Vec<Vec<usize>>,
    portion: Portion,
    left: Bins,
    /// Jumps at the joints, what they say of each other and of what is left.
    joints: Vec<Bins>,
    of_joints: DMatrix<f64>,
    left_of_joints: DVector<f64>,
    weights: Vec<f64>,
}

impl Blocks {
    fn new(bench: &Workbench, left_rad: &[f64], axis: usize, block: usize) -> Option<Self> {
        let mut edges = Vec::new();
        let mut sums = Vec::new();
        let mut ranges = Vec::new();
        let soft = soft(block);
        let mut first = 0;
        for range in &bench.portion.ranges {
            let count = range.len().saturating_sub(2 * soft) / block;
            ranges.push(sums.len()..sums.len() + count);
            let stretch_rad = &left_rad[first..first + range.len()];
            let edge = |k: usize| soft + k * block;
            let places = (0..count).map(|k| edge(k)..edge(k + 1));
            sums.extend(sums_between_soft_edges(stretch_rad, soft, places));
            // A block begins where the row before it ends; the very first row of all stands in for its own beginning.
            let before = |k: usize| (range.start + edge(k)).saturating_sub(1);
            edges.push((0..=count).map(before).collect());
            first += range.len();
        }
        let noise = &bench.noise[axis];
        let portion = Portion::new(ranges, noise.rate_hz / block as f64)?;
        let portion = portion.within(bench.portion.band_hz);
        let mut of_blocks = noise.of_blocks(block);
        of_blocks.theta[1] /= (2 * soft).max(1) as f64;
        let weights = of_blocks.weights(&portion);
        let (left, joints) = (portion.transform(&sums), portion.joints());
        let count = joints.len();
        Some(Self {
            of_joints: DMatrix::from_fn(count, count, |a, b| {
                inner(&joints[a], &joints[b], &weights)
            }),
            left_of_joints: DVector::from_fn(count, |a, _| inner(&joints[a], &left, &weights)),
            left,
            joints,
            edges,
            weights,
            portion,
        })
    }

    /// 2 Δ ln L of the two waves of one order, jumps at the joints fitted away; zero where they would have to be larger
    /// than any encoder's.
    fn ratio(&self, table: &Table, order: u32) -> f64 {
        let waves = [f64::cos, f64::sin].map(|wave| {
            let rows: Vec<f64> = self
                .edges
                .iter()
                .flat_map(|edges| {
                    edges.windows(2).map(|ends| {
                        let at = |row: usize| wave(f64::from(order) * table.angle_rad[row]);
                        at(ends[1]) - at(ends[0])
                    })
                })
                .collect();
            self.portion.transform(&rows)
        });
        let free = self.joints.len();
        let count = free + waves.len();
        let of = |a: &Bins, b: &Bins| inner(a, b, &self.weights);
        let of_places = |a: usize, b: usize| match (a.checked_sub(free), b.checked_sub(free)) {
            (None, None) => self.of_joints[(a, b)],
            (Some(wave), None) => of(&waves[wave], &self.joints[b]),
            (None, Some(wave)) => of(&self.joints[a], &waves[wave]),
            // What the data do not show of a wave is not there.
            (Some(one), Some(other)) if one == other => {
                of(&waves[one], &waves[other]) + most_rad(order).powi(-2)
            }
            (Some(one), Some(other)) => of(&waves[one], &waves[other]),
        };
        let gram = DMatrix::from_fn(count, count, of_places);
        let scale = gram.diagonal();
        let scale = scale.map(|own| own.max(f64::MIN_POSITIVE).sqrt().recip());
        let gram = DMatrix::from_fn(count, count, |a, b| gram[(a, b)] * scale[a] * scale[b]);
        let right = DVector::from_fn(count, |a, _| {
            scale[a]
                * match a.checked_sub(free) {
                    None => self.left_of_joints[a],
                    Some(wave) => of(&waves[wave], &self.left),
                }
        });
        let fit = stable_inverse(&gram) * &right;
        let amplitude_rad = (fit[free] * scale[free]).hypot(fit[free + 1] * scale[free + 1]);
        if amplitude_rad > most_rad(order) {
            return 0.0;
        }
        let joints = right.rows(0, free).into_owned();
        let without = stable_inverse(&gram.view((0, 0), (free, free)).into_owned()) * &joints;
        right.dot(&fit) - joints.dot(&without)
    }
}
