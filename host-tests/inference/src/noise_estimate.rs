//! Joint estimate of all four noise terms of one record, with their covariance.

use nalgebra::DMatrix;

use crate::noise::{NoiseBasis, NoiseLevels, TERMS};

/// Estimated noise levels with their uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseEstimate {
    /// Maximum-likelihood levels, none below 0.
    pub levels: NoiseLevels,
    /// Their standard deviations in the order N, Q, B, K, from the Fisher information of all four together.
    pub stds: [f64; TERMS],
}

impl NoiseBasis {
    /// Fits angle random walk, white angle, flicker and rate random walk together \[the record's unit squared\], by the
    /// Whittle likelihood.
    ///
    /// # Inputs
    /// `power`: expected sum of squared coefficients in each bin. The constant of each span is excluded: an unknown bias
    /// holds no information on noise.
    ///
    /// # Returns
    /// `None` where the four terms are not distinguishable.
    pub fn estimate(&self, power: &[f64]) -> Option<NoiseEstimate> {
        let (basis, power) = self.without_constants(power);
        let density: Vec<f64> = power
            .iter()
            .zip(&basis.counts)
            .map(|(p, n)| p / n)
            .collect();
        // Flicker and walk are hardly distinguishable: there is a local maximum near either.
        let white = 0.5 * median(density.iter().copied());
        let of_angle = density.iter().zip(&basis.power[1]);
        let angle = 0.5 * median(of_angle.map(|(density, power)| density / power));
        let starts = [[1.0, 1.0], [1.0, WEAK], [WEAK, 1.0]];
        let levels = starts
            .map(|[flicker, walk]| {
                let start = NoiseLevels {
                    white,
                    angle,
                    flicker: flicker * white,
                    walk: walk * white,
                };
                basis.fit(&power, start, [true; TERMS])
            })
            .into_iter()
            .max_by(|a, b| {
                let of = |levels: &NoiseLevels| basis.log_likelihood(&power, *levels);
                of(a).total_cmp(&of(b))
            })?;
        let stds = basis.stds(levels)?;
        Some(NoiseEstimate { levels, stds })
    }

    fn log_likelihood(&self, power: &[f64], levels: NoiseLevels) -> f64 {
        let s = self.binned(levels);
        let bins = s.iter().zip(&self.counts).zip(power);
        -0.5 * bins
            .map(|((s, count), power)| count * s.ln() + power / s)
            .sum::<f64>()
    }

    /// Removes the bins of zero frequency.
    fn without_constants(&self, power: &[f64]) -> (Self, Vec<f64>) {
        let is_left: Vec<bool> = self.frequency.iter().map(|&middle| middle > 0.0).collect();
        fn left<T: Clone>(values: &[T], is_left: &[bool]) -> Vec<T> {
            let pairs = values.iter().zip(is_left);
            pairs
                .filter(|(_, left)| **left)
                .map(|(value, _)| value.clone())
                .collect()
        }
        let mut basis = self.clone();
        basis.bins = left(&self.bins, &is_left);
        basis.counts = left(&self.counts, &is_left);
        basis.power = std::array::from_fn(|term| left(&self.power[term], &is_left));
        basis.frequency = left(&self.frequency, &is_left);
        (basis, left(power, &is_left))
    }

    /// Standard deviations of jointly fitted levels.
    fn stds(&self, levels: NoiseLevels) -> Option<[f64; TERMS]> {
        let s = self.binned(levels);
        let information = DMatrix::from_fn(TERMS, TERMS, |a, b| {
            let bins = s.iter().zip(&self.counts).enumerate();
            bins.map(|(bin, (s, count))| {
                0.5 * count * self.power[a][bin] * self.power[b][bin] / (s * s)
            })
            .sum::<f64>()
        });
        // Scaled, as the levels differ by many powers of ten.
        let scale = DMatrix::from_diagonal(&information.diagonal().map(|one| one.sqrt().recip()));
        let covariance = &scale * (&scale * information * &scale).try_inverse()? * &scale;
        Some(std::array::from_fn(|term| {
            covariance[(term, term)].max(0.0).sqrt()
        }))
    }
}

/// Initial ratio of the weaker drift level.
const WEAK: f64 = 1e-3;

/// Median, the upper one of an even number; 0 without values.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use crate::noise::TERMS;
    use crate::{Dct, NoiseBasis, Observations};

    const ROWS: usize = 8192;

    /// A record of given standard deviations a row, flicker as first-order processes of one variance an octave apart.
    fn record(seed: u64, [white, angle, flicker, walk]: [f64; TERMS]) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let (mut drift, mut before) = (0.0, normal());
        let mut poles: [f64; 14] = std::array::from_fn(|_| flicker * normal());
        (0..ROWS)
            .map(|_| {
                let next = normal();
                let differenced = next - before;
                before = next;
                drift += walk * normal();
                let mut slow = 0.0;
                for (octave, pole) in poles.iter_mut().enumerate() {
                    let share = 0.5_f64.powi(octave as i32 + 1);
                    *pole =
                        (1.0 - share) * *pole + flicker * (share * (2.0 - share)).sqrt() * normal();
                    slow += *pole;
                }
                white * normal() + angle * differenced + drift + slow
            })
            .collect()
    }

    /// Pulls of a record's estimated terms: errors over their standard deviations.
    fn pulls(seed: u64, put_in: [f64; TERMS]) -> [f64; TERMS] {
        let basis = NoiseBasis::new(&Observations::bridged(&[true; ROWS]).expect("rows"));
        let mut spectrum = record(seed, put_in);
        Dct::new(ROWS).forward(&mut spectrum);
        let sum = |bin: &std::ops::Range<usize>| spectrum[bin.clone()].iter().map(|c| c * c).sum();
        let power: Vec<f64> = basis.bins.iter().map(sum).collect();
        let estimate = basis.estimate(&power).expect("four terms");
        let rows = ROWS as f64;
        // First-order processes of variance f², an octave apart, have the density f² n/(k ln 2) together.
        let expected = [
            put_in[0].powi(2),
            put_in[1].powi(2),
            0.5 * put_in[2].powi(2) * rows / std::f64::consts::LN_2,
            put_in[3].powi(2) / (std::f64::consts::PI / rows).powi(2),
        ];
        std::array::from_fn(|term| {
            (estimate.levels.as_array()[term] - expected[term]) / estimate.stds[term]
        })
    }

    #[test]
    fn four_terms_that_act_together_are_each_within_their_intervals() {
        const SEEDS: u64 = 24;
        let each: Vec<_> = (0..SEEDS)
            .map(|seed| pulls(seed, [1.0, 0.6, 0.05, 0.002]))
            .collect();
        for term in 0..TERMS {
            let mean = each.iter().map(|pulls| pulls[term]).sum::<f64>() / SEEDS as f64;
            let square = each.iter().map(|pulls| pulls[term].powi(2)).sum::<f64>() / SEEDS as f64;
            // Four standard deviations of a mean, and of a root mean square, of so many normal numbers.
            assert!(mean.abs() < 0.82, "{term}: {mean}");
            assert!((0.42..1.58).contains(&square.sqrt()), "{term}: {square}");
        }
    }

    #[test]
    fn of_white_noise_of_rate_nothing_is_called_another_term() {
        for seed in 0..24 {
            let [white, others @ ..] = pulls(100 + seed, [1.0, 0.0, 0.0, 0.0]);
            assert!(white.abs() < 4.0, "{seed}: {white}");
            assert!(others.iter().all(|pull| *pull < 4.0), "{seed}: {others:?}");
        }
    }
}
