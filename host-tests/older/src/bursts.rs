//! Rates that last for a moment: longer than a slip, shorter than a regime.
//!
//! Enters: what is left of a gyro's residual, in bins, and its noise. Leaves: what a matched filter of a run of rows says
//! of every run (`Matched`), and the run that explains most as a window ([`bursts`]), every run counted as a trial.
//!
//! With K the transform of 1/S, a constant over rows a to b shows as the sum of the residual's matched filter over them,
//! with the variance Σ K(i − j) over both.

use rayon::prelude::*;
use realfft::num_complex::Complex64;
use std::f64::consts::SQRT_2;

use super::empirical::{Form, Term};
use super::events::{Event, coarsest_rad, event, guarded, least_pulses};
use super::hunt::PLAINER;
use super::local;
use super::portion::Bins;
use super::workbench::Workbench;

/// Fewer rows than this are what noise of a few rows could make of a slip.
const SHORTEST_ROWS: usize = 8;

/// What lasts longer \[s\] is a step or a slow shape.
const LONGEST_S: f64 = 2.0;

/// A burst must be this strong (2 Δ ln L): two edges were picked for it, and noise that is rough for a moment is not one.
const LEAST: f64 = 80.0;

/// The matched filter of one gyro's rows, summed.
pub(super) struct Matched {
    /// Sums over the rows before each row.
    sums: Vec<f64>,
    /// Σ K over lags from −l to l.
    around: Vec<f64>,
    /// Σ K over a run of l rows and itself.
    own: Vec<f64>,
}

impl Matched {
    /// Of one gyro's bins; nothing where they cannot be transformed.
    pub(super) fn new(bench: &Workbench, axis: usize, left: &Bins) -> Option<Self> {
        let portion = &bench.portion;
        let rows = portion.rows();
        let weights = bench.noise[axis].weights(portion);
        let inverse = portion.inverse();
        let last = weights.len() - 1;
        let in_time = |mut bins: Vec<Complex64>| {
            bins[0].im = 0.0;
            bins[last].im = 0.0;
            let mut values = inverse.make_output_vec();
            inverse.process(&mut bins, &mut values).ok()?;
            Some(values)
        };
        let paired = |bin: usize| if bin == 0 || bin == last { 1.0 } else { SQRT_2 };
        let whitened = left.iter().zip(&weights).enumerate();
        let filtered = in_time(
            whitened
                .map(|(bin, (value, weight))| value * *weight / paired(bin))
                .collect(),
        )?;
        let shared = in_time(
            weights
                .iter()
                .map(|weight| Complex64::from(*weight))
                .collect(),
        )?;
        let scale = (rows as f64).sqrt().recip();
        let mut sums = vec![0.0];
        for value in filtered {
            sums.push(sums[sums.len() - 1] + value * scale);
        }
        let longest = ((LONGEST_S * rows as f64 / portion.seconds()) as usize).clamp(1, rows / 4);
        let (mut around, mut own) = (vec![shared[0] / rows as f64], vec![0.0]);
        for lag in 1..=longest {
            own.push(own[lag - 1] + around[lag - 1]);
            around.push(around[lag - 1] + 2.0 * shared[lag] / rows as f64);
        }
        Some(Self { sums, around, own })
    }

    /// The filter at one row.
    pub(super) fn row(&self, place: usize) -> f64 {
        self.run(place, 1)
    }

    fn run(&self, begin: usize, width: usize) -> f64 {
        self.sums[begin + width] - self.sums[begin]
    }

    /// What rows so far apart know of each other's size; nothing where no run is so long.
    pub(super) fn shared(&self, lag: usize) -> f64 {
        match lag {
            0 => self.around[0],
            _ => {
                let until = self.around.get(lag).map(|sum| sum - self.around[lag - 1]);
                0.5 * until.unwrap_or(0.0)
            }
        }
    }

    /// What a run of rows knows of its size.
    pub(super) fn own(&self, width: usize) -> f64 {
        self.own[width]
    }

    /// 2 Δ ln L of a run.
    pub(super) fn explained(&self, begin: usize, width: usize) -> f64 {
        self.run(begin, width).powi(2) / self.own[width]
    }

