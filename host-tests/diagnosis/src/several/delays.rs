//! Joint estimate of the delays of several recordings.

/// Weighted mean of delays with its standard deviation \[s\]; `None` without any delay.
///
/// # Inputs
/// `each`: delay and standard deviation \[s\], the latter infinite for a recording without a delay.
pub(super) fn mean_delay(each: impl Iterator<Item = (f64, f64)>) -> Option<(f64, f64)> {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (value_s, std_s) in each.filter(|(_, std_s)| *std_s > 0.0) {
        sum += value_s * std_s.powi(-2);
        weights += std_s.powi(-2);
    }
    (weights > 0.0).then(|| (sum / weights, weights.sqrt().recip()))
}

/// Weighted mean of delays that agree \[s\], 0 without any delay; `None` if they differ.
///
/// # Inputs
/// `each`: as in [`mean_delay`]; `same`: largest distance of a delay from the mean \[σ\].
pub(super) fn joint_delay(each: &[(f64, f64)], same: f64) -> Option<f64> {
    let Some((mean_s, std_of_mean_s)) = mean_delay(each.iter().copied()) else {
        return Some(0.0);
    };
    // A recording without an estimated delay may have a weak one.
    let may_be = |(value_s, std_s): &(f64, f64)| match std_s.is_finite() {
        true => (value_s - mean_s).abs() < same * std_s,
        false => mean_s.abs() < 2.0 * same * std_of_mean_s,
    };
    each.iter().all(may_be).then_some(mean_s)
}

#[cfg(test)]
mod tests {
    use super::joint_delay;

    #[test]
    fn delays_are_one_where_each_recording_alone_allows_it() {
        const NONE: (f64, f64) = (0.0, f64::INFINITY);
        assert_eq!(joint_delay(&[NONE, NONE], 5.0), Some(0.0));
        let mean_s = joint_delay(&[(4.0e-4, 1e-6), (4.02e-4, 1e-6)], 5.0);
        assert!(mean_s.is_some_and(|mean_s| (mean_s - 4.01e-4).abs() < 1e-12));
        assert_eq!(joint_delay(&[(4.0e-4, 1e-6), (4.2e-4, 1e-6)], 5.0), None);
        // Weak and strong, given a recording without a delay.
        assert!(joint_delay(&[(5e-6, 1e-6), NONE], 5.0).is_some());
        assert_eq!(joint_delay(&[(4e-4, 1e-6), NONE], 5.0), None);
    }
}
