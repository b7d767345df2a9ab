//! Noise beyond what the model declares: physics that shows only in the spectrum.
//!
//! Enters: fitted and declared noise. Leaves: [`Excess`] of random walk (`angle_random_walk`, which lock-in
//! imitates) and of white angle noise (`pulse_quantisation`: a step q leaves q²/12), in units of their kinds. What is
//! there only while the unit moves is no noise of the instrument: it stays a location.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::declare::FAMILY_SIGNIFICANCE;
use super::hunt::VETO;
use super::noise::{self, Declared, Noise};
use super::portion::{Bins, Portion};
use super::scene::Scene;
use super::split::{Regime, intersect};
pub use rlg_findings::excess::{Excess, PULSES, WALK};
pub use rlg_model::kinds::NOISE_KINDS;

/// Less than a tenth more noise than declared is no finding.
pub const LEAST_EXCESS: f64 = 1.1;

/// Levels that are compared: two on each of three gyros.
const TRIALS: f64 = 6.0;

/// What the fitted rows leave, and where.
pub struct Left<'a> {
    /// Motion.
    pub scene: &'a Scene,
    /// Stretches of like motion.
    pub regimes: &'a [Regime],
    /// The fitted rows.
    pub portion: &'a Portion,
    /// What everything found leaves of them.
    pub bins: &'a [Bins; 3],
    /// Fitted noise.
    pub noise: &'a [Noise; 3],
}

/// The excess, and the noise to locate by: with a level that only motion raises put back to what the model declares.
pub struct Compared {
    /// By kind.
    pub found: Vec<Excess>,
    /// Noise that is the instrument's own.
    pub own: [Noise; 3],
}

/// Compares fitted with declared levels in what everything found leaves. The noise fit keeps a declared level
/// unless the data contradict it beside a generous library; what differs here must contradict it beside what was found.
pub fn excess(given: &Left, declared: &[Declared; 3]) -> Compared {
    let Left {
        portion,
        bins: left,
        noise,
        ..
    } = *given;
    let mut found = Vec::new();
    let mut own = *noise;
    let mut compare = |term: usize,
                       of: &dyn Fn(&Declared) -> Option<f64>,
                       unit_of: &dyn Fn(f64, f64) -> f64,
                       mut entry: Excess| {
        let mut any = false;
        for axis in 0..3 {
            let Some(level) = of(&declared[axis]) else {
                continue;
            };
            let fitted = noise[axis].theta[term];
            if fitted > LEAST_EXCESS * level && given.follows_motion(axis, term) {
                own[axis].theta[term] = level;
            } else if fitted > LEAST_EXCESS * level {
                entry.values[axis] = unit_of(fitted - level, noise[axis].rate_hz);
                // d√(θ − θ0) = dθ/(2 √(θ − θ0)).
                let error = noise::level_error(&noise[axis], portion, term);
                entry.stds[axis] = entry.values[axis] * 0.5 * fitted / (fitted - level) * error;
                let ratio =
                    noise::ratio_over_level(portion, &left[axis], &noise[axis], term, level);
                // More noise only, so half of the two-sided chance.
                let chance = 0.5 * ChiSquared::new(1.0).map_or(1.0, |law| law.sf(ratio));
                let p_value = -(TRIALS * (-chance).ln_1p()).exp_m1();
                entry.p_value = entry.p_value.min(p_value);
                entry.log_likelihood_gain += 0.5 * ratio;
                any = true;
            }
        }
        if any && entry.p_value < FAMILY_SIGNIFICANCE {
            found.push(entry);
        }
    };
    compare(
        0,
        &|declared| declared.random_walk,
        &|theta, rate_hz| (theta * rate_hz).sqrt(),
        WALK,
    );
    compare(
        1,
        &|declared| declared.white_angle,
        &|theta, _| (12.0 * theta).sqrt(),
        PULSES,
    );
    Compared { found, own }
}

impl Left<'_> {
    /// Whether the power in a term's band differs between stretches of like motion by more than a chance of
    /// [`VETO`] (Bartlett's test), and is below its mean where the unit moves least.
    fn follows_motion(&self, axis: usize, term: usize) -> bool {
        /// Degrees of freedom below which a variance says too little for Bartlett's test.
        const LEAST_DEGREES: f64 = 5.0;
        let bands: Vec<Band> = self.bands(axis, term);
        let bands: Vec<&Band> = bands
            .iter()
            .filter(|band| band.degrees >= LEAST_DEGREES)
            .collect();
        let degrees: f64 = bands.iter().map(|band| band.degrees).sum();
        let weighed = |of: &dyn Fn(&Band) -> f64| -> f64 {
            bands.iter().map(|band| band.degrees * of(band)).sum()
        };
        let mean = weighed(&|band| band.variance) / degrees;
        let Some(quietest) = bands.iter().min_by(|a, b| a.rate.total_cmp(&b.rate)) else {
            return false;
        };
        let others = bands.len() as f64 - 1.0;
        let Ok(law) = ChiSquared::new(others) else {
            return false;
        };
        let inverse: f64 = bands.iter().map(|band| band.degrees.recip()).sum();
        let correction = 1.0 + (inverse - degrees.recip()) / (3.0 * others);
        let statistic = weighed(&|band| (mean / band.variance).ln()) / correction;
        quietest.variance < mean && law.sf(statistic) < VETO
    }

    /// What the term's best filter, its share of S, passes in each stretch.
    fn bands(&self, axis: usize, term: usize) -> Vec<Band> {
        let portion = self.portion;
        let weights = self.noise[axis].weights(portion);
        let alone = noise::of_one_term(&self.noise[axis], portion, term);
        let shares: Vec<f64> = alone.iter().zip(&weights).map(|(own, w)| own * w).collect();
        let filtered: Bins = self.bins[axis]
            .iter()
            .zip(weights.iter().zip(&shares))
            .map(|(bin, (weight, share))| bin * weight.sqrt() * *share)
            .collect();
        let [second, fourth] = [2, 4].map(|power| {
            let each = shares.iter().enumerate();
            each.map(|(bin, share)| portion.degrees(bin) * share.powi(power))
                .sum::<f64>()
        });
        let degrees_a_row = second * second / fourth / portion.rows() as f64;
        let values = portion.rows_of(&filtered);
        let rows: Vec<usize> = portion.ranges.iter().flat_map(Clone::clone).collect();
        let rate = &self.scene.rate_rad_s;
        let of_regime = |regime: &Regime| {
            let inside = intersect(&portion.ranges, std::slice::from_ref(&regime.rows));
            let (mut count, mut variance, mut turned) = (0.0, 0.0, 0.0);
            for range in inside {
                let first = rows.partition_point(|row| *row < range.start);
                for (row, value) in range.zip(&values[first..]) {
                    count += 1.0;
                    variance += value * value;
                    turned += rate.iter().map(|axis| axis[row].powi(2)).sum::<f64>();
                }
            }
            Band {
                degrees: degrees_a_row * count,
                variance: variance / count,
                rate: turned / count,
            }
        };
        self.regimes.iter().map(of_regime).collect()
    }
}

/// Power in a term's band over one stretch of like motion.
struct Band {
    /// Degrees of freedom.
    degrees: f64,
    /// Mean square.
    variance: f64,
    /// Mean square rate of the case.
    rate: f64,
}
