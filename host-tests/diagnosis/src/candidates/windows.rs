//! Effects of some rows only: a gyro follows a channel between two instants, as with a mount that gives way and is
//! tightened.

use std::ops::Range;

use rayon::prelude::*;
use rlg_catalogue::vocabulary::channels;
use rlg_catalogue::{Column, Expression, Pool, Sensed};
use rlg_inference::Fit;
use rlg_inference::score_test::noises;
use rlg_plan::WindowPlan;
use rlg_signal::streams::each_axis;

use super::scores::{Coarse, Found, integrated};
use crate::iteration::pass::Pass;

/// Residual of a fit on a gyro, as whitened sums of rows.
struct Whitened {
    /// Root of the sums' noise \[rad\].
    roots: Vec<f64>,
    /// Whitened sums \[σ\].
    rows: Vec<f64>,
}

/// Window of a gyro's rows in which a channel explains the residual, with its gain.
struct Shown {
    rows: Range<usize>,
    /// Gain in log likelihood.
    gain: f64,
    /// Gain of the channel in all rows.
    whole: f64,
    /// Range of either edge: the edge is undetermined while the channel is at rest.
    reach: [Range<usize>; 2],
}

/// Selects for each gyro the window with the highest evidence given any of `fits`, in which it follows a channel or has a
/// constant.
pub(crate) fn strongest(
    pass: &Pass,
    fits: &[&Fit],
    coarse: &Coarse,
    plan: &WindowPlan,
) -> Vec<Found> {
    let signals = &pass.motion.signals;
    let channels = channels(signals, pass.motion.is_moving);
    // A channel that hardly changes resembles a constant: it must gain the price of its selection.
    let picked_from = |expression: Expression| match expression == Expression::ONE {
        true => 3.0,
        false => 3.0 * channels.len() as f64,
    };
    let all = [&[Expression::ONE], &channels[..]].concat();
    let asked: Vec<(usize, Expression)> = (0..3)
        .flat_map(|gyro| all.iter().map(move |one| (gyro, *one)))
        .collect();
    let left: Vec<[Whitened; 3]> = fits
        .iter()
        .flat_map(|fit| {
            let left_rad = pass.left_by(fit);
            noises(fit).into_iter().map(move |levels| {
                each_axis(|gyro| {
                    let roots = coarse.roots(levels[gyro]);
                    let rows = coarse.whitened(&left_rad[gyro], &roots);
                    Whitened { roots, rows }
                })
            })
        })
        .collect();
    let best: Vec<(usize, Expression, Shown)> = asked
        .par_iter()
        .filter_map(|&(gyro, expression)| {
            let column = Sensed::tried(Column::Expression(expression), gyro, signals);
            let column = column.values(signals);
            let of_fit = left.iter().filter_map(|left| {
                let Whitened { roots, rows } = &left[gyro];
                strongest_window(&coarse.whitened(&column, roots), rows, plan)
            });
            let best = of_fit.max_by(|a, b| a.gain.total_cmp(&b.gain))?;
            Some((gyro, expression, best))
        })
        .collect();
    (0..3)
        .filter_map(|gyro| {
            let own = best.iter().filter(|(other, ..)| *other == gyro);
            let worth = |one: &(usize, Expression, Shown)| one.2.gain - picked_from(one.1).ln();
            let best = own.max_by(|a, b| worth(a).total_cmp(&worth(b)))?;
            let (_, expression, shown) = best;
            let (rows, places) = placed(pass, shown, coarse.each, plan.edge_deviations());
            let mut pool = Pool::default();
            let places = picked_from(*expression) * places;
            let expression = expression.within(rows, signals)?;
            let candidate = pool.expression(gyro, expression, places, signals);
            // An effect of all rows nearly fits in most of them.
            let is_of_some = shown.gain - shown.whole > candidate.hypothesis.price;
            is_of_some.then(|| Found {
                surplus: integrated(shown.gain, 1) - candidate.hypothesis.price,
                candidate,
                columns: pool.columns,
            })
        })
        .collect()
}

