//! Design columns: what a unit parameter adds to a sensed increment, before 1/(1 − s_i).

use realfft::num_complex::Complex64;
use rlg_signal::derivatives::{Spectrum, row_means};

use crate::expression::Expression;
use crate::lock_in::{self, Threshold};
use crate::low_pass::{self, LowPass};
use crate::resonance::{Part, Resonance};
use crate::signals::{Path, Signals, Triad};

/// One column, by what it is made of. Axes are 0, 1, 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Column {
    /// T \[s\].
    Constant,
    /// The case's increment \[rad\].
    Increment(usize),
    /// Its derivative \[rad/s\]; where a delay is known already, the secant of that delay.
    Delay(usize),
    /// The rate's second derivative times T.
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
    /// Warming of the first axis · increment of the second.
    WarmingTimesIncrement(usize, usize),
    /// B T.
    Magnetic(usize),
    /// The block's increment \[rad\].
    Dither(usize),
    /// Its derivative \[rad/s\].
    DitherDelay(usize),
    /// Increment of the pickoff angle's cube \[rad³\].
    DitherCube(usize),
    /// Component along the second axis of what lay along the first at the start, T.
    SpaceVector(usize, usize),
    /// α_about · ω_senses · T, α behind a resonant suspension; or its derivative by frequency or damping.
    ResonantFlexure(usize, usize, Resonance, Part),
    /// What a soft mount adds to the reference's increment \[rad\]; or its derivative.
    Mount(usize, Resonance, Part),
    /// What a low pass on a gyro's path adds to its increment \[rad\]; or its derivative by the time constant.
    LowPass(usize, LowPass, low_pass::Part),
    /// What lock-in adds to a gyro's increment \[rad\]; or its derivative by the threshold.
    LockIn(usize, Threshold, lock_in::Part),
    /// Increment of the cosine (true) or sine of the table's angle times an order.
    Wave(usize, u32, bool),
    /// An expression in measured channels · T.
    Expression(Expression),
    /// 1 in one row.
    Impulse(usize),
    /// T from a row on.
    Step(usize),
}

/// The reference's increments about an axis behind a path and a further system.
fn behind(
    path: Path,
    axis: usize,
    signals: &Signals,
    response: impl Fn(f64) -> Complex64,
) -> Vec<f64> {
    if path == signals.path {
        // Of rates, where increments are wanted.
        let period_s = signals.period_s();
        signals.spectra[axis].through(|hz| response(hz) * period_s)
    } else {
        let reference_rad = signals.reference_rad(axis);
        let behind_rad = path.along(axis, path.delay_s[axis], reference_rad, signals.rate_hz);
        Spectrum::new(&behind_rad, signals.rate_hz).through(response)
    }
}

impl Column {
    /// The column that an expression is, if it is one: an effect that is listed has its name.
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

    /// Whether the recording has what it is made of.
    pub fn is_available(self, signals: &Signals) -> bool {
        use Column::{
            Dither, DitherCube, DitherDelay, Force, ForceRate, ForceSquare, ForceTimesIncrement,
            Magnetic, Warming, WarmingRate, WarmingTimesIncrement,
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
            Dither(_) | DitherDelay(_) | DitherCube(_) => signals.dither_rad.is_some(),
            Column::Expression(expression) => expression.values(signals).is_some(),
            _ => true,
        }
    }

    /// Its values by row; zero where the recording lacks what it is made of.
    pub fn values(self, signals: &Signals) -> Vec<f64> {
        let period = signals.period_s();
        let rows = signals.rows;
        let scaled = |values: &[f64], factor: f64| -> Vec<f64> {
            values.iter().map(|value| value * factor).collect()
        };
        let of_rate = |law: &dyn Fn(f64) -> f64, axis: usize| {
            let at_middles: Vec<f64> = signals.rate_rad_s[axis]
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
            Self::Increment(axis) => signals.case_rad[axis].clone(),
            Self::Delay(axis) => {
                let delay = signals.path.delay_s[axis];
                if delay == 0.0 {
                    scaled(&signals.spectra[axis].mean_derivative(1), period)
                } else {
                    let reference = signals.reference_rad(axis);
                    let early = signals.path.along(axis, 0.0, reference, signals.rate_hz);
                    let pairs = early.iter().zip(&signals.case_rad[axis]);
                    pairs
                        .map(|(before, after)| (before - after) / delay)
                        .collect()
                }
            }
            Self::Jerk(axis) => scaled(&signals.spectra[axis].mean_derivative(2), period),
            Self::Magnitude(axis) => of_rate(&f64::abs, axis),
            Self::Square(axis) => of_rate(&|rate| rate * rate, axis),
            Self::Cube(axis) => of_rate(&|rate| rate.powi(3), axis),
            Self::Flexure(about, senses) => {
                let at_middles = product(
                    &signals.acceleration_rad_s2[about],
                    &signals.rate_rad_s[senses],
                );
                scaled(&row_means(&at_middles), period)
            }
            Self::CubicFlexure(about, senses) => {
                let cubes: Vec<f64> = signals.acceleration_rad_s2[about]
                    .iter()
                    .map(|alpha| alpha.powi(3))
                    .collect();
                scaled(
                    &row_means(&product(&cubes, &signals.rate_rad_s[senses])),
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
                &|force| product(force, &signals.case_rad[axis]),
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
                &|warming| product(warming, &signals.case_rad[with]),
                of,
            ),
            Self::Magnetic(axis) => {
                channel(&signals.magnetic_t, &|field| scaled(field, period), axis)
            }
            Self::Dither(axis) => channel(&signals.dither_rad, &<[f64]>::to_vec, axis),
            Self::DitherDelay(axis) => channel(
                &signals.dither_rad,
                &|dither| Spectrum::new(dither, signals.rate_hz).mean_derivative(1),
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
                let acceleration = signals.spectra[about]
                    .middle_derivative_behind(1, |hz| resonance.suspension(hz, part));
                let at_middles = product(&acceleration, &signals.rate_rad_s[senses]);
                scaled(&row_means(&at_middles), period)
            }
            Self::Mount(axis, resonance, part) => {
                let mut unmounted = signals.path;
                unmounted.mount[axis] = None;
                behind(unmounted, axis, signals, |hz| {
                    resonance.beyond_mount(hz, part)
                })
            }
            Self::LowPass(axis, low_pass, part) => {
                let mut unfiltered = signals.path;
                unfiltered.low_pass[axis] = None;
                behind(unfiltered, axis, signals, |hz| low_pass.beyond(hz, part))
            }
            Self::LockIn(gyro, threshold, part) => threshold.increments(gyro, part, signals),
            Self::Wave(axis, order, is_cosine) => {
                let wave = |angle: f64| {
                    let turn = f64::from(order) * angle;
                    if is_cosine { turn.cos() } else { turn.sin() }
                };
                let mut angle = 0.0;
                let mut before = wave(angle);
                let increments = signals.reference_rad(axis).iter().map(|increment| {
                    angle += increment;
                    let now = wave(angle);
                    let turned = now - before;
                    before = now;
                    turned
                });
                increments.collect()
            }
            Self::Expression(expression) => expression
                .values(signals)
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
