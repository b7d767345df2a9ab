//! What this very recording's noise does to the search, and what the search would have found in it.
//!
//! Enters: the bench as the search left it, on the fitted rows; the catch; a seed. Leaves: [`SelfTest`]:
//! * time slides: what the fit left, moved circularly against the regressors by random times of at least a
//!   second. Whatever real coupling there was is gone, the noise is the recording's own, so every name is false;
//! * injections: patterns of every kind, at known matched-filter SNR ρ, added to slid residuals: the share found
//!   and rightly named (diagnosis road, step 13).
//!
//! Everything happens in the sufficient statistics g and F of information.rs. A slide by k rows multiplies the
//! residual's bins by e^{−iωk}, so g against a column at every k is one inverse transform of
//! column · conj(residual) / S; an injection of p adds F p to g. Found terms are fitted away in every trial.
//!
//! Not in the trials: Gauss–Newton (delays stay linear), the noise fit, and the search for events and expressions.
//! Slides by less than a column's correlation time, or by a period of the motion, are not independent of each
//! other: the upper limit counts them as if they were.

use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;
use realfft::ComplexToReal;
use realfft::num_complex::Complex64;
use rlg_diagnosis::self_test::{beyond, upper_limit};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::bench::Bench;
use super::declare::CATALOGUE_SIGNIFICANCE;
use super::hunt::Catch;
use super::hypotheses::CATALOGUE;
use super::information::{Information, aside, fit_away, inverse_aside, scaled_inverse};
use super::portion::Bins;
use super::regressor::Regressor;
use super::select;
use super::weigh::{self, prior_width};
use super::workbench::{Parameters, Workbench};

/// Slides: none false among 200 bounds the rate to 1.5 % with 95 % confidence, and costs less than the fit.
const SLIDES: usize = 200;

/// No slide is shorter \[s\]: effects late or early by less are still coupled to the motion.
const SHORTEST_SLIDE_S: f64 = 1.0;

/// Strengths of the injections (matched-filter SNR): from seldom found to always.
pub const RHO: [f64; 4] = [4.0, 6.0, 8.0, 10.0];

/// Injections of each kind at each strength; the curve sums over kinds.
const DRAWS: usize = 2;

/// One strength, all kinds together.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Matched-filter SNR.
    pub rho: f64,
    /// Patterns injected.
    pub injections: usize,
    /// Trials in which the search named anything.
    pub detected: usize,
    /// Trials in which the kind was named, alone or in a class of kinds not told apart.
    pub named: usize,
    /// Chance that a pattern of this strength passes the significance asked for, in noise as modelled.
    pub theory: f64,
}

/// One kind, all strengths.
#[derive(Debug, Clone, PartialEq)]
pub struct Kind {
    /// Index into the catalogue.
    pub effect: usize,
    /// Detected and named by strength, in the order of [`RHO`]; `None` where the pattern would be larger than
    /// credible physics.
    pub by_rho: Vec<Option<[usize; 2]>>,
    /// Slides in which it was named.
    pub false_names: usize,
}

/// What the trials showed.
#[derive(Debug, Clone, PartialEq)]
pub struct SelfTest {
    /// Time slides made.
    pub slides: usize,
    /// Slides in which anything was named.
    pub false_names: usize,
    /// No more than this share of slides would name anything, at 95 % confidence (Clopper and Pearson).
    pub upper_limit: f64,
    /// By strength.
    pub curve: Vec<Point>,
    /// By kind.
    pub kinds: Vec<Kind>,
}

impl SelfTest {
    /// No trial was possible.
    fn none() -> Self {
        Self {
            slides: 0,
            false_names: 0,
            upper_limit: 1.0,
            curve: Vec::new(),
            kinds: Vec::new(),
        }
    }
}

