//! Wiener-filtered motion of the gyros, from which columns are formed.
//!
//! Derivatives of a raw record are mostly noise of its highest frequencies; a column with noise of its own is underestimated
//! (errors in variables), and the same noise in the rows would favour any effect that subtracts it from the gyros. Each axis
//! passes a Wiener weight 1 − N/P of its power P and of the largest noise N of a bin: white noise of rate and of angle, as
//! much as fits below P at all frequencies, and the scatter of a bin that averages few periodogram lines. Beyond its ends
//! the record is extended by linear prediction.

use nalgebra::Vector3;
use realfft::num_complex::Complex64;
use rlg_plan::ConditioningPlan;
use rlg_signal::axes::Triad;
use rlg_signal::derivatives::Spectrum;
use rlg_signal::linear_prediction::extended;
use rlg_signal::transforms::mean_periodogram;

/// Wiener-filters increments of three axes.
pub fn conditioned(
    increments_rad: &[Vector3<f64>],
    rate_hz: f64,
    plan: &ConditioningPlan,
) -> Triad {
    let [least_order, most_order] = plan.predictor_orders;
    std::array::from_fn(|axis| {
        let values: Vec<f64> = increments_rad.iter().map(|row| row[axis]).collect();
        let weight = Weight::new(&values, plan);
        let of_hz = |hz: f64| Complex64::new(weight.at(hz / rate_hz), 0.0);
        let beyond = plan.piece_rows.min(values.len() / 2);
        let order = ((plan.predicted_by_s * rate_hz) as usize).clamp(least_order, most_order);
        let record = extended(&values, beyond, order);
        let through = Spectrum::new(&record, rate_hz).through(of_hz);
        through[beyond..beyond + values.len()].to_vec()
    })
}

/// Estimates the variance of white noise in a row of a gyro's increments \[rad²\]: as much as fits, with white noise of
/// angle, below the power at every frequency. High frequencies determine it; at low ones motion masks it.
pub fn white_noise_rad2(increments_rad: &[f64], plan: &ConditioningPlan) -> f64 {
    /// Number of steps from zero to the largest white noise of angle.
    const TRIED: usize = 20;
    let mut bins = bins(increments_rad, plan);
    bins.retain(|bin| bin.scatter < plan.known);
    let highest = || bins.iter().filter(|bin| bin.share > plan.high_per_row);
    let most = highest().map(|bin| bin.power / lambda(bin.share));
    let most = most.fold(f64::INFINITY, f64::min);
    if !most.is_finite() {
        return 0.0;
    }
    let tried = (0..=TRIED).map(|k| {
        let angle = most * k as f64 / TRIED as f64;
        let above = bins.iter().map(|bin| bin.power - angle * lambda(bin.share));
        let white = above.fold(f64::INFINITY, f64::min).max(0.0);
        let cost = |bin: &Bin| {
            let power = (white + angle * lambda(bin.share)).max(f64::MIN_POSITIVE);
            power.ln() + bin.power / power
        };
        (highest().map(cost).sum::<f64>(), white)
    });
    let likeliest = tried.min_by(|a, b| a.0.total_cmp(&b.0));
    likeliest.map_or(0.0, |(_, white)| white)
}

/// Mean power over some lines of a periodogram.
struct Bin {
    /// Upper edge \[cycles per row\].
    share: f64,
    power: f64,
    /// Relative standard deviation of the power.
    scatter: f64,
}

/// Spectrum of white noise of angle in increments, per unit variance.
fn lambda(share: f64) -> f64 {
    4.0 * (std::f64::consts::PI * share).sin().powi(2)
}

fn bins(values: &[f64], plan: &ConditioningPlan) -> Vec<Bin> {
    let piece = plan.piece_rows.min(values.len() / 4).max(2) & !1;
    let power = mean_periodogram(values, piece);
    // Welch's method: half-overlapping Hann-windowed segments; a window spreads a line over one and a half.
    let pieces = (2 * values.len() / piece) as f64 - 1.0;
    let mut bins: Vec<Bin> = Vec::new();
    let mut begin = 1;
    while begin < power.len() {
        let end = ((begin as f64 * plan.bin_ratio) as usize)
            .max(begin + 1)
            .min(power.len());
        let lines = ((end - begin) as f64 / 1.5).max(1.0);
        bins.push(Bin {
            share: (end as f64 - 0.5) / piece as f64,
            power: power[begin..end].iter().sum::<f64>() / (end - begin) as f64,
            scatter: (pieces * lines).sqrt().recip(),
        });
        begin = end;
    }
    bins
}

/// Wiener weight by frequency.
struct Weight {
    /// Upper edge of each bin \[cycles per row\], and its weight.
    bins: Vec<(f64, f64)>,
}

impl Weight {
    fn new(values: &[f64], plan: &ConditioningPlan) -> Self {
        let bins = bins(values, plan);
        let least = |of: &dyn Fn(f64, f64) -> f64, from: f64| {
            let above = bins.iter().filter(|bin| bin.share > from);
            above
                .map(|bin| of(bin.share, bin.power * (1.0 + plan.scatter * bin.scatter)))
                .fold(f64::INFINITY, f64::min)
        };
        let white = least(&|_, power| power, 0.0);
        let angle = least(
            &|share, power| (power - white).max(0.0) / lambda(share),
            plan.high_per_row,
        );
        let angle = if angle.is_finite() { angle } else { 0.0 };
        let weighted = bins.iter().map(|bin| {
            let most = plan.margin * (1.0 + plan.scatter * bin.scatter);
            let noise = most * (white + angle * lambda(bin.share));
            let weight = (1.0 - noise / bin.power.max(f64::MIN_POSITIVE)).max(0.0);
            (bin.share, weight)
        });
        Self {
            bins: weighted.collect(),
        }
    }

    fn at(&self, share: f64) -> f64 {
        let place = self.bins.partition_point(|(edge, _)| *edge < share);
        // Below the first bin lies the mean motion, which is no noise.
        self.bins
            .get(place)
            .map_or(0.0, |(_, weight)| if place == 0 { 1.0 } else { *weight })
    }
}

#[cfg(test)]
mod tests {
    use rlg_plan::ConditioningPlan;

    use super::white_noise_rad2;

    /// Approximately normal noise: sums of twelve uniform numbers of a generator that is the same on every machine.
    fn noise(rows: usize) -> Vec<f64> {
        let mut state = 7u64;
        let mut number = move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 33) as f64 / (1u64 << 31) as f64
        };
        let sum = |_| (0..12).map(|_| number()).sum::<f64>() - 6.0;
        (0..rows).map(sum).collect()
    }

    #[test]
    fn white_noise_is_told_from_motion_and_from_white_noise_of_angle() {
        let white = noise(40_000);
        let moving: Vec<f64> = white
            .iter()
            .enumerate()
            .map(|(row, noise)| noise + 300.0 * (0.05 * row as f64).sin())
            .collect();
        let plan = ConditioningPlan::default();
        let found = white_noise_rad2(&moving, &plan);
        assert!((0.6..1.1).contains(&found), "{found}");
        let angle: Vec<f64> = white.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let found = white_noise_rad2(&angle, &plan);
        assert!(found < 0.05, "{found}");
    }
}
