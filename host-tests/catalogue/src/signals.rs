//! Measured inputs on the gyros' rows, and the motion derived from them.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;
use rlg_signal::derivatives::Spectrum;

/// A channel on the three body axes, `[axis][row]`.
pub type Triad = [Vec<f64>; 3];

/// Temperature of a block changes more slowly than this \[Hz\]; what is faster is the converter's noise.
const THERMAL_EDGE_HZ: f64 = 0.5;

/// Inputs as they were measured.
#[derive(Debug, Clone, Copy, Default)]
pub struct Inputs<'a> {
    /// Specific force, row means \[m/s²\].
    pub force_m_s2: Option<&'a Triad>,
    /// Temperature \[K\].
    pub temperature_k: Option<&'a Triad>,
    /// Magnetic flux density \[T\].
    pub magnetic_t: Option<&'a Triad>,
    /// Block relative to case at row ends \[rad\], one entry more than rows.
    pub pickoff_rad: Option<&'a Triad>,
}

/// What columns are made of.
pub struct Signals {
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// Number of rows.
    pub rows: usize,
    /// Increments of the case \[rad\] as the gyros saw them, delays that are already known included.
    pub case_rad: Triad,
    /// The same before any delay; empty where `delay_s` is 0.
    pub undelayed_rad: Triad,
    /// Delay of each gyro against the reference that `case_rad` includes \[s\].
    pub delay_s: [f64; 3],
    /// Rate at row middles \[rad/s\].
    pub rate_rad_s: Triad,
    /// Angular acceleration at row middles \[rad/s²\].
    pub acceleration_rad_s2: Triad,
    /// Of the mean rates, for further derivatives.
    pub spectra: [Spectrum; 3],
    /// Specific force \[m/s²\].
    pub force_m_s2: Option<Triad>,
    /// Temperature since the first row \[K\].
    pub warming_k: Option<Triad>,
    /// Magnetic flux density \[T\].
    pub magnetic_t: Option<Triad>,
    /// Increments of block against case \[rad\], conditioned like the motion.
    pub dither_rad: Option<Triad>,
    /// Pickoff angle at row ends \[rad\].
    pub pickoff_rad: Option<Triad>,
    /// Scale error of the model \[1\], for the 1/(1 − s_i) of sensed increments.
    pub scale_error: [f64; 3],
    /// Rates along the sensing axes from body rates: the inverse of Eq. (7)'s matrix.
    pub sensing_from_body: Matrix3<f64>,
    /// Of the body against the start in the middle of each row; single precision is that of the columns in the sums.
    attitude: Vec<UnitQuaternion<f32>>,
}

impl Signals {
    /// Derives what the columns need.
    ///
    /// # Inputs
    /// `undelayed_rad`: increments of the case \[rad\], noise removed; `dither_rad`: increments of the blocks \[rad\];
    /// `delay_s`: how late each gyro is.
    pub fn new(
        rate_hz: f64,
        mut undelayed_rad: Triad,
        dither_rad: Option<Triad>,
        inputs: Inputs,
        delay_s: [f64; 3],
        scale_error: [f64; 3],
        sensing_from_body: Matrix3<f64>,
    ) -> Self {
        let rows = undelayed_rad[0].len();
        let mut planner = RealFftPlanner::new();
        let case_rad: Triad = std::array::from_fn(|axis| {
            if delay_s[axis] == 0.0 {
                std::mem::take(&mut undelayed_rad[axis])
            } else {
                Spectrum::by(&mut planner, &undelayed_rad[axis], rate_hz).delayed(delay_s[axis])
            }
        });
        let spectra: [Spectrum; 3] = std::array::from_fn(|axis| {
            let rates: Vec<f64> = case_rad[axis].iter().map(|angle| angle * rate_hz).collect();
            Spectrum::by(&mut planner, &rates, rate_hz)
        });
        Self {
            rate_rad_s: std::array::from_fn(|axis| spectra[axis].middle_derivative(0)),
            acceleration_rad_s2: std::array::from_fn(|axis| spectra[axis].middle_derivative(1)),
            warming_k: inputs
                .temperature_k
                .map(|triad| std::array::from_fn(|axis| warming(&triad[axis], rate_hz))),
            pickoff_rad: inputs
                .pickoff_rad
                .map(|triad| std::array::from_fn(|axis| triad[axis][1..].to_vec())),
            force_m_s2: inputs.force_m_s2.cloned(),
            magnetic_t: inputs.magnetic_t.cloned(),
            attitude: attitude(&case_rad),
            rate_hz,
            rows,
            case_rad,
            undelayed_rad,
            delay_s,
            spectra,
            dither_rad,
            scale_error,
            sensing_from_body,
        }
    }

    /// One row's period \[s\].
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// Component along body `axis` of a unit vector fixed in space that lay along body axis `at_start`.
    pub fn space_vector(&self, at_start: usize, axis: usize) -> Vec<f64> {
        self.attitude
            .iter()
            .map(|body_from_start| (body_from_start * Vector3::ith(at_start, 1.0))[axis].into())
            .collect()
    }
}

/// Temperature since the start in the band in which a block changes \[K\].
fn warming(temperature_k: &[f64], rate_hz: f64) -> Vec<f64> {
    let start = temperature_k[0];
    let values: Vec<f64> = temperature_k.iter().map(|value| value - start).collect();
    if values.iter().all(|value| *value == 0.0) {
        return values;
    }
    let slow = Spectrum::new(&values, rate_hz).through(|hz| {
        let fourth = (hz / THERMAL_EDGE_HZ).powi(4);
        Complex64::new(1.0 / (1.0 + fourth), 0.0)
    });
    let first = slow[0];
    slow.iter().map(|value| value - first).collect()
}

/// Attitude in the middle of each row against the first row's begin, from the increments alone.
fn attitude(case_rad: &Triad) -> Vec<UnitQuaternion<f32>> {
    let mut start_from_body = UnitQuaternion::identity();
    (0..case_rad[0].len())
        .map(|row| {
            let turn = Vector3::new(case_rad[0][row], case_rad[1][row], case_rad[2][row]);
            let middle = start_from_body * UnitQuaternion::from_scaled_axis(0.5 * turn);
            start_from_body *= UnitQuaternion::from_scaled_axis(turn);
            middle.inverse().cast::<f32>()
        })
        .collect()
}
