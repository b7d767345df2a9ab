//! Converts between rates sampled at an instant and means over a row, so that gyros and reference are comparable.
//!
//! `sampling = "instant"`: the value at the row's end, as of a logger that polls a sensor for its rate. Taken as a mean
//! it would appear half a row late. Gyros keep their values, whose noise is white: with gyros sampled at an instant,
//! means on the same rows are converted to instants; in all other cases instants are converted to means.
//!
//! The conversion is by the angle θ at the rows' ends: an instant is θ̇ there, a mean is the step of θ. Both filters
//! are maximally flat (Lagrange interpolation over up to [`MOST`] rows on either side; Fornberg 1988, Table 1):
//! accurate to 1e-4 below a fifth of the row rate, to 1 % below 0.28 of it. At half the row rate both have zero gain:
//! samples there carry no information on half a row earlier.

use std::path::Path;

use super::manifest::TableEntry;
use super::{Clock, Quantity, Table};
use crate::error::InputError;

/// Largest number of rows on either side in a filter.
const MOST: usize = 8;

/// Smallest number, at a gap or an end; with fewer a row is not measured, or is left out at an end.
const LEAST: usize = 4;

/// Tolerance for two clocks to count as one \[rows\].
const SAME_ROW: f64 = 0.01;

/// Quantities sampled at an instant or averaged over a row, or their sums over the row's period.
const OF_A_ROW: [Quantity; 4] = [
    Quantity::GyroRate,
    Quantity::ReferenceIncrement,
    Quantity::SpecificForce,
    Quantity::VelocityIncrement,
];

/// Output of a filter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Filter {
    /// Mean over a row, from instants at the rows' ends.
    Means,
    /// Instant at a row's end, from means over rows.
    Instants,
}

/// Converts the tables' values to instants or means, the same for gyros and the channels compared with them.
///
/// # Errors
/// Only some of the gyros are instants; or stamped instants, if means are needed.
pub(super) fn on_one_footing(
    path: &Path,
    entries: &[TableEntry],
    tables: &mut [Table],
) -> Result<(), InputError> {
    let is_instant = |table: usize, channel: usize| entries[table].channels[channel].is_instant();
    let places: Vec<(usize, usize)> = tables
        .iter()
        .enumerate()
        .flat_map(|(t, table)| (0..table.channels.len()).map(move |c| (t, c)))
        .filter(|&(t, c)| OF_A_ROW.contains(&tables[t].channels[c].quantity))
        .collect();
    if !places.iter().any(|&(t, c)| is_instant(t, c)) {
        return Ok(());
    }
    let keeps = keeps_instants(path, tables, &is_instant)?;
    let mut filtered: Vec<(usize, Filter)> = Vec::new();
    for (t, c) in places {
        if is_instant(t, c) == keeps {
            continue;
        }
        let table = &mut tables[t];
        if let Clock::Stamped { .. } = table.clock {
            return Err(InputError::new(
                path,
                "is sampled at an instant by stamps that are not even",
            )
            .channel(format!(
                "table {}, channel {}",
                table.file, table.channels[c].column
            ))
            .expected("rate_hz, for means over rows to be formed; or sampling = \"mean\""));
        }
        let filter = if keeps {
            Filter::Instants
        } else {
            Filter::Means
        };
        let values = &mut table.channels[c].values;
        *values = filter.of(values);
        filtered.push((t, filter));
    }
    filtered.dedup();
    for (t, filter) in filtered {
        filter.cut_ends(&mut tables[t]);
    }
    Ok(())
}

/// True if gyros are sampled at an instant and all channels compared with them are on their rows.
fn keeps_instants(
    path: &Path,
    tables: &[Table],
    is_instant: &impl Fn(usize, usize) -> bool,
) -> Result<bool, InputError> {
    let of = |wanted: &'static [Quantity]| {
        let rows = tables.iter().enumerate();
        rows.flat_map(move |(t, table)| {
            let channels = table.channels.iter().enumerate();
            channels
                .filter(|(_, channel)| wanted.contains(&channel.quantity))
                .map(move |(c, _)| (t, c))
        })
    };
    let gyros: Vec<(usize, usize)> = of(&Quantity::GYROS).collect();
    let instants = gyros.iter().filter(|&&(t, c)| is_instant(t, c)).count();
    if instants == 0 {
        return Ok(false);
    }
    if instants < gyros.len() {
        return Err(
            InputError::new(path, "samples some gyros at an instant and others not")
                .value(format!("{instants} of {}", gyros.len()))
                .expected("sampling = \"instant\" for all gyros or for none"),
        );
    }
    let has_attitude = of(&[Quantity::ReferenceAttitude]).next().is_some();
    let gyro_clock = &tables[gyros[0].0].clock;
    let on_rows =
        of(&[Quantity::ReferenceIncrement]).all(|(t, _)| same_rows(&tables[t].clock, gyro_clock));
    Ok(!has_attitude && on_rows)
}

/// True if the rows of two clocks end at the same times.
fn same_rows(one: &Clock, other: &Clock) -> bool {
    match (one, other) {
        (
            &Clock::Uniform { rate_hz, start_s },
            &Clock::Uniform {
                rate_hz: other_hz,
                start_s: other_s,
            },
        ) => {
            let offset = (start_s - other_s) * other_hz;
            rate_hz == other_hz && (offset - offset.round()).abs() < SAME_ROW
        }
        (one, other) => one == other,
    }
}

