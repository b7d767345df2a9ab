//! Parametric bootstrap of the recording without an effect: its size by the same estimator in its absence.

use rlg_plan::Plan;
use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rlg_catalogue::candidates::PoolColumns;
use rlg_inference::score_test::{Projected, ScoreTest, spectra};
use rlg_inference::{Dct, Fit, Hypothesis, NoiseBasis, NoiseLevels, NormalEquations, Observations};
use rlg_signal::partition::Use;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::sharing::{set_of, with_noise_of};
use super::together::Together;
use crate::alignment::case_motion::{Measured, estimate_from};
use crate::rows::data::Data;
use crate::search::structure::{Found, effect_rad};
use rlg_signal::streams::{Triad, add, add_triad, each_axis};

/// Parametric bootstrap of the recording under the hypothesis that an effect is absent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bootstrap {
    /// Number of bootstrap draws.
    pub draws: usize,
    /// Sum over the draws of the squared size of the absent effect \[σ²\].
    squared_size: f64,
    /// Number of the effect's parameters that the recording determines.
    rank: usize,
}

impl Bootstrap {
    /// Zero draws for each member of a fit.
    fn of_each(fit: &Fit) -> Vec<Self> {
        let each = fit.ranks.iter().map(|&rank| Self {
            rank: rank.max(1),
            ..Self::default()
        });
        each.collect()
    }

    /// Mean squared size of the absent effect per parameter \[σ²\]: 1 where the likelihood is right.
    pub fn inflation(&self) -> f64 {
        self.squared_size / (self.draws * self.rank).max(1) as f64
    }

    /// Divides a log-likelihood ratio by the inflation if that is significant; never increases it.
    fn deflated(&self, log_likelihood_ratio: f64, plan: &Plan) -> f64 {
        let is_chance = self
            .law()
            .is_none_or(|law| law.sf(self.squared_size) > plan.judgement.reenactment_chance);
        if is_chance {
            log_likelihood_ratio
        } else {
            log_likelihood_ratio / self.inflation().max(1.0)
        }
    }

    /// True if an inflation of `critical` or more is rejected at the plan's significance level.
    fn excludes(&self, critical: f64, plan: &Plan) -> bool {
        self.law().is_some_and(|law| {
            law.cdf(self.squared_size / critical) < plan.judgement.reenactment_chance
        })
    }

    /// Distribution of the squared size where the likelihood is right: χ² with draws · rank degrees of freedom.
    fn law(&self) -> Option<ChiSquared> {
        ChiSquared::new((self.draws * self.rank) as f64).ok()
    }
}

/// Effect whose name depends on the parametric bootstrap.
#[derive(Debug, Clone, Copy)]
pub struct Named {
    /// Log-likelihood ratio of the effect.
    pub log_likelihood_ratio: f64,
    /// Loss in log-likelihood ratio at which the name falls.
    pub margin: f64,
}

impl Named {
    /// Inflation at which the name falls.
    fn critical_inflation(&self) -> f64 {
        let kept = (self.log_likelihood_ratio - self.margin).max(f64::MIN_POSITIVE);
        self.log_likelihood_ratio / kept
    }

    /// True if the bootstrap's inflation takes the effect's name.
    pub fn falls(&self, shown: &Bootstrap, plan: &Plan) -> bool {
        let left = shown.deflated(self.log_likelihood_ratio, plan);
        self.log_likelihood_ratio - left >= self.margin
    }
}

/// Draws parametric bootstraps of all recordings without each effect of a set in turn, until its name is decided; the
/// projections of the recordings add up.
///
/// The estimated motion takes the part of the true one; reference and gyros get fresh noise of the fitted levels, and the
/// other effects act. Motion and columns are then estimated from the draw as from the recording.
///
/// # Inputs
/// `fit`: of members of `together`; `named`: of each member, in their order.
pub(crate) fn bootstrap(
    each: &[Data],
    together: &Together,
    fit: &Fit,
    named: &[Named],
    plan: &Plan,
) -> Vec<Bootstrap> {
    let mut shown = Bootstrap::of_each(fit);
    if shown.is_empty() {
        return shown;
    }
    let fits: Vec<Fit> = (0..each.len()).map(|k| with_noise_of(fit, k)).collect();
    let stages: Vec<Stage> = (0..each.len())
        .map(|recording| {
            let set = set_of(&fit.members, &together.shared, recording);
            let (data, found) = (&each[recording], &together.found[recording]);
            Stage::new(data, found, &fits[recording], set)
        })
        .collect();
    repeat(&mut shown, named, plan, |draw, open| {
        let each = stages.iter().enumerate().map(|(recording, stage)| {
            // No two recordings have the same noise.
            stage.play((draw * stages.len() + recording) as u64, open, plan)
        });
        let sum = each.reduce(|sum, own| {
            let pairs = sum.iter().zip(&own);
            pairs.map(|(sum, own)| sum.joined(own)).collect()
        });
        sum.iter().flatten().map(squared_size).collect()
    });
    shown
}

