//! Design columns: effect of a unit parameter on a sensed increment, before 1/(1 − s_i).

use std::f64::consts::TAU;

use realfft::num_complex::Complex64;
use rlg_signal::axes::add;
use rlg_signal::derivatives::{Spectrum, row_means};

use crate::expression::Expression;
use crate::high_pass::{self, HighPass};
use crate::lock_in::{self, Threshold};
use crate::low_pass::{self, LowPass};
use crate::resonance::{self, Part, Resonance};
use crate::signals::{CaseMotion, Estimate, Path, Signals, Triad, late};

/// Design column, by its regressors. Axes are 0, 1, 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Column {
    /// T \[s\].
    Constant,
    /// Increment of the case \[rad\].
    Increment(usize),
    /// Derivative of the increment \[rad/s\].
    Delay(usize),
    /// Second derivative of the rate, times T.
    Jerk(usize),
    /// |ω| T.
    Magnitude(usize),
    /// ω² T.
    Square(usize),
    /// ω³ T.
    Cube(usize),
    /// α_about · ω_senses · T.
    Flexure(usize, usize),
    /// α_about³ · ω_senses · T.
    CubicFlexure(usize, usize),
    /// f T.
    Force(usize),
    /// f² T.
    ForceSquare(usize),
    /// df/dt T.
    ForceRate(usize),
    /// f · increment, both of one axis.
    ForceTimesIncrement(usize),
    /// Warming · T.
    Warming(usize),
    /// d(warming)/dt · T.
    WarmingRate(usize),
    /// Warming of the first axis times the increment of the second.
    WarmingTimesIncrement(usize, usize),
    /// B T.
    Magnetic(usize),
    /// (f/|f|) × up · T.
    OffVertical(usize),
    /// Increment of the block \[rad\].
    Dither(usize),
    /// Derivative of the block's increment \[rad/s\], at a delay of the pickoff \[s\].
    DitherDelay(usize, f64),
    /// Effect of a pickoff delay on the block's increment \[rad\] beyond a known delay and beyond the linear term of
    /// [`Column::DitherDelay`]: known delay \[s\] and additional delay found \[s\].
    DitherBeyond(usize, f64, f64),
    /// Increment of the cube of the pickoff angle \[rad³\].
    DitherCube(usize),
    /// Component along the second axis of a space-fixed unit vector that lay along the first at the start, times T.
    SpaceVector(usize, usize),
    /// α_about · ω_senses · T, with α after a resonant suspension; or its derivative with respect to frequency or
    /// damping.
    ResonantFlexure(usize, usize, Resonance, Part),
    /// Effect of a soft mount on the reference's increment \[rad\]; or its derivative.
    Mount(usize, Resonance, Part),
    /// Effect of a gyro's delay \[s\] on its increment \[rad\].
    Late(usize, f64),
    /// Effect of a low pass in a gyro's path on its increment \[rad\]; or its derivative with respect to the time
    /// constant.
    LowPass(usize, LowPass, low_pass::Part),
    /// Effect of a high pass behind a gyro on its increment \[rad\]; or its derivative with respect to the time constant.
    HighPass(usize, HighPass, high_pass::Part),
    /// Effect of lock-in on a gyro's increment \[rad\]; or its derivative with respect to the threshold.
    LockIn(usize, Threshold, lock_in::Part),
    /// Increment of the cosine (true) or sine of an order times the table's angle.
    Wave(usize, u32, bool),
    /// Expression in measured channels, times T.
    Expression(Expression),
    /// 1 in one row.
    Impulse(usize),
    /// T from a row on, 0 before.
    Step(usize),
}

/// Column with the estimate of the motion from which it is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensed {
    /// The column.
    pub column: Column,
    /// Estimate of the motion.
    pub of: Estimate,
}

impl Sensed {
    /// Column of a candidate effect on a gyro.
    pub fn tried(column: Column, gyro: usize, signals: &Signals) -> Self {
        let root = (signals.rows as f64).sqrt();
        let negligible = signals.plan.negligible_share;
        let is_shared =
            |axis: usize| axis == gyro || signals.shared[(gyro, axis)].abs() * root > negligible;
        let of = match column.axes() {
            Some(axes) if !axes.into_iter().flatten().any(is_shared) => Estimate::Likeliest,
            _ => Estimate::Independent,
        };
        Self { column, of }
    }