/// Runs all trials.
pub fn self_test(
    bench: &Workbench,
    parameters: &Parameters,
    candidates: &[usize],
    catch: &Catch,
    seed: u64,
) -> SelfTest {
    let rows = bench.portion.rows();
    let rate_hz = rows as f64 / bench.portion.seconds();
    let shortest = ((SHORTEST_SLIDE_S * rate_hz) as usize).clamp(1, rows / 4);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let shifts: Vec<usize> = (0..SLIDES)
        .map(|_| random.random_range(shortest..=rows - shortest))
        .collect();
    let mut left = bench.left_over(&catch.values);
    for (axis, left) in left.iter_mut().enumerate() {
        // In step with the dither only where it stands: slid, it would be a delay of it.
        let aside: Vec<&Regressor> = aside(bench.joints(), bench.nuisances(axis)).collect();
        fit_away(left, &aside, &bench.noise[axis].weights(&bench.portion));
    }
    let slid = slid_rights(bench, parameters, &left, &shifts);
    let mut numbers = slid.iter().chain(&catch.information.fisher);
    if !numbers.all(|number| number.is_finite()) {
        return SelfTest::none();
    }
    // Blocks beside the bench are not slid, so nothing is asked of them.
    let own = bench.beside().map(|_| bench.own_information());
    let information = own.as_ref().unwrap_or(&catch.information);
    let trials = Trials::new(parameters, candidates, information, &slid);

    let names: Vec<Vec<(usize, Vec<usize>)>> = (0..SLIDES)
        .into_par_iter()
        .map(|slide| trials.run(slide, None))
        .collect();
    let false_names = names.iter().filter(|set| !set.is_empty()).count();
    let patterns: Vec<(usize, usize, u64)> = (0..candidates.len())
        .flat_map(|place| {
            (0..RHO.len()).flat_map(move |strength| {
                (0..DRAWS as u64).map(move |draw| (place, strength, draw))
            })
        })
        .collect();
    // Each pattern has its own stream of random numbers, so that threads do not matter.
    let found: Vec<Option<(bool, bool)>> = patterns
        .par_iter()
        .enumerate()
        .map(|(number, &(place, strength, _))| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(1 + number as u64);
            trials.inject(candidates[place], RHO[strength], &mut random)
        })
        .collect();
    let of = |place: usize, strength: usize| -> Option<[usize; 2]> {
        let here = patterns.iter().zip(&found);
        let here: Vec<(bool, bool)> = here
            .filter(|((p, s, _), _)| (*p, *s) == (place, strength))
            .filter_map(|(_, found)| *found)
            .collect();
        let count = |one: &dyn Fn(&(bool, bool)) -> bool| here.iter().filter(|f| one(f)).count();
        (here.len() == DRAWS).then(|| [count(&|f| f.0), count(&|f| f.1)])
    };
    let kinds: Vec<Kind> = candidates
        .iter()
        .enumerate()
        .map(|(place, &effect)| Kind {
            effect,
            by_rho: (0..RHO.len()).map(|strength| of(place, strength)).collect(),
            false_names: names
                .iter()
                .filter(|set| set.iter().any(|(named, _)| *named == effect))
                .count(),
        })
        .collect();
    let curve = (0..RHO.len())
        .map(|strength| {
            let tried: Vec<(&Kind, [usize; 2])> = kinds
                .iter()
                .filter_map(|kind| Some((kind, kind.by_rho[strength]?)))
                .collect();
            let chances = tried
                .iter()
                .map(|(kind, _)| trials.theory(kind.effect, RHO[strength]));
            Point {
                rho: RHO[strength],
                injections: DRAWS * tried.len(),
                detected: tried.iter().map(|(_, found)| found[0]).sum(),
                named: tried.iter().map(|(_, found)| found[1]).sum(),
                theory: chances.sum::<f64>() / tried.len().max(1) as f64,
            }
        })
        .collect();
    SelfTest {
        slides: SLIDES,
        false_names,
        upper_limit: upper_limit(false_names, SLIDES),
        curve,
        kinds,
    }
}

/// [`inner`] of a column and the residual slid by 0, 1, 2, … rows: row k of what is slid stands at k + shift.
fn slid_inner(
    inverse: &dyn ComplexToReal<f64>,
    column: &Bins,
    residual: &Bins,
    weights: &[f64],
) -> Vec<f64> {
    let last = column.len() - 1;
    let mut product: Vec<Complex64> = column
        .iter()
        .zip(residual)
        .zip(weights)
        .enumerate()
        .map(|(bin, ((column, residual), weight))| {
            // The inverse transform counts each pair of bins twice; `inner` counts it once.
            let once = if bin == 0 || bin == last { 1.0 } else { 0.5 };
            column * residual.conj() * (weight * once)
        })
        .collect();
    let mut at_shift = inverse.make_output_vec();
    // Fails where an end is no number: of a residual beyond what f64 holds nothing can be said.
    if inverse.process(&mut product, &mut at_shift).is_err() {
        at_shift.fill(f64::NAN);
    }
    at_shift
}

/// g of every parameter and found term (rows) for every slide (columns), the joints and nuisances fitted away.
fn slid_rights(
    bench: &Workbench,
    parameters: &Parameters,
    left: &[Bins; 3],
    shifts: &[usize],
) -> DMatrix<f64> {
    let count = parameters.count() + bench.terms().len();
    let everything: Vec<usize> = (0..count).collect();
    let inverse = bench.portion.inverse();
    let mut total = DMatrix::zeros(count, shifts.len());
    for (axis, left) in left.iter().enumerate() {
        let weights = bench.noise[axis].weights(&bench.portion);
        let against = |column: &Bins| -> DVector<f64> {
            let at_shift = slid_inner(inverse, column, left, &weights);
            DVector::from_iterator(shifts.len(), shifts.iter().map(|&shift| at_shift[shift]))
        };
        let aside: Vec<&Regressor> = aside(bench.joints(), bench.nuisances(axis)).collect();
        let aside_bins: Vec<Bins> = aside.par_iter().map(|column| column.to_bins()).collect();
        let aside_rights: Vec<DVector<f64>> = aside_bins.par_iter().map(against).collect();
        let aside_fisher = DMatrix::from_fn(aside.len(), aside.len(), |a, b| {
            aside[a].inner(&aside_bins[b], &weights)
        });
        let aside_inverse = inverse_aside(aside_fisher, bench.joints().len());
        let rights: Vec<(usize, DVector<f64>)> = bench
            .columns_of(&everything, axis)
            .into_par_iter()
            .map(|(index, column)| {
                let column = column.to_bins();
                let on_aside = aside.iter().map(|other| other.inner(&column, &weights));
                let fitted = &aside_inverse * DVector::from_iterator(aside.len(), on_aside);
                let mut right = against(&column);
                for (size, other) in fitted.iter().zip(&aside_rights) {
                    right.axpy(-size, other, 1.0);
                }
                (index, right)
            })
            .collect();
        for (index, right) in rights {
            let mut row = total.row_mut(index);
            row += right.transpose();
        }
    }
    total
}

