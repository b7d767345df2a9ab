//! Estimates of errors of single stamps, and of jumps between two, by generalised least squares.
//!
//! With w = S⁻¹ times the rows, the generalised-least-squares estimate of a jump in row k is w_k / mean(1/S), of an error e
//! of one stamp (+e in the row before it, −e in the row after) (w_{k−1} − w_k) / mean(λ/S).

use rlg_plan::AttitudeOutlierPlan;
use rlg_signal::axes::Triad;

use crate::likelihood::equations::BandNoise;
use crate::likelihood::noise::{Alike, Levels};

/// Median of χ² with three degrees of freedom.
pub(crate) const MEDIAN_CHI_SQUARED: f64 = 2.366;

/// Rows divided by the noise's power, and the information on a jump and on a stamp's error.
pub struct Weighted {
    rows: Triad,
    /// Level of each row, by axis; `None` if constant.
    along: [Option<Vec<f64>>; 3],
    alike: Alike,
    /// Information by axis \[rad⁻²\].
    jump_information: [f64; 3],
    stamp_information: [f64; 3],
}

impl Weighted {
    /// # Inputs
    /// `left_rad`: residuals of rows bounded by `times_s`; `levels`: of the noise.
    pub fn new(
        BandNoise { band, terms }: &BandNoise,
        levels: &Levels,
        left_rad: &Triad,
        times_s: &[f64],
    ) -> Self {
        let powers = [0, 1, 2].map(|axis| terms.of_coefficients(levels.of(axis)));
        let mean = |axis: usize, of: &dyn Fn(f64) -> f64| {
            let pairs = terms.lambda.iter().zip(&powers[axis]);
            let sum: f64 = pairs.map(|(lambda, power)| of(*lambda) / power).sum();
            sum / powers[axis].len() as f64
        };
        let along = [0, 1, 2].map(|axis| levels.of_rows(axis, times_s));
        Self {
            rows: [0, 1, 2].map(|axis: usize| {
                let left = left_rad[axis].iter().enumerate();
                let level = |row: usize| along[axis].as_ref().map_or(1.0, |levels| levels[row]);
                let rows: Vec<f64> = left.map(|(row, left)| left / level(row)).collect();
                band.divided(&rows, &powers[axis])
            }),
            along,
            alike: terms.alike,
            jump_information: [0, 1, 2].map(|axis| mean(axis, &|_| 1.0)),
            stamp_information: [0, 1, 2].map(|axis| mean(axis, &|lambda| lambda)),
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows[0].len()
    }

    /// Level of a row, and of the stamp before it.
    fn level(&self, axis: usize, row: usize) -> f64 {
        let levels = self.along[axis].as_ref();
        levels.map_or(1.0, |levels| levels[row.min(levels.len() - 1)])
    }

    fn scaled(&self, values: [f64; 3], row: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis: usize| values[axis] * self.level(axis, row))
    }

    /// Best estimate of a jump in a row, by generalised least squares \[rad\].
    pub fn jump_rad(&self, row: usize) -> [f64; 3] {
        self.scaled(self.jump(row), row)
    }

    /// A jump in a row and its standard deviation by the information of that very row \[rad\]: the lowest coefficients carry
    /// much of it, and not alike in all rows.
    ///
    /// # Inputs
    /// `unit`: the same noise's weights of a unit in this row of each axis.
    pub fn exact_jump_rad(&self, unit: &Self, row: usize) -> [[f64; 2]; 3] {
        [0, 1, 2].map(|axis: usize| {
            let own = unit.rows[axis][row];
            [
                self.rows[axis][row] / own,
                (self.level(axis, row) / own).sqrt(),
            ]
        })
    }

    /// Estimates a jump in a row, in noise levels of that row.
    fn jump(&self, row: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis: usize| self.rows[axis][row] / self.jump_information[axis])
    }

    /// χ² statistic of a jump in a row.
    pub fn of_jump(&self, row: usize) -> f64 {
        self.squared(self.jump(row), self.jump_information)
    }

    /// Estimates the error of a stamp from the rows before and after, in levels of the noise there.
    fn stamp(&self, stamp: usize) -> [f64; 3] {
        [0, 1, 2].map(|axis: usize| {
            let of_row = |row: Option<usize>| row.and_then(|row| self.rows[axis].get(row));
            let grown = of_row(stamp.checked_sub(1)).unwrap_or(&0.0);
            let shrunk = of_row(Some(stamp)).unwrap_or(&0.0);
            (grown - shrunk) / self.stamp_information[axis]
        })
    }

    /// χ² statistic of the error of a stamp.
    pub fn of_stamp(&self, stamp: usize) -> f64 {
        self.squared(self.stamp(stamp), self.stamp_information)
    }

    /// χ² statistic of a vector with this information.
    fn squared(&self, vector: [f64; 3], information: [f64; 3]) -> f64 {
        let of_group = |axes: &&[usize]| {
            let sum: f64 = axes.iter().map(|&axis| vector[axis] * vector[axis]).sum();
            sum * information[axes[0]]
        };
        self.alike.iter().map(of_group).sum()
    }

    /// Excess of single-stamp errors over the threshold \[rad\], by stamp; one more than rows.
    pub fn outliers_rad(&self, plan: &AttitudeOutlierPlan) -> Triad {
        let mut errors: Triad = std::array::from_fn(|_| vec![0.0; self.rows() + 1]);
        for stamp in 1..self.rows() {
            let size = (self.of_stamp(stamp) / 3.0).sqrt();
            if size > plan.beyond {
                let errors_rad = self.scaled(self.stamp(stamp), stamp);
                for (errors, error) in errors.iter_mut().zip(errors_rad) {
                    errors[stamp] = error * (1.0 - plan.beyond / size);
                }
            }
        }
        errors
    }
}

#[cfg(test)]
mod tests {
    use rlg_plan::AttitudePlan;

    use super::Weighted;
    use crate::likelihood::equations::{Band, BandNoise};
    use crate::likelihood::noise::{Levels, NoiseTerms};

    #[test]
    fn a_jump_has_its_size_in_every_row() {
        const ROWS: usize = 400;
        const SIZE_RAD: f64 = 0.02;
        let plan = AttitudePlan::default();
        let band = Band::new(ROWS, 0.02, &plan.noise.band);
        let terms = NoiseTerms::new(ROWS, 0.02, band.cut, false, &plan.noise);
        let mut levels = vec![0.0; terms.count()];
        // White noise of the angle, far above the random walk.
        (levels[0], levels[1]) = (1e-12, 2.5e-7);
        let levels = Levels::of_all(levels);
        let noise = BandNoise { band, terms };
        let times_s: Vec<f64> = (0..=ROWS).map(|row| 0.02 * row as f64).collect();
        let weighted = |size: f64, row: usize| {
            let one = || {
                (0..ROWS)
                    .map(|own| if own == row { size } else { 0.0 })
                    .collect()
            };
            Weighted::new(&noise, &levels, &[one(), one(), one()], &times_s)
        };
        for row in [3, 130, 200, 397] {
            let found = weighted(SIZE_RAD, row).exact_jump_rad(&weighted(1.0, row), row);
            for [size, std] in found {
                assert!((size - SIZE_RAD).abs() < 1e-12, "{row}: {size}");
                assert!(std > 0.0 && std < 1e-3, "{row}: {std}");
            }
        }
    }
}