    /// Column of [`Estimate::Independent`].
    pub fn independent(column: Column) -> Self {
        Self {
            column,
            of: Estimate::Independent,
        }
    }

    /// Column of a known effect.
    pub fn known(column: Column) -> Self {
        let of = match column {
            Column::Increment(_) | Column::Late(..) | Column::LowPass(..) | Column::Mount(..) => {
                Estimate::Measured
            }
            _ => Estimate::Likeliest,
        };
        Self { column, of }
    }

    /// Computes the values by row; zero if the recording lacks a channel of the column.
    pub fn values(self, signals: &Signals) -> Vec<f64> {
        match self.of {
            Estimate::Independent => self.column.of_motion(signals, &signals.independent),
            Estimate::Likeliest => self.column.of_motion(signals, &signals.likeliest),
            Estimate::Measured => {
                let likeliest = || self.column.of_motion(signals, &signals.likeliest);
                self.column.of_measured(signals).unwrap_or_else(likeliest)
            }
        }
    }

    /// Part of a linear effect that the shrinkage gate removes, to be subtracted from the residual; `None` for other
    /// columns. The reference's noise after a filter is retained: with a different noise spectrum in every set, noise
    /// would decide between sets.
    pub fn hidden(self, signals: &Signals) -> Option<Vec<f64>> {
        let is_filtered = match self.column {
            Column::Increment(_) => false,
            Column::Late(gyro, _) => {
                let path = signals.path;
                path.low_pass[gyro].is_some() || path.mount != [None; 3]
            }
            Column::LowPass(.., low_pass::Part::Response)
            | Column::Mount(.., resonance::Part::Response) => true,
            _ => return None,
        };
        let mut hidden = if is_filtered {
            self.column.of_motion(signals, &signals.likeliest)
        } else {
            self.column.of_measured(signals)?
        };
        add(&mut hidden, &self.values(signals), -1.0);
        Some(hidden)
    }
}

/// Sensed increments of a gyro after a linear system \[rad\], without the factor 1/(1 − s_i).
fn sensed_behind(
    motion: &CaseMotion,
    gyro: usize,
    signals: &Signals,
    response: impl Fn(f64) -> Complex64,
) -> Vec<f64> {
    let period_s = signals.period_s();
    let mut sum = vec![0.0; signals.rows];
    for axis in 0..3 {
        let along = signals.sensing_from_body[(gyro, axis)];
        if along != 0.0 {
            let part = motion.spectra[axis].through(|hz| response(hz) * along * period_s);
            add(&mut sum, &part, 1.0);
        }
    }
    sum
}

/// Increments about an axis after a linear system \[rad\].
fn increments_behind(
    motion: &CaseMotion,
    axis: usize,
    period_s: f64,
    response: impl Fn(f64) -> Complex64,
) -> Vec<f64> {
    motion.spectra[axis].through(|hz| response(hz) * period_s)
}

impl Column {
    /// Returns the listed column equal to an expression, if there is one: a listed effect takes its own name.
    pub fn of(expression: Expression) -> Option<Self> {
        use crate::expression::Channel::{
            Acceleration, DitherRate, Field, Force, Rate, Warming, WarmingRate,
        };
        use crate::expression::Factor::{Channel as Of, Size};
        match expression.parts() {
            [Some(Of(one)), None, None] => match one {
                Rate(axis) => Some(Self::Increment(axis)),
                Acceleration(axis) => Some(Self::Delay(axis)),
                Force(axis) => Some(Self::Force(axis)),
                Warming(axis) => Some(Self::Warming(axis)),
                WarmingRate(axis) => Some(Self::WarmingRate(axis)),
                Field(axis) => Some(Self::Magnetic(axis)),
                DitherRate(axis) => Some(Self::Dither(axis)),
                _ => None,
            },
            [Some(Size(Rate(axis))), None, None] => Some(Self::Magnitude(axis)),
            [Some(Of(a)), Some(Of(b)), None] => match (a, b) {
                (Rate(a), Rate(b)) if a == b => Some(Self::Square(a)),
                (Force(a), Force(b)) if a == b => Some(Self::ForceSquare(a)),
                (Rate(senses), Acceleration(about)) | (Acceleration(about), Rate(senses)) => {
                    Some(Self::Flexure(about, senses))
                }
                (Rate(a), Force(b)) | (Force(b), Rate(a)) if a == b => {
                    Some(Self::ForceTimesIncrement(a))
                }
                (Rate(with), Warming(of)) | (Warming(of), Rate(with)) => {
                    Some(Self::WarmingTimesIncrement(of, with))
                }
                _ => None,
            },
            [Some(Of(Rate(a))), Some(Of(Rate(b))), Some(Of(Rate(c)))] if a == b && b == c => {
                Some(Self::Cube(a))
            }
            _ => None,
        }
    }

