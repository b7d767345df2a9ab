//! Scans of all rows for a step of a record and for an impulse in it.
//!
//! With r the residual's coefficients and S the noise, the inverse transform of r/S is the score of an impulse at every
//! row, and its sum from a row on the score of a step there.

use crate::noise::{NoiseBasis, NoiseLevels};
use crate::normal_equations::Transform;

/// What happens at one row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventKind {
    /// The record is larger in one row.
    Impulse,
    /// The record is larger from the row on.
    Step,
}

/// The strongest event of its kind in a record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Which.
    pub kind: EventKind,
    /// Row.
    pub row: usize,
    /// Size in standard deviations.
    pub size: f64,
}

/// Rows at which the information of a step is computed; between them it is interpolated.
const STEP_PLACES: usize = 48;

/// Rows from either end of a span that are not scanned for impulses.
const END_ROWS: usize = 4;

/// Scans the first span of a transform.
///
/// # Inputs
/// `residual`: coefficients of the record less what is fitted.
pub fn scan(
    transform: &Transform,
    basis: &NoiseBasis,
    residual: &[f64],
    levels: NoiseLevels,
) -> Vec<Event> {
    let powers = basis.by_coefficient(levels);
    let weighted: Vec<f64> = residual.iter().zip(&powers).map(|(r, s)| r / s).collect();
    let score = transform.rows_of(&weighted);
    let span = &transform.observations().spans[0];
    let is_seen = |row: usize| !span.gaps.iter().any(|gap| gap.contains(&row));
    let rows = span.rows.len();
    let information = powers.iter().map(|power| 1.0 / power).sum::<f64>() / rows as f64;
    let mut events = Vec::new();
    let inner = span.rows.start + END_ROWS..span.rows.end.saturating_sub(END_ROWS);
    let impulse = inner
        .filter(|&row| is_seen(row))
        .max_by(|&a, &b| score[a].abs().total_cmp(&score[b].abs()));
    if let Some(row) = impulse {
        events.push(Event {
            kind: EventKind::Impulse,
            row,
            size: score[row] / information.sqrt(),
        });
    }
    events.extend(step(transform, &powers, &score));
    events
}

fn step(transform: &Transform, powers: &[f64], score: &[f64]) -> Option<Event> {
    let span = &transform.observations().spans[0];
    let rows = span.rows.len();
    let margin = (rows / 100).max(8);
    if rows < 4 * margin {
        return None;
    }
    let last = rows - margin;
    let places: Vec<usize> = (0..STEP_PLACES)
        .map(|place| margin + place * (last - margin) / (STEP_PLACES - 1))
        .collect();
    let informations: Vec<f64> = places
        .iter()
        .map(|&place| {
            let mut column = vec![0.0; transform.observations().record_rows];
            column[span.rows.start + place..].fill(1.0);
            let spectrum = transform.spectrum(&column);
            spectrum.iter().zip(powers).map(|(c, s)| c * c / s).sum()
        })
        .collect();
    let mut sum = 0.0;
    let mut best: Option<(usize, f64)> = None;
    for row in (margin..rows).rev() {
        sum += score[span.rows.start + row];
        if row >= last {
            continue;
        }
        let after = places
            .partition_point(|&place| place <= row)
            .min(STEP_PLACES - 1)
            .max(1);
        let (low, high) = (places[after - 1], places[after]);
        let share = (row - low) as f64 / (high - low) as f64;
        let information =
            informations[after - 1] + share * (informations[after] - informations[after - 1]);
        let size = sum / information.sqrt();
        if best.is_none_or(|(_, found)| size.abs() > found.abs()) {
            best = Some((row, size));
        }
    }
    best.map(|(row, size)| Event {
        kind: EventKind::Step,
        row: span.rows.start + row,
        size,
    })
}
