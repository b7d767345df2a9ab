//! Posterior of the change point of a step.

use std::ops::Range;

use rayon::prelude::*;

use crate::noise::{NoiseBasis, NoiseLevels};
use crate::transform::Transform;

/// Posterior of the change point of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// Candidate rows, ascending.
    pub places: Vec<Place>,
}

/// A candidate row of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Middle row of the group.
    pub row: usize,
    /// Number of rows in the group.
    pub rows: usize,
    /// Posterior probability of the group.
    pub probability: f64,
    /// Maximum-likelihood size of a step here, in the record's unit.
    pub size: f64,
}

/// Groups of rows around a step, and per gap in it.
const SEEN_PLACES: usize = 48;
const GAP_PLACES: usize = 16;

impl Instant {
    /// Computes the posterior around a step of `sigmas` standard deviations at `row`, in the first span of a transform, on a
    /// grid refined towards probable rows. All rows of a gap have the same likelihood.
    ///
    /// # Inputs
    /// `record`: values on all rows, step included.
    pub fn around(
        transform: &Transform,
        basis: &NoiseBasis,
        levels: NoiseLevels,
        record: &[f64],
        (row, sigmas): (usize, f64),
    ) -> Self {
        /// Probability below which a group is dropped.
        const NOT_THERE: f64 = 1e-4;
        let span = &transform.observations().spans[0];
        let weights = basis.weights(levels);
        let spectrum = transform.spectrum(record);
        let likelihood = |row: usize| {
            let mut column = vec![0.0; record.len()];
            column[row..].fill(1.0);
            let column = transform.spectrum(&column);
            let (mut score, mut information) = (0.0, 0.0);
            for ((column, record), weight) in column.iter().zip(&spectrum).zip(&weights) {
                score += column * record * weight;
                information += column * column * weight;
            }
            (0.5 * score * score / information, score / information)
        };
        // Ten times the resolution of the change point of a step of this size.
        let reach = (20.0 * span.rows.len() as f64 / (sigmas * sigmas).max(4.0)).ceil() as usize;
        let inner = span.rows.start + 1..span.rows.end - 1;
        let mut within = row.saturating_sub(reach).max(inner.start)..(row + reach).min(inner.end);
        loop {
            let found = Self::among(&groups(&within, &span.gaps), &likelihood);
            let mut possible = found.places.iter();
            let is_possible = |place: &&Place| place.probability > NOT_THERE;
            let (Some(first), Some(last)) = (
                possible.find(is_possible),
                found.places.iter().rfind(is_possible),
            ) else {
                return found;
            };
            let begin = first.row.saturating_sub(first.rows).max(within.start);
            let closer = begin..(last.row + last.rows + 1).min(within.end);
            // Stops unless the interval is halved.
            if within.len() <= SEEN_PLACES || 2 * closer.len() > within.len() {
                return found;
            }
            within = closer;
        }
    }

    /// Posterior probabilities of groups of rows of equal likelihood, each row with the number it represents.
    fn among(
        groups: &[(Vec<usize>, usize)],
        likelihood: &(impl Fn(usize) -> (f64, f64) + Sync),
    ) -> Self {
        let of_first = |(rows, _): &(Vec<usize>, usize)| likelihood(rows[0]);
        let fitted: Vec<(f64, f64)> = groups.par_iter().map(of_first).collect();
        let best = fitted.iter().map(|one| one.0).fold(0.0, f64::max);
        let mut places: Vec<Place> = Vec::new();
        for ((rows, length), (log_likelihood, size)) in groups.iter().zip(fitted) {
            places.extend(rows.iter().map(|&row| Place {
                row,
                rows: *length,
                probability: *length as f64 * (log_likelihood - best).exp(),
                size,
            }));
        }
        places.sort_by_key(|place| place.row);
        let sum: f64 = places.iter().map(|place| place.probability).sum();
        places.iter_mut().for_each(|place| place.probability /= sum);
        Self { places }
    }

    /// Posterior mean row.
    pub fn row(&self) -> usize {
        let rows = self.places.iter();
        rows.map(|place| place.probability * place.row as f64)
            .sum::<f64>()
            .round() as usize
    }

