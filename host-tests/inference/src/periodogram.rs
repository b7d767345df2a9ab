//! Periodogram of lines at all frequencies, between the coefficients too: likelihood gain of a sine and a cosine.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;
use rlg_plan::PeriodogramPlan;

use crate::noise::{NoiseBasis, NoiseLevels};
use crate::noise_estimate::median;
use crate::transform::Transform;

/// A residual weighted by the inverse of its noise.
pub struct Weighed {
    /// S⁻¹ times the residual on rows, 0 where a row is not seen.
    pub rows: Vec<f64>,
    /// Number of seen rows.
    pub seen: usize,
    /// Noise power of each coefficient of the span.
    power: Vec<f64>,
    /// Noise power of each coefficient without drift.
    stationary: Vec<f64>,
}

impl Weighed {
    /// Weights a record by the inverse of its noise.
    ///
    /// # Inputs
    /// `transform`, `basis`: of one span; `seen`: usable rows.
    pub fn new(
        record: &[f64],
        seen: &[bool],
        (transform, basis): (&Transform, &NoiseBasis),
        levels: NoiseLevels,
    ) -> Self {
        let power = basis.by_coefficient(levels);
        let mut spectrum = transform.spectrum(record);
        let pairs = spectrum.iter_mut().zip(&power);
        pairs.for_each(|(value, power)| *value /= power);
        let mut rows = transform.rows_of(&spectrum);
        let unseen = rows.iter_mut().zip(seen).filter(|(_, seen)| !**seen);
        unseen.for_each(|(value, _)| *value = 0.0);
        Self {
            rows,
            seen: seen.iter().filter(|&&seen| seen).count(),
            stationary: basis.by_coefficient(levels.stationary()),
            power,
        }
    }

    /// Noise power at a frequency, as a share of the row rate.
    pub fn noise(&self, share: f64) -> f64 {
        self.power[self.coefficient(share)]
    }

    fn coefficient(&self, share: f64) -> usize {
        let place = (2.0 * share * self.power.len() as f64).round() as usize;
        place.min(self.power.len() - 1)
    }

    /// True if most of the noise at a frequency is drift, which may be a slow line.
    fn is_drift(&self, share: f64) -> bool {
        let place = self.coefficient(share);
        2.0 * self.stationary[place] < self.power[place]
    }
}

/// Likelihood gain of a line at each frequency.
pub struct Periodogram<'a> {
    weighed: &'a Weighed,
    /// 2 Δ ln L of a sine and a cosine.
    gains: Vec<f64>,
    padded: usize,
    /// Frequencies per resolution of the record.
    step: usize,
    plan: &'a PeriodogramPlan,
}

/// The strongest line of several records.
#[derive(Debug, Clone, PartialEq)]
pub struct Peak {
    /// Frequency as a share of the row rate.
    pub share: f64,
    /// ln of its false-alarm probability, over all frequencies.
    pub ln_chance: f64,
}

impl<'a> Periodogram<'a> {
    /// Transforms a weighted residual, with at least four frequencies a resolution.
    pub fn new(weighed: &'a Weighed, plan: &'a PeriodogramPlan) -> Self {
        let rows = weighed.rows.len();
        let padded = (4 * rows).next_power_of_two();
        let mut values = weighed.rows.clone();
        values.resize(padded, 0.0);
        let mut spectrum = vec![Complex64::ZERO; padded / 2 + 1];
        let forward = RealFftPlanner::new().plan_fft_forward(padded);
        // The lengths are those of the transform.
        let transformed = forward.process(&mut values, &mut spectrum);
        debug_assert!(transformed.is_ok());
        let scale = 2.0 / weighed.seen.max(1) as f64;
        let gains = spectrum.iter().enumerate().map(|(place, value)| {
            scale * value.norm_sqr() * weighed.noise(place as f64 / padded as f64)
        });
        Self {
            gains: gains.collect(),
            weighed,
            padded,
            step: padded / rows,
            plan,
        }
    }

    fn share(&self, place: usize) -> f64 {
        place as f64 / self.padded as f64
    }

    /// ln of the probability of a noise gain as large at one frequency: under the fitted noise, or under the local noise
    /// around it, the larger.
    fn ln_chance(&self, place: usize) -> f64 {
        let gain = self.gains[place];
        let (level, freedom) = self.beside(place);
        let local = -freedom * (0.5 * gain / level / freedom).ln_1p();
        match self.weighed.is_drift(self.share(place)) {
            true => local,
            false => local.max(-0.5 * gain),
        }
    }

