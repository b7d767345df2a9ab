//! Error angles, columns and noise on the fitted steps, kept together while the search goes on.
//!
//! Enters: a [`Record`], runs of stamps. Leaves: [`Information`] about all parameters of the catalogue, re-made when
//! the noise or the point of linearisation changes. Behind the catalogue's parameters stand columns that belong to
//! every fit: the clock and frame of a reference that lies far off, and terms found in the data.

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;
use std::ops::Range;

use super::levels::{self, DeclaredLevels};
use super::record::Record;
use super::whiten::{Levels, Whitener};
use crate::bench::Bench;
use crate::empirical::Term;
use crate::hypotheses::CATALOGUE;
use crate::information::Information;
use crate::scene::Scene;
use crate::weigh::prior_width;
use crate::workbench::Parameters;

/// A column that belongs to every fit.
#[derive(Debug, Clone, PartialEq)]
pub enum Behind {
    /// What is left of the reference's delay \[s\].
    Delay,
    /// What is left of its turn about a body axis \[rad\].
    Turn(usize),
    /// A term found in the data.
    Term(Term),
}

/// See the page above.
pub struct AttitudeBench<'a> {
    /// Channels and motion.
    pub scene: &'a Scene,
    /// Stamps and errors.
    pub record: &'a Record,
    parameters: &'a Parameters,
    /// The stamps it works on.
    pub runs: Vec<Range<usize>>,
    /// The noise.
    pub levels: Levels,
    /// Errors, moved to the point of linearisation.
    error_rad: Vec<Vector3<f64>>,
    columns: Vec<(usize, Vec<Vector3<f64>>)>,
    behind: Vec<(Behind, Vec<Vector3<f64>>)>,
    at: Vec<Vec<f64>>,
}

/// Series that a likelihood of the noise needs.
pub struct Scored {
    error: Vec<Vector3<f64>>,
    columns: Vec<Vec<Vector3<f64>>>,
    widths: Vec<f64>,
}

impl<'a> AttitudeBench<'a> {
    /// Pushes the columns of `effects` to the stamps.
    pub fn new(
        scene: &'a Scene,
        record: &'a Record,
        parameters: &'a Parameters,
        runs: Vec<Range<usize>>,
        levels: Levels,
        effects: &[usize],
    ) -> Self {
        let at: Vec<Vec<f64>> = crate::hypotheses::no_effects();
        let mut bench = Self {
            scene,
            record,
            parameters,
            runs,
            levels,
            error_rad: record.error_rad.clone(),
            columns: Vec::new(),
            behind: Vec::new(),
            at,
        };
        bench.columns = bench.make_columns(effects);
        bench
    }

    fn make_columns(&self, effects: &[usize]) -> Vec<(usize, Vec<Vector3<f64>>)> {
        let wanted: Vec<(usize, usize, usize)> = effects
            .iter()
            .flat_map(|&effect| {
                let first = self.parameters.of(effect).start;
                self.parameters
                    .of(effect)
                    .map(move |index| (effect, index - first, index))
            })
            .collect();
        wanted
            .into_par_iter()
            .map(|(effect, parameter, index)| {
                let sensed = [0, 1, 2].map(|axis: usize| {
                    CATALOGUE[effect].column(self.scene, &self.at[effect], parameter, axis)
                });
                (
                    index,
                    self.record.push(sensed.each_ref().map(Option::as_deref)),
                )
            })
            .collect()
    }

    /// Adds a column that belongs to every fit.
    pub fn stand_behind(&mut self, behind: Behind) -> Result<(), String> {
        let column = match &behind {
            Behind::Delay => self.record.rate_at_stamps(self.scene),
            Behind::Turn(axis) => self.record.turn_at_stamps(*axis),
            Behind::Term(term) => {
                let values = term.column(self.scene)?;
                let mut sensed: [Option<&[f64]>; 3] = [None; 3];
                sensed[term.axis] = Some(&values);
                self.record.push(sensed)
            }
        };
        self.behind.push((behind, column));
        Ok(())
    }

    /// Columns behind the catalogue.
    pub fn behind(&self) -> impl Iterator<Item = &Behind> {
        self.behind.iter().map(|(behind, _)| behind)
    }

    /// All columns with their indices.
    fn all_columns(&self) -> Vec<(usize, &[Vector3<f64>])> {
        let first = self.parameters.count();
        let behind = self.behind.iter().enumerate();
        self.columns
            .iter()
            .map(|(index, column)| (*index, column.as_slice()))
            .chain(behind.map(|(place, (_, column))| (first + place, column.as_slice())))
            .collect()
    }

