//! Trials of a search on the sufficient statistics of its likelihood.
//!
//! Under noise of the fitted levels the scores of all columns are one normal vector, whose covariance is their Fisher
//! information, known to the search; an effect adds information times parameters to it. So noise and effects are simulated
//! without a row. The nuisance parameters of gaps and the found effects are fitted in every trial.
//!
//! Not simulated: the fit of the noise, with drift; events and families; the confirmation, which only removes names.

use nalgebra::{Cholesky, DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use rlg_catalogue::Candidate;
use rlg_catalogue::candidates::Variant;
use rlg_findings::result::{Sensitivity, Tested};
use rlg_inference::linear::{pseudo_inverse, pseudo_inverse_beside};
use rlg_inference::{Hypothesis, Likelihood, NoiseLevels};
use rlg_plan::Plan;

use super::{Reach, Said, Trials as _, chance_of_name, sensitivity};
use crate::candidates::scores::integrated;

/// Noise of each record, and the found effects, fitted in every trial.
#[derive(Clone, Copy)]
pub struct FoundSet<'a> {
    /// Noise of each record.
    pub levels: &'a [NoiseLevels],
    /// Found effects.
    pub members: &'a [&'a Hypothesis],
}

/// Runs the trials on any likelihood; `None` if no candidate of the catalogue has a column.
///
/// # Inputs
/// `rows`: of the catalogue.
pub fn self_test_on(
    data: &impl Likelihood,
    set: FoundSet,
    rows: &[Row],
    plan: &Plan,
    seed: u64,
) -> Option<Tested> {
    let trials = Trials::new(data, set, rows, plan)?;
    Some(trials.tested(seed, plan))
}

/// Row of the catalogue as a hypothesis on the records.
pub struct Row<'a> {
    kind: &'static str,
    hypothesis: &'a Hypothesis,
    /// True if its effects may be injected; the others are only tried.
    may_act: bool,
    /// Known sizes of its kind.
    reach: Option<Reach>,
}

impl<'a> Row<'a> {
    /// Row of a candidate; `None` for events, expressions, harmonics, and candidates that require another.
    pub fn of(candidate: &'a Candidate) -> Option<Self> {
        let is_row = !matches!(
            candidate.variant,
            Variant::Event { .. } | Variant::Expression { .. } | Variant::Harmonic { .. }
        ) && candidate.hypothesis.requires.is_none();
        let reach = Reach::of(candidate.kind);
        is_row.then_some(Self::new(candidate.kind, &candidate.hypothesis, reach))
    }

    /// Row of a kind whose effects may be injected.
    pub fn new(kind: &'static str, hypothesis: &'a Hypothesis, reach: Option<Reach>) -> Self {
        Self {
            kind,
            hypothesis,
            may_act: true,
            reach,
        }
    }

    /// The same without injections.
    pub fn only_tried(self) -> Self {
        Self {
            may_act: false,
            ..self
        }
    }
}

/// A hypothesis of the catalogue in the trials.
pub struct Tried<'a> {
    kind: &'static str,
    hypothesis: &'a Hypothesis,
    /// Its parameters by columns of the records.
    columns: Sparse,
    /// Fisher information of its parameters, those fitted in every trial profiled out.
    information: DMatrix<f64>,
    /// Covariance of its parameters.
    covariance: DMatrix<f64>,
    rank: usize,
    may_act: bool,
    reach: Option<Reach>,
}

/// Sparse matrix of parameters by columns: place and factor of each entry.
struct Sparse(Vec<Vec<(usize, f64)>>);

impl Sparse {
    fn parameters(&self) -> usize {
        self.0.len()
    }

    /// Product with a vector over the columns.
    fn times(&self, vector: &DVector<f64>) -> DVector<f64> {
        let of_one = |own: &Vec<(usize, f64)>| own.iter().map(|(at, by)| by * vector[*at]).sum();
        DVector::from_iterator(self.parameters(), self.0.iter().map(of_one))
    }

    /// Product of the transpose with a vector over the parameters.
    fn spread(&self, parameters: &DVector<f64>, count: usize) -> DVector<f64> {
        let mut sum = DVector::zeros(count);
        for (own, value) in self.0.iter().zip(parameters.iter()) {
            own.iter().for_each(|(at, by)| sum[*at] += by * value);
        }
        sum
    }
}

