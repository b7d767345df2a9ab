//! Parametric bootstrap of the search on this recording: names given in noise alone, and detection of known effects.
//!
//! Whitened rows of noise are drawn with the scatter of each block, effects are added to the normal equations, and the
//! search decides on these. Accepted effects are fitted in every trial. Not in the trials: the growth of the registration,
//! steps of a bias, lines and expressions.

use nalgebra::{DMatrix, DVector};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rlg_diagnosis::self_test::{Reach, Said, Trials, chance_of_name, sensitivity};
use rlg_findings::result::Sensitivity;
use rlg_inference::Bound;

use crate::likelihood::block_sums::{BlockSums, Statistic};
use crate::rows::alignment::{COUNT, GROUPS, Group, places};
use crate::rows::blocks::Blocks;
use crate::selection::group_selection::{Choice, Named};

/// Bootstrap trials of the search on a recording's blocks.
pub(crate) struct OnBlocks<'a> {
    blocks: &'a Blocks<'a>,
    choice: Choice<'a>,
    /// Accepted physical effects.
    physics: &'a [Named],
    /// Accepted groups of the registration.
    found: Vec<&'static Group>,
    /// Column indices of all accepted parameters.
    set: Vec<usize>,
    /// Column indices of all accepted parameters and of the whole registration.
    wide: Vec<usize>,
    /// Standard deviation of a whitened row in each block.
    scatter: Vec<f64>,
    planted: Vec<Planted>,
}

/// An effect added in trials.
pub(crate) struct Planted {
    kind: &'static str,
    places: Vec<usize>,
    bounds: Vec<Bound>,
    /// Joint information matrix of its parameters, given those fitted with them.
    information: DMatrix<f64>,
    /// Information on each parameter alone, given the same.
    alone: Vec<f64>,
    /// Degrees of freedom of its design effect.
    degrees: f64,
    /// Number of alternatives.
    among: usize,
}

impl<'a> OnBlocks<'a> {
    pub(crate) fn new(
        blocks: &'a Blocks<'a>,
        choice: Choice<'a>,
        physics: &'a [Named],
        registration: &[Named],
    ) -> Self {
        let found: Vec<&Group> = GROUPS
            .iter()
            .filter(|group| registration.iter().any(|one| one.group() == group.kind))
            .collect();
        let of_physics: Vec<usize> = physics.iter().flat_map(|one| one.places.clone()).collect();
        let of_found = found.iter().flat_map(|group| places(group.kind));
        let set = of_found.chain(of_physics.iter().copied()).collect();
        let wide: Vec<usize> = (0..COUNT).chain(of_physics).collect();
        let sums = &blocks.sums;
        let left = sums.left(&wide).into_iter().zip(blocks.rows());
        let mut on_blocks = Self {
            scatter: left
                .map(|(left, rows)| (left.max(0.0) / rows as f64).sqrt())
                .collect(),
            planted: Vec::new(),
            blocks,
            choice,
            physics,
            found,
            set,
            wide,
        };
        on_blocks.planted = on_blocks
            .of_registration()
            .chain(on_blocks.of_physics())
            .collect();
        on_blocks
    }

