//! What accelerometers should read: gravity in the body, and what columns are made of.

use rlg_signal::accelerometer_rows::Rows;
use rlg_signal::axes::{AXES, Triad, each_axis};
use rlg_signal::derivatives::Spectrum;

use crate::carried::Carried;
use crate::vertical::{UNKNOWNS, Vertical};

/// The force that is predicted, and what columns are made of.
///
/// Columns use this force, not the measured one: noise in a regressor would draw its coefficient to zero.
pub struct Prediction {
    /// The accelerometers' rows.
    pub rows: Rows,
    /// Attitude and lever-arm forces.
    pub carried: Carried,
    /// The vertical as known so far.
    pub vertical: Vertical,
    /// Mean specific force over each row \[m/s²\].
    pub force_m_s2: Triad,
    /// Scale error of the model, for the 1/(1 − s_i) of a reading.
    pub scale_error: [f64; 3],
    /// Warming of each block since the start, mean over each row \[K\].
    pub warming_k: Option<Triad>,
    spectra: [Spectrum; 3],
}

impl Prediction {
    /// Predicts the force.
    pub fn new(
        rows: Rows,
        carried: Carried,
        vertical: Vertical,
        scale_error: [f64; 3],
        warming_k: Option<Triad>,
    ) -> Self {
        let force_m_s2 = vertical.force_m_s2(&rows, &carried);
        let spectra = spectra_of(&force_m_s2, rows.rate_hz);
        Self {
            rows,
            carried,
            vertical,
            force_m_s2,
            scale_error,
            warming_k,
            spectra,
        }
    }

    /// Takes over what was learned of the vertical.
    pub fn move_vertical(&mut self, unknowns: &[f64; UNKNOWNS]) {
        self.vertical = self.vertical.moved(unknowns);
        self.force_m_s2 = self.vertical.force_m_s2(&self.rows, &self.carried);
        self.spectra = spectra_of(&self.force_m_s2, self.rows.rate_hz);
    }

    /// The force along an axis as it was `delay_s` before \[m/s²\].
    pub fn force_before(&self, axis: usize, delay_s: f64) -> Vec<f64> {
        self.spectra[axis].delayed(delay_s)
    }

    /// Its rate of change then \[m/s³\].
    pub fn slope_before(&self, axis: usize, delay_s: f64) -> Vec<f64> {
        use realfft::num_complex::Complex64;
        use std::f64::consts::TAU;
        self.spectra[axis].through(|hz| {
            Complex64::new(0.0, TAU * hz) * Complex64::from_polar(1.0, -TAU * hz * delay_s)
        })
    }

    /// Mean rate of the case over each row \[rad/s\].
    pub fn rate_rad_s(&self, axis: usize) -> Vec<f64> {
        let angles = self.carried.angle_rad[axis].iter();
        angles.map(|angle| angle * self.rows.rate_hz).collect()
    }

    /// Columns of the vertical's unknowns \[m/s per row\], for each of them its three axes.
    pub fn vertical_columns(&self) -> Vec<Vec<f64>> {
        let tilts = self.vertical.columns(&self.rows, &self.carried);
        let period_s = self.rows.period_s();
        let each = tilts.into_iter().flat_map(|triad| {
            let scaled = triad.into_iter().zip(self.scale_error);
            scaled.map(|(values, scale_error)| {
                let factor = period_s / (1.0 - scale_error);
                values.into_iter().map(|value| value * factor).collect()
            })
        });
        each.collect()
    }
}

/// Warming of the blocks since the start, mean over the accelerometers' rows \[K\].
pub fn warming_k(temperature_k: &Triad, gyro_rate_hz: f64, rows: &Rows) -> Triad {
    let share = rows.rate_hz / gyro_rate_hz;
    each_axis(|axis| {
        let start = temperature_k[axis].first().copied().unwrap_or(0.0);
        let warming: Vec<f64> = temperature_k[axis]
            .iter()
            .map(|value| (value - start) * share)
            .collect();
        rows.gather(&warming)
    })
}

fn spectra_of(force_m_s2: &Triad, rate_hz: f64) -> [Spectrum; 3] {
    [0, 1, 2].map(|axis: usize| Spectrum::new(&force_m_s2[axis], rate_hz))
}

/// The name of an accelerometer's channel.
pub fn channel_name(axis: usize) -> String {
    format!("accel_{}", AXES[axis])
}
