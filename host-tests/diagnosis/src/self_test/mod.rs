//! Monte Carlo self-test of the search on this recording: false names in noise alone, and detection of known effects.
//!
//! `moments` runs a search on the sufficient statistics of its likelihood; other searches supply trials of their own.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rlg_catalogue::accelerometers;
use rlg_findings::result::{
    Diagnosis, SelfTestEntry, SelfTestKind, SelfTestPoint, Sensitivity, Tested,
};
use rlg_plan::{Plan, SelfTestPlan};
use statrs::distribution::{Beta, ChiSquared, ContinuousCDF};

pub mod moments;

pub use moments::{FoundSet, Row, self_test_on};

/// Named effect of a trial.
pub struct Said {
    /// Contract kind.
    pub kind: &'static str,
    /// Kinds within the class of the named one, itself among them.
    pub alike: Vec<&'static str>,
}

impl Said {
    fn may_be(&self, kind: &str) -> bool {
        self.alike.contains(&kind)
    }
}

/// Search on noise like a recording's, with injected effects.
pub trait Trials {
    /// Type of an injectable effect.
    type Planted;

    /// One effect of each kind.
    fn planted(&self) -> Vec<&Self::Planted>;

    /// Contract kind of an effect.
    fn kind(&self, planted: &Self::Planted) -> &'static str;

    /// Returns the effect named in noise alone.
    fn in_noise(&self, random: &mut ChaCha8Rng) -> Option<Said>;

    /// Returns the effect named with an injection of signal-to-noise ratio `rho`; `None` if the size exceeds the bounds of
    /// its parameters.
    fn with(
        &self,
        planted: &Self::Planted,
        rho: f64,
        random: &mut ChaCha8Rng,
    ) -> Option<Option<Said>>;

    /// Predicted probability that the effect is named in noise as fitted.
    fn theory(&self, planted: &Self::Planted, rho: f64) -> f64;

    /// Sensitivity of the recording to the effect's kind.
    ///
    /// # Inputs `needed_snr`: SNR at which an effect is found.
    fn sensitivity(&self, planted: &Self::Planted, needed_snr: f64) -> Option<Sensitivity>;

    /// Runs all trials.
    fn tested(&self, seed: u64, plan: &Plan) -> Tested {
        let needed_snr = plan.findings.needed_snr;
        let (own, random) = (
            &plan.judgement.self_test,
            &mut ChaCha8Rng::seed_from_u64(seed),
        );
        Tested {
            self_test: self.entry(random, own),
            sensitivity: self
                .planted()
                .into_iter()
                .filter_map(|one| self.sensitivity(one, needed_snr))
                .collect(),
        }
    }

    /// Counts false names, detections and correct names.
    fn entry(&self, random: &mut ChaCha8Rng, plan: &SelfTestPlan) -> SelfTestEntry {
        let alone: Vec<Option<&str>> = (0..plan.draws)
            .map(|_| Some(self.in_noise(random)?.kind))
            .collect();
        let false_names = alone.iter().flatten().count();
        let mut curve = plan.strengths.map(|rho| SelfTestPoint {
            rho,
            injections: 0,
            detected: 0,
            named: 0,
            theory: 0.0,
        });
        let mut by_kind = Vec::new();
        for planted in self.planted() {
            let kind = self.kind(planted);
            let named = alone.iter().flatten().filter(|name| **name == kind);
            let mut entry = SelfTestKind {
                kind: kind.to_string(),
                false_names: named.count(),
                detected: Vec::new(),
                named: Vec::new(),
            };
            for point in &mut curve {
                let mut counts = None;
                for _ in 0..plan.each {
                    let Some(said) = self.with(planted, point.rho, random) else {
                        continue;
                    };
                    let [detected, named] = counts.get_or_insert([0, 0]);
                    *detected += usize::from(said.is_some());
                    *named += usize::from(said.is_some_and(|said| said.may_be(kind)));
                    point.injections += 1;
                    point.theory += self.theory(planted, point.rho);
                }
                point.detected += counts.map_or(0, |[detected, _]| detected);
                point.named += counts.map_or(0, |[_, named]| named);
                entry.detected.push(counts.map(|[detected, _]| detected));
                entry.named.push(counts.map(|[_, named]| named));
            }
            by_kind.push(entry);
        }
        for point in &mut curve {
            point.theory /= point.injections.max(1) as f64;
        }
        SelfTestEntry {
            slides: plan.draws,
            false_names,
            upper_limit_95: upper_limit(false_names, plan.draws),
            curve: curve.to_vec(),
            kinds: by_kind,
        }
    }
}