    fn of_registration(&self) -> impl Iterator<Item = Planted> + '_ {
        let others = GROUPS.iter().filter(|group| !self.is_found(group));
        others.map(|group| {
            let own: Vec<usize> = places(group.kind).collect();
            let bound = Bound {
                std: group.prior_std,
                ..Bound::NONE
            };
            self.planted(
                group.kind,
                own,
                vec![bound; group.names.len()],
                &self.set,
                GROUPS.len(),
            )
        })
    }

    fn of_physics(&self) -> impl Iterator<Item = Planted> + '_ {
        let effects = &self.choice.candidates.effects;
        let is_named = |kind: &str| self.physics.iter().any(|one| one.kind == kind);
        let others = effects.iter().filter(move |(one, _)| !is_named(one.kind));
        others.map(|(one, own)| {
            let bounds = (0..own.len()).map(|k| one.hypothesis.bound(k)).collect();
            self.planted(one.kind, own.clone(), bounds, &self.wide, effects.len())
        })
    }

    fn planted(
        &self,
        kind: &'static str,
        places: Vec<usize>,
        bounds: Vec<Bound>,
        beside: &[usize],
        among: usize,
    ) -> Planted {
        let sums = &self.blocks.sums;
        Planted {
            information: sums.information_of(beside, &places),
            alone: sums.information(beside, &places),
            degrees: sums.degrees_of(beside, &places),
            kind,
            places,
            bounds,
            among,
        }
    }

    fn is_found(&self, group: &Group) -> bool {
        self.found.iter().any(|one| one.kind == group.kind)
    }

    fn noise(&self, random: &mut ChaCha8Rng) -> BlockSums {
        self.blocks.of_others(|block| {
            let one: f64 = StandardNormal.sample(random);
            self.scatter[block] * one
        })
    }

    /// Returns the kind named from the sums of a trial: a physical effect first, as in the search.
    fn named(&self, sums: &BlockSums) -> Option<Said> {
        let choice = Choice {
            sums,
            ..self.choice
        };
        let known: Vec<&'static str> = self.physics.iter().map(|one| one.kind).collect();
        if let (Some(named), _) = choice.next(&self.wide, &known) {
            let mut alike = choice.rivals(&self.wide, &named.statistic, &known);
            alike.push(named.kind);
            return Some(Said {
                kind: named.kind,
                alike,
            });
        }
        let others = GROUPS.iter().filter(|group| !self.is_found(group));
        let called_for = others.filter_map(|group| {
            let (is_seen, gain) = choice.called_for(group, &self.set);
            is_seen.then_some((gain, group))
        });
        let (_, group) = called_for.max_by(|a, b| a.0.total_cmp(&b.0))?;
        let all: Vec<usize> = self.set.iter().copied().chain(places(group.kind)).collect();
        let beside: Vec<&Group> = self.found.iter().copied().chain([group]).collect();
        let mut alike = choice.supported(group, &all, &known, &beside).alike;
        alike.push(group.kind);
        Some(Said {
            kind: group.kind,
            alike,
        })
    }
}

impl Trials for OnBlocks<'_> {
    type Planted = Planted;

    fn planted(&self) -> Vec<&Planted> {
        self.planted.iter().collect()
    }

    fn kind(&self, planted: &Planted) -> &'static str {
        planted.kind
    }

    fn in_noise(&self, random: &mut ChaCha8Rng) -> Option<Said> {
        self.named(&self.noise(random))
    }

    fn with(&self, planted: &Planted, rho: f64, random: &mut ChaCha8Rng) -> Option<Option<Said>> {
        let normal = planted.places.iter().map(|_| StandardNormal.sample(random));
        let normal = DVector::<f64>::from_iterator(planted.places.len(), normal);
        let root = planted.information.clone().cholesky()?.l();
        // Random direction of unit size in the metric of the information.
        let along = root.transpose().solve_upper_triangular(&normal)? / normal.norm();
        let values = along * rho;
        let is_possible = values
            .iter()
            .zip(&planted.bounds)
            .all(|(value, bound)| value.abs() < bound.std && !bound.excludes(*value, 0.0, 0.0));
        is_possible.then(|| {
            let mut sums = self.noise(random);
            sums.add(&planted.places, &values);
            self.named(&sums)
        })
    }

    fn theory(&self, planted: &Planted, rho: f64) -> f64 {
        let plan = &self.choice.plan.attitude;
        let count = planted.places.len();
        chance_of_name(count, rho, |squared_size| {
            let statistic = Statistic {
                squared_size,
                design_effect: 1.0,
                degrees: planted.degrees,
                count,
            };
            statistic.gain(planted.among, true, &plan.blocks) >= plan.least_gain
        })
    }

    fn sensitivity(&self, planted: &Planted, needed_snr: f64) -> Option<Sensitivity> {
        sensitivity(
            planted.kind,
            Reach::of(planted.kind)?,
            planted.alone.iter().copied(),
            needed_snr,
        )
    }
}
