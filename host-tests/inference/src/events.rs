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
    events.extend(step(transform, basis, levels, &score));
    events
}

/// Information of a step from row `place` of `rows` on, by bins of single coefficients and samples of wider ones.
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

fn step(
    transform: &Transform,
    basis: &NoiseBasis,
    levels: NoiseLevels,
    score: &[f64],
) -> Option<Event> {
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
    let powers = basis.binned(levels);
    let informations: Vec<f64> = places
        .iter()
        .map(|&place| step_information(basis, &powers, rows, place))
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
            .clamp(1, STEP_PLACES - 1);
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

#[cfg(test)]
mod tests {
    use super::{EventKind, scan};
    use crate::normal_equations::Transform;
    use crate::{NoiseBasis, NoiseLevels, Observations};

    #[test]
    fn a_step_and_an_impulse_are_found_at_their_rows_with_their_size_in_standard_deviations() {
        let rows = 2000;
        let observations = Observations::bridged(&vec![true; rows]).expect("rows");
        let basis = NoiseBasis::new(&observations);
        let levels = NoiseLevels {
            white: 4.0,
            ..NoiseLevels::default()
        };
        let transform = Transform::new(observations, &basis, levels);
        let found = |record: &[f64], kind| {
            let events = scan(&transform, &basis, &transform.spectrum(record), levels);
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
    }
}