impl Filter {
    /// Filters a channel; NaN with fewer than [`LEAST`] measured rows on a side.
    fn of(self, values: &[f64]) -> Vec<f64> {
        let weights: Vec<Vec<f64>> = (0..=MOST).map(|rows| self.weights(rows)).collect();
        // Rows k−i and k+i−1 are symmetric about a row's middle, k+1−i and k+i about its end.
        let after = match self {
            Self::Means => 0,
            Self::Instants => 1,
        };
        let value = |row: usize| {
            let middle = row + after;
            let rows = middle.min(values.len().saturating_sub(middle)).min(MOST);
            let pair = |i: usize| values[middle - i] + values[middle + i - 1];
            let known = (1..=rows).take_while(|&i| pair(i).is_finite()).count();
            match known < LEAST {
                true => f64::NAN,
                false => (1..=known).map(|i| weights[known][i - 1] * pair(i)).sum(),
            }
        };
        (0..values.len()).map(value).collect()
    }

    /// Removes the rows at both ends of a table that have no value because rows beyond are missing.
    fn cut_ends(self, table: &mut Table) {
        let lead = match self {
            Self::Means => LEAST,
            Self::Instants => LEAST - 1,
        };
        let kept = lead.min(table.rows)..(table.rows + lead).saturating_sub(2 * LEAST - 1);
        if kept.is_empty() {
            // A table too short keeps its rows, all unmeasured.
            return;
        }
        table.keep(kept);
    }

    /// Weights of the pairs of rows, the nearest first, over `rows` rows on either side.
    fn weights(self, rows: usize) -> Vec<f64> {
        match self {
            Self::Means => (0..rows).map(|row| mean_weight(row, rows)).collect(),
            Self::Instants => {
                let mut sum = 0.0;
                let slopes: Vec<f64> = (1..=rows).map(|j| slope_weight(j, rows)).collect();
                // θ(k+j) − θ(k−j) contains every row nearer than j.
                let sums = slopes.iter().rev().map(|slope| {
                    sum += slope;
                    sum
                });
                let mut weights: Vec<f64> = sums.collect();
                weights.reverse();
                weights
            }
        }
    }
}

/// Weight of θ(j) − θ(−j) in the derivative at 0, over `n` steps on either side.
fn slope_weight(j: usize, n: usize) -> f64 {
    let share: f64 = (1..=n)
        .filter(|&other| other != j)
        .map(|other| {
            let (other, own) = ((other * other) as f64, (j * j) as f64);
            other / (other - own)
        })
        .product();
    share / (2.0 * j as f64)
}

/// Weight of the instants at ±(place + ½), of `n` such pairs, in the mean over −½ to ½: the mean of their Lagrange
/// polynomial.
fn mean_weight(place: usize, n: usize) -> f64 {
    /// Intervals of Simpson's rule: exact to rounding for a polynomial of this degree.
    const INTERVALS: usize = 512;
    let square = |place: usize| (place as f64 + 0.5).powi(2);
    let polynomial = |x: f64| -> f64 {
        (0..n)
            .filter(|&other| other != place)
            .map(|other| (x * x - square(other)) / (square(place) - square(other)))
            .product()
    };
    let sum: f64 = (0..=INTERVALS)
        .map(|step| {
            let weight = match step {
                0 | INTERVALS => 1.0,
                step if step % 2 == 1 => 4.0,
                _ => 2.0,
            };
            weight * polynomial(step as f64 / INTERVALS as f64 - 0.5)
        })
        .sum();
    // Half for each of the pair.
    0.5 * sum / (3.0 * INTERVALS as f64)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::{Filter, MOST};

    /// Rounding error of f64 in sums over rows.
    const ROUNDING: f64 = 1e-12;

    /// Bound of the derivative's relative error at `share` of the row rate: ω = sin ω Σ 4ᵐ m!²/(2m+1)! s²ᵐ with s = sin
    /// ω/2, truncated at m = [`MOST`]; the remaining terms decrease at least as fast as s²ᵐ.
    fn truncated(share: f64) -> f64 {
        let w = 2.0 * PI * share;
        let square = (w / 2.0).sin().powi(2);
        let first: f64 = (1..=MOST)
            .map(|m| square * (2 * m) as f64 / (2 * m + 1) as f64)
            .product();
        w.sin() / w * first / (1.0 - square)
    }

    /// Largest errors of both filters, for a tone at `share` of the row rate.
    fn errors(share: f64) -> [f64; 2] {
        let w = 2.0 * PI * share;
        let instants: Vec<f64> = (0..400).map(|row| (w * f64::from(row + 1)).sin()).collect();
        let angle = |k: f64| -(w * k).cos() / w;
        let means: Vec<f64> = (0..400)
            .map(|row| angle(f64::from(row + 1)) - angle(f64::from(row)))
            .collect();
        let worst = |made: Vec<f64>, right: &[f64]| {
            assert_eq!(made.len(), right.len());
            let inside = 10..made.len() - 10;
            inside
                .map(|row| (made[row] - right[row]).abs())
                .fold(0.0, f64::max)
        };
        [
            worst(Filter::Means.of(&instants), &means),
            worst(Filter::Instants.of(&means), &instants),
        ]
    }

    #[test]
    fn each_filter_undoes_what_the_sampling_did() {
        for share in [0.01, 0.1, 0.2, 1.0 / 3.0] {
            let errors = errors(share);
            let most = truncated(share) + ROUNDING;
            assert!(
                errors.iter().all(|error| *error < most),
                "{share}: {errors:?}"
            );
        }
    }

    #[test]
    fn a_constant_stays_and_what_stands_at_a_gap_is_not_measured() {
        let mut values = vec![2.5; 40];
        values[20] = f64::NAN;
        for filter in [Filter::Means, Filter::Instants] {
            let made = filter.of(&values);
            let known = made.iter().filter(|value| value.is_finite());
            assert!(known.clone().all(|value| (value - 2.5).abs() < 1e-12));
            // Three to four rows at either end, eight about the gap.
            assert_eq!(known.count(), 40 - 7 - 8, "{filter:?}");
        }
    }
}
