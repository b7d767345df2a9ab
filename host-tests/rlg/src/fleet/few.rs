//! Distinguishes one of three or four instruments from the others by the scatter of their own recordings.
//!
//! Of so few the spread between instruments is hardly known: a median deviation of three is that of two. Two tests apply
//! together. The distance from the mean of the others must exceed the scatter of an instrument's recordings about their own
//! mean, pooled over instruments: Student's t of a contrast in a one-way classification (Scheffé, The Analysis of Variance,
//! 1959, §3.4). And the others must lie close together compared with it: Dixon's ratio of the gap to the whole range (Dixon
//! 1953).

use std::collections::BTreeMap;

use super::statistics::{Fleet, Measured, Place, mean, normal_chance, student_chance};

/// Dixon's r10 at 95 %, two-sided, by number of values (Rorabacher 1991, table 1).
const DIXON: [(usize, f64); 2] = [(3, 0.970), (4, 0.829)];

/// Places every instrument among the others.
///
/// # Returns
/// None if no instrument has two recordings, so that the scatter is unknown, or for a number of instruments without a
/// critical ratio.
pub(super) fn places(
    by_instrument: &BTreeMap<String, Vec<Measured>>,
    outlier_z: f64,
) -> BTreeMap<String, Place> {
    let critical = DIXON
        .iter()
        .find(|(count, _)| *count == by_instrument.len());
    let (Some((_, ratio)), Some(scatter)) = (critical, Scatter::of(by_instrument)) else {
        return BTreeMap::new();
    };
    let means: Vec<(&String, f64, usize)> = by_instrument
        .iter()
        .filter_map(|(name, all)| Some((name, mean(all)?.value, all.len())))
        .collect();
    let place = |&(name, own, count): &(&String, f64, usize)| {
        let others = means.iter().filter(|(other, ..)| *other != name);
        let (values, inverse): (Vec<f64>, Vec<f64>) = others
            .map(|(_, value, count)| (*value, 1.0 / *count as f64))
            .unzip();
        let known = values.len() as f64;
        let middle = values.iter().sum::<f64>() / known;
        let share = 1.0 / count as f64 + inverse.iter().sum::<f64>() / (known * known);
        let t = (own - middle) / (scatter.std * share.sqrt());
        let fleet = Fleet {
            median: middle,
            ..Fleet::of(&values)?
        };
        let is_beyond = student_chance(t, scatter.freedom) < normal_chance(outlier_z);
        let place = Place {
            fleet,
            z: t,
            is_outlier: is_beyond && gap(own, &values) > *ratio,
        };
        Some((name.clone(), place))
    };
    means.iter().filter_map(place).collect()
}

/// Gap between a value and the nearest other over the range of all; 0 if it lies between them.
fn gap(own: f64, others: &[f64]) -> f64 {
    let least = others.iter().copied().fold(f64::INFINITY, f64::min);
    let most = others.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let outside = (least - own).max(own - most);
    match outside > 0.0 {
        true => outside / (outside + most - least),
        false => 0.0,
    }
}

/// Scatter of recordings about the mean of their own instrument.
struct Scatter {
    std: f64,
    freedom: usize,
}

impl Scatter {
    /// Pools the scatter of all instruments; it is at least the recordings' own σ.
    fn of(by_instrument: &BTreeMap<String, Vec<Measured>>) -> Option<Self> {
        let (mut squares, mut freedom, mut own, mut count) = (0.0, 0, 0.0, 0.0);
        for all in by_instrument.values() {
            let middle = mean(all)?.value;
            freedom += all.len() - 1;
            for one in all {
                squares += (one.value - middle).powi(2);
                own += one.std * one.std;
                count += 1.0;
            }
        }
        let square = (squares / freedom as f64).max(own / count);
        (freedom > 0 && square > 0.0).then(|| Self {
            std: square.sqrt(),
            freedom,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Recordings of instruments about these values, scattered by ±`scatter`.
    fn fleet(middles: &[f64], scatter: f64, recordings: usize) -> BTreeMap<String, Vec<Measured>> {
        let of = |(place, middle): (usize, &f64)| {
            let signs = (0..recordings).map(|k| if k % 2 == 0 { 1.0 } else { -1.0 });
            let all = signs.map(|sign| Measured {
                value: middle + sign * scatter,
                std: 0.1 * scatter,
            });
            (format!("u{place}"), all.collect())
        };
        middles.iter().enumerate().map(of).collect()
    }

    fn outliers(of: &BTreeMap<String, Vec<Measured>>) -> Vec<String> {
        let all = places(of, 3.5).into_iter();
        let far = all.filter(|(_, place)| place.is_outlier);
        far.map(|(name, _)| name).collect()
    }

    #[test]
    fn one_of_three_fifty_times_its_own_scatter_off_stands_out() {
        let three = fleet(&[0.0, 4.0, 880.0], 17.6, 20);
        assert_eq!(outliers(&three), ["u2"]);
        let z = places(&three, 3.5)["u2"].z;
        // 878 over 17.6 √(20/19) √(1/20 + 1/40)
        assert!((z - 177.6).abs() < 0.1, "{z}");
    }

    #[test]
    fn three_that_all_differ_have_no_outlier_and_neither_have_three_alike() {
        assert!(outliers(&fleet(&[0.0, 400.0, 880.0], 17.6, 20)).is_empty());
        assert!(outliers(&fleet(&[0.0, 3.0, 8.0], 17.6, 20)).is_empty());
    }

    #[test]
    fn one_recording_each_shows_no_scatter() {
        assert!(places(&fleet(&[0.0, 1.0, 880.0], 1.0, 1), 3.5).is_empty());
    }

    #[test]
    fn two_recordings_are_too_few_for_a_small_distance() {
        // 3.6 σ by a normal law, three degrees of freedom.
        let of = fleet(&[0.0, 0.0, 4.4], 1.0, 2);
        assert!(places(&of, 3.5)["u2"].z > 3.0 && outliers(&of).is_empty());
    }
}