    /// The run that explains most of those that begin in some rows and end before `end`.
    fn best(
        &self,
        begins: std::ops::Range<usize>,
        covering: Option<usize>,
        end: usize,
    ) -> Option<(usize, usize)> {
        let longest = self.own.len() - 1;
        let widths = std::iter::successors(Some(SHORTEST_ROWS), |width| Some(width + width / 4));
        let runs = widths
            .take_while(|width| *width <= longest)
            .flat_map(|width| {
                let last = (end + 1).saturating_sub(width);
                let (from, until) = match covering {
                    Some(place) => (
                        (place + 1).saturating_sub(width).max(begins.start),
                        last.min(place + 1),
                    ),
                    None => (begins.start, last.min(begins.end)),
                };
                (from..until).map(move |begin| (begin, width))
            });
        let explained = |run: &(usize, usize)| self.explained(run.0, run.1);
        let (mut begin, mut width) = runs.max_by(|a, b| explained(a).total_cmp(&explained(b)))?;
        // The widths that were tried are a quarter apart: each edge goes where it explains most.
        let mut step = width / 4;
        while step > 0 {
            let around = [
                (begin.saturating_sub(step), width + step),
                (begin + step, width.saturating_sub(step)),
                (begin, width + step),
                (begin, width.saturating_sub(step)),
            ];
            let inside = |run: &(usize, usize)| {
                run.0 >= begins.start
                    && run.0 + run.1 <= end
                    && (SHORTEST_ROWS..=longest).contains(&run.1)
            };
            let better = around
                .into_iter()
                .filter(inside)
                .filter(|run| explained(run) > self.explained(begin, width))
                .max_by(|a, b| explained(a).total_cmp(&explained(b)));
            match better {
                Some(run) => (begin, width) = run,
                None => step /= 2,
            }
        }
        Some((begin, width))
    }

    /// 2 Δ ln L of one row beside the run around it that explains clearly more than it does, where one does: two edges are
    /// chosen for a run, and noise of single readings lets it gain a little.
    pub(super) fn beside_a_burst(&self, place: usize) -> f64 {
        let alone = self.explained(place, 1);
        let longest = self.own.len() - 1;
        let end = (place + longest).min(self.sums.len() - 1);
        let begins = place.saturating_sub(longest)..place + 1;
        let best = self.best(begins, Some(place), end);
        let covers = |run: &(usize, usize)| (run.0..run.0 + run.1).contains(&place);
        let clearer =
            best.filter(|run| covers(run) && self.explained(run.0, run.1) > alone + PLAINER);
        let Some((begin, width)) = clearer else {
            return alone;
        };
        let (before, after) = (place - begin, begin + width - 1 - place);
        let common = 0.5 * (self.around[before] + self.around[after]);
        let free = self.own[1] - common * common / self.own[width];
        let left = self.row(place) - common * self.run(begin, width) / self.own[width];
        if free > 0.0 { left * left / free } else { 0.0 }
    }
}

/// The burst that explains most on each gyro.
pub fn bursts(bench: &Workbench, left: &[Bins; 3]) -> Vec<Event> {
    let scene = bench.scene();
    (0..3_usize)
        .into_par_iter()
        .filter_map(|axis| {
            let matched = Matched::new(bench, axis, &left[axis])?;
            let runs = guarded(&bench.portion).filter_map(|(inside, offset)| {
                let (begin, width) = matched.best(inside.clone(), None, inside.end)?;
                let row = (begin as i64 + offset) as usize;
                let turned_rad = matched.run(begin, width) / matched.own(width) * width as f64;
                Some((
                    matched.explained(begin, width),
                    turned_rad,
                    row..row + width,
                ))
            });
            let (ratio, turned_rad, rows) = runs.max_by(|a, b| a.0.total_cmp(&b.0))?;
            // As of a slip: what a pulse or two make is the counter's own.
            let counted =
                || least_pulses(&scene.streams, axis) * coarsest_rad(&scene.streams, axis);
            if ratio < LEAST || turned_rad.abs() < counted() {
                return None;
            }
            let expression = local::window(scene, &rows);
            let term = Term {
                axis,
                form: Form::Product { expression },
            };
            // Every beginning with every end.
            let trials = 3.0 * bench.portion.rows() as f64 * matched.own.len() as f64;
            Some(event(term, ratio, trials))
        })
        .collect()
}
