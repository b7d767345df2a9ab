//! A set of hypotheses as parameters: products and moments of their columns by record and bin, with the nuisance parameters
//! of gaps.
//!
//! A record's gaps are parameters of that record alone. They are integrated out first, record by record: the remainder is as
//! small as the set. Free constants of several records couple them; then all are integrated out at once.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::hypothesis::Hypothesis;
use crate::likelihood::Likelihood;
use crate::linear::{LEAST_INFORMATION, dot, invert, sub_matrix};
use crate::noise::NoiseLevels;

/// A set and the gaps of its records, in parameters scaled to unit power.
pub(crate) struct Assembled {
    /// Parameters of each member.
    pub blocks: Vec<Range<usize>>,
    /// Parameters of each record's gaps, behind those of the members.
    pub gaps: Vec<Range<usize>>,
    /// Blocks of nuisance parameters, joined where coupled.
    apart: Vec<Range<usize>>,
    /// Factor of each scaled parameter to its own unit.
    pub scale: Vec<f64>,
    /// Sums of each record.
    pub records: Vec<OfRecord>,
}

/// Sums of one record for the parameters.
pub(crate) struct OfRecord {
    /// Σ of the squared record in each bin, less the members' fixed contributions.
    pub energy: Vec<f64>,
    /// Parameters with an effect on this record, ascending.
    parameters: Vec<usize>,
    /// Packed lower triangle of G, row by row, per bin.
    gram: Vec<Vec<f64>>,
    /// h, per bin.
    moments: Vec<Vec<f64>>,
}

/// Information of a set after integration over the gaps' parameters.
pub(crate) struct BesideGaps {
    /// Information of the members' parameters.
    pub information: DMatrix<f64>,
    /// ln determinant of the gaps' own information.
    pub log_determinant: f64,
    /// Inverse of the gaps' own information, block by block.
    inverses: Vec<DMatrix<f64>>,
    /// C G⁻¹ with C between members and gaps, (members' parameters × gaps').
    through: DMatrix<f64>,
}

impl Assembled {
    pub(crate) fn new(data: &impl Likelihood, set: &[&Hypothesis]) -> Self {
        let whole: Vec<&Hypothesis> = set.iter().copied().chain(data.free()).collect();
        let mut blocks = Vec::new();
        let mut count = 0;
        for one in &whole {
            blocks.push(count..count + one.parameters);
            count += one.parameters;
        }
        let records = data.record_count();
        let mut columns: Vec<Vec<Vec<(usize, f64)>>> = vec![vec![Vec::new(); count]; records];
        let mut power = vec![0.0; count];
        for (one, block) in whole.iter().zip(&blocks) {
            for term in &one.terms {
                let scale = data.scale(term.record, term.column);
                if scale > 0.0 {
                    let size = term.coefficient / scale;
                    let parameter = block.start + term.parameter;
                    columns[term.record][parameter].push((term.column, size));
                    power[parameter] += size * size;
                }
            }
        }
        let scale_of = |power: &f64| {
            if *power > 0.0 {
                1.0 / power.sqrt()
            } else {
                1.0
            }
        };
        let scale: Vec<f64> = power.iter().map(scale_of).collect();
        let records = columns
            .into_iter()
            .enumerate()
            .map(|(record, of_parameters)| {
                let fixed = set.iter().flat_map(|one| &one.fixed);
                let fixed: Vec<(usize, f64)> = fixed
                    .filter(|one| one.record == record && data.scale(record, one.column) > 0.0)
                    .map(|one| (one.column, one.size / data.scale(record, one.column)))
                    .collect();
                OfRecord::new(data, record, &of_parameters, &scale, &fixed)
            })
            .collect();
        let gaps = blocks.split_off(set.len());
        let first = blocks.last().map_or(0, |last| last.end);
        let apart = match gaps.len() > data.record_count() {
            true => std::iter::once(first..count).collect(),
            false => gaps.clone(),
        };
        Self {
            gaps,
            apart,
            blocks,
            scale,
            records,
        }
    }

