//! The levels of the noise terms that make a spectrum most likely.
//!
//! Enters: power and free degrees of every bin, the terms' shapes there, a place to start from. Leaves: θ ≥ 0 that
//! maximises the Whittle likelihood −½ Σ (degrees · ln S + power/S), S = Σ θ_b B_b.
//!
//! Multiplicative steps θ_b ← θ_b · [Σ B_b power/S²] / [Σ B_b degrees/S] climb the likelihood and keep θ positive, but
//! creep where two terms share a band: so neighbouring bins are first taken together, which makes a step a thousand
//! times cheaper, and the climb starts from several places (diagnosis.md, "A noise fit that worked").

use super::noise::TERMS;

/// Low bins that stay alone: drift is told from a random walk of angle there.
const ALONE: usize = 64;

/// Relative width of the groups above: a shape changes by less than a tenth over one.
const WIDTH: f64 = 1.04;

/// Steps from one place; the likelihood is settled to a hundredth after a third of them.
const STEPS: usize = 600;

/// Neighbouring bins taken together.
struct Group {
    power: f64,
    degrees: f64,
    shape: [f64; TERMS],
}

/// What a spectrum says of the levels.
pub struct Levels(Vec<Group>);

impl Levels {
    /// Takes neighbouring bins together.
    pub fn new(power: &[f64], degrees: &[f64], shapes: &[[f64; TERMS]]) -> Self {
        let mut groups = Vec::new();
        let mut first = 0;
        while first < power.len() {
            let last = if first < ALONE {
                first + 1
            } else {
                ((first as f64 * WIDTH) as usize).clamp(first + 1, power.len())
            };
            let bins = first..last;
            let count = bins.len() as f64;
            groups.push(Group {
                power: power[bins.clone()].iter().sum(),
                degrees: degrees[bins.clone()].iter().sum(),
                shape: std::array::from_fn(|term| {
                    let shapes = shapes[bins.clone()].iter();
                    shapes.map(|shape| shape[term]).sum::<f64>() / count
                }),
            });
            first = last;
        }
        Self(groups)
    }

    /// Nothing.
    pub fn none() -> Self {
        Self(Vec::new())
    }

    /// What another spectrum says of the same levels, at higher frequencies.
    pub fn append(&mut self, mut other: Self) {
        self.0.append(&mut other.0);
    }

    /// The best levels with their ln L, those `held` staying as they start. It climbs from `start`, and from where
    /// all that is left at the lowest frequencies is drift of the one or the other kind.
    pub fn most_likely(&self, start: &[f64; TERMS], held: [bool; TERMS]) -> ([f64; TERMS], f64) {
        let drifting = |term: usize| {
            let mut theta = *start;
            theta[term] = self.lowest_alone(term);
            theta
        };
        [*start, drifting(2), drifting(3)]
            .into_iter()
            .map(|start| {
                let theta = self.climb(start, held);
                (theta, self.likelihood(&theta))
            })
            .filter(|(theta, likelihood)| {
                likelihood.is_finite() && theta.iter().all(|theta| theta.is_finite())
            })
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap_or(([f64::NAN; TERMS], f64::NEG_INFINITY))
    }

    /// The level at which one term alone leaves the power of the lowest bins that have freedom left.
    fn lowest_alone(&self, term: usize) -> f64 {
        /// Degrees of freedom to look at: the lowest few, because drift falls steeply.
        const LOOKED_AT: f64 = 6.0;
        let (mut level, mut looked_at) = (0.0, 0.0);
        for group in &self.0 {
            if looked_at >= LOOKED_AT {
                break;
            }
            level += group.power / group.shape[term];
            looked_at += group.degrees;
        }
        level / looked_at.max(1.0)
    }

    fn likelihood(&self, theta: &[f64; TERMS]) -> f64 {
        let of = |group: &Group| {
            let level = level(&group.shape, theta);
            -0.5 * (group.degrees * level.ln() + group.power / level)
        };
        self.0.iter().map(of).sum()
    }

    fn climb(&self, mut theta: [f64; TERMS], held: [bool; TERMS]) -> [f64; TERMS] {
        for _ in 0..STEPS {
            let (mut upper, mut lower) = ([0.0; TERMS], [0.0; TERMS]);
            for group in &self.0 {
                let level = level(&group.shape, &theta);
                let (pull, hold) = (group.power / (level * level), group.degrees / level);
                for term in 0..TERMS {
                    upper[term] += group.shape[term] * pull;
                    lower[term] += group.shape[term] * hold;
                }
            }
            for term in 0..TERMS {
                if lower[term] > 0.0 && !held[term] {
                    theta[term] *= upper[term] / lower[term];
                }
            }
        }
        theta
    }
}

fn level(shape: &[f64; TERMS], theta: &[f64; TERMS]) -> f64 {
    shape
        .iter()
        .zip(theta)
        .map(|(shape, theta)| shape * theta)
        .sum()
}
