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
use rayon::prelude::*;
use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::Variant;
use rlg_findings::result::{SelfTestEntry, SelfTestKind, SelfTestPoint};
use rlg_inference::linear::pseudo_inverse;
use rlg_inference::{Hypothesis, Likelihood, NoiseLevels};
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
    let members = found.fit.members.iter();
    let members = members.map(|&place| &found.candidates[place].hypothesis);
    let rows: Vec<Row> = found.candidates.iter().filter_map(Row::of).collect();
    let of = (&found.fit.levels[..], &members.collect::<Vec<_>>()[..]);
    self_test_on(&found.equations, of, &rows, (plan, seed))
}

/// The same on data of any kind.
///
/// # Inputs
/// `levels`: noise of each record; `members`: what was found, which is fitted in every trial; `rows`: of the catalogue.
pub fn self_test_on(
    data: &impl Likelihood,
    (levels, members): (&[NoiseLevels], &[&Hypothesis]),
    rows: &[Row],
    (plan, seed): (&AnalysisPlan, u64),
) -> Option<SelfTestEntry> {
    let trials = Trials::new(data, (levels, members), rows, plan)?;
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

/// A row of the catalogue as a hypothesis on the records.
pub struct Row<'a> {
    kind: &'static str,
    hypothesis: &'a Hypothesis,
    /// Whether an effect of it may be added; the others are only tried.
    may_act: bool,
}

impl<'a> Row<'a> {
    /// That of a candidate; `None` of what happens once, of expressions, and of what only stands beside another.
    pub fn of(candidate: &'a Candidate) -> Option<Self> {
        let is_row = !matches!(
            candidate.variant,
            Variant::Event { .. } | Variant::Expression { .. } | Variant::Harmonic { .. }
        ) && candidate.hypothesis.requires.is_none();
        is_row.then_some(Self {
            kind: candidate.kind,
            hypothesis: &candidate.hypothesis,
            may_act: true,
        })
    }

    /// The same where it is only tried.
    pub fn only_tried(self) -> Self {
        Self {
            may_act: false,
            ..self
        }
    }
}

/// A hypothesis of the catalogue in the trials.
struct Tried<'a> {
    kind: &'static str,
    hypothesis: &'a Hypothesis,
    /// Its parameters by columns of the records.
    columns: Sparse,
    /// Information of its parameters, what is fitted in every trial taken out.
    information: DMatrix<f64>,
    /// Covariance of its parameters.
    covariance: DMatrix<f64>,
    rank: usize,
    may_act: bool,
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

/// Parameters by places of columns: place and factor of each.
struct Sparse(Vec<Vec<(usize, f64)>>);

impl Sparse {
    fn parameters(&self) -> usize {
        self.0.len()
    }

    /// Its product with a vector over the columns.
    fn times(&self, vector: &DVector<f64>) -> DVector<f64> {
        let of_one = |own: &Vec<(usize, f64)>| own.iter().map(|(at, by)| by * vector[*at]).sum();
        DVector::from_iterator(self.parameters(), self.0.iter().map(of_one))
    }

    /// Its transpose's product with a vector over the parameters.
    fn spread(&self, parameters: &DVector<f64>, count: usize) -> DVector<f64> {
        let mut sum = DVector::zeros(count);
        for (own, value) in self.0.iter().zip(parameters.iter()) {
            own.iter().for_each(|(at, by)| sum[*at] += by * value);
        }
        sum
    }
}

/// Symmetric matrices over the columns of each record; columns of different records have nothing in common.
struct ByRecord {
    /// First column of each, and its matrix.
    blocks: Vec<(usize, DMatrix<f64>)>,
}

impl ByRecord {
    fn times(&self, vector: &DVector<f64>) -> DVector<f64> {
        let mut product = DVector::zeros(vector.len());
        for (first, block) in &self.blocks {
            let own = block * vector.rows(*first, block.nrows());
            product.rows_mut(*first, block.nrows()).copy_from(&own);
        }
        product
    }
}

