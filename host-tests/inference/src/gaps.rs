//! Nuisance parameters of gaps.
//!
//! A likelihood diagonal in frequency needs a value in every row; the unknown rows of a gap are nuisance parameters, in full
//! one per row. A straight line across the gap, an impulse at either end and a box over it are equivalent up to the
//! frequency at which a gap holds no power. Without the box, white angle (an encoder's noise) reduces the standard deviation
//! of a constant to 0.6 of its true value.

use std::ops::Range;

use crate::dct::{cosines, sines};
use crate::free_rows::FreeNumber;
use crate::observations::Span;

/// Shortest gap with a box, as a share of its span: in shorter ones the impulses at its ends are equivalent.
const SHORTEST: f64 = 1.0 / 64.0;

/// Share of the power in coefficient `k` of a span of `rows` lost in a gap of `gap` rows: the nuisance parameters follow any
/// noise up to about one cycle across the gap, white angle a little further than white noise.
pub fn missing(gap: usize, rows: usize, k: usize) -> f64 {
    let share = gap as f64 / rows as f64;
    share * ((k as f64 * share - 0.5) / 1.5).clamp(0.0, 1.0)
}

/// Nuisance parameters at the ends of gaps: impulses less the box of equal area, without effect on slow noise.
pub fn ends(span: &Span) -> Vec<FreeNumber> {
    let rows = span.rows.len();
    let mut all = Vec::new();
    for gap in &span.gaps {
        let own = gap.start - span.rows.start..gap.end - span.rows.start;
        let mut rows_of_gap = vec![own.start, own.end - 1];
        rows_of_gap.dedup();
        all.extend(rows_of_gap.into_iter().map(|row| FreeNumber {
            impulse: Some(row),
            across: is_long(gap.len(), rows).then(|| (own.clone(), -1.0 / gap.len() as f64)),
        }));
    }
    all
}

/// Slow nuisance parameters of a span: its first and its last row, whose angles have no neighbour, a box over each gap that
/// is long enough, and its level where that is free.
pub fn slow(span: &Span) -> Vec<FreeNumber> {
    let rows = span.rows.len();
    let of_span = [0, rows - 1].map(|row| FreeNumber {
        impulse: Some(row),
        across: None,
    });
    let long = span.gaps.iter().filter(|gap| is_long(gap.len(), rows));
    let long = long.map(|gap| FreeNumber {
        impulse: None,
        across: Some((gap.start - span.rows.start..gap.end - span.rows.start, 1.0)),
    });
    let level = span.has_free_level.then_some(FreeNumber {
        impulse: None,
        across: Some((0..rows, 1.0)),
    });
    of_span.into_iter().chain(long).chain(level).collect()
}

/// Coefficients of a nuisance parameter's shape in a span of `rows`.
pub fn spectrum(one: &FreeNumber, rows: usize) -> Vec<f64> {
    let mut sum = one
        .impulse
        .map_or_else(|| vec![0.0; rows], |row| impulse(rows, row));
    if let Some((over, height)) = &one.across {
        for (value, part) in sum.iter_mut().zip(across(rows, over)) {
            *value += height * part;
        }
    }
    sum
}

fn is_long(gap: usize, rows: usize) -> bool {
    gap > 2 && gap as f64 >= SHORTEST * rows as f64
}

/// Coefficients of a box over some rows of a span of `rows`.
fn across(rows: usize, gap: &Range<usize>) -> Vec<f64> {
    let [first_sines, end_sines] = [gap.start, gap.end].map(|row| step_sines(rows, row));
    let scale = (2.0 / rows as f64).sqrt();
    let halves = sines(rows);
    let mut spectrum: Vec<f64> = (0..rows)
        .map(|k| scale * (end_sines[k] - first_sines[k]) / (2.0 * halves[k]))
        .collect();
    spectrum[0] = gap.len() as f64 / (rows as f64).sqrt();
    spectrum
}

/// sin(π row k/n) for all k of a span of n rows, from cosines a quarter turn back.
fn step_sines(rows: usize, row: usize) -> Vec<f64> {
    cosines(rows, 3 * rows, 2 * row, rows)
}

/// Coefficients of an impulse in one row of a span of `rows`.
fn impulse(rows: usize, row: usize) -> Vec<f64> {
    let scale = (2.0 / rows as f64).sqrt();
    let mut impulse = cosines(rows, 0, 2 * row + 1, rows);
    impulse.iter_mut().for_each(|wave| *wave *= scale);
    impulse[0] = (1.0 / rows as f64).sqrt();
    impulse
}

#[cfg(test)]
mod tests {
    use crate::{Dct, Observations};

    #[test]
    fn a_box_is_one_in_its_gap_and_nothing_elsewhere() {
        let mut seen = [true; 400];
        seen[150..250].fill(false);
        let observations = Observations::bridged(&seen).expect("rows");
        let span = &observations.spans[0];
        let mut whole = super::across(span.rows.len(), &span.gaps[0]);
        Dct::new(span.rows.len()).inverse(&mut whole);
        for (row, value) in whole.iter().enumerate() {
            let expected = f64::from((150..250).contains(&row));
            assert!((value - expected).abs() < 1e-9, "{row}: {value}");
        }
    }
}
