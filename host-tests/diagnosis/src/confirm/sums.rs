//! Sums over blocks of all rows of a recording longer than memory, as one more record of the search over its stretches.
//!
//! Slow effects survive summation: bias, temperature, the drift that vibration rectifies. Columns are formed at the full
//! rate and summed, so that products of fast motions are in them. White noise of a row adds up, white noise of angle
//! telescopes: sums have noise of the same kinds. Blocks that hold rows of a stretch are left out: no row counts twice.

use rlg_plan::Plan;
use std::ops::Range;

use rlg_catalogue::{Candidate, Pool};
use rlg_inference::block_validation::BlockSums;
use rlg_inference::search::DriftPrior;
use rlg_inference::{
    Columns, Fit, Hypothesis, NoiseLevels, NormalEquations, Observations, TooFewRows,
};
use rlg_signal::partition::blocks;
use rlg_signal::streams::{Triad, add};

use crate::confirm::whitened::{Whitener, columns_of};
use crate::iteration::pass::sizes_on;
use crate::rows::data::Data;
use crate::rows::noise_levels::first_levels;
use crate::search::linearisation::is_seen;

/// Rows of all recordings, and sums over all rows of the one recording that they are stretches of.
#[derive(Clone, Copy)]
pub(crate) struct Recordings<'a> {
    pub(crate) each: &'a [Data<'a>],
    pub(crate) sums: Option<&'a Sums>,
}

impl<'a> Recordings<'a> {
    /// A single recording.
    pub(crate) fn of_one(data: &'a Data<'a>) -> Self {
        Self {
            each: std::slice::from_ref(data),
            sums: None,
        }
    }
}

/// Data of one recording, or of sums over all of one, in a search.
pub(crate) struct Side<'a> {
    /// Candidates over its own columns.
    pub(crate) candidates: &'a [Candidate],
    pub(crate) equations: &'a NormalEquations,
    pub(crate) drift: &'a DriftPrior,
    /// Noise levels before any effect is found.
    pub(crate) levels: &'a [NoiseLevels],
}

/// Sums over blocks of rows.
pub(crate) struct Summed {
    /// Blocks per second \[Hz\].
    pub(crate) rate_hz: f64,
    /// True for blocks with all rows measured.
    pub(crate) measured: Vec<bool>,
    /// True for blocks to fit.
    pub(crate) seen: Vec<bool>,
    /// Held-out blocks.
    pub(crate) tested: Vec<Range<usize>>,
    /// Residual \[rad per block\].
    pub(crate) residual_rad: Triad,
    /// Definitions of the columns.
    pub(crate) pool: Pool,
    /// Columns, indexed as in the pool; single precision, as everywhere in the sums over bins.
    pub(crate) columns: Vec<Vec<f32>>,
    /// Candidates over these columns.
    pub(crate) candidates: Vec<Candidate>,
}

/// Block sums with the normal equations of every column.
pub(crate) struct Sums {
    pub(crate) summed: Summed,
    equations: NormalEquations,
    drift: DriftPrior,
    /// Noise levels before any effect is found.
    levels: Vec<NoiseLevels>,
}

/// Selected columns.
struct Chosen<'a> {
    columns: &'a [Vec<f32>],
    places: Vec<usize>,
}

impl Columns for Chosen<'_> {
    fn count(&self) -> usize {
        self.places.len()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        wide(&self.columns[self.places[place]])
    }
}

fn wide(column: &[f32]) -> Vec<f64> {
    column.iter().map(|sum| f64::from(*sum)).collect()
}

impl Sums {
    /// Forms the normal equations of all columns.
    ///
    /// # Errors
    /// Too few blocks are seen.
    pub(crate) fn new(mut summed: Summed, drift: DriftPrior) -> Result<Self, TooFewRows> {
        let observations = Observations::bridged(&summed.seen)?;
        let levels = first_levels(&summed.residual_rad, &observations);
        let all = Chosen {
            columns: &summed.columns,
            places: (0..summed.columns.len()).collect(),
        };
        let equations = NormalEquations::new(
            observations,
            &summed.residual_rad,
            &all,
            NoiseLevels::mean(&levels),
        );
        summed
            .candidates
            .retain(|one| is_seen(&one.hypothesis, &equations));
        Ok(Self {
            summed,
            equations,
            drift,
            levels,
        })
    }

    /// Side of the sums in a search.
    pub(crate) fn side(&self) -> Side<'_> {
        Side {
            candidates: &self.summed.candidates,
            equations: &self.equations,
            drift: &self.drift,
            levels: &self.levels,
        }
    }

    /// Drift prior declared by the model.
    pub(crate) fn drift(&self) -> &DriftPrior {
        &self.drift
    }

    /// Frees the spectra of the columns once the set is final.
    pub(crate) fn release(&mut self) {
        self.equations.truncate(0);
    }

    /// Sums whitened residual and columns of a set over validation blocks.
    pub(crate) fn whitened(
        &self,
        set: &[Hypothesis],
        levels: &[NoiseLevels],
        plan: &Plan,
    ) -> Result<BlockSums, TooFewRows> {
        let summed = &self.summed;
        let observations = Observations::bridged(&summed.seen)?;
        let whitener = Whitener::of(observations, summed.seen.clone(), levels);
        let whitened = |gyro: usize, rows: &[f64]| whitener.rows(gyro, rows);
        let values = |column: usize| wide(&summed.columns[column]);
        let columns = columns_of(set, summed.seen.len(), &values, &whitened);
        let records: Vec<Vec<f64>> = (0..3)
            .map(|gyro| whitened(gyro, &summed.residual_rad[gyro]))
            .collect();
        let blocks = blocks(&summed.seen, summed.rate_hz, &plan.rates.blocks);
        Ok(BlockSums::new(&records, &columns, &blocks))
    }

    /// Forms the normal equations of some candidates, reindexed to their own columns.
    pub(crate) fn of(
        &self,
        candidates: &[Candidate],
        levels: &[NoiseLevels],
    ) -> Result<(NormalEquations, Vec<Candidate>), TooFewRows> {
        let all = &self.summed.pool.columns;
        let mut pool = Pool::default();
        let adopted = candidates.iter().map(|one| pool.adopt(one, all));
        let adopted: Vec<Candidate> = adopted.collect();
        let place = |column| all.iter().position(|other| other == column);
        let places = pool.columns.iter().filter_map(place).collect();
        let columns = Chosen {
            columns: &self.summed.columns,
            places,
        };
        let observations = Observations::bridged(&self.summed.seen)?;
        let residual_rad = &self.summed.residual_rad;
        let equations = NormalEquations::new(
            observations,
            residual_rad,
            &columns,
            NoiseLevels::mean(levels),
        );
        Ok((equations, adopted))
    }

    /// Residual of the blocks after a fit \[rad\].
    ///
    /// # Inputs
    /// `candidates`: indexed as in the fit, over the columns here.
    pub(crate) fn left_by(&self, fit: &Fit, candidates: &[Candidate]) -> Triad {
        let mut left_rad = self.summed.residual_rad.clone();
        for (gyro, left) in left_rad.iter_mut().enumerate() {
            for (column, size) in sizes_on(fit, candidates, gyro) {
                add(left, &wide(&self.summed.columns[column]), -size);
            }
        }
        left_rad
    }
}