    /// Number of the members' parameters.
    pub(crate) fn of_members(&self) -> usize {
        self.blocks.last().map_or(0, |last| last.end)
    }

    /// Information and score of all parameters under noise powers by bin, `[record][bin]`.
    pub(crate) fn sums(&self, powers: &[Vec<f64>]) -> (DMatrix<f64>, DVector<f64>) {
        let count = self.scale.len();
        let mut information = DMatrix::zeros(count, count);
        let mut score = DVector::zeros(count);
        for (record, powers) in self.records.iter().zip(powers) {
            let size = record.parameters.len();
            let mut gram = vec![0.0; size * (size + 1) / 2];
            let mut moments = vec![0.0; size];
            for ((of_bin, of_moments), power) in record.gram.iter().zip(&record.moments).zip(powers)
            {
                let weight = 1.0 / power;
                for (sum, value) in gram.iter_mut().zip(of_bin) {
                    *sum += weight * value;
                }
                for (sum, value) in moments.iter_mut().zip(of_moments) {
                    *sum += weight * value;
                }
            }
            let mut packed = gram.iter();
            for (i, &a) in record.parameters.iter().enumerate() {
                score[a] += moments[i];
                for (&b, value) in record.parameters[..=i].iter().zip(&mut packed) {
                    information[(a, b)] += value;
                    if a != b {
                        information[(b, a)] += value;
                    }
                }
            }
        }
        (information, score)
    }

    /// Integrates the gaps' parameters out of an information (Schur complement).
    pub(crate) fn beside_gaps(&self, information: &DMatrix<f64>) -> BesideGaps {
        let own = self.of_members();
        let others = information.nrows() - own;
        let mut left = information.view((0, 0), (own, own)).into_owned();
        let mut through = DMatrix::zeros(own, others);
        let mut log_determinant = 0.0;
        let mut inverses = Vec::with_capacity(self.apart.len());
        for block in &self.apart {
            let (inverse, log) = invert(&sub_matrix(information, block));
            let between = information.view((0, block.start), (own, block.len()));
            let of_block = between * &inverse;
            left -= &of_block * between.transpose();
            through
                .view_mut((0, block.start - own), (own, block.len()))
                .copy_from(&of_block);
            log_determinant += log;
            inverses.push(inverse);
        }
        BesideGaps {
            information: left,
            log_determinant,
            inverses,
            through,
        }
    }

    /// Information of the members' parameters under the noise of a fit, gaps integrated out.
    pub(crate) fn information(
        &self,
        data: &impl Likelihood,
        levels: &[NoiseLevels],
    ) -> DMatrix<f64> {
        let powers = binned(data, levels);
        self.beside_gaps(&self.sums(&powers).0).information
    }
}

/// Noise powers by record and bin.
pub(crate) fn binned(data: &impl Likelihood, levels: &[NoiseLevels]) -> Vec<Vec<f64>> {
    let each = levels.iter().enumerate();
    each.map(|(record, levels)| data.basis(record).binned(*levels))
        .collect()
}

impl BesideGaps {
    /// C G⁻¹ with C between members and gaps, (members' parameters × gaps').
    pub(crate) fn through(&self) -> &DMatrix<f64> {
        &self.through
    }

    /// Power of the records explained by the gaps, sᵀ G⁻¹ s, for a given score.
    pub(crate) fn power_of_gaps(&self, score: &DVector<f64>) -> f64 {
        let mut at = 0;
        let each = self.inverses.iter().map(|inverse| {
            let own = score.rows(at, inverse.nrows());
            at += inverse.nrows();
            own.dot(&(inverse * own))
        });
        each.sum()
    }

