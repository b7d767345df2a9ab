//! Effects on one gyro found by scans: a step of its bias, a spectral line, an expression in measured channels.

use nalgebra::Vector3;
use rlg_catalogue::entries::{STEP, UNLISTED};
use rlg_catalogue::expression::Factor;
use rlg_catalogue::{Candidate, Expression, Pool};
use rlg_signal::axes::Triad;

use crate::gyros::physics::Gyro;
use crate::rows::linearised_rows::About;

/// An effect on one gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scanned {
    /// Step of its bias.
    Step(Step),
    /// Sine and cosine of one frequency.
    Line(Wave),
    /// Expression in measured channels.
    Expression(OnGyro),
}

/// A step of one gyro's bias.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Index of the gyro.
    pub axis: usize,
    /// First row of the step.
    pub row: usize,
}

impl Step {
    /// Column of a step of 1 rad/s.
    pub(crate) fn column(&self, about: &About, gyro: &Gyro) -> Triad {
        about.carried(|row| gyro.sensed_along(self.axis, if row >= self.row { 1.0 } else { 0.0 }))
    }

    /// Contribution of a step of 1 rad/s to the gyros, in the case's axes \[rad by row\].
    pub(crate) fn in_case_rad(&self, gyro: &Gyro) -> Triad {
        let mut case: Triad = std::array::from_fn(|_| vec![0.0; gyro.signals.rows]);
        let sensed = gyro.sensed_along(self.axis, 1.0);
        for (values, sensed) in case.iter_mut().zip(&sensed) {
            values[self.row..].fill(*sensed);
        }
        case
    }
}

/// A spectral line of one gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// Index of the gyro.
    pub axis: usize,
    /// Frequency \[Hz\].
    pub hz: f64,
    /// Its standard deviation \[Hz\].
    pub hz_std: f64,
}

/// An expression on one gyro.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnGyro {
    /// Index of the gyro.
    pub axis: usize,
    /// The expression.
    pub expression: Expression,
}

impl OnGyro {
    /// The expression as a candidate over a pool of its own.
    pub(crate) fn candidate(&self, gyro: &Gyro) -> (Pool, Candidate) {
        let mut pool = Pool::default();
        let one = pool.expression(self.axis, self.expression, 1.0, &gyro.signals);
        (pool, one)
    }

    fn in_case_rad(&self, gyro: &Gyro) -> Triad {
        let (pool, one) = self.candidate(gyro);
        let terms = one.hypothesis.terms.iter();
        gyro.case_rad(&pool, terms.map(|term| (term, 1.0)))
    }
}

impl Wave {
    /// Sine and cosine.
    fn parts(&self) -> [OnGyro; 2] {
        [Factor::Sine(self.hz), Factor::Cosine(self.hz)].map(|wave| OnGyro {
            axis: self.axis,
            expression: Expression::of(&[wave]),
        })
    }
}

impl Scanned {
    /// Kind as named in the contract.
    pub(crate) fn kind(&self) -> &'static str {
        match self {
            Self::Step(_) => STEP,
            Self::Line(_) | Self::Expression(_) => UNLISTED,
        }
    }

    /// Index of the gyro.
    pub(crate) fn axis(&self) -> usize {
        match self {
            Self::Step(Step { axis, .. })
            | Self::Line(Wave { axis, .. })
            | Self::Expression(OnGyro { axis, .. }) => *axis,
        }
    }

    /// Contribution of each parameter to the gyros, in the case's axes \[rad by row\].
    pub(crate) fn in_case_rad(&self, gyro: &Gyro) -> Vec<Triad> {
        match self {
            Self::Step(step) => vec![step.in_case_rad(gyro)],
            Self::Line(line) => line
                .parts()
                .iter()
                .map(|one| one.in_case_rad(gyro))
                .collect(),
            Self::Expression(one) => vec![one.in_case_rad(gyro)],
        }
    }

    /// Column of each parameter.
    pub(crate) fn columns(&self, about: &About, gyro: &Gyro) -> Vec<Triad> {
        let each = self.in_case_rad(gyro);
        each.iter().map(|case| carried(case, about)).collect()
    }
}

/// Column of a contribution in the case's axes.
pub(crate) fn carried(case_rad: &Triad, about: &About) -> Triad {
    about.carried(|row| Vector3::from_fn(|axis, _| case_rad[axis][row]))
}