    /// The whitener of the fitted steps.
    pub fn whitener(&self) -> Whitener {
        Whitener::new(&self.record.steps, &self.runs, &self.levels)
    }

    /// Numbers among the fitted steps.
    pub fn degrees(&self) -> usize {
        self.runs.iter().map(|run| 3 * (run.len() - 1)).sum()
    }

    /// From the first fitted stamp to the last \[s\].
    pub fn seconds(&self) -> f64 {
        let (Some(first), Some(last)) = (self.runs.first(), self.runs.last()) else {
            return 0.0;
        };
        self.record.times_s[last.end - 1] - self.record.times_s[first.start]
    }

    /// White noise of a stamp from the errors' own second differences: (1, −2, 1) of white noise has variance 6.
    pub fn rough_white_rad2(&self) -> f64 {
        let mut squares: Vec<f64> = self
            .runs
            .iter()
            .flat_map(|run| self.error_rad[run.clone()].windows(3))
            .flat_map(|three| {
                let second = three[0] - three[1] * 2.0 + three[2];
                [second.x, second.y, second.z].map(|value| value * value)
            })
            .collect();
        squares.sort_by(f64::total_cmp);
        /// Median of the square of a normal variable.
        const MEDIAN_SQUARE: f64 = 0.455;
        squares
            .get(squares.len() / 2)
            .map_or(1e-12, |median| (median / (6.0 * MEDIAN_SQUARE)).max(1e-18))
    }

    /// What the likelihood of noise levels is judged with. Where the columns take a share of the freedom that
    /// matters they are refitted for every level; where there is plenty they are fitted once, at `levels`.
    pub fn scorer(&self, effects: &[usize], levels: &Levels) -> Scored {
        /// Free numbers a column; beyond it a level comes out low by less than half a per cent.
        const PLENTY: usize = 100;
        let indices: Vec<usize> = self
            .parameters
            .of_all(effects)
            .into_iter()
            .chain(self.parameters.count()..self.parameters.count() + self.behind.len())
            .collect();
        let columns: Vec<(usize, &[Vector3<f64>])> = self
            .all_columns()
            .into_iter()
            .filter(|(index, _)| indices.contains(index))
            .collect();
        let information = self.information_at(levels);
        let width = |index: usize| prior_width(self.parameters, &information, index);
        if self.degrees() < PLENTY * columns.len() {
            return Scored {
                error: self.error_rad.clone(),
                widths: columns.iter().map(|(index, _)| width(*index)).collect(),
                columns: columns.iter().map(|(_, column)| column.to_vec()).collect(),
            };
        }
        let set: Vec<usize> = columns.iter().map(|(index, _)| *index).collect();
        let solution = information.solve(&set, &width);
        let mut error = self.error_rad.clone();
        for ((_, column), size) in columns.iter().zip(solution.values.iter()) {
            for (left, part) in error.iter_mut().zip(*column) {
                *left -= part * *size;
            }
        }
        Scored {
            error,
            columns: Vec::new(),
            widths: Vec::new(),
        }
    }

    /// Restricted ln likelihood of noise levels.
    pub fn score(&self, levels: &Levels, scored: &Scored) -> f64 {
        let whitener = Whitener::new(&self.record.steps, &self.runs, levels);
        let error = DVector::from_vec(whitener.whiten(&scored.error));
        let mut value = -0.5 * whitener.log_det - 0.5 * error.norm_squared();
        if !scored.columns.is_empty() {
            let columns: Vec<Vec<f64>> = scored
                .columns
                .par_iter()
                .map(|column| whitener.whiten(column))
                .collect();
            let flat: Vec<f64> = columns.into_iter().flatten().collect();
            let matrix = DMatrix::from_vec(error.len(), scored.widths.len(), flat);
            let information = Information {
                fisher: matrix.tr_mul(&matrix),
                right: matrix.tr_mul(&error),
                power: 0.0,
                parameters: scored.widths.len(),
                offsets: Vec::new(),
                of_mounting: 0,
                drifts: Vec::new(),
            };
            let set: Vec<usize> = (0..scored.widths.len()).collect();
            value += information
                .solve(&set, &|index| scored.widths[index])
                .log_evidence;
        }
        value
    }

