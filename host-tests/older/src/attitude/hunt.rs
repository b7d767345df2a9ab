//! The search on attitudes: listed physics, then jumps and unlisted physics, each held against the other.
//!
//! Enters: an [`AttitudeBench`] on the fitted steps. Leaves: [`Catch`], as the search on rows does. Every expression,
//! and every instant at which a bias or an angle could have jumped, is tried one at a time through the same columns,
//! and counted.

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use super::bench::{AttitudeBench, Behind};
use super::cut::Cut;
use super::judge::{amplitudes, unit_rates};
use super::levels::{self, DeclaredLevels};
use super::record::Record;
use super::whiten::Levels;
use crate::bench::Bench;
use crate::declare::{FAMILY_SIGNIFICANCE, REGRESSOR_FIDELITY};
use crate::empirical::{Form, Term};
use crate::hunt::{Alike, CLEARLY_BETTER, Catch, FoundTerm, MOST_TERMS, PLAINER, VETO};
use crate::names::differs;
use crate::products::{KnownAxis, Measured, Products, Survey};
use crate::readings::{PICKED, PRICE};
use crate::scene::Scene;
use crate::select::{self, Choice};
use crate::weigh::prior_width;
use crate::workbench::Parameters;

/// ln of the odds by which physics must beat drifting noise; effects are not weighed against drift one by one here.
const CLEAR_WIN: f64 = 10.0;

/// The same against gyros that walk more than declared: twenty to one.
const CLEAR_OF_WALKS: f64 = 3.0;

/// Instants tried for jumps in a first pass; a second one goes between them.
const INSTANTS: usize = 300;

/// What a search needs besides the bench.
pub struct Hunt<'a> {
    /// Numbering of the catalogue's parameters.
    pub parameters: &'a Parameters,
    /// Effects to try.
    pub candidates: &'a [usize],
    /// Declared noise.
    pub declared: &'a DeclaredLevels,
    /// How the steps are cut.
    pub cut: &'a Cut,
    /// Unlisted expressions.
    pub products: &'a Products<'a>,
}

/// Lays out the fitted steps with noise of these levels, and what belongs to every fit.
type Open<'o, 'a> = dyn Fn(Levels) -> Result<AttitudeBench<'a>, String> + 'o;

impl Hunt<'_> {
    /// Fits the noise under a generous library, then searches. `behind`: what belongs to every fit.
    pub fn run<'a>(
        &'a self,
        scene: &'a Scene,
        record: &'a Record,
        behind: &[Behind],
        progress: &dyn Fn(&str),
    ) -> Result<(AttitudeBench<'a>, Catch), String> {
        let open = |levels: Levels| {
            let (parameters, candidates) = (self.parameters, self.candidates);
            let runs = self.cut.fitted.clone();
            let mut bench = AttitudeBench::new(scene, record, parameters, runs, levels, candidates);
            for behind in behind {
                bench.stand_behind(behind.clone())?;
            }
            Ok(bench)
        };
        let (bench, as_noise) = self.as_noise(&open, progress)?;
        if bench.levels.drifting() == 0 || self.declared.walk_rad2_s.contains(&None) {
            return self.or_walks((bench, as_noise), &open, progress);
        }
        // Drift and a step, a line or a decay imitate each other: the same search with the declared noise, and physics
        // must win clearly (readings.rs).
        let declared = Levels {
            drift_rad2_s3: [0.0; 3],
            drift_relaxes_s: f64::INFINITY,
            ..levels::first(self.declared, &bench)
        };
        let mut steady = open(declared)?;
        let as_physics = hunt(&mut steady, self, false, progress)?;
        if price(&steady, &as_physics) > price(&bench, &as_noise) + CLEAR_WIN {
            return Ok((steady, as_physics));
        }
        Ok((bench, as_noise))
    }

    /// The search with the noise that the data ask for.
    fn as_noise<'a>(
        &self,
        open: &Open<'_, 'a>,
        progress: &dyn Fn(&str),
    ) -> Result<(AttitudeBench<'a>, Catch), String> {
        let mut bench = open(self.declared.plain())?;
        progress("fitting the noise");
        bench.levels = levels::first(self.declared, &bench);
        bench.levels = levels::fit(&bench, self.candidates, self.declared);
        let catch = hunt(&mut bench, self, true, progress)?;
        Ok((bench, catch))
    }

    /// What was found, or gyros that walk more than the model declares: a walk that is held too low becomes whichever
    /// slow effect resembles it, which has to be clearly better than that.
    fn or_walks<'a>(
        &self,
        found: (AttitudeBench<'a>, Catch),
        open: &Open<'_, 'a>,
        progress: &dyn Fn(&str),
    ) -> Result<(AttitudeBench<'a>, Catch), String> {
        let (bench, as_physics) = &found;
        let is_open = self.declared.walk_rad2_s.contains(&None);
        if as_physics.choice.chosen.is_empty() || is_open || bench.degrees() < levels::ENOUGH {
            return Ok(found);
        }
        let mut walking = open(bench.levels)?;
        progress("weighing gyros that walk more");
        let free = DeclaredLevels {
            walk_rad2_s: [None; 3],
            ..*self.declared
        };
        walking.levels = levels::fit(&walking, &[], &free);
        let (values, _) = fit(&walking, self.parameters, &[]);
        let nothing_found = walking.ln_likelihood(&values) - PRICE * (values.len() + 3) as f64;
        if price(bench, as_physics) > nothing_found + CLEAR_OF_WALKS {
            return Ok(found);
        }
        let as_walk = hunt(&mut walking, self, false, progress)?;
        Ok((walking, as_walk))
    }
}