/// Window in the recording's rows, and the number of places from which it was selected.
fn placed(pass: &Pass, shown: &Shown, each: usize, deviations: f64) -> (Range<usize>, f64) {
    let edges = Edges {
        rows: pass.motion.signals.rows,
        at: [shown.rows.start, shown.rows.end].map(|edge| edge * each),
        deviations,
        reach: shown
            .reach
            .clone()
            .map(|reach| reach.start.saturating_sub(1) * each..(reach.end + 1) * each),
    };
    let ([start, end], places) = edges.placed(&pass.cuts);
    (start..end, places)
}

/// Edges of a window.
pub(crate) struct Edges {
    /// Rows of the recording.
    pub rows: usize,
    /// Estimated edges.
    pub at: [usize; 2],
    /// Half-width of the ranges \[σ\].
    pub deviations: f64,
    /// Range of each edge.
    pub reach: [Range<usize>; 2],
}

impl Edges {
    /// Edges of a window of some rows and a squared size \[σ²\]: an edge of m rows and z standard deviations is uncertain by
    /// m/(z²/2) rows.
    pub fn of(window: Range<usize>, squared_size: f64, rows: usize, plan: &WindowPlan) -> Self {
        let deviations = plan.edge_deviations();
        let places = (0.5 * squared_size).max(4.0);
        let reach = (deviations * window.len() as f64 / places).ceil() as usize;
        let at = [window.start, window.end];
        Self {
            rows,
            at,
            deviations,
            reach: at.map(|edge| edge.saturating_sub(reach)..edge + reach + 1),
        }
    }

    /// Moves each edge to a change of the kind of motion if both ranges contain one of such `cuts`: the window is then as
    /// short as they allow.
    ///
    /// # Returns
    /// The edges, and the number of places from which they were selected.
    pub fn placed(&self, cuts: &[usize]) -> ([usize; 2], f64) {
        let [starts, ends] = &self.reach;
        let start = cuts
            .iter()
            .copied()
            .filter(|cut| starts.contains(cut))
            .max();
        let end = cuts.iter().copied().filter(|cut| ends.contains(cut)).min();
        if let (Some(start), Some(end)) = (start, end)
            && start < end
        {
            let count = cuts.len() as f64;
            return ([start, end], count * count);
        }
        // A uniform prior of the logarithm of the length.
        let both = 2.0 * self.deviations;
        let [starts, ends] = self.reach.clone().map(|reach| both / reach.len() as f64);
        let length = (self.at[1] - self.at[0]) as f64;
        let rows = self.rows as f64;
        (self.at, rows * starts * rows.ln() * length * ends)
    }
}

/// Window of whitened rows with the largest gain in log likelihood by a column.
fn strongest_window(column: &[f64], record: &[f64], plan: &WindowPlan) -> Option<Shown> {
    let rows = column.len().min(record.len());
    let mut scores = vec![0.0; rows + 1];
    let mut informations = vec![0.0; rows + 1];
    for row in 0..rows {
        scores[row + 1] = scores[row] + column[row] * record[row];
        informations[row + 1] = informations[row] + column[row] * column[row];
    }
    let all = informations[rows];
    // A window with less of the column's power than this is only a few of its rows.
    let least = 1e-3 * all;
    let of = |start: usize, end: usize| -> (usize, usize, f64) {
        let information = informations[end] - informations[start];
        let score = scores[end] - scores[start];
        let gain = if information > least {
            0.5 * score * score / information
        } else {
            f64::NEG_INFINITY
        };
        (start, end, gain)
    };
    let places: Vec<usize> = (0..=plan.edges).map(|k| k * rows / plan.edges).collect();
    let all = places.iter().enumerate();
    let mut best = all
        .flat_map(|(k, &start)| places[k + 1..].iter().map(move |&end| (start, end)))
        .filter(|(start, end)| end - start < rows)
        .map(|(start, end)| of(start, end))
        .max_by(|a, b| a.2.total_cmp(&b.2))?;
    let near = rows / plan.edges;
    for edge in [0, 1, 0, 1] {
        let (start, end, _) = best;
        let at = if edge == 0 { start } else { end };
        best = (at.saturating_sub(near)..=(at + near).min(rows))
            .map(|at| if edge == 0 { (at, end) } else { (start, at) })
            .filter(|(start, end)| start < end)
            .map(|(start, end)| of(start, end))
            .fold(best, |best, one| if one.2 > best.2 { one } else { best });
    }
    let (start, end, gain) = best;
    let is_as_good = |other: (usize, usize, f64)| other.2 > gain - plan.edge_within;
    let starts = (0..start)
        .rev()
        .take_while(|&at| is_as_good(of(at, end)))
        .last();
    let later = (start + 1..end)
        .take_while(|&at| is_as_good(of(at, end)))
        .last();
    let ends = (end + 1..=rows)
        .take_while(|&at| is_as_good(of(start, at)))
        .last();
    let earlier = (start + 1..end)
        .rev()
        .take_while(|&at| is_as_good(of(start, at)))
        .last();
    let whole = scores[rows] * scores[rows] / informations[rows].max(f64::MIN_POSITIVE);
    (gain > 0.0).then(|| Shown {
        rows: start..end,
        gain,
        whole: 0.5 * whole,
        reach: [
            starts.unwrap_or(start)..later.unwrap_or(start) + 1,
            earlier.unwrap_or(end)..ends.unwrap_or(end) + 1,
        ],
    })
}