/// One trial: its statistics are all there is, linear where the search left them.
struct Slid(Information);

impl Bench for Slid {
    type Declared = ();

    fn information(&self) -> Information {
        self.0.clone()
    }

    fn relinearise(&mut self, _effect: usize, _at: &[f64]) {}

    fn refit_noise(&mut self, _effects: &[usize], (): &()) {}
}

/// The statistics of all trials, found terms fitted away.
struct Trials<'a> {
    parameters: &'a Parameters,
    candidates: &'a [usize],
    information: Information,
    slid: DMatrix<f64>,
}

impl<'a> Trials<'a> {
    fn new(
        parameters: &'a Parameters,
        candidates: &'a [usize],
        information: &Information,
        slid: &DMatrix<f64>,
    ) -> Self {
        let known = parameters.count();
        let terms = information.parameters - known;
        let fisher = &information.fisher;
        let own = fisher.view((known, known), (terms, terms)).into_owned();
        let cross = fisher.view((0, known), (known, terms));
        let through = cross * scaled_inverse(&own);
        let term_rights = slid.rows(known, terms);
        Self {
            parameters,
            candidates,
            information: Information {
                fisher: fisher.view((0, 0), (known, known)) - &through * cross.transpose(),
                right: DVector::zeros(known),
                power: information.power,
                drifts: information.drifts.clone(),
                ..Information::empty(known)
            },
            slid: slid.rows(0, known) - through * term_rights,
        }
    }

    /// What is named in one slide, with an injected pattern or without.
    fn run(&self, slide: usize, pattern: Option<&DVector<f64>>) -> Vec<(usize, Vec<usize>)> {
        let mut right = self.slid.column(slide).into_owned();
        if let Some(pattern) = pattern {
            right += &self.information.fisher * pattern;
        }
        let mut slid = Slid(Information {
            right,
            ..self.information.clone()
        });
        select::names(&mut slid, self.parameters, self.candidates)
    }

    /// Whether a pattern of `effect` at strength `rho` is detected, and rightly named; `None` where the
    /// recording has nothing of it, or its size would not be credible.
    fn inject(&self, effect: usize, rho: f64, random: &mut ChaCha8Rng) -> Option<(bool, bool)> {
        let mut pattern = DVector::zeros(self.parameters.count());
        for index in self.parameters.of(effect) {
            let normal: f64 = StandardNormal.sample(random);
            let size = normal * prior_width(self.parameters, &self.information, index);
            // Where physics allows one sign only, so does the trial.
            let positive = CATALOGUE[effect].card().positive;
            pattern[index] = if positive { size.abs() } else { size };
        }
        let power = pattern.dot(&(&self.information.fisher * &pattern));
        // Also false where it is not a number.
        if !(power > 0.0 && power.is_finite()) {
            return None;
        }
        pattern *= rho / power.sqrt();
        if pattern.amax() > CATALOGUE[effect].card().largest {
            return None;
        }
        let slide = random.random_range(0..self.slid.ncols());
        let found = self.run(slide, Some(&pattern));
        let named = found
            .iter()
            .any(|(named, class)| *named == effect || class.contains(&effect));
        Some((!found.is_empty(), named))
    }

    /// Chance that noise as modelled and a pattern of strength `rho` exceed the significance asked for:
    /// a noncentral χ² of as many degrees as the recording fixes, as a Poisson mixture of central ones.
    fn theory(&self, effect: usize, rho: f64) -> f64 {
        let indices: Vec<usize> = self.parameters.of(effect).collect();
        let solution = self.information.solve(&indices, &|index| {
            prior_width(self.parameters, &self.information, index)
        });
        let degrees = solution.degrees.round().max(1.0);
        let chance = CATALOGUE_SIGNIFICANCE * weigh::share(self.candidates, effect);
        let Ok(law) = ChiSquared::new(degrees) else {
            return 0.0;
        };
        beyond(law.inverse_cdf(1.0 - chance), degrees, rho * rho)
    }
}
