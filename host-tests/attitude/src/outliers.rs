//! Errors of single stamps, and jumps between two, by what noise makes of them.
//!
//! With w = S⁻¹ times the rows, the best estimate of a jump in row k is w_k / mean(1/S), of an error e of one stamp (+e in the
//! row before it, −e in the row after) (w_{k−1} − w_k) / mean(λ/S). (inference.md, B5.)

use rlg_signal::axes::Triad;

use crate::equations::Band;
use crate::noise::{Alike, Levels, NoiseTerms};

/// Median of χ² with three degrees of freedom.
pub(crate) const MEDIAN_CHI_SQUARED: f64 = 2.366;

/// Rows divided by the noise's power, and what a number of them weighs.
pub struct Weighted {
    rows: Triad,
    alike: Alike,
    /// By axis.
    jump_information: [f64; 3],
    stamp_information: [f64; 3],
}

impl Weighted {
    /// # Inputs
    /// `left_rad`: rows less all that is fitted; `levels`: of the noise.
    pub fn new(band: &Band, terms: &NoiseTerms, left_rad: &Triad, levels: &Levels) -> Self {
        let powers = [0, 1, 2].map(|axis| terms.of_coefficients(levels.of(axis)));
        let mean = |axis: usize, of: &dyn Fn(f64) -> f64| {
            let pairs = terms.lambda.iter().zip(&powers[axis]);
            let sum: f64 = pairs.map(|(lambda, power)| of(*lambda) / power).sum();
            sum / powers[axis].len() as f64
        };
        Self {
            rows: [0, 1, 2].map(|axis: usize| band.divided(&left_rad[axis], &powers[axis])),
            alike: terms.alike,
            jump_information: [0, 1, 2].map(|axis| mean(axis, &|_| 1.0)),
            stamp_information: [0, 1, 2].map(|axis| mean(axis, &|lambda| lambda)),
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows[0].len()
    }

    /// Best estimate of a jump in a row \[rad\].
    pub fn jump_rad(&self, row: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis: usize| self.rows[axis][row] / self.jump_information[axis])
    }

    /// Standard deviation of each of its numbers \[rad\].
    pub fn jump_std_rad(&self) -> [f64; 3] {
        self.jump_information
            .map(|information| information.powf(-0.5))
    }

    /// Squared size of a jump in a row, in standard deviations.
    pub fn of_jump(&self, row: usize) -> f64 {
        self.squared(self.jump_rad(row), self.jump_information)
    }

    /// Best estimate of the error of a stamp, between the rows before and after \[rad\].
    fn stamp_rad(&self, stamp: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis: usize| {
            let of_row = |row: Option<usize>| row.and_then(|row| self.rows[axis].get(row));
            let grown = of_row(stamp.checked_sub(1)).unwrap_or(&0.0);
            let shrunk = of_row(Some(stamp)).unwrap_or(&0.0);
            (grown - shrunk) / self.stamp_information[axis]
        })
    }

    /// Squared size of the error of a stamp, in standard deviations.
    pub fn of_stamp(&self, stamp: usize) -> f64 {
        self.squared(self.stamp_rad(stamp), self.stamp_information)
    }

    /// Squared size in standard deviations.
    fn squared(&self, vector: [f64; 3], information: [f64; 3]) -> f64 {
        let of_group = |axes: &&[usize]| {
            let sum: f64 = axes.iter().map(|&axis| vector[axis] * vector[axis]).sum();
            sum * information[axes[0]]
        };
        self.alike.iter().map(of_group).sum()
    }

    /// Errors of single stamps beyond four standard deviations, by how much they exceed those \[rad\]; one more than rows.
    pub fn outliers_rad(&self) -> Triad {
        /// Beyond this many standard deviations a stamp is no longer noise.
        const BEYOND: f64 = 4.0;
        let mut errors: Triad = std::array::from_fn(|_| vec![0.0; self.rows() + 1]);
        for stamp in 1..self.rows() {
            let size = (self.of_stamp(stamp) / 3.0).sqrt();
            if size > BEYOND {
                for (errors, error) in errors.iter_mut().zip(self.stamp_rad(stamp)) {
                    errors[stamp] = error * (1.0 - BEYOND / size);
                }
            }
        }
        errors
    }
}
