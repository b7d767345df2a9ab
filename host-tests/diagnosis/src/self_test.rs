//! What the search would name in noise alone, and find of known effects, on this very recording.
//!
//! Under noise of the fitted levels the scores of all columns are one normal vector, whose covariance is the information
//! that the search already has; an effect of given parameters adds information times parameters to it. So noise is drawn,
//! and effects are added, without a row. What gaps leave unknown and the effects that were found are fitted in every trial.
//!
//! Not in the trials: the fit of the noise, with drift; events and families; the confirmation, which only takes names away.

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::Variant;
use rlg_findings::result::{SelfTestEntry, SelfTestKind, SelfTestPoint};
use rlg_inference::Hypothesis;
use rlg_inference::linear::pseudo_inverse;
use statrs::distribution::{Beta, ChiSquared, ContinuousCDF};

use super::plan::AnalysisPlan;
use super::scores::integrated;
use super::search::Found;

/// Draws of noise: none named among 200 bounds the share to 1.5 % with 95 % confidence.
const DRAWS: usize = 200;

/// Strengths of the effects that are added (matched-filter SNR): from seldom found to always.
const RHO: [f64; 4] = [4.0, 6.0, 8.0, 10.0];

/// Effects of each kind at each strength.
const EACH: usize = 2;

/// Goes through the trials; `None` where no row of the catalogue has a column.
pub fn self_test(found: &Found, plan: &AnalysisPlan, seed: u64) -> Option<SelfTestEntry> {
    let trials = Trials::new(found, plan)?;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let alone: Vec<Option<&str>> = (0..DRAWS)
        .map(|_| Some(trials.named(&trials.noise(&mut random))?.kind))
        .collect();
    let false_names = alone.iter().flatten().count();
    let mut curve = RHO.map(|rho| SelfTestPoint {
        rho,
        injections: 0,
        detected: 0,
        named: 0,
        theory: 0.0,
    });
    let mut by_kind = Vec::new();
    for planted in trials.one_of_each_kind() {
        let mut entry = SelfTestKind {
            kind: planted.kind.to_string(),
            false_names: alone
                .iter()
                .flatten()
                .filter(|name| **name == planted.kind)
                .count(),
            detected: Vec::new(),
            named: Vec::new(),
        };
        for point in &mut curve {
            let mut counts = None;
            for _ in 0..EACH {
                let Some(scores) = trials.with(planted, point.rho, &mut random) else {
                    continue;
                };
                let said = trials.named(&scores);
                let [detected, named] = counts.get_or_insert([0, 0]);
                *detected += usize::from(said.is_some());
                *named += usize::from(said.is_some_and(|said| said.may_be(planted.kind)));
                point.injections += 1;
                point.theory += trials.theory(planted, point.rho);
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
    Some(SelfTestEntry {
        slides: DRAWS,
        false_names,
        upper_limit_95: upper_limit(false_names, DRAWS),
        curve: curve.to_vec(),
        kinds: by_kind,
    })
}

/// A hypothesis of the catalogue in the trials.
struct Tried<'a> {
    kind: &'static str,
    hypothesis: &'a Hypothesis,
    /// Its parameters by columns of the records.
    columns: DMatrix<f64>,
    /// Covariance of its parameters.
    covariance: DMatrix<f64>,
    rank: usize,
}

/// What a trial names.
struct Said {
    kind: &'static str,
    /// Kinds that come close.
    alike: Vec<&'static str>,
}

impl Said {
    fn may_be(&self, kind: &str) -> bool {
        self.alike.contains(&kind)
    }
}

struct Trials<'a> {
    tried: Vec<Tried<'a>>,
    /// Information of all columns of all records, what is fitted in every trial taken out.
    information: DMatrix<f64>,
    /// Root of the information before that.
    root: DMatrix<f64>,
    /// What takes it out of scores.
    left: DMatrix<f64>,
    /// Log posterior that a name needs beyond its worth, prices of places apart.
    needed: f64,
    class_within: f64,
}

impl<'a> Trials<'a> {
    fn new(found: &'a Found, plan: &AnalysisPlan) -> Option<Self> {
        let equations = &found.equations;
        let is_row = |one: &&Candidate| {
            !matches!(
                one.variant,
                Variant::Event { .. } | Variant::Expression { .. } | Variant::Harmonic { .. }
            ) && one.hypothesis.requires.is_none()
        };
        let rows: Vec<&Candidate> = found.candidates.iter().filter(is_row).collect();
        let members = found.fit.members.iter();
        let members = members.map(|&place| &found.candidates[place].hypothesis);
        let fitted: Vec<&Hypothesis> = equations.gaps().iter().chain(members).collect();
        let all = fitted.iter().copied();
        let all = all.chain(rows.iter().map(|one| &one.hypothesis));
        let mut columns: Vec<(usize, usize)> = all
            .flat_map(|one| one.terms.iter().map(|term| (term.record, term.column)))
            .filter(|(_, column)| equations.scale(*column) > 0.0)
            .collect();
        columns.sort_unstable();
        columns.dedup();
        let of = |hypothesis: &Hypothesis| {
            let mut matrix = DMatrix::zeros(hypothesis.parameters, columns.len());
            for term in &hypothesis.terms {
                if let Ok(place) = columns.binary_search(&(term.record, term.column)) {
                    let unit = equations.scale(term.column);
                    matrix[(term.parameter, place)] += term.coefficient / unit;
                }
            }
            matrix
        };
        let weights: Vec<Vec<f64>> = found
            .fit
            .levels
            .iter()
            .map(|levels| equations.basis.binned(*levels))
            .collect();
        let whole = DMatrix::from_fn(columns.len(), columns.len(), |a, b| {
            let ((record, a), (other, b)) = (columns[a], columns[b]);
            if record != other {
                return 0.0;
            }
            let powers = weights[record].iter().enumerate();
            powers
                .map(|(bin, power)| equations.product(bin, a, b) / power)
                .sum()
        });
        let mut raised = whole.clone();
        for place in 0..columns.len() {
            // Columns that are sums of others leave no root.
            raised[(place, place)] *= 1.0 + 1e-9;
        }
        let root = Cholesky::new(raised)?.unpack();
        let count = columns.len();
        let mut left = DMatrix::identity(count, count);
        let blocks: Vec<DMatrix<f64>> = fitted.into_iter().map(of).collect();
        let parameters = blocks.iter().map(DMatrix::nrows).sum();
        let mut nuisance = DMatrix::zeros(parameters, count);
        let mut first = 0;
        for block in &blocks {
            nuisance.rows_mut(first, block.nrows()).copy_from(block);
            first += block.nrows();
        }
        if parameters > 0 {
            let own = &nuisance * &whole * nuisance.transpose();
            left -= &whole * nuisance.transpose() * pseudo_inverse(&own) * &nuisance;
        }
        let information = &left * &whole;
        let tried: Vec<Tried> = rows
            .into_iter()
            .filter_map(|one| {
                let columns = of(&one.hypothesis);
                let own = &columns * &information * columns.transpose();
                let covariance = pseudo_inverse(&own);
                let rank = (&own * &covariance).trace().round() as usize;
                (rank > 0).then_some(Tried {
                    kind: one.kind,
                    hypothesis: &one.hypothesis,
                    columns,
                    covariance,
                    rank,
                })
            })
            .collect();
        let mut kinds: Vec<&str> = tried.iter().map(|one| one.kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let each = (plan.search.expected_effects / kinds.len() as f64).ln();
        (!tried.is_empty()).then_some(Self {
            tried,
            information,
            root,
            left,
            needed: plan.naming - each,
            class_within: plan.class_within,
        })
    }

    /// Scores of noise alone.
    fn noise(&self, random: &mut ChaCha8Rng) -> DVector<f64> {
        let count = self.left.nrows();
        let normal = DVector::from_fn(count, |_, _| StandardNormal.sample(random));
        &self.left * (&self.root * normal)
    }

    /// Scores of noise with an effect of signal-to-noise ratio `rho`; `None` where it is larger than anybody would believe.
    fn with(&self, planted: &Tried, rho: f64, random: &mut ChaCha8Rng) -> Option<DVector<f64>> {
        let root = planted.covariance.clone().symmetric_eigen();
        let normal: DVector<f64> =
            DVector::from_fn(root.eigenvalues.len(), |_, _| StandardNormal.sample(random));
        let spread = root.eigenvalues.map(|value| value.max(0.0).sqrt());
        let along = &root.eigenvectors * spread.component_mul(&normal);
        let information = &planted.columns * &self.information * planted.columns.transpose();
        let size = along.dot(&(information * &along)).sqrt();
        let parameters = along * (rho / size);
        let is_possible = parameters.iter().enumerate().all(|(place, value)| {
            let bound = planted.hypothesis.bound(place);
            !bound.excludes(*value, 0.0, 0.0)
        });
        let effect = &self.information * planted.columns.transpose() * parameters;
        is_possible.then(|| self.noise(random) + effect)
    }

    /// What a hypothesis is worth by scores: its gain, its parameters integrated over a prior of their own size.
    fn worth(one: &Tried, scores: &DVector<f64>) -> f64 {
        let own = &one.columns * scores;
        let gain = 0.5 * own.dot(&(&one.covariance * &own));
        integrated(gain, one.rank) - one.hypothesis.price
    }

    /// What is named, and which kinds come close.
    fn named(&self, scores: &DVector<f64>) -> Option<Said> {
        let worths: Vec<f64> = self
            .tried
            .iter()
            .map(|one| Self::worth(one, scores))
            .collect();
        let best = (0..worths.len()).max_by(|&a, &b| worths[a].total_cmp(&worths[b]))?;
        let close = worths.iter().zip(&self.tried);
        let close = close.filter(|(value, _)| **value > worths[best] - self.class_within);
        (worths[best] > self.needed).then(|| Said {
            kind: self.tried[best].kind,
            alike: close.map(|(_, one)| one.kind).collect(),
        })
    }

    /// Of each kind the hypothesis of most numbers.
    fn one_of_each_kind(&self) -> Vec<&Tried<'a>> {
        let mut each: Vec<&Tried> = Vec::new();
        for one in &self.tried {
            match each.iter_mut().find(|other| other.kind == one.kind) {
                Some(other) if other.rank < one.rank => *other = one,
                Some(_) => {}
                None => each.push(one),
            }
        }
        each
    }

    /// Chance that an effect is worth its name in noise as fitted.
    fn theory(&self, planted: &Tried, rho: f64) -> f64 {
        let needed = self.needed + planted.hypothesis.price;
        let (mut low, mut high) = (0.0, 1e4);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if integrated(middle, planted.rank) < needed {
                low = middle;
            } else {
                high = middle;
            }
        }
        beyond(2.0 * high, planted.rank as f64, rho * rho)
    }
}

/// Upper limit of a share of which `found` of `trials` were seen, 95 % confidence (Clopper-Pearson).
pub fn upper_limit(found: usize, trials: usize) -> f64 {
    if found >= trials {
        return 1.0;
    }
    Beta::new(found as f64 + 1.0, (trials - found) as f64).map_or(1.0, |law| law.inverse_cdf(0.95))
}

/// P(χ'² > threshold), noncentral with `degrees` and noncentrality λ: Σ_j Poisson(j; λ/2) P(χ²_{k+2j} > threshold).
pub fn beyond(threshold: f64, degrees: f64, noncentrality: f64) -> f64 {
    let half = 0.5 * noncentrality;
    // Ten standard deviations of the Poisson law beyond its mean leave less than 1e-15.
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
