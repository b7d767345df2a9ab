//! Measured inputs on the gyros' rows, and the motion derived from them.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use realfft::num_complex::Complex64;
use rlg_signal::derivatives::Spectrum;

use crate::low_pass::{self, LowPass};
use crate::resonance::{Part, Resonance};

/// Names of the axes.
pub const AXES: [&str; 3] = ["x", "y", "z"];

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
    /// Channels of unknown quantity, by name.
    pub others: &'a [(String, Vec<f64>)],
    /// When the first row begins on the recording's clock \[s\].
    pub start_s: f64,
}

/// What stands between the reference and what a gyro turns with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Path {
    /// How late each gyro is against the reference \[s\].
    pub delay_s: [f64; 3],
    /// The soft mount between reference and case about each axis.
    pub mount: [Option<Resonance>; 3],
    /// The low pass on each gyro's path.
    pub low_pass: [Option<LowPass>; 3],
}

/// What columns are made of.
pub struct Signals {
    /// Rows per second \[Hz\].
    pub rate_hz: f64,
    /// Number of rows.
    pub rows: usize,
    /// When the first row begins on the recording's clock \[s\].
    pub start_s: f64,
    /// Increments of the case \[rad\] as the gyros saw them, behind `path`.
    pub case_rad: Triad,
    /// The same as the reference saw them; empty where nothing lies between.
    reference_rad: Triad,
    /// Delays and mounts that are already known.
    pub path: Path,
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
    /// Channels of unknown quantity, by name.
    pub others: Vec<(String, Vec<f64>)>,
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
    /// `reference_rad`: increments of the reference \[rad\], noise removed; `dither_rad`: increments of the blocks \[rad\].
    pub fn new(
        rate_hz: f64,
        mut reference_rad: Triad,
        dither_rad: Option<Triad>,
        inputs: Inputs,
        path: Path,
        scale_error: [f64; 3],
        sensing_from_body: Matrix3<f64>,
    ) -> Self {
        let rows = reference_rad[0].len();
        let case_rad: Triad = std::array::from_fn(|axis| {
            if path.is_direct(axis) {
                std::mem::take(&mut reference_rad[axis])
            } else {
                path.along(axis, path.delay_s[axis], &reference_rad[axis], rate_hz)
            }
        });
        let spectra: [Spectrum; 3] = std::array::from_fn(|axis| {
            let rates: Vec<f64> = case_rad[axis].iter().map(|angle| angle * rate_hz).collect();
            Spectrum::new(&rates, rate_hz)
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
            reference_rad,
            path,
            spectra,
            others: inputs.others.to_vec(),
            start_s: inputs.start_s,
            dither_rad,
            scale_error,
            sensing_from_body,
        }
    }

    /// Increments about an axis as the reference saw them \[rad\].
    pub fn reference_rad(&self, axis: usize) -> &[f64] {
        if self.path.is_direct(axis) {
            &self.case_rad[axis]
        } else {
            &self.reference_rad[axis]
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

impl Path {
    /// Whether nothing lies between the reference and a gyro.
    pub fn is_direct(&self, axis: usize) -> bool {
        self.delay_s[axis] == 0.0 && self.mount[axis].is_none() && self.low_pass[axis].is_none()
    }

    /// The reference's increments about an axis behind its mount, its low pass and a delay \[rad\].
    pub fn along(
        &self,
        axis: usize,
        delay_s: f64,
        reference_rad: &[f64],
        rate_hz: f64,
    ) -> Vec<f64> {
        let (mount, low_pass) = (self.mount[axis], self.low_pass[axis]);
        if delay_s == 0.0 && mount.is_none() && low_pass.is_none() {
            return reference_rad.to_vec();
        }
        Spectrum::new(reference_rad, rate_hz).through(|hz| {
            let late = Complex64::from_polar(1.0, -std::f64::consts::TAU * hz * delay_s);
            let beyond = mount.map_or(Complex64::ZERO, |mount| {
                mount.beyond_mount(hz, Part::Response)
            });
            let passed = low_pass.map_or(Complex64::ZERO, |low_pass| {
                low_pass.beyond(hz, low_pass::Part::Response)
            });
            late * (1.0 + beyond) * (1.0 + passed)
        })
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
