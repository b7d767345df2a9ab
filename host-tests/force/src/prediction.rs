//! Predicted specific force: gravity in body axes, and the regressors of the design columns.

use std::ops::Range;

use rlg_inference::Columns;
use rlg_signal::accelerometer_rows::Rows;
use rlg_signal::axes::{Triad, each_axis};
use rlg_signal::derivatives::Spectrum;

use crate::carried::Carried;
use crate::readings::Readings;
use crate::vertical::{UNKNOWNS, Vertical};

/// Predicted force and the regressors of the design columns.
///
/// Columns use this force, not the measured one: noise in a regressor biases its coefficient towards zero (attenuation).
pub struct Prediction {
    /// The accelerometers' rows.
    pub rows: Readings,
    /// Attitude and lever-arm terms.
    pub carried: Carried,
    /// Current estimate of the vertical of each recording.
    pub verticals: Vec<Vertical>,
    /// Mean specific force over each row \[m/s²\].
    pub force_m_s2: Triad,
    /// Scale error of the model, for the factor 1/(1 − s_i) of a sample.
    pub scale_error: [f64; 3],
    /// Warming of each block since the start, mean over each row \[K\].
    pub warming_k: Option<Triad>,
    /// Spectra of the force, recording by recording.
    spectra: Vec<[Spectrum; 3]>,
}

/// Columns of the unknowns of the verticals: one for each recording, unknown and axis.
pub struct VerticalColumns {
    /// Number of rows of all recordings.
    count: usize,
    /// Rows of one recording and values on them \[m/s per row\]; by recording, unknown and axis.
    pub columns: Vec<(Range<usize>, Vec<f64>)>,
}

impl Columns for VerticalColumns {
    fn count(&self) -> usize {
        self.columns.len()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        let (rows, own) = &self.columns[place];
        let mut values = vec![0.0; self.count];
        values[rows.clone()].copy_from_slice(own);
        values
    }
}

impl Prediction {
    /// Predicts the force.
    pub fn new(
        rows: Readings,
        carried: Carried,
        verticals: Vec<Vertical>,
        scale_error: [f64; 3],
        warming_k: Option<Triad>,
    ) -> Self {
        let mut made_of = Self {
            rows,
            carried,
            verticals,
            force_m_s2: Triad::default(),
            scale_error,
            warming_k,
            spectra: Vec::new(),
        };
        made_of.predict();
        made_of
    }

    fn predict(&mut self) {
        self.force_m_s2 = Triad::default();
        self.spectra.clear();
        for (piece, vertical) in self.rows.pieces.iter().zip(&self.verticals) {
            let own = vertical.force_m_s2(&self.rows, piece, &self.carried);
            self.spectra.push(spectra_of(&own, self.rows.rate_hz));
            for (all, own) in self.force_m_s2.iter_mut().zip(own) {
                all.extend(own);
            }
        }
    }

    /// Corrects the verticals of some recordings by their estimated unknowns.
    ///
    /// # Inputs `moves`: place of the recording, and the unknowns.
    pub fn move_verticals(&mut self, moves: &[(usize, [f64; UNKNOWNS])]) {
        for (place, unknowns) in moves {
            self.verticals[*place] = self.verticals[*place].moved(*unknowns);
        }
        self.predict();
    }

    /// Force along an axis, delayed by `delay_s` \[m/s²\].
    pub fn force_before(&self, axis: usize, delay_s: f64) -> Vec<f64> {
        let each = self.spectra.iter();
        each.flat_map(|spectra| spectra[axis].delayed(delay_s))
            .collect()
    }

    /// Rate of change of that force \[m/s³\].
    pub fn slope_before(&self, axis: usize, delay_s: f64) -> Vec<f64> {
        use realfft::num_complex::Complex64;
        use std::f64::consts::TAU;
        let slope = |hz: f64| {
            Complex64::new(0.0, TAU * hz) * Complex64::from_polar(1.0, -TAU * hz * delay_s)
        };
        let each = self.spectra.iter();
        each.flat_map(|spectra| spectra[axis].through(slope))
            .collect()
    }

    /// Mean rate of the case over each row \[rad/s\].
    pub fn rate_rad_s(&self, axis: usize) -> Vec<f64> {
        let angles = self.carried.angle_rad[axis].iter();
        angles.map(|angle| angle * self.rows.rate_hz).collect()
    }

    /// Columns of the unknowns of the verticals, for the recordings at `places`.
    pub fn vertical_columns(&self, places: &[usize]) -> VerticalColumns {
        let period_s = self.rows.period_s();
        let mut columns = Vec::with_capacity(places.len() * UNKNOWNS * 3);
        for &place in places {
            let piece = &self.rows.pieces[place];
            let tilts = self.verticals[place].columns(&self.rows, piece, &self.carried);
            for triad in tilts {
                for (values, scale_error) in triad.into_iter().zip(self.scale_error) {
                    let factor = period_s / (1.0 - scale_error);
                    let scaled = values.into_iter().map(|value| value * factor);
                    columns.push((piece.rows.clone(), scaled.collect()));
                }
            }
        }
        VerticalColumns {
            count: self.rows.count,
            columns,
        }
    }
}

/// Warming of the blocks since `start_k`, mean over the rows of one recording's accelerometers \[K\].
pub fn warming_k(
    temperature_k: &Triad,
    start_k: [f64; 3],
    gyro_rate_hz: f64,
    rows: &Rows,
) -> Triad {
    let share = rows.rate_hz / gyro_rate_hz;
    each_axis(|axis| {
        let values = temperature_k[axis].iter();
        let warming: Vec<f64> = values
            .map(|value| (value - start_k[axis]) * share)
            .collect();
        rows.gather(&warming)
    })
}

fn spectra_of(force_m_s2: &Triad, rate_hz: f64) -> [Spectrum; 3] {
    [0, 1, 2].map(|axis: usize| Spectrum::new(&force_m_s2[axis], rate_hz))
}