/// Adds the self-test of another search, on other channels of the same recording: a joint trial is false if either is.
pub fn add_other_self_test(diagnosis: &mut Diagnosis, tested: Option<Tested>) {
    let (Some(before), Some(also)) = (&mut diagnosis.self_test, &tested) else {
        diagnosis.add_self_test(tested);
        return;
    };
    let also = &also.self_test;
    before.false_names = (before.false_names + also.false_names).min(before.slides);
    before.upper_limit_95 = upper_limit(before.false_names, before.slides);
    for (point, other) in before.curve.iter_mut().zip(&also.curve) {
        let expected = point.theory * point.injections as f64;
        let both = expected + other.theory * other.injections as f64;
        point.injections += other.injections;
        point.detected += other.detected;
        point.named += other.named;
        point.theory = both / point.injections.max(1) as f64;
    }
    before.kinds.extend(also.kinds.iter().cloned());
    diagnosis
        .sensitivity
        .extend(tested.into_iter().flat_map(|one| one.sensitivity));
}

/// Known sizes of a kind.
#[derive(Debug, Clone, Copy)]
pub struct Reach {
    /// Unit of its parameters.
    pub unit: &'static str,
    /// Typical size.
    pub typical: f64,
    /// Largest credible size.
    pub largest: f64,
}

impl Reach {
    /// Sizes of a kind of the catalogue; `None` for others.
    pub fn of(kind: &str) -> Option<Self> {
        rlg_catalogue::entries::find(kind).map(|entry| Self {
            unit: entry.unit,
            typical: entry.size.typical,
            largest: entry.size.largest,
        })
    }
}

impl From<&accelerometers::Kind> for Reach {
    fn from(kind: &accelerometers::Kind) -> Self {
        Self {
            unit: kind.unit,
            typical: kind.typical,
            largest: kind.largest,
        }
    }
}

/// Computes the sensitivity to a kind from the Fisher information of each parameter alone; `None` if all are zero.
pub fn sensitivity(
    kind: &str,
    reach: Reach,
    information: impl Iterator<Item = f64>,
    needed_snr: f64,
) -> Option<Sensitivity> {
    let typical = reach.typical;
    let snr = information.map(|one| typical * one.max(0.0).sqrt());
    let [weakest, strongest] = snr.fold([f64::INFINITY, 0.0_f64], |[low, high], snr| {
        [low.min(snr), high.max(snr)]
    });
    let largest_snr = reach.largest / typical * weakest;
    (strongest > 0.0).then(|| Sensitivity {
        kind: kind.to_string(),
        typical,
        unit: reach.unit.to_string(),
        snr: strongest,
        snr_weakest: if largest_snr < needed_snr {
            0.0
        } else {
            weakest
        },
    })
}

/// Probability that an effect of signal-to-noise ratio `rho` is named; `is_named` holds from some squared size on \[σ²\].
pub fn chance_of_name(rank: usize, rho: f64, is_named: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, 2e4);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if is_named(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    beyond(high, rank as f64, rho * rho)
}

/// Upper limit, with 95 % confidence, of the rate of `found` events in `trials` (Clopper–Pearson).
pub fn upper_limit(found: usize, trials: usize) -> f64 {
    if found >= trials {
        return 1.0;
    }
    Beta::new(found as f64 + 1.0, (trials - found) as f64).map_or(1.0, |law| law.inverse_cdf(0.95))
}

/// P(χ'² > threshold), noncentral with `degrees` and noncentrality λ: Σ_j Poisson(j; λ/2) P(χ²_{k+2j} > threshold).
pub fn beyond(threshold: f64, degrees: f64, noncentrality: f64) -> f64 {
    let half = 0.5 * noncentrality;
    // Ten standard deviations of the Poisson distribution beyond its mean leave less than 1e-15.
    let most = (half + 10.0 * half.sqrt() + 10.0) as usize;
    let mut share = (-half).exp();
    (0..=most)
        .map(|j| {
            if j > 0 {
                share *= half / j as f64;
            }
            ChiSquared::new(degrees + 2.0 * j as f64).map_or(0.0, |law| share * law.sf(threshold))
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::{beyond, upper_limit};
    use statrs::distribution::{ContinuousCDF, Normal};

    #[test]
    fn none_in_two_hundred_bounds_the_rate_to_three_in_two_hundred() {
        // The rule of three: 1 − 0.05^(1/n) is nearly 3/n.
        let exact = 1.0 - 0.05_f64.powf(1.0 / 200.0);
        assert!((upper_limit(0, 200) / exact - 1.0).abs() < 1e-6);
        assert_eq!(upper_limit(200, 200), 1.0);
    }

    #[test]
    fn the_noncentral_law_agrees_with_two_normals() {
        // One degree: |ρ + n| > t has two normal tails.
        let (rho, t) = (3.0_f64, 2.5_f64);
        let normal = Normal::standard();
        let exact = normal.sf(t - rho) + normal.sf(t + rho);
        assert!((beyond(t * t, 1.0, rho * rho) - exact).abs() < 1e-12);
    }
}