/// Block-diagonal symmetric matrix over the columns of all records, one block per record.
struct ByRecord {
    /// First column and matrix of each block.
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

/// Parameters fitted in every trial.
struct Fitted {
    columns: Sparse,
    /// Products of the information of all columns with each parameter.
    with: Vec<DVector<f64>>,
    /// Covariance of its parameters.
    covariance: DMatrix<f64>,
}

impl Fitted {
    /// Projects the fitted parameters out of scores.
    fn out_of(&self, mut scores: DVector<f64>) -> DVector<f64> {
        let sizes = &self.covariance * self.columns.times(&scores);
        for (with, size) in self.with.iter().zip(sizes.iter()) {
            scores.axpy(-size, with, 1.0);
        }
        scores
    }
}

/// Monte Carlo trials of a search, see the module's page.
pub struct Trials<'a> {
    tried: Vec<Tried<'a>>,
    /// Information of all columns of all records, nothing profiled out.
    whole: ByRecord,
    /// Its Cholesky factor.
    root: ByRecord,
    fitted: Fitted,
    /// Log posterior that a name needs, prices of places apart.
    needed: f64,
    class_within: f64,
    /// Number of columns of all records.
    count: usize,
}

/// Record and column of each place in a hypothesis, ascending.
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

/// Fisher information of columns, record by record.
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

/// Cholesky factor of an information; `None` if it has none.
fn root_of(information: &ByRecord) -> Option<ByRecord> {
    let each = information.blocks.iter().map(|(first, block)| {
        let mut raised = block.clone();
        for place in 0..raised.nrows() {
            // Linearly dependent columns would leave no factor.
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
        FoundSet { levels, members }: FoundSet,
        rows: &[Row<'a>],
        plan: &Plan,
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
            let alone = products(&columns, &with);
            let left: Vec<_> = with.into_iter().map(|one| fitted.out_of(one)).collect();
            let information = products(&columns, &left);
            let covariance = pseudo_inverse_beside(&information, &alone);
            let rank = (&information * &covariance).trace().round() as usize;
            (rank > 0).then_some(Tried {
                kind: one.kind,
                hypothesis: one.hypothesis,
                columns,
                information,
                covariance,
                rank,
                may_act: one.may_act,
                reach: one.reach,
            })
        };
        let tried: Vec<Tried> = rows.iter().filter_map(of_row).collect();
        let mut kinds: Vec<&str> = tried.iter().map(|one| one.kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let each = (plan.inference.search.expected_effects / kinds.len() as f64).ln();
        (!tried.is_empty()).then_some(Self {
            tried,
            whole,
            root,
            fitted,
            needed: plan.judgement.naming - each,
            class_within: plan.judgement.class_within,
            count,
        })
    }

    /// Simulates scores of noise alone.
    fn noise(&self, random: &mut ChaCha8Rng) -> DVector<f64> {
        let normal = DVector::from_fn(self.count, |_, _| StandardNormal.sample(random));
        self.fitted.out_of(self.root.times(&normal))
    }

    /// Simulates scores of noise with an effect of signal-to-noise ratio `rho`; `None` if it exceeds its parameters' bounds.
    fn scores_with(
        &self,
        planted: &Tried,
        rho: f64,
        random: &mut ChaCha8Rng,
    ) -> Option<DVector<f64>> {
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

    /// Log evidence of a hypothesis by scores: its gain, integrated over a g-prior, less its price.
    fn worth(one: &Tried, scores: &DVector<f64>) -> f64 {
        let own = one.columns.times(scores);
        let gain = 0.5 * own.dot(&(&one.covariance * &own));
        integrated(gain, one.rank) - one.hypothesis.price
    }

    /// Selects the named effect and the kinds in its class.
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
}

impl<'a> super::Trials for Trials<'a> {
    type Planted = Tried<'a>;

    /// For each kind the hypothesis with the highest rank.
    fn planted(&self) -> Vec<&Tried<'a>> {
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

    fn kind(&self, planted: &Tried<'a>) -> &'static str {
        planted.kind
    }

    fn in_noise(&self, random: &mut ChaCha8Rng) -> Option<Said> {
        self.named(&self.noise(random))
    }

    fn with(&self, planted: &Tried<'a>, rho: f64, random: &mut ChaCha8Rng) -> Option<Option<Said>> {
        let scores = self.scores_with(planted, rho, random)?;
        Some(self.named(&scores))
    }

    fn theory(&self, planted: &Tried<'a>, rho: f64) -> f64 {
        let needed = self.needed + planted.hypothesis.price;
        chance_of_name(planted.rank, rho, |squared_size| {
            integrated(0.5 * squared_size, planted.rank) >= needed
        })
    }

    fn sensitivity(&self, planted: &Tried<'a>, needed_snr: f64) -> Option<Sensitivity> {
        let information = planted.information.diagonal();
        let information = information.iter().copied();
        sensitivity(planted.kind, planted.reach?, information, needed_snr)
    }
}

/// Products of the information of all columns with each parameter.
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

/// Products of parameters with the vectors `with` of others.
fn products(columns: &Sparse, with: &[DVector<f64>]) -> DMatrix<f64> {
    let mut matrix = DMatrix::zeros(columns.parameters(), with.len());
    for (place, with) in with.iter().enumerate() {
        matrix.set_column(place, &columns.times(with));
    }
    matrix
}