    /// Ratio of the gains around a frequency to their expectation, by the median; and its effective number of samples.
    fn beside(&self, place: usize) -> (f64, f64) {
        /// Efficiency of the median of exponential variables: its variance is (ln 2)⁻² times that of the mean.
        const EFFICIENCY: f64 = std::f64::consts::LN_2 * std::f64::consts::LN_2;
        let away = self.plan.own + 1..=self.plan.around;
        let below = away
            .clone()
            .filter_map(|away| place.checked_sub(away * self.step));
        let above = away.map(|away| place + away * self.step);
        let near = below.filter(|&place| place > self.step).chain(above);
        let gains: Vec<f64> = near
            .filter_map(|place| self.gains.get(place).copied())
            .collect();
        if gains.is_empty() {
            return (1.0, 1.0);
        }
        let count = gains.len() as f64;
        let median = median(gains);
        // A gain of noise is exponential with mean 2.
        let level = 0.5 * median / std::f64::consts::LN_2;
        (level.max(f64::MIN_POSITIVE), EFFICIENCY * count)
    }
}

/// Finds the line of least false-alarm probability, on one record or on all together (Fisher's combination of p-values).
///
/// # Inputs
/// `is_free`: true for a frequency, as a share of the row rate, within the search.
pub fn strongest(records: &[Periodogram], is_free: impl Fn(f64) -> bool) -> Option<Peak> {
    let first = records.first()?;
    let count = records.len() as f64;
    // Number of trials: independent frequencies, and those between.
    let trials = 1.5 * first.weighed.rows.len() as f64;
    let plan = first.plan;
    let places = plan.least_turns * first.step..first.gains.len() - first.step;
    let all = |place: usize| records.iter().map(move |one| one.gains[place]);
    let strong = places.filter(|&place| all(place).sum::<f64>() > plan.least_gain);
    let peaks = strong.filter(|&place| is_free(first.share(place)));
    let peak = peaks.map(|place| {
        let each: Vec<f64> = records.iter().map(|one| one.ln_chance(place)).collect();
        let least = each.iter().copied().fold(0.0, f64::min) + count.ln();
        // Tail probability of a sum of exponential variables: e^−s Σ s^k/k!.
        let sum = -each.iter().sum::<f64>();
        let mut term = 1.0;
        let mut series = 1.0;
        for k in 1..records.len() {
            term *= sum / k as f64;
            series += term;
        }
        let together = series.ln() - sum;
        let ln_chance = least.min(together) + std::f64::consts::LN_2 + trials.ln();
        (place, ln_chance)
    });
    let (place, ln_chance) = peak.min_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(Peak {
        share: first.share(place),
        ln_chance: ln_chance.min(0.0),
    })
}

#[cfg(test)]
mod tests {
    use super::{Periodogram, Weighed, strongest};
    use crate::transform::Transform;
    use crate::{NoiseLevels, Observations};
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rlg_plan::PeriodogramPlan;

    const ROWS: usize = 6000;

    /// The strongest line of two records, the second with a sine of an amplitude in noise of variance 1.
    fn found(amplitude: f64, seed: u64) -> super::Peak {
        let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let noise: Vec<f64> = StandardNormal.sample_iter(rng).take(2 * ROWS).collect();
        let turn = std::f64::consts::TAU * 0.012_345;
        let seen: Vec<bool> = (0..ROWS).map(|row| row % 1000 < 800).collect();
        let observations = Observations::bridged(&seen).expect("rows enough");
        let levels = NoiseLevels {
            white: 1.0,
            ..NoiseLevels::default()
        };
        let (transform, basis) = Transform::with_basis(observations, levels);
        let records = [(0, 0.0), (1, amplitude)].map(|(record, amplitude)| {
            let noise = &noise[record * ROWS..];
            let record: Vec<f64> = (0..ROWS)
                .map(|row| noise[row] + amplitude * (turn * row as f64 + 0.7).sin())
                .collect();
            Weighed::new(&record, &seen, (&transform, &basis), levels)
        });
        let plan = PeriodogramPlan::default();
        let each = records.iter().map(|one| Periodogram::new(one, &plan));
        let each: Vec<Periodogram> = each.collect();
        strongest(&each, |_| true).expect("frequencies")
    }

    #[test]
    fn a_line_of_one_record_is_found_between_the_coefficients_and_noise_is_none() {
        let peak = found(0.2, 3);
        assert!(
            (peak.share - 0.012_345).abs() < 0.2 / ROWS as f64,
            "{peak:?}"
        );
        // 2 Δ ln L is 0.2² · 4800/2 = 96 and its chance e^−48, tested against as many neighbours.
        assert!(peak.ln_chance < (1e-6_f64).ln(), "{peak:?}");
        let by_chance = (10..40).filter(|&seed| found(0.0, seed).ln_chance < (0.05_f64).ln());
        // Of 30 nulls 1.5 are expected below 0.05.
        assert!(by_chance.count() <= 5);
    }
}
