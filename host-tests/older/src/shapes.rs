//! Slow shapes of one gyro's rate that nothing listed has: a jump, a constant over a window, a decay, told from a
//! wandering rate (diagnosis road, step 12).
//!
//! Enters: the bench with a choice of effects, and a gyro. Leaves: terms, each ahead of every drift that could stand in
//! its place (wander.rs) by more than the best of all instants comes to by chance.
//!
//! A noise fit that has not yet seen a shape takes it for a random walk, a search under steady noise finds a dozen small
//! things that imitate it together, and one edge of a window is no step. So both edges are looked for at once, under
//! every drift, before anything else slow is believed. Deliberately not here: slow lines and ramps, which drift
//! imitates too well.

use nalgebra::{DMatrix, DMatrixView, DVector};
use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::ops::Range;

use super::drift;
use super::empirical::{Form, Term};
use super::local;
use super::slow;
use super::steps;
use super::wander::{Blocks, Drift, Wander};
use super::workbench::{Parameters, Workbench};

/// What a shape is held against.
pub(super) const HELD_AGAINST: [Drift; 2] = [Drift::Walk, Drift::Flicker];

/// More shapes than this on a gyro are drift.
const MOST_SHAPES: usize = 3;

/// ln of the likelihood by which each kind must be ahead of a wandering rate: of 15 000 simulated records of
/// white noise, walks and flicker of any strength the best jump came to 12.7, window to 17.7, two jumps to 17.8, decay to
/// 9.8
/// (`cargo test --release -p rlg --lib shapes::tests::how_far -- --ignored --nocapture`).
pub(super) const AHEAD_JUMP: f64 = 13.0;
pub(super) const AHEAD_WINDOW: f64 = 18.0;
pub(super) const AHEAD_DECAY: f64 = 10.5;

/// The same for two jumps of unlike sizes.
const AHEAD_TWO_JUMPS: f64 = 19.5;

/// Time constants \[s\] from the first, each by half an octave longer, up to half the span.
const SHORTEST_DECAY_S: f64 = 0.5;

/// Less of a shape than this beside what is fitted says nothing.
const OWN_SHARE: f64 = 0.05;

/// Blocks in the shortest window, and between an edge and the end of a recording.
const FEWEST_BLOCKS: usize = 2;

/// A found shape.
pub struct Shape {
    /// What describes it: one term, or the two jumps.
    pub terms: Vec<Term>,
    /// ln of the likelihood by which it is ahead.
    pub ahead: f64,
    /// Its chance were there white noise alone, all instants and gyros counted.
    pub p_value: f64,
}

/// What was looked at, in blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Jump(usize),
    Window(usize, usize),
    Jumps(usize, usize),
    Decay(usize),
}

impl Kind {
    fn needed(self) -> f64 {
        match self {
            Self::Jump(_) => AHEAD_JUMP,
            Self::Window(..) => AHEAD_WINDOW,
            Self::Jumps(..) => AHEAD_TWO_JUMPS,
            Self::Decay(_) => AHEAD_DECAY,
        }
    }
}

/// The shapes of one gyro beside a set and the terms on the bench, which is left as it was.
pub fn search(
    bench: &mut Workbench,
    parameters: &Parameters,
    set: &[usize],
    axis: usize,
) -> Result<Vec<Shape>, String> {
    let Some(blocks) = Blocks::of(bench, &HELD_AGAINST) else {
        return Ok(Vec::new());
    };
    let kept = bench.terms().len();
    let patterns = Patterns::new(&blocks, &|row| bench.scene().streams.since_start_s(row));
    let mut found: Vec<Shape> = Vec::new();
    while found.len() < MOST_SHAPES {
        let indices = drift::indices(bench, parameters, set);
        let (_, sums) = slow::sums(bench, &indices, axis, &blocks);
        let last = sums.ncols() - 1;
        let residual = sums.column(last).into_owned();
        let wanders = blocks.wanders(&bench.noise[axis], &residual);
        let Some((kind, ahead)) = patterns.best(&wanders, &sums.columns(0, last), &residual) else {
            break;
        };
        let mut terms = Vec::new();
        if let Kind::Decay(k) = kind {
            let expression = format!("decay({:.3})", patterns.constants_s[k]);
            terms.push(Term {
                axis,
                form: Form::Product { expression },
            });
            bench.add_term(terms[0].clone())?;
        }
        for rows in patterns.constants(kind, &blocks, bench) {
            let term = refined(bench, parameters, set, axis, rows, blocks.rows)?;
            bench.add_term(term.clone())?;
            terms.push(term);
        }
        let degrees = if terms.len() == 2 { 2.0 } else { 1.0 };
        let chance = ChiSquared::new(degrees).map_or(1.0, |law| law.sf(2.0 * ahead));
        let trials = 3.0 * patterns.count(kind);
        found.push(Shape {
            terms,
            ahead,
            p_value: -(trials * (-chance).ln_1p()).exp_m1(),
        });
    }
    while bench.terms().len() > kept {
        bench.remove_term(bench.terms().len() - 1);
    }
    Ok(found)
}

