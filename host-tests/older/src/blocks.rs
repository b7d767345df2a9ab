//! Sums over blocks of rows beside a bench: the slow half of a recording longer than memory.
//!
//! Enters: residual and catalogue columns of the whole recording, formed at the full rate and summed over blocks
//! (long.rs). Leaves: what their lowest frequencies say of the parameters, of the noise and of the regimes.
//!
//! A sum over a block keeps all that changes slowly: a bias, temperature, the drift that vibration rectifies. White
//! noise of angle telescopes in it, a walk's adds up ([`Noise::of_blocks`]), so rows and blocks share one S. The rows on
//! the bench count above [`LONG_SPLIT_HZ`](super::declare::LONG_SPLIT_HZ), the blocks below: no frequency is counted
//! twice, and the information of both adds up.
//!
//! Deliberately not here: events and unlisted products. A step or a slip found in the rows has a column here, an
//! expression has none but for `time`; nonlinear effects stay linearised at nothing, which a delay of a few rows is
//! at these frequencies.

use std::ops::Range;

use super::empirical::{Form, Term};
use super::figures::channel;
use super::information::{Information, fit_away};
use super::invariance::{self, Amplitude};
use super::noise::{Noise, Series};
use super::portion::{Bins, Portion};
use super::regressor::{Regressor, regressors};
use super::result::WholeEntry;
use super::split::{Regime, intersect};
use super::streams::{Streams, Triad};
use super::validate::{Validation, validate};

/// One column of the catalogue in blocks; single precision, as in regressor.rs.
pub struct Column {
    /// Parameter of the catalogue.
    pub index: usize,
    /// Gyro.
    pub axis: usize,
    /// d(sum of the sensed increments)/d(parameter), one a block.
    pub sums: Vec<f32>,
}

/// Sums over blocks of rows of a whole recording, and how it is cut.
pub struct Sums {
    /// Blocks per second \[Hz\].
    pub rate_hz: f64,
    /// Rows in a block.
    pub block_rows: usize,
    /// Beginning of the first block \[s\].
    pub start_s: f64,
    /// Residual \[rad per block\].
    pub residual_rad: Triad,
    /// Columns of the catalogue.
    pub columns: Vec<Column>,
    /// Stretches of like motion, of blocks.
    pub regimes: Vec<Regime>,
    /// Fitted blocks.
    pub fitted: Vec<Range<usize>>,
    /// Held-out blocks.
    pub held_out: Vec<Range<usize>>,
    /// Where the rows at the full rate are \[s\].
    pub stretches_s: Vec<[f64; 2]>,
    /// Seconds whose rows could not be used.
    pub unusable_s: f64,
}

/// The sums, and the fitted ones in bins.
pub struct Blocks {
    /// The sums.
    pub sums: Sums,
    fitted: Fitted,
}

/// The fitted blocks in bins.
struct Fitted {
    portion: Portion,
    residual: [Bins; 3],
    joints: Vec<Regressor>,
    /// In the order of `columns`.
    columns: Vec<Regressor>,
}

impl Blocks {
    /// Transforms the fitted blocks, of which the bins in `band_hz` count. `None` where there are too few.
    pub fn new(sums: Sums, band_hz: [f64; 2]) -> Option<Self> {
        let portion = Portion::new(sums.fitted.clone(), sums.rate_hz)?.within(band_hz);
        let column = |column: &Column| {
            let wide: Vec<f64> = column.sums.iter().map(|sum| f64::from(*sum)).collect();
            Regressor::new(&portion.transform(&wide))
        };
        let fitted = Fitted {
            residual: [0, 1, 2].map(|axis: usize| portion.transform(&sums.residual_rad[axis])),
            joints: regressors(&portion.joints()),
            columns: sums.columns.iter().map(column).collect(),
            portion,
        };
        Some(Self { sums, fitted })
    }

    /// Before and after on the held-out blocks; `values` are (parameter index, value).
    pub fn validate(&self, values: &[(usize, f64)], noise: &[Noise; 3]) -> Vec<Validation> {
        let mut after_rad = self.sums.residual_rad.clone();
        self.subtract(&mut after_rad, values);
        let noise = noise.map(|noise| noise.of_blocks(self.sums.block_rows));
        let band_hz = self.fitted.portion.band_hz;
        validate(
            &self.sums.residual_rad,
            &after_rad,
            &noise,
            (&self.sums.held_out, band_hz),
            &[],
            self.sums.rate_hz,
        )
    }