/// ln of the likelihood of what was found, less what its numbers cost.
fn price(bench: &AttitudeBench, catch: &Catch) -> f64 {
    let drifts = bench.levels.drift_numbers();
    bench.ln_likelihood(&catch.values)
        - PRICE * (catch.values.len() + drifts) as f64
        - PICKED * catch.terms.len() as f64
}

/// Columns of every expression on every gyro, at the stamps.
struct Pushed(Vec<[Vec<Vector3<f64>>; 3]>);

/// A term, its likelihood ratio, its chance.
struct Found {
    term: Term,
    ratio: f64,
    p_value: f64,
}

/// Searches until nothing changes; the noise is refitted to what is left, or stays as it is.
pub fn hunt(
    bench: &mut AttitudeBench,
    search: &Hunt,
    refit_noise: bool,
    progress: &dyn Fn(&str),
) -> Result<Catch, String> {
    let declared = refit_noise.then_some(search.declared);
    let parameters = search.parameters;
    progress("forming expressions");
    let pushed = Pushed::new(bench, search.products);
    let mut allowed: Vec<usize> = search.candidates.to_vec();
    let mut vetoed = Vec::new();
    let mut entered: Vec<(f64, f64)> = Vec::new();
    let mut trials = 0;
    // The clock and frame of a reference that lies far off came with the bench.
    let given = bench.behind().count();
    loop {
        progress("weighing the listed effects");
        let choice = select::select(bench, parameters, &allowed, declared);
        let set = choice.effects();
        let (values, covariance) = fit(bench, parameters, &set);
        progress("searching for unlisted physics");
        let indices: Vec<usize> = values.iter().map(|(index, _)| *index).collect();
        let sight = Sight::new(bench, search.products, &pushed, &indices);
        trials += choice.trials + sight.trials();
        let left = bench.left_over(&values);
        let regimes: Vec<_> = choice
            .chosen
            .iter()
            .map(|one| {
                let prediction = bench.prediction(one.effect, one.values.as_slice());
                amplitudes(bench.record, search.cut, &bench.levels, &prediction, &left)
            })
            .collect();
        let known: Vec<Term> = bench
            .behind()
            .filter_map(|behind| match behind {
                Behind::Term(term) => Some(term.clone()),
                Behind::Delay | Behind::Turn(_) => None,
            })
            .collect();
        let fresh = |found: &Found| !known.contains(&found.term);
        let room = known.len() < MOST_TERMS;
        if let Some(found) = sight
            .objection(bench, parameters, &choice)
            .filter(|found| room && fresh(found))
        {
            bench.stand_behind(Behind::Term(found.term))?;
            entered.push((found.ratio, found.p_value));
            continue;
        }
        let veto = choice
            .chosen
            .iter()
            .zip(&regimes)
            .find(|(_, verdict)| verdict.p_value < VETO);
        if let Some((one, verdict)) = veto {
            allowed.retain(|&kept| kept != one.effect);
            vetoed.push((one.effect, differs(verdict.p_value)));
            continue;
        }
        let explained = explained(bench, parameters, &set);
        let allowance = REGRESSOR_FIDELITY.powi(2) * explained;
        let best = sight
            .best(&[])
            .filter(|found| found.p_value < FAMILY_SIGNIFICANCE && found.ratio > 1.0 + allowance);
        if let Some(found) = best.filter(|found| room && fresh(found)) {
            bench.stand_behind(Behind::Term(found.term))?;
            entered.push((found.ratio, found.p_value));
            continue;
        }
        let survey = sight.into_survey();
        let first = parameters.count() + given;
        let terms = known
            .into_iter()
            .zip(&entered)
            .enumerate()
            .map(|(place, (term, (ratio, p_value)))| {
                let at = indices
                    .iter()
                    .position(|&index| index == first + place)
                    .expect("always fitted");
                FoundTerm {
                    term,
                    size: values[at].1,
                    std: covariance[(at, at)].sqrt(),
                    with_next: 0.0,
                    alike: Alike::default(),
                    ratio: *ratio,
                    p_value: *p_value,
                }
            })
            .collect();
        return Ok(Catch {
            choice,
            regimes,
            terms,
            vetoed,
            uneven: Vec::new(),
            values,
            survey,
            trials,
            is_drift: false,
            information: bench.information(),
        });
    }
}