/// What is fitted in every trial.
struct Fitted {
    columns: Sparse,
    /// Information of all columns with each of its parameters.
    with: Vec<DVector<f64>>,
    /// Covariance of its parameters.
    covariance: DMatrix<f64>,
}

impl Fitted {
    /// Takes it out of scores.
    fn out_of(&self, mut scores: DVector<f64>) -> DVector<f64> {
        let sizes = &self.covariance * self.columns.times(&scores);
        for (with, size) in self.with.iter().zip(sizes.iter()) {
            scores.axpy(-size, with, 1.0);
        }
        scores
    }
}

struct Trials<'a> {
    tried: Vec<Tried<'a>>,
    /// Information of all columns of all records, nothing taken out.
    whole: ByRecord,
    /// Its root.
    root: ByRecord,
    fitted: Fitted,
    /// Log posterior that a name needs beyond its worth, prices of places apart.
    needed: f64,
    class_within: f64,
    /// Columns of all records.
    count: usize,
}

/// Record and column of each place that some hypothesis needs, ascending.
fn places<'a>(
    data: &impl Likelihood,
    all: impl Iterator<Item = &'a Hypothesis>,
) -> Vec<(usize, usize)> {
    let mut places: Vec<(usize, usize)> = all
        .flat_map(|one| one.terms.iter().map(|term| (term.record, term.column)))
        .filter(|(record, column)| data.scale(*record, *column) > 0.0)
        .collect();
    places.sort_unstable();
    places.dedup();
    places
}

/// Information of columns, record by record.
fn information(
    data: &impl Likelihood,
    levels: &[NoiseLevels],
    places: &[(usize, usize)],
) -> ByRecord {
    let mut first = 0;
    let of_record = |own: &[(usize, usize)]| {
        let begin = first;
        first += own.len();
        (begin, own.to_vec())
    };
    let records: Vec<(usize, Vec<(usize, usize)>)> =
        places.chunk_by(|a, b| a.0 == b.0).map(of_record).collect();
    let of = |(first, own): (usize, Vec<(usize, usize)>)| {
        let record = own[0].0;
        let powers = data.basis(record).binned(levels[record]);
        let mut block = DMatrix::zeros(own.len(), own.len());
        for (a, (_, column)) in own.iter().enumerate() {
            for (b, (_, other)) in own[..=a].iter().enumerate() {
                let powers = powers.iter().enumerate();
                let sum: f64 = powers
                    .map(|(bin, power)| data.product(record, bin, *column, *other) / power)
                    .sum();
                block[(a, b)] = sum;
                block[(b, a)] = sum;
            }
        }
        (first, block)
    };
    ByRecord {
        blocks: records.into_par_iter().map(of).collect(),
    }
}

/// Root of an information; `None` where it has none.
fn root_of(information: &ByRecord) -> Option<ByRecord> {
    let each = information.blocks.iter().map(|(first, block)| {
        let mut raised = block.clone();
        for place in 0..raised.nrows() {
            // Columns that are sums of others leave no root.
            raised[(place, place)] *= 1.0 + 1e-9;
        }
        Some((*first, Cholesky::new(raised)?.unpack()))
    });
    Some(ByRecord {
        blocks: each.collect::<Option<_>>()?,
    })
}