    /// Covariance of all parameters from that of the members'.
    pub(crate) fn covariance(&self, of_members: &DMatrix<f64>) -> DMatrix<f64> {
        let own = of_members.nrows();
        let others = self.through.ncols();
        let between = of_members * &self.through;
        let mut of_gaps = self.through.tr_mul(&between);
        let mut at = 0;
        for inverse in &self.inverses {
            let mut block = of_gaps.view_mut((at, at), inverse.shape());
            block += inverse;
            at += inverse.nrows();
        }
        let mut covariance = DMatrix::zeros(own + others, own + others);
        covariance
            .view_mut((0, 0), (own, own))
            .copy_from(of_members);
        covariance
            .view_mut((0, own), (own, others))
            .copy_from(&-&between);
        covariance
            .view_mut((own, 0), (others, own))
            .copy_from(&-between.transpose());
        covariance
            .view_mut((own, own), (others, others))
            .copy_from(&of_gaps);
        covariance
    }
}

impl OfRecord {
    fn new(
        data: &impl Likelihood,
        record: usize,
        of_parameters: &[Vec<(usize, f64)>],
        scale: &[f64],
        fixed: &[(usize, f64)],
    ) -> Self {
        let mut energy = data.energy(record).to_vec();
        for (bin, energy) in energy.iter_mut().enumerate() {
            for &(column, size) in fixed {
                *energy -= 2.0 * size * data.moment(record, bin, column);
                for &(other, other_size) in fixed {
                    *energy += size * other_size * data.product(record, bin, column, other);
                }
            }
            *energy = energy.max(LEAST_INFORMATION);
        }
        let parameters: Vec<usize> = (0..of_parameters.len())
            .filter(|&parameter| !of_parameters[parameter].is_empty())
            .collect();
        let bins = data.basis(record).bins.len();
        let size = parameters.len();
        let mut gram = vec![vec![0.0; size * (size + 1) / 2]; bins];
        let mut moments = vec![vec![0.0; size]; bins];
        for (i, &a) in parameters.iter().enumerate() {
            for &(column, weight) in &of_parameters[a] {
                for (bin, moments) in moments.iter_mut().enumerate() {
                    let mut moment = data.moment(record, bin, column);
                    for &(other, size) in fixed {
                        moment -= size * data.product(record, bin, column, other);
                    }
                    moments[i] += weight * scale[a] * moment;
                }
            }
            for (j, &b) in parameters.iter().enumerate().take(i + 1) {
                let at = i * (i + 1) / 2 + j;
                for &(first, first_weight) in &of_parameters[a] {
                    for &(second, second_weight) in &of_parameters[b] {
                        let weight = first_weight * second_weight * scale[a] * scale[b];
                        for (bin, gram) in gram.iter_mut().enumerate() {
                            gram[at] += weight * data.product(record, bin, first, second);
                        }
                    }
                }
            }
        }
        Self {
            energy,
            parameters,
            gram,
            moments,
        }
    }

    /// Expected residual power in each bin: of the mean, and of the posterior covariance.
    pub(crate) fn residual_power(
        &self,
        estimate: &DVector<f64>,
        covariance: &DMatrix<f64>,
    ) -> Vec<f64> {
        let size = self.parameters.len();
        let of_record: Vec<f64> = self.parameters.iter().map(|&a| estimate[a]).collect();
        let mut second = Vec::with_capacity(size * (size + 1) / 2);
        for (i, &a) in self.parameters.iter().enumerate() {
            let row = self.parameters[..=i].iter();
            second.extend(row.map(|&b| {
                let times = if a == b { 1.0 } else { 2.0 };
                times * (covariance[(a, b)] + estimate[a] * estimate[b])
            }));
        }
        let bins = self.energy.iter().zip(&self.gram).zip(&self.moments);
        bins.map(|((energy, gram), moments)| {
            let cross = dot(moments, &of_record);
            let square = dot(gram, &second);
            (energy - 2.0 * cross + square).max(LEAST_INFORMATION)
        })
        .collect()
    }
}