    /// How the recording was looked at, with its held-out figures.
    pub fn entry(&self, figures: &[Validation]) -> WholeEntry {
        let seconds = |blocks: &[Range<usize>]| {
            blocks.iter().map(|run| run.len() as f64).sum::<f64>() / self.sums.rate_hz
        };
        WholeEntry {
            blocks_per_s: self.sums.rate_hz,
            stretches_s: self.sums.stretches_s.clone(),
            split_hz: self.fitted.portion.band_hz[1],
            fitted_blocks_s: seconds(&self.fitted.portion.ranges),
            held_out_blocks_s: seconds(&self.sums.held_out),
            unusable_s: self.sums.unusable_s,
            channels: figures.iter().map(channel).collect(),
        }
    }

    /// Takes parameters at some values out of a residual.
    fn subtract(&self, left: &mut Triad, values: &[(usize, f64)]) {
        for column in &self.sums.columns {
            if let Some((_, value)) = values.iter().find(|(index, _)| *index == column.index) {
                for (left, sum) in left[column.axis].iter_mut().zip(&column.sums) {
                    *left -= value * f64::from(*sum);
                }
            }
        }
    }

    /// A found term in blocks; `None` for expressions, which are known from the rows alone.
    fn column(&self, term: &Term, streams: &Streams) -> Option<Vec<f64>> {
        let blocks = self.sums.residual_rad[0].len();
        let period_s = 1.0 / self.sums.rate_hz;
        let block_at =
            |time_s: f64| (streams.own_time(time_s).1 - self.sums.start_s) * self.sums.rate_hz;
        let of = |value: &dyn Fn(f64) -> f64| Some((0..blocks).map(|k| value(k as f64)).collect());
        match &term.form {
            // The share of the block that lies behind the step.
            Form::Step { time_s } => {
                let step = block_at(*time_s);
                of(&|block| (block + 1.0 - step).clamp(0.0, 1.0) * period_s)
            }
            Form::Slip { time_s } => {
                let slip = block_at(*time_s).floor();
                of(&|block| f64::from(u8::from(block == slip)))
            }
            Form::Product { expression } if expression == "time" => {
                of(&|block| (block + 0.5) * period_s * period_s)
            }
            _ => None,
        }
    }
}

/// A found term's column.
struct TermColumn {
    axis: usize,
    rows: Vec<f64>,
    bins: Regressor,
}

/// Blocks that stand beside a bench, with columns of the bench's terms.
pub struct Beside<'a> {
    /// The blocks.
    pub blocks: &'a Blocks,
    /// One for each term of the bench, in its order.
    terms: Vec<Option<TermColumn>>,
    /// Number of parameters of the catalogue, behind which the terms' sizes stand.
    parameters: usize,
}

impl<'a> Beside<'a> {
    /// Beside a bench without terms.
    pub fn new(blocks: &'a Blocks, parameters: usize) -> Self {
        Self {
            blocks,
            terms: Vec::new(),
            parameters,
        }
    }

    /// Keeps up with a term that the bench adds last.
    pub fn add_term(&mut self, term: &Term, streams: &Streams) {
        let column = self.blocks.column(term, streams).map(|rows| TermColumn {
            axis: term.axis,
            bins: Regressor::new(&self.blocks.fitted.portion.transform(&rows)),
            rows,
        });
        self.terms.push(column);
    }

    /// Keeps up with a term that the bench takes out.
    pub fn remove_term(&mut self, place: usize) {
        self.terms.remove(place);
    }

    /// Seconds of the fitted blocks.
    pub fn seconds(&self) -> f64 {
        self.blocks.fitted.portion.seconds()
    }

    /// The columns of one gyro that `wanted` names by parameter index, terms included.
    fn columns(
        &self,
        axis: usize,
        wanted: &(dyn Fn(usize) -> bool + Sync),
    ) -> Vec<(usize, &Regressor)> {
        let columns = self.blocks.sums.columns.iter();
        let of_catalogue = columns
            .zip(&self.blocks.fitted.columns)
            .filter(|(column, _)| column.axis == axis)
            .map(|(column, bins)| (column.index, bins));
        let terms = self.terms.iter().enumerate().filter_map(|(place, term)| {
            let term = term.as_ref().filter(|term| term.axis == axis)?;
            Some((self.parameters + place, &term.bins))
        });
        of_catalogue
            .chain(terms)
            .filter(|(index, _)| wanted(*index))
            .collect()
    }

