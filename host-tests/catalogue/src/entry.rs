//! A row of the catalogue: an effect, its action on the gyros and the prior of its size.

use rlg_inference::Bound;

use crate::column::Column;

/// Action of an effect's parameters on the gyros.
#[derive(Clone, Copy)]
pub enum Law {
    /// Parameter i acts on gyro i alone: columns with factors.
    Axes(fn(usize) -> Vec<(Column, f64)>),
    /// One parameter for all gyros: columns of gyro i.
    Common(fn(usize) -> Vec<(Column, f64)>),
    /// Parameter ij tilts gyro i about body axis j: column of (i, j, the axis whose rate is then sensed), times the
    /// tilt's sign.
    Tilts(fn(usize, usize, usize) -> Column, f64),
    /// Parameter ij adds column j to gyro i.
    Nine(fn(usize) -> Column),
    /// Parameter ij, i ≠ j, adds column j to gyro i.
    Across(fn(usize) -> Column),
    /// Parameter i adds to the case's rate along body axis k, on every gyro through the installation.
    Body(fn(usize, usize) -> Vec<(Column, f64)>),
}

/// Prior of the size of an entry's parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// Standard deviation of the prior about 0, in the entry's unit: no unit under test exceeds it by much.
    pub largest: f64,
    /// Typical size in an uncompensated navigation-grade ring-laser gyro, to an order of magnitude.
    pub typical: f64,
    /// The parameter is at least 0: a square, or a rate of decay.
    pub is_positive: bool,
}

impl Size {
    pub(crate) const fn of(typical: f64, largest: f64) -> Self {
        Self {
            typical,
            largest,
            is_positive: false,
        }
    }

    pub(crate) const fn positive(typical: f64, largest: f64) -> Self {
        Self {
            typical,
            largest,
            is_positive: true,
        }
    }

    /// Bound of the search.
    pub fn bound(self) -> Bound {
        let least = if self.is_positive {
            0.0
        } else {
            f64::NEG_INFINITY
        };
        Bound {
            std: self.largest,
            range: [least, f64::INFINITY],
        }
    }
}

/// One effect.
pub struct Entry {
    /// The contract's kind.
    pub kind: &'static str,
    /// Its equation.
    pub equation: &'static str,
    /// Unit of its parameters.
    pub unit: &'static str,
    /// Prior of their size.
    pub size: Size,
    /// Action on the gyros.
    pub law: Law,
    /// The effect is an everyday error, a priori three times likelier than others.
    pub everyday: bool,
    /// Meaning, for a navigation engineer.
    pub meaning: &'static str,
    /// Motion that makes it most observable.
    pub experiment: &'static str,
}

/// Sign and axis k of a tilt δ of gyro `axis` about `about`, which then senses sign · δ · ω_k (physics §1).
pub fn tilt(axis: usize, about: usize) -> (f64, usize) {
    let sign = if (about + 1) % 3 == axis { 1.0 } else { -1.0 };
    (sign, 3 - axis - about)
}