/// A constant over rows that are known to a block, to a row.
fn refined(
    bench: &mut Workbench,
    parameters: &Parameters,
    set: &[usize],
    axis: usize,
    rows: Range<usize>,
    within_rows: usize,
) -> Result<Term, String> {
    let roughly = constant(bench, axis, &rows);
    bench.add_term(roughly)?;
    let (indices, solution) = local::joint(bench, parameters, set);
    let fitted = indices.into_iter().zip(solution.values.iter().copied());
    let mut others: Vec<(usize, f64)> = fitted.collect();
    others.pop();
    let left = bench.left_over(&others);
    bench.remove_term(bench.terms().len() - 1);
    let rows = steps::refined(bench, axis, &left[axis], rows, 3 * within_rows / 2);
    Ok(constant(bench, axis, &rows))
}

/// 1 over some rows of a recording: a jump where they last until it ends.
fn constant(bench: &Workbench, axis: usize, rows: &Range<usize>) -> Term {
    let streams = &bench.scene().streams;
    let form = if rows.end == streams.end_of_recording(rows.start) {
        Form::Step {
            time_s: streams.start_s + rows.start as f64 / streams.rate_hz,
        }
    } else {
        Form::Product {
            expression: local::window(bench.scene(), rows),
        }
    };
    Term { axis, form }
}

/// Every shape as sums over blocks: of a jump at each block's start, and of each decay.
struct Patterns {
    jumps: DMatrix<f64>,
    decays: DMatrix<f64>,
    constants_s: Vec<f64>,
    recordings: Vec<usize>,
}

impl Patterns {
    /// `since_start_s` is a row's time from its recording's start.
    fn new(blocks: &Blocks, since_start_s: &dyn Fn(usize) -> f64) -> Self {
        let count = blocks.count();
        let of = &blocks.recordings;
        let since_s = |block: usize| {
            let rows = &blocks.scene_rows[block];
            since_start_s((rows.start + rows.end) / 2)
        };
        let span_s = (0..count).map(since_s).fold(0.0, f64::max);
        let constants_s: Vec<f64> = (0..)
            .map(|k| SHORTEST_DECAY_S * std::f64::consts::SQRT_2.powi(k))
            .take_while(|constant_s| *constant_s < 0.5 * span_s)
            .collect();
        let within = |a: usize, b: usize| f64::from(u8::from(of[a] == of[b]));
        Self {
            jumps: DMatrix::from_fn(count, count, |row, from| {
                let share = match row {
                    _ if row + 1 == from => blocks.spilt(),
                    _ if row == from => 1.0 - blocks.spilt(),
                    _ => f64::from(u8::from(row > from)),
                };
                share * within(row, from)
            }),
            decays: DMatrix::from_fn(count, constants_s.len(), |row, k| {
                (-since_s(row) / constants_s[k]).exp()
            }),
            constants_s,
            recordings: of.clone(),
        }
    }

    /// How many shapes of a kind there are.
    fn count(&self, kind: Kind) -> f64 {
        let blocks = self.recordings.len() as f64;
        match kind {
            Kind::Jump(_) => blocks,
            Kind::Window(..) | Kind::Jumps(..) => 0.5 * blocks * blocks,
            Kind::Decay(_) => self.constants_s.len() as f64,
        }
    }

    /// Whether a block can begin or end a shape.
    fn is_edge(&self, block: usize) -> bool {
        let own = self.recordings[block];
        let before = block.checked_sub(FEWEST_BLOCKS);
        let after = self.recordings.get(block + FEWEST_BLOCKS);
        before.is_some_and(|before| self.recordings[before] == own) && after == Some(&own)
    }

    /// What is furthest beyond what its kind needs, beside `known` columns; none where nothing is.
    fn best(
        &self,
        wanders: &[Wander],
        known: &DMatrixView<f64>,
        residual: &DVector<f64>,
    ) -> Option<(Kind, f64)> {
        let beyond = |found: &(Kind, f64)| found.1 - found.0.needed();
        self.furthest(wanders, known, residual)
            .into_iter()
            .filter(|found| beyond(found) > 0.0)
            .max_by(|a, b| beyond(a).total_cmp(&beyond(b)))
    }

    /// The best of each kind: jump, window, two jumps, decay; ln of the likelihood by which it is ahead.
    fn furthest(
        &self,
        wanders: &[Wander],
        known: &DMatrixView<f64>,
        residual: &DVector<f64>,
    ) -> [(Kind, f64); 4] {
        let each: Vec<(f64, [(Kind, f64); 4])> = wanders
            .par_iter()
            .map(|wander| self.under(wander, known, residual))
            .collect();
        let nothing = each.iter().map(|(nothing, _)| *nothing);
        let nothing = nothing.fold(f64::NEG_INFINITY, f64::max);
        std::array::from_fn(|slot| {
            let of_kind = each.iter().map(|(_, found)| found[slot]);
            let best = of_kind.max_by(|a, b| a.1.total_cmp(&b.1));
            let (kind, likelihood) = best.unwrap_or((Kind::Jump(0), f64::NEG_INFINITY));
            (kind, likelihood - nothing)
        })
    }