/// The joint fit of a set and everything behind it: (index, value), covariance in that order.
pub fn fit(
    bench: &AttitudeBench,
    parameters: &Parameters,
    set: &[usize],
) -> (Vec<(usize, f64)>, DMatrix<f64>) {
    let information = bench.information();
    let mut indices = parameters.of_all(set);
    indices.extend(parameters.count()..information.right.len());
    let solution = information.solve(&indices, &|index| {
        prior_width(parameters, &information, index)
    });
    let values = indices
        .into_iter()
        .zip(solution.values.iter().copied())
        .collect();
    (values, solution.covariance)
}

/// 2 Δ ln L of a set over nothing.
fn explained(bench: &AttitudeBench, parameters: &Parameters, set: &[usize]) -> f64 {
    let information = bench.information();
    let mut indices = parameters.of_all(set);
    indices.extend(parameters.count()..information.right.len());
    let width = |index: usize| prior_width(parameters, &information, index);
    2.0 * information.solve(&indices, &width).log_likelihood_gain
}

impl Pushed {
    fn new(bench: &AttitudeBench, products: &Products) -> Self {
        let columns = (0..products.names.len())
            .into_par_iter()
            .map(|product| {
                let mut values = Vec::new();
                products.evaluate(product, &mut values);
                [0, 1, 2].map(|axis: usize| {
                    let mut sensed: [Option<&[f64]>; 3] = [None; 3];
                    sensed[axis] = Some(&values);
                    bench.record.push(sensed)
                })
            })
            .collect();
        Self(columns)
    }
}

/// Everything outside the catalogue, measured against the residual and what is fitted.
struct Sight<'a> {
    products: &'a Products<'a>,
    survey: Survey,
    jumps: Survey,
    instants: Vec<Jump>,
}

#[derive(Clone, Copy)]
struct Jump {
    stamp: usize,
    slips: bool,
    time_s: f64,
}