    fn information_at(&self, levels: &Levels) -> Information {
        let whitener = Whitener::new(&self.record.steps, &self.runs, levels);
        let columns = self.all_columns();
        let error = DVector::from_vec(whitener.whiten(&self.error_rad));
        let whitened: Vec<Vec<f64>> = columns
            .par_iter()
            .map(|(_, column)| whitener.whiten(column))
            .collect();
        let matrix = DMatrix::from_vec(
            error.len(),
            columns.len(),
            whitened.into_iter().flatten().collect(),
        );
        let gram = matrix.tr_mul(&matrix);
        let right = matrix.tr_mul(&error);
        let mut information = Information::empty(self.parameters.count() + self.behind.len());
        information.power = error.norm_squared();
        for (a, (to_a, _)) in columns.iter().enumerate() {
            information.right[*to_a] = right[a];
            for (b, (to_b, _)) in columns.iter().enumerate() {
                information.fisher[(*to_a, *to_b)] = gram[(a, b)];
            }
        }
        information
    }

    /// The error angles less what the values explain.
    pub fn left_over(&self, values: &[(usize, f64)]) -> Vec<Vector3<f64>> {
        let mut left = self.error_rad.clone();
        for (index, column) in self.all_columns() {
            if let Some((_, value)) = values.iter().find(|(known, _)| *known == index) {
                for (left, part) in left.iter_mut().zip(column) {
                    *left -= part * *value;
                }
            }
        }
        left
    }

    /// ln likelihood of what the values leave.
    pub fn ln_likelihood(&self, values: &[(usize, f64)]) -> f64 {
        let whitener = self.whitener();
        let left = whitener.whiten(&self.left_over(values));
        -0.5 * (whitener.log_det + left.iter().map(|value| value * value).sum::<f64>())
    }

    /// What one effect's values make of the error angles, linearised where the bench stands.
    pub fn prediction(&self, effect: usize, values: &[f64]) -> Vec<Vector3<f64>> {
        let mut sum = vec![Vector3::zeros(); self.record.stamps()];
        let range = self.parameters.of(effect);
        for (index, column) in &self.columns {
            if range.contains(index) {
                let value = values[index - range.start];
                for (sum, part) in sum.iter_mut().zip(column) {
                    *sum += part * value;
                }
            }
        }
        sum
    }

    /// The columns of some parameters, whitened, with the columns behind.
    pub fn whitened_columns(
        &self,
        whitener: &Whitener,
        indices: &[usize],
    ) -> Vec<(usize, Vec<f64>)> {
        self.all_columns()
            .into_iter()
            .filter(|(index, _)| indices.contains(index))
            .map(|(index, column)| (index, whitener.whiten(column)))
            .collect()
    }

    /// The errors at the point of linearisation.
    pub fn error_rad(&self) -> &[Vector3<f64>] {
        &self.error_rad
    }

    /// e − f(p0) + J(p0) p0 for effects that are not linear.
    fn remake_error(&mut self) {
        let mut error = self.record.error_rad.clone();
        for (effect, entry) in CATALOGUE.iter().enumerate() {
            let at = &self.at[effect];
            if entry.is_linear() || at.iter().all(|value| *value == 0.0) {
                continue;
            }
            let sensed = entry.prediction(self.scene, at);
            let pushed = self
                .record
                .push(sensed.each_ref().map(|values| Some(values.as_slice())));
            let linear = self.prediction(effect, at);
            for (error, (exact, linear)) in error.iter_mut().zip(pushed.iter().zip(&linear)) {
                *error += linear - exact;
            }
        }
        self.error_rad = error;
    }
}

impl Bench for AttitudeBench<'_> {
    type Declared = DeclaredLevels;

    fn information(&self) -> Information {
        self.information_at(&self.levels)
    }

    fn at(&self) -> &[Vec<f64>] {
        &self.at
    }

    fn relinearise(&mut self, effect: usize, at: &[f64]) {
        self.at[effect] = at.to_vec();
        let range = self.parameters.of(effect);
        self.columns.retain(|(index, _)| !range.contains(index));
        let fresh = self.make_columns(&[effect]);
        self.columns.extend(fresh);
        self.columns.sort_by_key(|(index, _)| *index);
        self.remake_error();
    }

    fn refit_noise(&mut self, effects: &[usize], declared: &DeclaredLevels) {
        self.levels = levels::fit(self, effects, declared);
    }
}