#[cfg(test)]
mod tests {
    use super::{Edges, strongest_window};

    /// Sine that a record follows in rows 300 to 700 of 1000, and not outside.
    #[test]
    fn the_rows_in_which_a_column_is_followed_are_found() {
        let column: Vec<f64> = (0..1000).map(|row| (0.7 * row as f64).sin()).collect();
        let follows = |row: usize| (300..700).contains(&row);
        let record: Vec<f64> = (0..1000)
            .map(|row| if follows(row) { 2.0 * column[row] } else { 0.0 })
            .collect();
        let found =
            strongest_window(&column, &record, &rlg_plan::WindowPlan::default()).expect("a window");
        assert!(found.rows.start.abs_diff(300) < 5, "{:?}", found.rows);
        assert!(found.rows.end.abs_diff(700) < 5, "{:?}", found.rows);
        // ½ · 4 · 400 · ½.
        assert!((found.gain / 400.0 - 1.0).abs() < 0.02, "{}", found.gain);
    }

    /// The same sine, at rest from row 250 until row 350: an edge within the rest is undetermined.
    #[test]
    fn an_edge_in_a_rest_may_lie_in_all_of_it() {
        let rests = |row: usize| (250..350).contains(&row);
        let wave = |row: usize| {
            if rests(row) {
                0.0
            } else {
                (0.7 * row as f64).sin()
            }
        };
        let column: Vec<f64> = (0..1000).map(wave).collect();
        let record: Vec<f64> = (0..1000)
            .map(|row| {
                if (300..700).contains(&row) {
                    2.0 * column[row]
                } else {
                    0.0
                }
            })
            .collect();
        let found =
            strongest_window(&column, &record, &rlg_plan::WindowPlan::default()).expect("a window");
        let [start, end] = found.reach;
        assert!(start.contains(&251) && start.contains(&349), "{start:?}");
        assert!(end.contains(&700) && end.len() < 20, "{end:?}");
    }

    #[test]
    fn edges_that_may_lie_where_the_motion_changes_lie_there_and_cost_less() {
        let cuts = [0, 1900, 2005, 4000, 10_000];
        // Uncertain by 2000 rows over 200, times three.
        let plan = rlg_plan::WindowPlan::default();
        let edges = Edges::of(2000..4020, 400.0, 10_000, &plan);
        let (at, cheap) = edges.placed(&cuts);
        assert_eq!(at, [2005, 4000]);
        let (at, dear) = Edges::of(2000..4500, 400.0, 10_000, &plan).placed(&cuts);
        assert_eq!(at, [2000, 4500]);
        assert!(cheap < dear);
    }
}
