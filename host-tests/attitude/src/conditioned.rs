//! The motion that columns are made of: the gyros' own, without what is noise at a frequency.
//!
//! Derivatives of a raw record are mostly noise of its highest frequencies, and a column with noise of its own is
//! underestimated; worse, the same noise is in the rows, which would call for whatever takes it out of the gyros. Each axis passes
//! a Wiener weight 1 − N/P of its own power P and of the most that noise makes of a bin: white noise of rate and of angle, as much
//! as fits below P everywhere, and the scatter of a bin that averages few periodogram lines. Beyond its ends the record goes on as
//! its own past predicts.

use nalgebra::Vector3;
use realfft::num_complex::Complex64;
use rlg_signal::axes::Triad;
use rlg_signal::derivatives::Spectrum;
use rlg_signal::linear_prediction::extended;
use rlg_signal::transforms::mean_periodogram;

/// Longest piece of the averaged spectrum \[rows\].
const PIECE_ROWS: usize = 4096;

/// Time whose rows predict the next one \[s\], and their number at least and at most.
const PREDICTED_BY_S: f64 = 0.25;
const LEAST_ORDER: usize = 16;
const MOST_ORDER: usize = 256;

/// Bins of a spectrum within a factor of this are averaged.
const BIN_WIDTH: f64 = 1.12;

/// Increments of three axes, conditioned.
pub fn conditioned(increments_rad: &[Vector3<f64>], rate_hz: f64) -> Triad {
    std::array::from_fn(|axis| {
        let values: Vec<f64> = increments_rad.iter().map(|row| row[axis]).collect();
        let weight = Weight::new(&values);
        let of_hz = |hz: f64| Complex64::new(weight.at(hz / rate_hz), 0.0);
        let beyond = PIECE_ROWS.min(values.len() / 2);
        let order = ((PREDICTED_BY_S * rate_hz) as usize).clamp(LEAST_ORDER, MOST_ORDER);
        let record = extended(&values, beyond, order);
        let through = Spectrum::new(&record, rate_hz).through(of_hz);
        through[beyond..beyond + values.len()].to_vec()
    })
}

/// Wiener weight by frequency.
struct Weight {
    /// Upper edge of each bin \[cycles per row\], and its weight.
    bins: Vec<(f64, f64)>,
}

impl Weight {
    fn new(values: &[f64]) -> Self {
        let piece = PIECE_ROWS.min(values.len() / 4).max(2) & !1;
        let power = mean_periodogram(values, piece);
        let mut bins: Vec<(f64, f64)> = Vec::new();
        // Half-overlapping Hann-windowed pieces; a window spreads a line over one and a half.
        let pieces = (2 * values.len() / piece) as f64 - 1.0;
        let mut scatter: Vec<f64> = Vec::new();
        let mut begin = 1;
        while begin < power.len() {
            let end = ((begin as f64 * BIN_WIDTH) as usize)
                .max(begin + 1)
                .min(power.len());
            let mean = power[begin..end].iter().sum::<f64>() / (end - begin) as f64;
            bins.push(((end as f64 - 0.5) / piece as f64, mean));
            let lines = ((end - begin) as f64 / 1.5).max(1.0);
            scatter.push((pieces * lines).sqrt().recip());
            begin = end;
        }
        let lambda = |share: f64| 4.0 * (std::f64::consts::PI * share).sin().powi(2);
        /// Standard deviations that a bin of noise may stand off its mean.
        const OFF: f64 = 4.0;
        // A bin of few lines lies below its mean by chance.
        let least = |of: &dyn Fn(f64, f64) -> f64, from: f64| {
            let above = bins.iter().zip(&scatter);
            above
                .filter(|((share, _), _)| *share > from)
                .map(|((share, power), scatter)| of(*share, power * (1.0 + OFF * scatter)))
                .fold(f64::INFINITY, f64::min)
        };
        let white = least(&|_, power| power, 0.0);
        let angle = least(
            &|share, power| (power - white).max(0.0) / lambda(share),
            0.25,
        );
        let angle = if angle.is_finite() { angle } else { 0.0 };
        // The least of many averaged powers lies below their mean.
        const MARGIN: f64 = 1.5;
        let weighted = bins.iter().zip(&scatter).map(|(&(share, power), scatter)| {
            let most = MARGIN * (1.0 + OFF * scatter);
            let noise = most * (white + angle * lambda(share));
            (share, (1.0 - noise / power.max(f64::MIN_POSITIVE)).max(0.0))
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