    /// Posterior standard deviation \[rows\]: that of the places, and that of the rows within a group.
    pub fn std_rows(&self) -> f64 {
        let mean = self.row() as f64;
        let squares = self.places.iter();
        let variance: f64 = squares
            .map(|place| {
                let within = (place.rows as f64).powi(2) / 12.0;
                place.probability * ((place.row as f64 - mean).powi(2) + within)
            })
            .sum();
        variance.sqrt()
    }
}

/// Groups of rows in an interval: equal steps, and gaps, whose rows have equal likelihood; each row with the number it
/// represents.
fn groups(within: &Range<usize>, gaps: &[Range<usize>]) -> Vec<(Vec<usize>, usize)> {
    let is_reached = |gap: &&Range<usize>| gap.start <= within.end && gap.end >= within.start;
    let reached: Vec<&Range<usize>> = gaps.iter().filter(is_reached).collect();
    let step = within.len().div_ceil(SEEN_PLACES).max(1);
    let is_hidden = |row: &usize| {
        let mut gaps = reached.iter();
        gaps.any(|gap| (gap.start..=gap.end).contains(row))
    };
    let seen = (within.start + step / 2..within.end)
        .step_by(step)
        .filter(|row| !is_hidden(row))
        .map(|row| (vec![row], step));
    let unseen = reached.iter().map(|gap| {
        let step = (gap.len() + 1).div_ceil(GAP_PLACES);
        let rows = (gap.start + step / 2..=gap.end).step_by(step);
        (rows.collect(), step)
    });
    seen.chain(unseen).collect()
}

#[cfg(test)]
mod tests {
    use super::Instant;
    use crate::transform::Transform;
    use crate::{NoiseLevels, Observations};

    const ROWS: usize = 2000;

    /// White noise of variance 4.
    const LEVELS: NoiseLevels = NoiseLevels {
        white: 4.0,
        angle: 0.0,
        flicker: 0.0,
        walk: 0.0,
    };

    /// Posterior of a step in a record of which some rows are not seen.
    fn instant(record: &[f64], gap: std::ops::Range<usize>, sigmas: f64) -> Instant {
        let mut seen = vec![true; ROWS];
        seen[gap].fill(false);
        let observations = Observations::bridged(&seen).expect("rows");
        let (transform, basis) = Transform::with_basis(observations, LEVELS);
        Instant::around(&transform, &basis, LEVELS, record, (1203, sigmas))
    }

    /// A large step is located to a row in spite of the coarse first grid; for a weak one the spread of the rows within a
    /// group adds to that of the groups.
    #[test]
    fn the_deviation_of_an_instant_does_not_depend_on_how_far_around_it_is_looked() {
        for (size, expected) in [(1.0, 8.0 * 2.0_f64.sqrt()), (20.0, 12.0_f64.sqrt().recip())] {
            let mut record = vec![0.0; ROWS];
            record[1200..].fill(size);
            for sigmas in [14.0, 6.0] {
                let known = instant(&record, 0..0, sigmas);
                assert!(known.row().abs_diff(1200) <= 1, "{}", known.row());
                let std = known.std_rows();
                assert!(
                    (std / expected - 1.0).abs() < 0.15,
                    "{size} {sigmas}: {std}"
                );
            }
        }
    }

    /// White noise of variance 4 with a step of 1, 14 standard deviations: its row is resolved to some (2/1)² rows; in a gap
    /// its posterior is uniform.
    #[test]
    fn the_instant_of_a_step_is_known_to_some_rows_and_in_a_gap_to_the_gap() {
        let mut record = vec![0.0; ROWS];
        record[1200..].fill(1.0);
        let known = instant(&record, 0..0, 14.0);
        assert!(known.row().abs_diff(1200) <= 1, "{}", known.row());
        // Without noise in the record ln p falls by ½ · ¼ a row, on both sides: a standard deviation of √2 · 8 rows.
        let std = known.std_rows();
        assert!((std / (8.0 * 2.0_f64.sqrt()) - 1.0).abs() < 0.1, "{std}");
        let hidden = instant(&record, 1150..1350, 14.0);
        assert!(hidden.row().abs_diff(1250) < 4, "{}", hidden.row());
        let std = hidden.std_rows();
        assert!((std / (200.0 / 12.0_f64.sqrt()) - 1.0).abs() < 0.1, "{std}");
        let sizes = hidden.places.iter();
        let size: f64 = sizes.map(|place| place.probability * place.size).sum();
        assert!((size - 1.0).abs() < 1e-3, "{size}");
    }
}
