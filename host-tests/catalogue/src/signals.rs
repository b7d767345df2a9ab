//! Measured inputs on the gyros' rows, and the motion derived from them.

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use realfft::num_complex::Complex64;
use rlg_plan::CataloguePlan;
use rlg_signal::axes::add;
use rlg_signal::derivatives::Spectrum;
use rlg_signal::piece::Origin;
use rlg_signal::streams::Streams;

use crate::low_pass::LowPass;
use crate::resonance::Resonance;

/// Names of the axes.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// A channel on the three body axes, `[axis][row]`.
pub type Triad = [Vec<f64>; 3];

/// Measured inputs.
#[derive(Debug, Clone, Copy, Default)]
pub struct Inputs<'a> {
    /// Specific force, row means \[m/s²\].
    pub force_m_s2: Option<&'a Triad>,
    /// Temperature \[K\].
    pub temperature_k: Option<&'a Triad>,
    /// Magnetic flux density \[T\].
    pub magnetic_t: Option<&'a Triad>,
    /// Rotation from the measured specific force to the reference's vertical, by body axis \[1\].
    pub off_vertical: Option<&'a Triad>,
    /// Angle of block against case at row ends \[rad\], one entry more than rows.
    pub pickoff_rad: Option<&'a Triad>,
    /// Channels of unclassified quantity, by name.
    pub others: &'a [(String, Vec<f64>)],
    /// Start of the first row on the recording's clock \[s\].
    pub start_s: f64,
    /// Origin in the longer recording that the rows are a part of.
    pub origin: Option<&'a Origin>,
}

/// Transfer path from the reference to the rotation that each gyro senses.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Path {
    /// Delay of each gyro after the reference \[s\].
    pub delay_s: [f64; 3],
    /// Soft mount between reference and case about each axis.
    pub mount: [Option<Resonance>; 3],
    /// Low pass on each gyro's path.
    pub low_pass: [Option<LowPass>; 3],
}

/// Motion of the case after the path, and its derivatives, each computed when it is first asked for; a clone shares both.
#[derive(Clone)]
pub struct CaseMotion {
    /// Increments \[rad\].
    pub case_rad: Arc<Triad>,
    rate_hz: f64,
    derived: Arc<[Derived; 3]>,
}

/// Spectrum and derivatives on one axis.
#[derive(Default)]
struct Derived {
    spectrum: OnceLock<Spectrum>,
    rate_rad_s: OnceLock<Vec<f64>>,
    acceleration_rad_s2: OnceLock<Vec<f64>>,
}

impl CaseMotion {
    /// # Inputs
    /// `case_rad`: increments after the path \[rad\].
    pub fn new(case_rad: impl Into<Arc<Triad>>, rate_hz: f64) -> Self {
        Self {
            case_rad: case_rad.into(),
            rate_hz,
            derived: Arc::default(),
        }
    }

    /// Rate about an axis at row middles \[rad/s\].
    pub fn rate_rad_s(&self, axis: usize) -> &[f64] {
        let of = || self.spectrum(axis).middle_derivative(0);
        self.derived[axis].rate_rad_s.get_or_init(of)
    }

    /// Angular acceleration about an axis at row middles \[rad/s²\].
    pub fn acceleration_rad_s2(&self, axis: usize) -> &[f64] {
        let of = || self.spectrum(axis).middle_derivative(1);
        self.derived[axis].acceleration_rad_s2.get_or_init(of)
    }

    /// Spectrum of the mean rate about an axis, for further derivatives.
    pub fn spectrum(&self, axis: usize) -> &Spectrum {
        self.derived[axis].spectrum.get_or_init(|| {
            let angles = self.case_rad[axis].iter();
            let rates: Vec<f64> = angles.map(|angle| angle * self.rate_hz).collect();
            Spectrum::new(&rates, self.rate_hz)
        })
    }

    /// Frees spectra and derivatives until they are asked for again.
    pub fn release(&mut self) {
        self.derived = Arc::default();
    }
}

