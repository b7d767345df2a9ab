//! Medians and other quantiles of a sample.

/// Median; the upper one of an even number. `None` without values.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// Value with a share of all values below it. `None` without values.
pub fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let last = values.len().checked_sub(1)?;
    let place = ((share * values.len() as f64) as usize).min(last);
    Some(*values.select_nth_unstable_by(place, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::{median, quantile};

    #[test]
    fn quantiles_are_values_of_the_sample() {
        assert_eq!(median([]), None);
        assert_eq!(median([3.0]), Some(3.0));
        assert_eq!(median([9.0, 1.0, 5.0]), Some(5.0));
        assert_eq!(median([9.0, 1.0, 5.0, 7.0]), Some(7.0));
        let tens = || (0..10).rev().map(f64::from);
        for (share, value) in [(0.0, 0.0), (0.2, 2.0), (0.99, 9.0), (1.0, 9.0)] {
            assert_eq!(quantile(tens(), share), Some(value), "{share}");
        }
    }
}
