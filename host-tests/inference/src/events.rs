//! Matched-filter scans of all rows for a step, an impulse or a window in a record.
//!
//! With r the residual's coefficients and S the noise, the inverse transform of r/S is the score of an impulse at every row,
//! its sum from a row on the score of a step there, and the difference of two such sums that of a window.

use rayon::prelude::*;
use rlg_plan::EventPlan;

use crate::noise::{NoiseBasis, NoiseLevels};
use crate::transform::Transform;

/// Kind of an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// Outlier in one row.
    Impulse,
    /// Step from the row on.
    Step,
    /// Step from the row on, of limited duration.
    Window,
}

/// The strongest event of its kind in a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Kind of the event.
    pub kind: EventKind,
    /// First row.
    pub row: usize,
    /// Duration in rows.
    pub rows: usize,
    /// Size in standard deviations.
    pub size: f64,
    /// Its standard deviation, in the record's unit.
    pub std: f64,
}

/// Number of rows at which the information of a step is computed; between them it is interpolated.
const STEP_PLACES: usize = 48;

/// Scans the first span of a transform.
///
/// # Inputs
/// `residual`: coefficients of the record less the fit.
pub fn scan(
    transform: &Transform,
    basis: &NoiseBasis,
    residual: &[f64],
    levels: NoiseLevels,
    plan: &EventPlan,
) -> Vec<Event> {
    let (score, powers) = impulse_scores(transform, basis, residual, levels);
    let span = &transform.observations().spans[0];
    let mut events = Vec::from_iter(impulse(transform, &score, &powers, plan));
    let binned = basis.binned(levels);
    let from_row = sums_from(&score[span.rows.clone()]);
    let start = span.rows.start;
    events.extend(step(&from_row, basis, &binned, plan).map(|event| event.later_by(start)));
    events.extend(window(&from_row, basis, &binned, plan).map(|event| event.later_by(start)));
    events
}

/// The strongest impulse in the first span.
fn impulse(
    transform: &Transform,
    score: &[f64],
    powers: &[f64],
    plan: &EventPlan,
) -> Option<Event> {
    let span = &transform.observations().spans[0];
    let is_seen = |row: usize| !span.gaps.iter().any(|gap| gap.contains(&row));
    let rows = span.rows.len() as f64;
    let information = powers.iter().map(|power| 1.0 / power).sum::<f64>() / rows;
    let inner = span.rows.start + plan.end_rows..span.rows.end.saturating_sub(plan.end_rows);
    let row = inner
        .filter(|&row| is_seen(row))
        .max_by(|&a, &b| score[a].abs().total_cmp(&score[b].abs()))?;
    Some(Event {
        kind: EventKind::Impulse,
        row,
        rows: 1,
        size: score[row] / information.sqrt(),
        std: information.sqrt().recip(),
    })
}

/// Finds impulses in the first span, the strongest first, each given those before it: those larger than `least` \[σ\], at
/// most `most` of them.
///
/// # Inputs
/// `residual`: coefficients of the record less the fit.
pub fn impulses(
    transform: &Transform,
    basis: &NoiseBasis,
    residual: &[f64],
    levels: NoiseLevels,
    (least, most): (f64, usize),
    plan: &EventPlan,
) -> Vec<Event> {
    let powers = basis.by_coefficient(levels);
    let mut left = residual.to_vec();
    let mut found = Vec::new();
    while found.len() < most {
        let score = scores_under(transform, &left, &powers);
        let next = impulse(transform, &score, &powers, plan).filter(|one| one.size.abs() > least);
        let Some(next) = next else { break };
        let mut column = vec![0.0; transform.observations().record_rows];
        column[next.row] = next.size * next.std;
        let pairs = left.iter_mut().zip(transform.spectrum(&column));
        pairs.for_each(|(left, column)| *left -= column);
        found.push(next);
    }
    found
}

impl Event {
    fn later_by(self, rows: usize) -> Self {
        Self {
            row: self.row + rows,
            ..self
        }
    }
}

/// Sum of `score` from each row on, and 0 behind the last.
fn sums_from(score: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0; score.len() + 1];
    for row in (0..score.len()).rev() {
        sums[row] = sums[row + 1] + score[row];
    }
    sums
}

/// Score of an impulse at every row, and the noise power of every coefficient.
pub fn impulse_scores(
    transform: &Transform,
    basis: &NoiseBasis,
    residual: &[f64],
    levels: NoiseLevels,
) -> (Vec<f64>, Vec<f64>) {
    let powers = basis.by_coefficient(levels);
    (scores_under(transform, residual, &powers), powers)
}

/// Score of an impulse at every row for a known noise power of every coefficient.
fn scores_under(transform: &Transform, residual: &[f64], powers: &[f64]) -> Vec<f64> {
    let weighted: Vec<f64> = residual.iter().zip(powers).map(|(r, s)| r / s).collect();
    transform.rows_of(&weighted)
}