    /// True if the recording has the channels of the column.
    pub fn is_available(self, signals: &Signals) -> bool {
        use Column::{
            Dither, DitherBeyond, DitherCube, DitherDelay, Force, ForceRate, ForceSquare,
            ForceTimesIncrement, Magnetic, OffVertical, Warming, WarmingRate,
            WarmingTimesIncrement,
        };
        let varies = |triad: &Option<Triad>, axis: usize| {
            triad
                .as_ref()
                .is_some_and(|triad| triad[axis].iter().any(|value| *value != triad[axis][0]))
        };
        match self {
            Force(axis) | ForceSquare(axis) | ForceTimesIncrement(axis) => signals
                .force_m_s2
                .as_ref()
                .is_some_and(|triad| triad[axis].iter().any(|value| *value != 0.0)),
            ForceRate(axis) => varies(&signals.force_m_s2, axis),
            Warming(axis) | WarmingRate(axis) | WarmingTimesIncrement(axis, _) => {
                varies(&signals.warming_k, axis)
            }
            Magnetic(axis) => varies(&signals.magnetic_t, axis),
            OffVertical(axis) => varies(&signals.off_vertical, axis),
            Dither(_) | DitherDelay(..) | DitherBeyond(..) | DitherCube(_) => {
                signals.dither_rad.is_some()
            }
            Column::Expression(expression) => {
                expression.values(signals, &signals.independent).is_some()
            }
            _ => true,
        }
    }

    /// Axes of the motion in the column, for motion that gyros of other axes may not share.
    fn axes(self) -> Option<[Option<usize>; 3]> {
        match self {
            Self::Increment(axis)
            | Self::Delay(axis)
            | Self::Jerk(axis)
            | Self::Magnitude(axis)
            | Self::Square(axis)
            | Self::Cube(axis)
            | Self::ForceTimesIncrement(axis)
            | Self::WarmingTimesIncrement(_, axis) => Some([Some(axis), None, None]),
            Self::Flexure(about, senses)
            | Self::CubicFlexure(about, senses)
            | Self::ResonantFlexure(about, senses, ..) => Some([Some(about), Some(senses), None]),
            Self::Expression(expression) => expression.axes(),
            _ => None,
        }
    }

    /// Computes the values by row from [`Estimate::Independent`].
    pub fn values(self, signals: &Signals) -> Vec<f64> {
        self.of_motion(signals, &signals.independent)
    }

