//! Fit of noise levels to powers by the Whittle likelihood.

use crate::noise::{NoiseBasis, NoiseLevels, TERMS};

/// Power below which a bin is empty.
const LEAST_POWER: f64 = 1e-300;
const MOST_MULTIPLICATIVE: usize = 60;
const MOST_SCORING: usize = 10;

impl NoiseBasis {
    /// Fits the levels of `active` terms by the Whittle likelihood, maximising `−½ Σ count (ln S + P/S)`, from `start`.
    ///
    /// # Inputs
    /// `power`: expected sum of squared coefficients in each bin, positive. Multiplicative updates first, which converge
    /// from any start; then Fisher scoring as non-negative least squares.
    pub fn fit(&self, power: &[f64], start: NoiseLevels, active: [bool; TERMS]) -> NoiseLevels {
        if power.is_empty() {
            return start;
        }
        let whittle = Whittle::new(self, power, active);
        let mut levels = start.as_array();
        for (level, floor) in levels.iter_mut().zip(whittle.floor) {
            *level = if floor > 0.0 { level.max(floor) } else { 0.0 };
        }
        let updated = whittle.by_updates(whittle.at(levels));
        NoiseLevels::from_array(whittle.by_scoring(updated).levels)
    }
}

/// Whittle likelihood of the levels, given powers.
struct Whittle<'a> {
    basis: &'a NoiseBasis,
    /// Power over count of each bin.
    density: Vec<f64>,
    active: [bool; TERMS],
    /// Least level of each active term at the start.
    floor: [f64; TERMS],
}

/// Levels with their negative log likelihood.
struct Point {
    levels: [f64; TERMS],
    cost: f64,
}

impl<'a> Whittle<'a> {
    fn new(basis: &'a NoiseBasis, power: &[f64], active: [bool; TERMS]) -> Self {
        let density: Vec<f64> = power
            .iter()
            .zip(&basis.counts)
            .map(|(sum, count)| (sum / count).max(LEAST_POWER))
            .collect();
        let floor = std::array::from_fn(|term| {
            if !active[term] {
                return 0.0;
            }
            let ratios = density
                .iter()
                .zip(&basis.power[term])
                .map(|(density, power)| density / power);
            1e-3 * ratios.fold(f64::INFINITY, f64::min)
        });
        Self {
            basis,
            density,
            active,
            floor,
        }
    }

    fn at(&self, levels: [f64; TERMS]) -> Point {
        let of_bin = |bin: usize| {
            let s: f64 = (0..TERMS)
                .map(|term| levels[term] * self.basis.power[term][bin])
                .sum();
            self.basis.counts[bin] * (s.ln() + self.density[bin] / s)
        };
        let cost = 0.5 * (0..self.density.len()).map(of_bin).sum::<f64>();
        Point { levels, cost }
    }

    /// Multiplicative updates, damped where a full one raises the cost.
    fn by_updates(&self, mut now: Point) -> Point {
        for step in 0..MOST_MULTIPLICATIVE {
            let factors = self.factors(now.levels);
            let stepped = |factors: [f64; TERMS]| {
                self.at(std::array::from_fn(|term| now.levels[term] * factors[term]))
            };
            let mut tried = stepped(factors);
            if tried.cost > now.cost {
                tried = stepped(factors.map(f64::sqrt));
            }
            let gained = now.cost - tried.cost;
            if gained > 0.0 {
                now = tried;
            }
            if gained < if step < 12 { 0.3 } else { 3.0 } {
                break;
            }
        }
        now
    }

    /// Fisher scoring, its steps halved until the cost falls.
    fn by_scoring(&self, mut now: Point) -> Point {
        for _ in 0..MOST_SCORING {
            let target = self.scored(now.levels);
            let target: [f64; TERMS] = std::array::from_fn(|term| {
                if self.active[term] {
                    target[term].max(1e-3 * self.floor[term])
                } else {
                    0.0
                }
            });
            let mut share = 1.0;
            let mut gained = 0.0;
            for _ in 0..5 {
                let tried = self.at(std::array::from_fn(|term| {
                    now.levels[term] + share * (target[term] - now.levels[term])
                }));
                if tried.cost < now.cost - 1e-9 {
                    gained = now.cost - tried.cost;
                    now = tried;
                    break;
                }
                share /= 2.0;
            }
            if gained < 1e-3 {
                break;
            }
        }
        now
    }

    /// Factors of one multiplicative update.
    fn factors(&self, levels: [f64; TERMS]) -> [f64; TERMS] {
        let mut sums = [[0.0; 2]; TERMS];
        for (bin, density) in self.density.iter().enumerate() {
            let s: f64 = (0..TERMS)
                .map(|term| levels[term] * self.basis.power[term][bin])
                .sum();
            let count = self.basis.counts[bin];
            for (term, [above, below]) in sums.iter_mut().enumerate() {
                let power = self.basis.power[term][bin];
                *above += power * count * density / (s * s);
                *below += power * count / s;
            }
        }
        sums.map(|[above, below]| above / below)
    }