/// Estimate of the motion from which a column is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Estimate {
    /// Estimate whose noise is independent of the residual of its own axis: for candidate effects on that gyro.
    Independent,
    /// Most likely estimate: for candidate effects on gyros whose residual shares no noise with it, and for known
    /// nonlinear effects.
    Likeliest,
    /// Reference as measured, noise included: for known linear effects, which filter motion and noise of the reference
    /// alike and leave no part of the motion in the residual.
    Measured,
}

/// Estimates of the motion from which columns are computed.
pub struct Motions {
    /// Increments of the reference \[rad\] after the model's known path, noise included.
    pub measured_rad: Arc<Triad>,
    /// See [`Estimate::Independent`].
    pub independent: CaseMotion,
    /// See [`Estimate::Likeliest`].
    pub likeliest: CaseMotion,
    /// Increments of the blocks against the case \[rad\].
    pub dither_rad: Option<Triad>,
}

impl Motions {
    /// Uses one motion for all three estimates if no other is known.
    ///
    /// # Inputs
    /// `case_rad`: increments of the case \[rad\]; `dither_rad`: increments of the blocks against it \[rad\].
    pub fn of_one(case_rad: Arc<Triad>, dither_rad: Option<Triad>, rate_hz: f64) -> Self {
        let case = CaseMotion::new(Arc::clone(&case_rad), rate_hz);
        Self {
            independent: case.clone(),
            likeliest: case,
            dither_rad,
            measured_rad: case_rad,
        }
    }
}

impl<'a> Inputs<'a> {
    /// Takes the channels of aligned rows.
    pub fn of(streams: &'a Streams) -> Self {
        Self {
            force_m_s2: streams.force_m_s2.as_ref(),
            temperature_k: streams.temperature_k.as_ref(),
            magnetic_t: streams.magnetic_t.as_ref(),
            off_vertical: None,
            pickoff_rad: streams.pickoff_rad.as_ref(),
            others: &streams.others,
            start_s: streams.start_s,
            origin: streams.piece.origin.as_ref(),
        }
    }
}

/// Signals from which columns are computed.
pub struct Signals {
    /// Row rate \[Hz\].
    pub rate_hz: f64,
    /// Number of rows.
    pub rows: usize,
    /// Start of the first row on the recording's clock \[s\].
    pub start_s: f64,
    /// Time from the recording's beginning to the first row \[s\]: 0 except in a part of a longer recording.
    pub elapsed_s: f64,
    /// Increments of the reference \[rad\] after the model's known path, noise included.
    pub measured_rad: Arc<Triad>,
    /// Further path from there to the gyros.
    pub path: Path,
    /// See [`Estimate::Independent`].
    pub independent: CaseMotion,
    /// See [`Estimate::Likeliest`].
    pub likeliest: CaseMotion,
    /// Specific force \[m/s²\].
    pub force_m_s2: Option<Triad>,
    /// Temperature change since the recording's beginning \[K\].
    pub warming_k: Option<Triad>,
    /// Magnetic flux density \[T\].
    pub magnetic_t: Option<Triad>,
    /// Rotation from the measured specific force to the reference's vertical, by body axis: (f/|f|) × up \[1\]. Known
    /// only with attitude references.
    pub off_vertical: Option<Triad>,
    /// Increments of block against case \[rad\], filtered like the motion.
    pub dither_rad: Option<Triad>,
    /// Pickoff angle at row ends \[rad\].
    pub pickoff_rad: Option<Triad>,
    /// Channels of unclassified quantity, by name.
    pub others: Vec<(String, Vec<f64>)>,
    /// Scale error of the model \[1\], for the factor 1/(1 − s_i) of sensed increments.
    pub scale_error: [f64; 3],
    /// Sensing-axis rates from body rates: the inverse of the matrix of Eq. (7).
    pub sensing_from_body: Matrix3<f64>,
    /// The same with all effects found so far: determines the axes whose noise is in a gyro's residual.
    pub shared: Matrix3<f64>,
    /// Thresholds of the effects.
    pub plan: CataloguePlan,
    /// Attitude at the first row: body frame to start frame.
    start_from_body: UnitQuaternion<f64>,
    /// Rotation from the start frame to the body frame in the middle of each row, once it is asked for; single precision, as
    /// the columns in the sums.
    attitude: OnceLock<Vec<UnitQuaternion<f32>>>,
}

