//! Probability laws for the scores.
//!
//! Clopper–Pearson limits of a share, and the probability that a likelihood ratio with a given noncentrality exceeds a
//! threshold.

use statrs::distribution::{Beta, ChiSquared, ContinuousCDF as _};

/// Probability beyond each end of an interval: 95 % two-sided.
const TAIL: f64 = 0.025;

/// Two-sided 95 % limits of a share after `hits` of `trials` (Clopper and Pearson 1934).
pub fn limits(hits: usize, trials: usize) -> [f64; 2] {
    [
        bound(hits, trials, TAIL, false),
        bound(hits, trials, TAIL, true),
    ]
}

/// One-sided 95 % upper limit of a share.
pub fn upper_limit(hits: usize, trials: usize) -> f64 {
    bound(hits, trials, 2.0 * TAIL, true)
}

fn bound(hits: usize, trials: usize, tail: f64, upper: bool) -> f64 {
    let (k, n) = (hits as f64, trials as f64);
    if upper {
        if hits >= trials {
            return 1.0;
        }
        Beta::new(k + 1.0, n - k).map_or(1.0, |law| law.inverse_cdf(1.0 - tail))
    } else {
        if hits == 0 {
            return 0.0;
        }
        Beta::new(k, n - k + 1.0).map_or(0.0, |law| law.inverse_cdf(tail))
    }
}

/// Power of the likelihood-ratio test at significance `significance`, for an effect of strength `rho` with `degrees`
/// parameters: a noncentral χ², as a Poisson mixture of central ones.
pub fn detection(rho: f64, degrees: usize, significance: f64) -> f64 {
    /// Standard deviations of the Poisson law in the sum: the remainder is 1e-15.
    const REACH: f64 = 8.0;
    let degrees = degrees.max(1) as f64;
    let Ok(law) = ChiSquared::new(degrees) else {
        return 0.0;
    };
    let threshold = law.inverse_cdf(1.0 - significance);
    let mean = 0.5 * rho * rho;
    let last = (mean + REACH * mean.sqrt() + REACH * REACH) as usize;
    let mut log_weight = -mean;
    let mut chance = 0.0;
    for term in 0..=last {
        if term > 0 {
            log_weight += mean.ln() - (term as f64).ln();
        }
        if let Ok(law) = ChiSquared::new(degrees + 2.0 * term as f64) {
            chance += log_weight.exp() * law.sf(threshold);
        }
    }
    chance.min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn none_of_a_thousand_bounds_the_share_by_three_in_a_thousand() {
        // 1 - 0.05^(1/1000)
        assert!((upper_limit(0, 1000) - 2.991e-3).abs() < 2e-6);
        // The two-sided table value of 5 in 20.
        let [low, high] = limits(5, 20);
        assert!((low - 0.0866).abs() < 1e-4 && (high - 0.4910).abs() < 1e-4);
    }

    #[test]
    fn the_marks_theory_is_that_of_six_parameters_at_the_tools_significance() {
        // The marks state 0.87, 0.98 and 1.00 at 6, 7 and 10.
        let chance = |rho| detection(rho, 6, 1e-4 / 3.0);
        assert!((chance(6.0) - 0.87).abs() < 0.05, "{}", chance(6.0));
        assert!((chance(7.0) - 0.98).abs() < 0.02, "{}", chance(7.0));
        assert!(chance(10.0) > 0.999);
    }
}
