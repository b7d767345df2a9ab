//! The strongest spectral line of a residual, against the local noise power.

use rlg_plan::LineScanPlan;

use crate::noise_estimate::median;

/// A spectral line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Frequency as a share of the row rate.
    pub share: f64,
    /// Ratio of its power to the median of its neighbours' \[1\].
    pub ratio: f64,
}

impl Line {
    /// Gain in log likelihood over the neighbouring power, less the price of the search over `places`. The fitted noise is not
    /// used: coloured noise is no line. The median of a pair is 2 ln 2.
    pub fn surplus(&self, places: f64) -> f64 {
        self.ratio * std::f64::consts::LN_2 - places.ln()
    }
}

/// Finds the strongest line of a span.
///
/// # Inputs
/// `residual`: coefficients of the span, `rows` of them from the first on. A line between two coefficients appears in both,
/// so pairs are summed. The fitted noise is not used: a line absorbed by a drift term is found as well.
pub fn strongest(residual: &[f64], rows: usize, plan: &LineScanPlan) -> Option<Line> {
    let LineScanPlan { block: each, first } = *plan;
    let power: Vec<f64> = residual[..rows].iter().map(|c| c * c).collect();
    let pairs: Vec<f64> = power.windows(2).map(|pair| pair[0] + pair[1]).collect();
    let medians: Vec<f64> = pairs
        .chunks(each)
        .map(|block| median(block.iter().copied()))
        .collect();
    // In a steep spectrum the larger of two neighbouring medians is used.
    let beside = |k: usize| {
        let block = k / each;
        let other = if k % each < each / 2 {
            block.saturating_sub(1)
        } else {
            block + 1
        };
        medians[block].max(medians.get(other).copied().unwrap_or(0.0))
    };
    let best = (first..pairs.len())
        .map(|k| (k, pairs[k] / beside(k)))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let near = best.0.saturating_sub(1)..(best.0 + 3).min(power.len());
    let (sum, weighed) = near.fold((0.0, 0.0), |(sum, weighed), k| {
        (sum + power[k], weighed + power[k] * k as f64)
    });
    Some(Line {
        share: 0.5 * weighed / sum / rows as f64,
        ratio: best.1,
    })
}

#[cfg(test)]
mod tests {
    use super::strongest;
    use crate::Dct;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rlg_plan::LineScanPlan;

    #[test]
    fn a_line_in_noise_is_found_at_its_frequency() {
        let rows = 6000;
        let rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let noise: Vec<f64> = StandardNormal.sample_iter(rng).take(rows).collect();
        let turn = std::f64::consts::TAU * 0.0123;
        let mut record: Vec<f64> = (0..rows)
            .map(|row| noise[row] + 0.4 * (turn * row as f64 + 0.7).sin())
            .collect();
        Dct::new(rows).forward(&mut record);
        let line = strongest(&record, rows, &LineScanPlan::default()).expect("rows enough");
        assert!((line.share - 0.0123).abs() < 0.5 / rows as f64, "{line:?}");
        assert!(line.ratio > 50.0, "{line:?}");
    }
}