impl Signals {
    /// Derives the inputs of the columns.
    pub fn new(
        rate_hz: f64,
        motions: Motions,
        inputs: Inputs,
        path: Path,
        scale_error: [f64; 3],
        (sensing_from_body, shared): (Matrix3<f64>, Matrix3<f64>),
        plan: &CataloguePlan,
    ) -> Self {
        let Motions {
            measured_rad,
            independent,
            likeliest,
            dither_rad,
        } = motions;
        Self {
            warming_k: inputs.temperature_k.map(|triad| {
                let start_k = inputs.origin.and_then(|origin| origin.temperature_k);
                std::array::from_fn(|axis| {
                    let start_k = start_k.map(|start_k| start_k[axis]);
                    warming(&triad[axis], start_k, rate_hz, plan)
                })
            }),
            pickoff_rad: inputs
                .pickoff_rad
                .map(|triad| std::array::from_fn(|axis| triad[axis][1..].to_vec())),
            force_m_s2: inputs.force_m_s2.cloned(),
            magnetic_t: inputs.magnetic_t.cloned(),
            off_vertical: inputs.off_vertical.cloned(),
            start_from_body: inputs
                .origin
                .map_or_else(UnitQuaternion::identity, |origin| origin.start_from_body),
            attitude: OnceLock::new(),
            rate_hz,
            rows: measured_rad[0].len(),
            measured_rad,
            independent,
            likeliest,
            path,
            others: inputs.others.to_vec(),
            start_s: inputs.start_s,
            elapsed_s: inputs
                .origin
                .map_or(0.0, |origin| inputs.start_s - origin.start_s),
            dither_rad,
            scale_error,
            sensing_from_body,
            shared,
            plan: *plan,
        }
    }

    /// Builds the signals of a motion whose noise is not in the residual, with a direct path.
    ///
    /// # Inputs
    /// `case_rad`: increments of the case \[rad\]; `dither_rad`: increments of the blocks against it \[rad\]; `inputs`:
    /// other channels; `scale_error`, `sensing_from_body`: of the model.
    pub fn of_known(
        (case_rad, dither_rad): (Triad, Option<Triad>),
        inputs: Inputs,
        rate_hz: f64,
        scale_error: [f64; 3],
        sensing_from_body: Matrix3<f64>,
        plan: &CataloguePlan,
    ) -> Self {
        let motions = Motions::of_one(Arc::new(case_rad), dither_rad, rate_hz);
        let sensing = (sensing_from_body, sensing_from_body);
        Self::new(
            rate_hz,
            motions,
            inputs,
            Path::default(),
            scale_error,
            sensing,
            plan,
        )
    }

    /// Frees what is derived from the motions until it is asked for again.
    pub fn release(&mut self) {
        self.independent.release();
        self.likeliest.release();
        self.attitude.take();
    }

    /// Computes the sensed increments of a gyro from the measured reference \[rad\], after the mount about each axis
    /// and without the scale factor 1/(1 − s_i).
    pub fn measured_along_rad(&self, gyro: usize) -> Vec<f64> {
        let mut sum = vec![0.0; self.rows];
        for (axis, values) in self.measured_rad.iter().enumerate() {
            let along = self.sensing_from_body[(gyro, axis)];
            if along != 0.0 {
                let mount = self.path.mount[axis];
                let part =
                    mount.map(|mount| Path::through(values, self.rate_hz, |hz| mount.whole(hz)));
                add(&mut sum, part.as_ref().unwrap_or(values), along);
            }
        }
        sum
    }

    /// Row period \[s\].
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// Computes the component along body `axis` of a unit vector fixed in space that lay along body axis `at_start` at
    /// the start.
    pub fn space_vector(&self, at_start: usize, axis: usize) -> Vec<f64> {
        let attitude = self
            .attitude
            .get_or_init(|| attitude(&self.independent.case_rad, self.start_from_body));
        attitude
            .iter()
            .map(|body_from_start| (body_from_start * Vector3::ith(at_start, 1.0))[axis].into())
            .collect()
    }
}

impl Path {
    /// True if reference and gyro have no delay, mount or low pass between them.
    pub fn is_direct(&self, axis: usize) -> bool {
        self.delay_s[axis] == 0.0 && self.mount[axis].is_none() && self.low_pass[axis].is_none()
    }