impl<'a> Sight<'a> {
    fn new(
        bench: &AttitudeBench,
        products: &'a Products<'a>,
        pushed: &Pushed,
        indices: &[usize],
    ) -> Self {
        let whitener = bench.whitener();
        let error = DVector::from_vec(whitener.whiten(bench.error_rad()));
        let known: Vec<(usize, DVector<f64>)> = bench
            .whitened_columns(&whitener, indices)
            .into_iter()
            .map(|(index, column)| (index, DVector::from_vec(column)))
            .collect();
        let axis = || KnownAxis {
            indices: known.iter().map(|(index, _)| Some(*index)).collect(),
            gram: DMatrix::from_fn(known.len(), known.len(), |a, b| known[a].1.dot(&known[b].1)),
            residual: DVector::from_fn(known.len(), |a, _| known[a].1.dot(&error)),
        };
        let measure = |column: &[Vector3<f64>]| -> Option<Measured> {
            let column = DVector::from_vec(whitener.whiten(column));
            let own = column.norm_squared();
            (own > 0.0 && own.is_finite()).then(|| Measured {
                own,
                residual: column.dot(&error),
                known: known.iter().map(|(_, other)| column.dot(other)).collect(),
            })
        };
        let survey = Survey::of(
            pushed
                .0
                .par_iter()
                .map(|axes| axes.each_ref().map(|column| measure(column)))
                .collect(),
            [axis(), axis(), axis()],
            3.0 * pushed.0.len() as f64,
        );
        let stamps = whitener.stamps();
        let every = stamps.len().div_ceil(INSTANTS).max(1);
        let rates = unit_rates(bench.record);
        let jumps_at = |stamps: &[usize]| -> Vec<Jump> {
            stamps
                .iter()
                .flat_map(|&stamp| {
                    let times_s = &bench.record.times_s;
                    let between_s = 0.5 * (times_s[stamp - 1] + times_s[stamp]);
                    [(false, times_s[stamp - 1]), (true, between_s)].map(|(slips, time_s)| Jump {
                        stamp,
                        slips,
                        time_s,
                    })
                })
                .collect()
        };
        let look = |instants: &[Jump]| -> Survey {
            let measured = instants
                .par_iter()
                .map(|jump| [0, 1, 2].map(|axis: usize| measure(&jump.column(bench, &rates, axis))))
                .collect();
            Survey::of(
                measured,
                [axis(), axis(), axis()],
                // Every stamp counts, whether the first pass stopped there or not.
                6.0 * stamps.len() as f64,
            )
        };
        let coarse: Vec<usize> = stamps.iter().copied().step_by(every).collect();
        let mut instants = jumps_at(&coarse);
        let mut jumps = look(&instants);
        if every > 1 {
            let near: Vec<usize> = (0..3)
                .filter_map(|axis| jumps.best(axis, &[]))
                .flat_map(|best| {
                    let at = instants[best.product].stamp;
                    stamps
                        .iter()
                        .copied()
                        .filter(move |stamp| stamp.abs_diff(at) <= every)
                })
                .collect();
            instants = jumps_at(&near);
            jumps = look(&instants);
        }
        Self {
            products,
            survey,
            jumps,
            instants,
        }
    }

    fn trials(&self) -> usize {
        3 * self.products.names.len() + 3 * self.instants.len()
    }

    fn into_survey(self) -> Survey {
        self.survey
    }

    /// The most telling jump or expression when the parameters in `without` are not fitted.
    fn best(&self, without: &[usize]) -> Option<Found> {
        let expressions = (0..3).filter_map(|axis| {
            let best = self.survey.best(axis, without)?;
            let expression = self.products.names[best.product].clone();
            Some(Found {
                term: Term {
                    axis,
                    form: Form::Product { expression },
                },
                ratio: best.ratio,
                p_value: best.p_value,
            })
        });
        let jumps = (0..3).filter_map(|axis| {
            let best = self.jumps.best(axis, without)?;
            let jump = self.instants[best.product];
            let time_s = jump.time_s;
            let form = if jump.slips {
                Form::Slip { time_s }
            } else {
                Form::Step { time_s }
            };
            Some(Found {
                term: Term { axis, form },
                ratio: best.ratio + PLAINER,
                p_value: best.p_value,
            })
        });
        expressions
            .chain(jumps)
            .filter(|found| found.p_value < FAMILY_SIGNIFICANCE)
            .max_by(|a, b| a.ratio.total_cmp(&b.ratio))
    }

    /// A term outside the catalogue that explains a chosen effect's share better by itself.
    fn objection(
        &self,
        bench: &AttitudeBench,
        parameters: &Parameters,
        choice: &Choice,
    ) -> Option<Found> {
        let set = choice.effects();
        let full = explained(bench, parameters, &set);
        choice.chosen.iter().find_map(|one| {
            let rest: Vec<usize> = set
                .iter()
                .copied()
                .filter(|&kept| kept != one.effect)
                .collect();
            let share = full - explained(bench, parameters, &rest);
            let own: Vec<usize> = parameters.of(one.effect).collect();
            self.best(&own)
                .filter(|found| found.ratio > share + CLEARLY_BETTER)
        })
    }
}

impl Jump {
    fn column(
        &self,
        bench: &AttitudeBench,
        rates: &[Vec<Vector3<f64>>; 3],
        axis: usize,
    ) -> Vec<Vector3<f64>> {
        let before = self.stamp - 1;
        let size = if self.slips {
            bench.record.steps[self.stamp]
                .start_from_body
                .column(axis)
                .into_owned()
        } else {
            Vector3::zeros()
        };
        (0..bench.record.stamps())
            .map(|stamp| match (self.slips, stamp < self.stamp) {
                (_, true) => Vector3::zeros(),
                (true, false) => size,
                (false, false) => rates[axis][stamp] - rates[axis][before],
            })
            .collect()
    }
}