    /// Levels after a full Fisher-scoring step.
    fn scored(&self, levels: [f64; TERMS]) -> [f64; TERMS] {
        let scale: [f64; TERMS] =
            std::array::from_fn(|term| self.basis.power[term].iter().copied().fold(0.0, f64::max));
        let mut normal = [[0.0; TERMS]; TERMS];
        let mut right = [0.0; TERMS];
        for (bin, density) in self.density.iter().enumerate() {
            let terms: [f64; TERMS] = std::array::from_fn(|term| self.basis.power[term][bin]);
            let s: f64 = terms
                .iter()
                .zip(levels)
                .map(|(power, level)| power * level)
                .sum();
            let weight = 0.5 * self.basis.counts[bin] / (s * s);
            for a in 0..TERMS {
                let scaled = terms[a] / scale[a];
                right[a] += weight * scaled * density;
                let row = normal[a].iter_mut().zip(terms.iter().zip(scale));
                for (sum, (term, scale)) in row {
                    *sum += weight * scaled * term / scale;
                }
            }
        }
        let solved = non_negative(&normal, &right, self.active);
        std::array::from_fn(|term| solved[term] / scale[term])
    }
}

/// Minimises ½ xᵀ A x − bᵀ x over x ≥ 0 with only `active` entries free: the best of all subsets with a non-negative
/// solution.
fn non_negative(
    a: &[[f64; TERMS]; TERMS],
    b: &[f64; TERMS],
    active: [bool; TERMS],
) -> [f64; TERMS] {
    let mut best = [0.0; TERMS];
    let mut least = 0.0;
    for subset in 1_usize..1 << TERMS {
        let members: Vec<usize> = (0..TERMS).filter(|term| subset >> term & 1 == 1).collect();
        if members.iter().any(|&term| !active[term]) {
            continue;
        }
        let matrix = nalgebra::DMatrix::from_fn(members.len(), members.len(), |i, j| {
            a[members[i]][members[j]]
        });
        let right = nalgebra::DVector::from_fn(members.len(), |i, _| b[members[i]]);
        let Some(cholesky) = matrix.cholesky() else {
            continue;
        };
        let solved = cholesky.solve(&right);
        let value = -0.5 * right.dot(&solved);
        if value < least && solved.iter().all(|&value| value >= 0.0) {
            least = value;
            best = [0.0; TERMS];
            for (&term, &value) in members.iter().zip(solved.iter()) {
                best[term] = value;
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    use crate::{Dct, NoiseBasis, NoiseLevels, Observations};

    const ROWS: usize = 8192;

    fn spectrum(record: &[f64]) -> Vec<f64> {
        let mut values = record.to_vec();
        Dct::new(record.len()).forward(&mut values);
        values
    }

    fn basis() -> NoiseBasis {
        NoiseBasis::new(&Observations::bridged(&vec![true; ROWS]).expect("rows"))
    }

    fn power(basis: &NoiseBasis, spectrum: &[f64]) -> Vec<f64> {
        let sum = |bin: &std::ops::Range<usize>| spectrum[bin.clone()].iter().map(|c| c * c).sum();
        basis.bins.iter().map(sum).collect()
    }

    /// Normal numbers of a seed.
    fn normals(seed: u64, count: usize) -> Vec<f64> {
        let rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        StandardNormal.sample_iter(rng).take(count).collect()
    }

    #[test]
    fn each_term_is_fitted_within_its_own_uncertainty() {
        let basis = basis();
        let (white, angle) = (2.0, 0.5);
        let walk_step = 0.02;
        let (mut whites, mut angles, mut walks) = (0.0, 0.0, 0.0);
        let seeds = 12;
        for seed in 0..seeds {
            let steps = normals(3 * seed, ROWS);
            let angles_rad = normals(3 * seed + 1, ROWS + 1);
            let rates = normals(3 * seed + 2, ROWS);
            let mut drift = 0.0;
            let record: Vec<f64> = (0..ROWS)
                .map(|row| {
                    drift += walk_step * steps[row];
                    let differenced = angles_rad[row + 1] - angles_rad[row];
                    drift + f64::sqrt(white) * rates[row] + f64::sqrt(angle) * differenced
                })
                .collect();
            let fitted = basis.fit(
                &power(&basis, &spectrum(&record)),
                NoiseLevels {
                    white: 1.0,
                    angle: 1.0,
                    flicker: 0.0,
                    walk: 1.0,
                },
                [true, true, false, true],
            );
            whites += fitted.white / seeds as f64;
            angles += fitted.angle / seeds as f64;
            walks += fitted.walk / seeds as f64;
        }
        let expected_walk = walk_step * walk_step / (std::f64::consts::PI / ROWS as f64).powi(2);
        assert!((whites / white - 1.0).abs() < 0.03, "{whites}");
        assert!((angles / angle - 1.0).abs() < 0.03, "{angles}");
        assert!(
            (walks / expected_walk - 1.0).abs() < 0.25,
            "{}",
            walks / expected_walk
        );
    }
}