/// Adds draws to `all` as long as a name is undecided.
///
/// # Inputs
/// `named`: of each member, in their order; `play`: squared sizes of the members in `open` in a draw \[σ²\].
fn repeat(
    all: &mut [Bootstrap],
    named: &[Named],
    plan: &Plan,
    play: impl Fn(usize, &[usize]) -> Vec<f64>,
) {
    let is_open = |one: &Bootstrap, named: &Named| {
        let critical = named.critical_inflation();
        critical > 1.0 && !one.excludes(critical, plan)
    };
    for draw in 0..plan.judgement.reenactments {
        let open: Vec<usize> = (0..all.len())
            .filter(|&place| all[place].draws == 0 || is_open(&all[place], &named[place]))
            .collect();
        if open.is_empty() {
            break;
        }
        let sizes = play(draw, &open);
        for (place, size) in open.into_iter().zip(sizes) {
            all[place].draws += 1;
            all[place].squared_size += size;
        }
    }
}

/// Squared size of a hypothesis by its projection \[σ²\]: twice its gain in log likelihood.
fn squared_size(shown: &Projected) -> f64 {
    2.0 * shown.gain().log_likelihood
}

/// Source of random numbers in a draw, independent of the others.
#[derive(Clone, Copy)]
enum Source {
    Reference,
    Pickoff,
    Gyro,
    /// Fraction of a pulse in a counter at the beginning.
    Pulses,
}

impl Source {
    /// Generator of one axis, the same for the same draw.
    fn of(self, draw: u64, axis: usize) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(draw);
        random.set_stream(3 * self as u64 + axis as u64);
        random
    }
}

/// Data common to all draws.
struct Stage<'a> {
    data: &'a Data<'a>,
    found: &'a Found,
    fit: &'a Fit,
    /// Hypothesis of each member, its fixed terms as one more parameter.
    set: Vec<Hypothesis>,
    /// Effect of each member \[rad\]; empty for a single member.
    effects_rad: Vec<Triad>,
    basis: NoiseBasis,
    dct: Dct,
    fitted: Observations,
    seen: Vec<bool>,
}

impl<'a> Stage<'a> {
    fn new(data: &'a Data<'a>, found: &'a Found, fit: &'a Fit, set: Vec<Hypothesis>) -> Self {
        let rows = data.streams.rows;
        let seen = data.rows_of(&[Use::Fit]);
        let is_alone = fit.members.len() < 2;
        let effects_rad = (0..fit.members.len()).filter(|_| !is_alone);
        Self {
            set,
            effects_rad: effects_rad
                .map(|place| effect_rad(found, fit, place))
                .collect(),
            basis: NoiseBasis::new(&Observations::separate(&vec![true; rows], 1)),
            dct: Dct::new(rows),
            fitted: data
                .observed(&seen)
                .expect("what was fitted has rows")
                .to_fast_length(),
            seen,
            data,
            found,
            fit,
        }
    }

    /// Projects each of the `absent` members on a draw without it.
    fn play(&self, draw: u64, absent: &[usize], plan: &Plan) -> Vec<Projected> {
        let signals = &self.found.motion.signals;
        let (case_rad, dither_rad, noise_rad) = self.noises(draw);
        let measured = Measured {
            reference_rad: Arc::new(case_rad),
            dither_rad: dither_rad.as_ref(),
        };
        let levels = &self.fit.levels;
        let motion = estimate_from(
            self.data,
            measured,
            &noise_rad,
            levels,
            &self.seen,
            signals.path,
            plan,
        );
        drop(dither_rad);
        let columns = PoolColumns {
            columns: &self.found.pool.columns,
            signals: &motion.signals,
        };
        let none = PoolColumns {
            columns: &[],
            signals: &motion.signals,
        };
        let size = |&place: &usize| {
            let mut residual_rad = noise_rad.clone();
            let others = (0..self.set.len()).filter(|other| *other != place);
            for other in others.clone() {
                add_triad(&mut residual_rad, &self.effects_rad[other], 1.0);
            }
            let equations = NormalEquations::new(
                self.fitted.clone(),
                &residual_rad,
                &none,
                NoiseLevels::mean(levels),
            );
            let others: Vec<&Hypothesis> = others.map(|other| &self.set[other]).collect();
            let tests = [ScoreTest::new(&equations, &others, &columns, levels)];
            let own = spectra(&tests, std::slice::from_ref(&self.set[place]), &columns);
            tests[0].project(&self.set[place], &own)
        };
        absent.iter().map(size).collect()
    }