    /// One gyro's series for the noise fit, with the columns that `wanted` names.
    pub fn series(&self, axis: usize, wanted: &(dyn Fn(usize) -> bool + Sync)) -> Series<'_> {
        let fitted = &self.blocks.fitted;
        let columns = self.columns(axis, wanted).into_iter().map(|(_, bins)| bins);
        Series {
            portion: &fitted.portion,
            residual: &fitted.residual[axis],
            columns: fitted.joints.iter().chain(columns).collect(),
            block_rows: self.blocks.sums.block_rows,
        }
    }

    /// Adds what one gyro's blocks say, under the noise of its rows.
    pub fn add_axis(
        &self,
        axis: usize,
        noise: &Noise,
        wanted: &(dyn Fn(usize) -> bool + Sync),
        total: &mut Information,
    ) {
        let fitted = &self.blocks.fitted;
        let weights = self.weights(noise);
        total.add_axis(
            &fitted.joints,
            &[],
            &fitted.residual[axis],
            &self.columns(axis, wanted),
            &weights,
        );
    }

    fn weights(&self, noise: &Noise) -> Vec<f64> {
        let noise = noise.of_blocks(self.blocks.sums.block_rows);
        noise.weights(&self.blocks.fitted.portion)
    }

    /// Whittle log-likelihood of what the values leave in the blocks.
    pub fn whittle(&self, noise: &[Noise; 3], values: &[(usize, f64)]) -> f64 {
        let fitted = &self.blocks.fitted;
        (0..3)
            .map(|axis| {
                let weights = self.weights(&noise[axis]);
                let mut left = fitted.residual[axis].clone();
                for (index, bins) in self.columns(axis, &|_| true) {
                    if let Some((_, value)) = values.iter().find(|(known, _)| *known == index) {
                        bins.add_to(&mut left, -value);
                    }
                }
                fit_away(&mut left, &fitted.joints, &weights);
                fitted.portion.log_likelihood(&left, &weights)
            })
            .sum()
    }

    /// How large an effect's parameters `of` are in each regime and in all blocks together, as fitted = 1.
    pub fn amplitudes(
        &self,
        noise: &[Noise; 3],
        values: &[(usize, f64)],
        of: &Range<usize>,
    ) -> (Vec<(f64, Amplitude)>, Option<Amplitude>) {
        let blocks = self.blocks;
        let mut left = blocks.sums.residual_rad.clone();
        blocks.subtract(&mut left, values);
        for (place, term) in self.terms.iter().enumerate() {
            let index = self.parameters + place;
            let value = values.iter().find(|(known, _)| *known == index);
            if let (Some(term), Some((_, value))) = (term, value) {
                for (left, row) in left[term.axis].iter_mut().zip(&term.rows) {
                    *left -= value * row;
                }
            }
        }
        let own: Vec<(usize, f64)> = values
            .iter()
            .filter(|(index, _)| of.contains(index))
            .map(|(index, value)| (*index, -value))
            .collect();
        let mut prediction: Triad = [0, 1, 2].map(|_| vec![0.0; left[0].len()]);
        blocks.subtract(&mut prediction, &own);
        let noise = noise.map(|noise| noise.of_blocks(blocks.sums.block_rows));
        let fitted = &blocks.fitted.portion;
        let amplitude = |rows: Vec<Range<usize>>, name: &str| {
            let portion = Portion::new(rows, blocks.sums.rate_hz)?.within(fitted.band_hz);
            let found = invariance::amplitude(&noise, &portion, &prediction, &left, name)?;
            Some((found.std.powi(-2) / portion.seconds(), found))
        };
        let of_regime = |regime: &Regime| {
            let rows = intersect(std::slice::from_ref(&regime.rows), &fitted.ranges);
            amplitude(rows, &format!("{}, slowly", regime.name))
        };
        let everywhere = amplitude(fitted.ranges.clone(), "all of it, slowly");
        (
            blocks.sums.regimes.iter().filter_map(of_regime).collect(),
            everywhere.map(|(_, amplitude)| amplitude),
        )
    }
}