    /// Applies a linear effect to the measured reference \[rad\]: each part of the path after its predecessors (mount,
    /// low pass, delay), so that all parts together are the path; a part that is not on the path after the whole path.
    /// `None` for other columns.
    fn of_measured(self, signals: &Signals) -> Option<Vec<f64>> {
        let (path, rate_hz) = (signals.path, signals.rate_hz);
        let reference_rad = &*signals.measured_rad;
        match self {
            Self::Increment(axis) => {
                Some(path.along(axis, &reference_rad[axis], rate_hz).into_owned())
            }
            Self::Mount(axis, mount, part @ resonance::Part::Response) => {
                let before = |hz| match path.mount[axis] {
                    Some(_) => Complex64::ONE,
                    None => path.response(axis, hz),
                };
                let beyond = |hz| mount.beyond_mount(hz, part) * before(hz);
                Some(Path::through(&reference_rad[axis], rate_hz, beyond))
            }
            Self::LowPass(gyro, low_pass, part @ low_pass::Part::Response) => {
                let sensed = signals.measured_along_rad(gyro);
                let before = |hz| match path.low_pass[gyro] {
                    Some(_) => Complex64::ONE,
                    None => late(path.delay_s[gyro], hz),
                };
                let beyond = |hz| low_pass.beyond(hz, part) * before(hz);
                Some(Path::through(&sensed, rate_hz, beyond))
            }
            Self::Late(gyro, delay_s) => {
                let sensed = signals.measured_along_rad(gyro);
                let before = |hz| path.low_pass[gyro].map_or(Complex64::ONE, |one| one.whole(hz));
                let beyond = |hz| (late(delay_s, hz) - 1.0) * before(hz);
                Some(Path::through(&sensed, rate_hz, beyond))
            }
            _ => None,
        }
    }

