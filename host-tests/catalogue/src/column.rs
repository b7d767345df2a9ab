//! Design columns: effect of a unit parameter on a sensed increment, before 1/(1 − s_i). Their values: `sensed`.

use crate::expression::Expression;
use crate::high_pass::{self, HighPass};
use crate::lock_in::{self, Threshold};
use crate::low_pass::{self, LowPass};
use crate::resonance::{Part, Resonance};
use crate::signals::{Signals, Triad};

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
    pub(crate) fn axes(self) -> Option<[Option<usize>; 3]> {
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
}