    /// Delay of the largest magnitude \[s\].
    pub fn longest_delay_s(&self) -> f64 {
        let by_size = |a: &f64, b: &f64| a.abs().total_cmp(&b.abs());
        self.delay_s.into_iter().max_by(by_size).unwrap_or_default()
    }

    /// Frequency response about an axis at a frequency \[Hz\].
    pub fn response(&self, axis: usize, hz: f64) -> Complex64 {
        let mount = self.mount[axis].map_or(Complex64::ONE, |mount| mount.whole(hz));
        let low_pass = self.low_pass[axis].map_or(Complex64::ONE, |one| one.whole(hz));
        late(self.delay_s[axis], hz) * mount * low_pass
    }

    /// Applies the path to the reference's increments about an axis \[rad\].
    pub fn along<'a>(&self, axis: usize, reference_rad: &'a [f64], rate_hz: f64) -> Cow<'a, [f64]> {
        if self.is_direct(axis) {
            return Cow::Borrowed(reference_rad);
        }
        Self::through(reference_rad, rate_hz, |hz| self.response(axis, hz)).into()
    }

    /// Removes the path from increments about an axis \[rad\]: the inverse of [`Path::along`].
    pub fn before<'a>(&self, axis: usize, case_rad: &'a [f64], rate_hz: f64) -> Cow<'a, [f64]> {
        if self.is_direct(axis) {
            return Cow::Borrowed(case_rad);
        }
        Self::through(case_rad, rate_hz, |hz| self.response(axis, hz).inv()).into()
    }

    /// Applies a linear system to increments \[rad\].
    pub fn through(
        values_rad: &[f64],
        rate_hz: f64,
        response: impl Fn(f64) -> Complex64,
    ) -> Vec<f64> {
        Spectrum::new(values_rad, rate_hz).through(response)
    }
}

/// Frequency response of a delay \[s\] at a frequency \[Hz\].
pub fn late(delay_s: f64, hz: f64) -> Complex64 {
    if delay_s == 0.0 {
        return Complex64::ONE;
    }
    Complex64::from_polar(1.0, -std::f64::consts::TAU * hz * delay_s)
}

/// Temperature of each block in the first row, low-passed to the thermal band \[K\].
///
/// # Inputs
/// `temperature_k`: from the recording's beginning on, two seconds at least.
pub fn start_temperature_k(temperature_k: &Triad, rate_hz: f64, plan: &CataloguePlan) -> [f64; 3] {
    std::array::from_fn(|axis| {
        let first_k = temperature_k[axis][0];
        first_k + warming(&temperature_k[axis], Some(first_k), rate_hz, plan)[0]
    })
}

/// Temperature rise above `start_k`, or above the first row, low-passed to the thermal band \[K\].
fn warming(
    temperature_k: &[f64],
    start_k: Option<f64>,
    rate_hz: f64,
    plan: &CataloguePlan,
) -> Vec<f64> {
    let first_k = temperature_k[0];
    let values: Vec<f64> = temperature_k.iter().map(|value| value - first_k).collect();
    let slow = match values.iter().all(|value| *value == 0.0) {
        true => values,
        false => Spectrum::new(&values, rate_hz).through(|hz| {
            let fourth = (hz / plan.thermal_edge_hz).powi(4);
            Complex64::new(1.0 / (1.0 + fourth), 0.0)
        }),
    };
    let start = start_k.map_or(slow[0], |start_k| start_k - first_k);
    slow.iter().map(|value| value - start).collect()
}

/// Integrates the increments alone to the attitude in the middle of each row: start frame to body.
fn attitude(case_rad: &Triad, at_first: UnitQuaternion<f64>) -> Vec<UnitQuaternion<f32>> {
    let mut start_from_body = at_first;
    (0..case_rad[0].len())
        .map(|row| {
            let turn = Vector3::new(case_rad[0][row], case_rad[1][row], case_rad[2][row]);
            let middle = start_from_body * UnitQuaternion::from_scaled_axis(0.5 * turn);
            start_from_body *= UnitQuaternion::from_scaled_axis(turn);
            middle.inverse().cast::<f32>()
        })
        .collect()
}