impl<'a> Trials<'a> {
    fn new(
        data: &impl Likelihood,
        (levels, members): (&[NoiseLevels], &[&Hypothesis]),
        rows: &[Row<'a>],
        plan: &AnalysisPlan,
    ) -> Option<Self> {
        let fitted: Vec<&Hypothesis> = data.free().iter().chain(members.iter().copied()).collect();
        let all = fitted.iter().copied();
        let places = places(data, all.chain(rows.iter().map(|one| one.hypothesis)));
        let of = |hypothesis: &Hypothesis| {
            let mut columns = vec![Vec::new(); hypothesis.parameters];
            for term in &hypothesis.terms {
                if let Ok(place) = places.binary_search(&(term.record, term.column)) {
                    let unit = data.scale(term.record, term.column);
                    columns[term.parameter].push((place, term.coefficient / unit));
                }
            }
            Sparse(columns)
        };
        let count = places.len();
        let whole = information(data, levels, &places);
        let root = root_of(&whole)?;
        let columns = Sparse(fitted.into_iter().flat_map(|one| of(one).0).collect());
        let with = information_with(&whole, &columns, count);
        let own = products(&columns, &with);
        let fitted = Fitted {
            covariance: pseudo_inverse(&own),
            columns,
            with,
        };
        let of_row = |one: &Row<'a>| {
            let columns = of(one.hypothesis);
            let with = information_with(&whole, &columns, count);
            let left: Vec<_> = with.into_iter().map(|one| fitted.out_of(one)).collect();
            let information = products(&columns, &left);
            let covariance = pseudo_inverse(&information);
            let rank = (&information * &covariance).trace().round() as usize;
            (rank > 0).then_some(Tried {
                kind: one.kind,
                hypothesis: one.hypothesis,
                columns,
                information,
                covariance,
                rank,
                may_act: one.may_act,
            })
        };
        let tried: Vec<Tried> = rows.iter().filter_map(of_row).collect();
        let mut kinds: Vec<&str> = tried.iter().map(|one| one.kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let each = (plan.search.expected_effects / kinds.len() as f64).ln();
        (!tried.is_empty()).then_some(Self {
            tried,
            whole,
            root,
            fitted,
            needed: plan.naming - each,
            class_within: plan.class_within,
            count,
        })
    }

    /// Scores of noise alone.
    fn noise(&self, random: &mut ChaCha8Rng) -> DVector<f64> {
        let normal = DVector::from_fn(self.count, |_, _| StandardNormal.sample(random));
        self.fitted.out_of(self.root.times(&normal))
    }

    /// Scores of noise with an effect of signal-to-noise ratio `rho`; `None` where it is larger than anybody would believe.
    fn with(&self, planted: &Tried, rho: f64, random: &mut ChaCha8Rng) -> Option<DVector<f64>> {
        let root = planted.covariance.clone().symmetric_eigen();
        let normal: DVector<f64> =
            DVector::from_fn(root.eigenvalues.len(), |_, _| StandardNormal.sample(random));
        let spread = root.eigenvalues.map(|value| value.max(0.0).sqrt());
        let along = &root.eigenvectors * spread.component_mul(&normal);
        let size = along.dot(&(&planted.information * &along)).sqrt();
        let parameters = along * (rho / size);
        let is_possible = parameters.iter().enumerate().all(|(place, value)| {
            let bound = planted.hypothesis.bound(place);
            !bound.excludes(*value, 0.0, 0.0)
        });
        let columns = planted.columns.spread(&parameters, self.count);
        let effect = self.fitted.out_of(self.whole.times(&columns));
        is_possible.then(|| self.noise(random) + effect)
    }

    /// What a hypothesis is worth by scores: its gain, its parameters integrated over a prior of their own size.
    fn worth(one: &Tried, scores: &DVector<f64>) -> f64 {
        let own = one.columns.times(scores);
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
        for one in self.tried.iter().filter(|one| one.may_act) {
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

/// Information of all columns with each parameter.
fn information_with(whole: &ByRecord, columns: &Sparse, count: usize) -> Vec<DVector<f64>> {
    let parameters = columns.parameters();
    (0..parameters)
        .map(|parameter| {
            let mut unit = DVector::zeros(parameters);
            unit[parameter] = 1.0;
            whole.times(&columns.spread(&unit, count))
        })
        .collect()
}

/// Products of parameters with what `with` holds of others.
fn products(columns: &Sparse, with: &[DVector<f64>]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(columns.parameters(), with.len());
    for (place, with) in with.iter().enumerate() {
        matrix.set_column(place, &columns.times(with));
    }
    matrix
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