/// Size of the largest impulse in any span of a transform \[σ\].
///
/// # Inputs
/// `residual`: coefficients of the record less the fit.
pub fn largest_impulse(
    transform: &Transform,
    basis: &NoiseBasis,
    residual: &[f64],
    levels: NoiseLevels,
    plan: &EventPlan,
) -> f64 {
    let (score, powers) = impulse_scores(transform, basis, residual, levels);
    let mut first = 0;
    let spans = transform.observations().spans.iter();
    spans
        .map(|span| {
            let rows = span.rows.len();
            let of_span = &powers[first..first + rows];
            first += rows;
            let information = of_span.iter().map(|power| 1.0 / power).sum::<f64>() / rows as f64;
            let inner =
                span.rows.start + plan.end_rows..span.rows.end.saturating_sub(plan.end_rows);
            let largest = inner.map(|row| score[row].abs()).fold(0.0, f64::max);
            largest / information.sqrt()
        })
        .fold(0.0, f64::max)
}

/// Fisher information of a step from row `place` of `rows` on, by bins of single coefficients and samples of wider ones.
///
/// Coefficient k of the step is −√(2/n) sin(π place k/n)/(2 sin(π k/2n)).
fn step_information(basis: &NoiseBasis, powers: &[f64], rows: usize, place: usize) -> f64 {
    const SAMPLES: usize = 8;
    let n = rows as f64;
    let square = |k: usize| {
        if k == 0 {
            return (rows - place).pow(2) as f64 / n;
        }
        let angle = std::f64::consts::PI * k as f64 / n;
        let ratio = (place as f64 * angle).sin() / (2.0 * (0.5 * angle).sin());
        2.0 / n * ratio * ratio
    };
    let bins = basis
        .bins
        .iter()
        .zip(powers)
        .filter(|(bin, _)| bin.end <= rows);
    bins.map(|(bin, power)| {
        let count = bin.len().min(SAMPLES);
        let samples = (0..count).map(|sample| square(bin.start + sample * bin.len() / count));
        samples.sum::<f64>() / count as f64 * bin.len() as f64 / power
    })
    .sum()
}

/// The strongest step of a span.
///
/// # Inputs
/// `from_row`: sums of the score; `powers`: noise of every bin.
fn step(from_row: &[f64], basis: &NoiseBasis, powers: &[f64], plan: &EventPlan) -> Option<Event> {
    let rows = from_row.len() - 1;
    let margin = (rows / plan.step_end_one_in).max(plan.step_end_rows);
    if rows < 4 * margin {
        return None;
    }
    let last = rows - margin;
    let places: Vec<usize> = (0..STEP_PLACES)
        .map(|place| margin + place * (last - margin) / (STEP_PLACES - 1))
        .collect();
    let informations: Vec<f64> = places
        .iter()
        .map(|&place| step_information(basis, powers, rows, place))
        .collect();
    let of_row = |row: usize| {
        let after = places
            .partition_point(|&place| place <= row)
            .clamp(1, STEP_PLACES - 1);
        let (low, high) = (places[after - 1], places[after]);
        let share = (row - low) as f64 / (high - low) as f64;
        informations[after - 1] + share * (informations[after] - informations[after - 1])
    };
    let sizes = (margin..last).map(|row| (row, from_row[row] / of_row(row).sqrt()));
    let (row, size) = sizes.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    Some(Event {
        kind: EventKind::Step,
        row,
        rows: rows - row,
        size,
        std: of_row(row).sqrt().recip(),
    })
}

/// Fisher information of a window of `length` of `rows`, well inside of them.
///
/// Coefficient k is √(2/n) cos(π k (a + L/2)/n) sin(π k L/2n)/sin(π k/2n); the square of the cosine is ½ on average over
/// places.
fn window_information(basis: &NoiseBasis, powers: &[f64], rows: usize, length: usize) -> f64 {
    const SAMPLES: usize = 16;
    let n = rows as f64;
    let square = |k: usize| {
        if k == 0 {
            return (length * length) as f64 / n;
        }
        let angle = 0.5 * std::f64::consts::PI * k as f64 / n;
        ((length as f64 * angle).sin() / angle.sin()).powi(2) / n
    };
    let bins = basis.bins.iter().zip(powers);
    bins.filter(|(bin, _)| bin.end <= rows)
        .map(|(bin, power)| {
            let count = bin.len().min(SAMPLES);
            let samples = (0..count).map(|sample| square(bin.start + sample * bin.len() / count));
            samples.sum::<f64>() / count as f64 * bin.len() as f64 / power
        })
        .sum()
}