    /// Computes the values by row from one estimate of the motion.
    fn of_motion(self, signals: &Signals, motion: &CaseMotion) -> Vec<f64> {
        let period = signals.period_s();
        let rows = signals.rows;
        let scaled = |values: &[f64], factor: f64| -> Vec<f64> {
            values.iter().map(|value| value * factor).collect()
        };
        let of_rate = |law: &dyn Fn(f64) -> f64, axis: usize| {
            let at_middles: Vec<f64> = motion.rate_rad_s[axis]
                .iter()
                .map(|rate| law(*rate))
                .collect();
            scaled(&row_means(&at_middles), period)
        };
        let product =
            |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
        let channel = |triad: &Option<Triad>, law: &dyn Fn(&[f64]) -> Vec<f64>, axis: usize| {
            triad
                .as_ref()
                .map_or_else(|| vec![0.0; rows], |triad| law(&triad[axis]))
        };
        match self {
            Self::Constant => vec![period; rows],
            Self::Increment(axis) => motion.case_rad[axis].clone(),
            Self::Delay(axis) => scaled(&motion.spectra[axis].mean_derivative(1), period),
            Self::Jerk(axis) => scaled(&motion.spectra[axis].mean_derivative(2), period),
            Self::Magnitude(axis) => of_rate(&f64::abs, axis),
            Self::Square(axis) => of_rate(&|rate| rate * rate, axis),
            Self::Cube(axis) => of_rate(&|rate| rate.powi(3), axis),
            Self::Flexure(about, senses) => {
                let at_middles = product(
                    &motion.acceleration_rad_s2[about],
                    &motion.rate_rad_s[senses],
                );
                scaled(&row_means(&at_middles), period)
            }
            Self::CubicFlexure(about, senses) => {
                let cubes: Vec<f64> = motion.acceleration_rad_s2[about]
                    .iter()
                    .map(|alpha| alpha.powi(3))
                    .collect();
                scaled(
                    &row_means(&product(&cubes, &motion.rate_rad_s[senses])),
                    period,
                )
            }
            Self::Force(axis) => channel(&signals.force_m_s2, &|force| scaled(force, period), axis),
            Self::ForceSquare(axis) => channel(
                &signals.force_m_s2,
                &|force| scaled(&product(force, force), period),
                axis,
            ),
            Self::ForceRate(axis) => channel(
                &signals.force_m_s2,
                &|force| {
                    scaled(
                        &Spectrum::new(force, signals.rate_hz).mean_derivative(1),
                        period,
                    )
                },
                axis,
            ),
            Self::ForceTimesIncrement(axis) => channel(
                &signals.force_m_s2,
                &|force| product(force, &motion.case_rad[axis]),
                axis,
            ),
            Self::Warming(axis) => {
                channel(&signals.warming_k, &|warming| scaled(warming, period), axis)
            }
            Self::WarmingRate(axis) => channel(
                &signals.warming_k,
                &|warming| {
                    scaled(
                        &Spectrum::new(warming, signals.rate_hz).mean_derivative(1),
                        period,
                    )
                },
                axis,
            ),
            Self::WarmingTimesIncrement(of, with) => channel(
                &signals.warming_k,
                &|warming| product(warming, &motion.case_rad[with]),
                of,
            ),
            Self::Magnetic(axis) => {
                channel(&signals.magnetic_t, &|field| scaled(field, period), axis)
            }
            Self::OffVertical(axis) => {
                channel(&signals.off_vertical, &|off| scaled(off, period), axis)
            }
            Self::Dither(axis) => channel(&signals.dither_rad, &<[f64]>::to_vec, axis),
            Self::DitherDelay(axis, late_s) => channel(
                &signals.dither_rad,
                &|dither| {
                    let slope = |hz: f64| Complex64::new(0.0, TAU * hz) * late(-late_s, hz);
                    Spectrum::new(dither, signals.rate_hz).through(slope)
                },
                axis,
            ),
            Self::DitherBeyond(axis, known_s, found_s) => channel(
                &signals.dither_rad,
                &|dither| {
                    let beyond = |hz: f64| {
                        let slope = Complex64::new(1.0, -TAU * hz * found_s);
                        late(-known_s - found_s, hz) * slope - late(-known_s, hz)
                    };
                    Spectrum::new(dither, signals.rate_hz).through(beyond)
                },
                axis,
            ),
            Self::DitherCube(axis) => channel(
                &signals.pickoff_rad,
                &|angle| {
                    let mut before = angle[0].powi(3);
                    angle
                        .iter()
                        .map(|angle| {
                            let cube = angle.powi(3);
                            let increment = cube - before;
                            before = cube;
                            increment
                        })
                        .collect()
                },
                axis,
            ),
            Self::SpaceVector(at_start, axis) => {
                scaled(&signals.space_vector(at_start, axis), period)
            }
            Self::ResonantFlexure(about, senses, resonance, part) => {
                let acceleration = motion.spectra[about]
                    .middle_derivative_behind(1, |hz| resonance.suspension(hz, part));
                let at_middles = product(&acceleration, &motion.rate_rad_s[senses]);
                scaled(&row_means(&at_middles), period)
            }
            // The motion is after the path: the response of a part already on the path is divided out.
            Self::Mount(axis, mount, part) => {
                let on_path = signals.path.mount[axis];
                increments_behind(motion, axis, period, |hz| {
                    let before = on_path.map_or(Complex64::ONE, |one| one.whole(hz));
                    mount.beyond_mount(hz, part) / before
                })
            }
            Self::LowPass(gyro, low_pass, part) => {
                let on_path = signals.path.low_pass[gyro];
                sensed_behind(motion, gyro, signals, |hz| {
                    let before = on_path.map_or(Complex64::ONE, |one| one.whole(hz));
                    low_pass.beyond(hz, part) / before
                })
            }
            Self::HighPass(gyro, high_pass, part) => {
                let sensed_rad = sensed_behind(motion, gyro, signals, |_| Complex64::ONE);
                high_pass.beyond(&sensed_rad, period, part)
            }
            Self::Late(gyro, delay_s) => {
                sensed_behind(motion, gyro, signals, |hz| 1.0 - late(-delay_s, hz))
            }
            Self::LockIn(gyro, threshold, part) => {
                threshold.increments(gyro, part, signals, motion)
            }
            Self::Wave(axis, order, is_cosine) => {
                let wave = |angle: f64| {
                    let turn = f64::from(order) * angle;
                    if is_cosine { turn.cos() } else { turn.sin() }
                };
                let mut angle = 0.0;
                let mut before = wave(angle);
                let reference_rad =
                    signals
                        .path
                        .before(axis, &motion.case_rad[axis], signals.rate_hz);
                let increments = reference_rad.iter().map(|increment| {
                    angle += increment;
                    let now = wave(angle);
                    let turned = now - before;
                    before = now;
                    turned
                });
                increments.collect()
            }
            Self::Expression(expression) => expression
                .values(signals, motion)
                .unwrap_or_else(|| vec![0.0; rows]),
            Self::Impulse(row) => {
                let mut values = vec![0.0; rows];
                values[row] = 1.0;
                values
            }
            Self::Step(row) => {
                let mut values = vec![0.0; rows];
                values[row..].fill(period);
                values
            }
        }
    }
}