    /// ln of the likelihood under one drift of nothing, and of the best of each kind.
    fn under(
        &self,
        wander: &Wander,
        known: &DMatrixView<f64>,
        residual: &DVector<f64>,
    ) -> (f64, [(Kind, f64); 4]) {
        let (count, decays) = (self.jumps.ncols(), self.decays.ncols());
        let beside = known.ncols();
        // One solve for all: what is beside, the shapes, the residual.
        let mut all = DMatrix::zeros(count, beside + count + decays + 1);
        all.columns_mut(0, beside).copy_from(known);
        all.columns_mut(beside, count).copy_from(&self.jumps);
        all.columns_mut(beside + count, decays)
            .copy_from(&self.decays);
        all.set_column(beside + count + decays, residual);
        wander.whiten(&mut all);
        let whole = all.columns(beside, count + decays + 1);
        let whole_gram = whole.tr_mul(&whole);
        let gram = match directions(&all.columns(0, beside)) {
            Some(directions) => {
                let shadow = directions.tr_mul(&whole);
                &whole_gram - shadow.tr_mul(&shadow)
            }
            None => whole_gram.clone(),
        };
        let last = count + decays;
        let nothing = -0.5 * (wander.log_volume + gram[(last, last)]);
        let says = |place: usize| gram[(place, last)];
        let single = |place: usize| {
            let own = gram[(place, place)];
            let is_free = own > OWN_SHARE * whole_gram[(place, place)];
            is_free.then(|| 0.5 * says(place).powi(2) / own)
        };
        let kinds = [
            Kind::Jump(0),
            Kind::Window(0, 0),
            Kind::Jumps(0, 0),
            Kind::Decay(0),
        ];
        let mut best = kinds.map(|kind| (kind, nothing));
        let mut offer = |slot: usize, kind: Kind, gain: f64| {
            if nothing + gain > best[slot].1 {
                best[slot] = (kind, nothing + gain);
            }
        };
        for k in 0..decays {
            if let Some(gain) = single(count + k) {
                offer(3, Kind::Decay(k), gain);
            }
        }
        let edges: Vec<usize> = (0..count).filter(|&block| self.is_edge(block)).collect();
        for (place, &from) in edges.iter().enumerate() {
            if let Some(gain) = single(from) {
                offer(0, Kind::Jump(from), gain);
            }
            for &to in &edges[place + 1..] {
                if to < from + FEWEST_BLOCKS || self.recordings[to] != self.recordings[from] {
                    continue;
                }
                let [of_from, of_to] = [from, to].map(|edge| gram[(edge, edge)]);
                let both = gram[(from, to)];
                let difference = |gram: &DMatrix<f64>| {
                    gram[(from, from)] + gram[(to, to)] - 2.0 * gram[(from, to)]
                };
                let own = difference(&gram);
                if own < OWN_SHARE * difference(&whole_gram) {
                    continue;
                }
                let [b, c] = [says(from), says(to)];
                offer(1, Kind::Window(from, to), 0.5 * (b - c).powi(2) / own);
                let volume = of_from * of_to - both * both;
                if volume > 1e-3 * OWN_SHARE * of_from * of_to {
                    let gain = (b * b * of_to - 2.0 * b * c * both + c * c * of_from) / volume;
                    offer(2, Kind::Jumps(from, to), 0.5 * gain);
                }
            }
        }
        (nothing, best)
    }

    /// The scene's rows over which a kind is constant.
    fn constants(&self, kind: Kind, blocks: &Blocks, bench: &Workbench) -> Vec<Range<usize>> {
        let start = |block: usize| blocks.scene_rows[block].start;
        let jump = |block: usize| {
            let from = start(block);
            from..bench.scene().streams.end_of_recording(from)
        };
        match kind {
            Kind::Jump(from) => vec![jump(from)],
            Kind::Jumps(from, to) => vec![jump(from), jump(to)],
            Kind::Window(from, to) => std::iter::once(start(from)..start(to)).collect(),
            Kind::Decay(_) => Vec::new(),
        }
    }
}

/// Orthonormal directions of some columns; those that are none are left out.
fn directions(columns: &DMatrixView<f64>) -> Option<DMatrix<f64>> {
    const LEAST: f64 = 1e-9;
    if columns.ncols() == 0 {
        return None;
    }
    let parts = columns.clone_owned().svd(true, false);
    let least = LEAST * parts.singular_values.max();
    let all = parts.u?;
    let kept: Vec<usize> = (0..all.ncols())
        .filter(|&k| parts.singular_values[k] > least)
        .collect();
    Some(all.select_columns(&kept))
}