/// The strongest window of a span, of two rows to half of them.
///
/// # Inputs
/// `from_row`: sums of the score; `powers`: noise of every bin.
fn window(from_row: &[f64], basis: &NoiseBasis, powers: &[f64], plan: &EventPlan) -> Option<Event> {
    let rows = from_row.len() - 1;
    let size = |row: usize, length: usize, information: f64| {
        (from_row[row] - from_row[row + length]) / information.sqrt()
    };
    let of_length = |length: usize| window_information(basis, powers, rows, length);
    let larger = |a: &(usize, usize, f64), b: &(usize, usize, f64)| a.2.abs().total_cmp(&b.2.abs());
    let lengths = std::iter::successors(Some(2_usize), |length| {
        Some(((*length as f64 * plan.length_ratio) as usize).max(length + 1))
    });
    let inner = plan.end_rows..rows.saturating_sub(plan.end_rows);
    let lengths: Vec<usize> = lengths.take_while(|length| 2 * length <= rows).collect();
    let strongest = lengths.par_iter().filter_map(|&length| {
        let information = of_length(length);
        let places =
            (inner.start..inner.end.saturating_sub(length)).step_by((length / plan.places).max(1));
        places
            .map(|row| (row, length, size(row, length, information)))
            .max_by(larger)
    });
    let (mut row, mut length, mut best) = strongest.max_by(larger)?;
    // Refines each edge in turn.
    for edge in [0, 1, 0, 1] {
        let reach = (length / plan.places).max(1);
        let (start, end) = (row, row + length);
        let near =
            |at: usize| at.saturating_sub(reach).max(inner.start)..=(at + reach).min(inner.end);
        let places = if edge == 0 { near(start) } else { near(end) };
        let moved = places.filter_map(|at| {
            let (start, end) = if edge == 0 { (at, end) } else { (start, at) };
            (start + 1 < end).then(|| (start, end - start))
        });
        let (shortest, longest) = (length.saturating_sub(reach).max(1), length + reach);
        let [of_shortest, of_longest] = [shortest, longest].map(of_length);
        let of_near = |now: usize| {
            let share = (now - shortest) as f64 / (longest - shortest) as f64;
            of_shortest + share * (of_longest - of_shortest)
        };
        let found = moved
            .map(|(row, length)| (row, length, size(row, length, of_near(length))))
            .max_by(larger);
        (row, length, best) = found?;
    }
    Some(Event {
        kind: EventKind::Window,
        row,
        rows: length,
        size: best,
        std: of_length(length).sqrt().recip(),
    })
}

#[cfg(test)]
mod tests {
    use super::{EventKind, impulses, scan};
    use crate::transform::Transform;
    use crate::{NoiseBasis, NoiseLevels, Observations};
    use rlg_plan::EventPlan;

    const ROWS: usize = 2000;

    /// White noise of variance 4.
    fn white() -> (Transform, NoiseBasis, NoiseLevels) {
        let observations = Observations::bridged(&[true; ROWS]).expect("rows");
        let levels = NoiseLevels {
            white: 4.0,
            ..NoiseLevels::default()
        };
        let (transform, basis) = Transform::with_basis(observations, levels);
        (transform, basis, levels)
    }

    #[test]
    fn a_step_and_an_impulse_are_found_at_their_rows_with_their_size_in_standard_deviations() {
        let rows = ROWS;
        let (transform, basis, levels) = white();
        let found = |record: &[f64], kind| {
            let events = scan(
                &transform,
                &basis,
                &transform.spectrum(record),
                levels,
                &EventPlan::default(),
            );
            *events
                .iter()
                .find(|event| event.kind == kind)
                .expect("one of each kind")
        };
        let mut record = vec![0.0; rows];
        record[700] = 20.0;
        let impulse = found(&record, EventKind::Impulse);
        assert_eq!(impulse.row, 700);
        assert!((impulse.size - 10.0).abs() < 0.1, "{}", impulse.size);
        let mut record = vec![0.0; rows];
        record[1200..].fill(1.0);
        let step = found(&record, EventKind::Step);
        assert!(step.row.abs_diff(1200) < 5, "{}", step.row);
        // White noise of variance 4: √(800 · 1/4).
        assert!((step.size / 14.14 - 1.0).abs() < 0.03, "{}", step.size);
        let mut record = vec![0.0; rows];
        record[900..1000].fill(3.0);
        let window = found(&record, EventKind::Window);
        assert_eq!((window.row, window.rows), (900, 100));
        // √(100 · 9/4).
        assert!((window.size / 15.0 - 1.0).abs() < 0.03, "{}", window.size);
    }

    #[test]
    fn impulses_are_found_one_by_one_and_no_more_than_there_are() {
        let rows = ROWS;
        let (transform, basis, levels) = white();
        let mut record = vec![0.0; rows];
        let truth = [(1500, 30.0), (300, -24.0), (301, 18.0)];
        truth.iter().for_each(|&(row, size)| record[row] = size);
        let spectrum = transform.spectrum(&record);
        let plan = EventPlan::default();
        let found = impulses(&transform, &basis, &spectrum, levels, (5.0, 10), &plan);
        let found: Vec<(usize, f64)> = found
            .iter()
            .map(|one| (one.row, (one.size * one.std).round()))
            .collect();
        assert_eq!(found, truth);
        let first = impulses(&transform, &basis, &spectrum, levels, (5.0, 1), &plan);
        assert_eq!(first.len(), 1);
    }
}