    /// Draws increments of a reference and of blocks \[rad\], and the residual's noise \[rad\].
    fn noises(&self, draw: u64) -> (Triad, Option<Triad>, Triad) {
        let motion = &self.found.motion;
        let signals = &motion.signals;
        let of_reference = |axis: usize| NoiseLevels {
            white: motion.reference_walk[axis].value,
            angle: motion.reference_angle[axis].value,
            ..NoiseLevels::default()
        };
        let of_pickoff = |axis: usize| NoiseLevels {
            angle: self.data.model.pickoff_white_rad2(axis),
            ..NoiseLevels::default()
        };
        let reference =
            each_axis(|axis| self.draw(Source::Reference.of(draw, axis), of_reference(axis)));
        let pickoff = signals
            .dither_rad
            .as_ref()
            .map(|_| each_axis(|axis| self.draw(Source::Pickoff.of(draw, axis), of_pickoff(axis))));
        let noise_rad = each_axis(|gyro| {
            let mut own = self.fit.levels[gyro];
            if pickoff.is_some() {
                own.angle -= of_pickoff(gyro).angle;
            }
            for axis in 0..3 {
                let share = signals.shared[(gyro, axis)].powi(2);
                own.white -= share * of_reference(axis).white;
                own.angle -= share * of_reference(axis).angle;
            }
            own.white = own.white.max(0.0);
            own.angle = own.angle.max(0.0);
            let mut noise = self.own_noise(draw, gyro, own);
            for (axis, values) in reference.iter().enumerate() {
                let passed = signals.path.along(gyro, values, signals.rate_hz);
                add(&mut noise, &passed, -signals.shared[(gyro, axis)]);
            }
            if let Some(pickoff) = &pickoff {
                add(&mut noise, &pickoff[gyro], -1.0);
            }
            noise
        });
        let anew = |truth: &[f64], noise: Vec<f64>| -> Vec<f64> {
            truth.iter().zip(noise).map(|(a, b)| a + b).collect()
        };
        let before = |axis: usize| {
            let case_rad = &signals.independent.case_rad[axis];
            signals.path.before(axis, case_rad, signals.rate_hz)
        };
        let [x, y, z] = reference;
        let case_rad = [
            anew(&before(0), x),
            anew(&before(1), y),
            anew(&before(2), z),
        ];
        let dither_rad = pickoff
            .zip(signals.dither_rad.as_ref())
            .map(|(noise, truth)| {
                let [x, y, z] = noise;
                [anew(&truth[0], x), anew(&truth[1], y), anew(&truth[2], z)]
            });
        (case_rad, dither_rad, noise_rad)
    }

    /// Draws a gyro's own noise \[rad\]; a counter without a dither quantises it together with its motion.
    fn own_noise(&self, draw: u64, gyro: usize, mut levels: NoiseLevels) -> Vec<f64> {
        let Some(sensed_rad) = &self.data.counted_rad[gyro] else {
            return self.draw(Source::Gyro.of(draw, gyro), levels);
        };
        let pulse_rad = self.data.lattice.counted_rad[gyro];
        levels.angle = (levels.angle - pulse_rad.powi(2) / 12.0).max(0.0);
        let noise = self.draw(Source::Gyro.of(draw, gyro), levels);
        let mut random = Source::Pulses.of(draw, gyro);
        let mut pulses: f64 = random.random();
        let pairs = noise.iter().zip(sensed_rad);
        pairs
            .map(|(noise, sensed)| {
                let turned = noise + sensed;
                let before = pulses.floor();
                pulses += turned / pulse_rad;
                (pulses.floor() - before) * pulse_rad - sensed
            })
            .collect()
    }

    /// Draws noise on all rows \[rad\].
    fn draw(&self, mut random: ChaCha8Rng, levels: NoiseLevels) -> Vec<f64> {
        let mut values: Vec<f64> = self
            .basis
            .by_coefficient(levels)
            .into_iter()
            .map(|power| {
                let one: f64 = StandardNormal.sample(&mut random);
                power.max(0.0).sqrt() * one
            })
            .collect();
        self.dct.inverse(&mut values);
        values
    }
}
