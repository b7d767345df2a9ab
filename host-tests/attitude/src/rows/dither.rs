//! Effect of the blocks' dither on the motion measured by their gyros.

use nalgebra::{SMatrix, SVector, Vector3};
use rlg_model::Model;
use rlg_signal::streams::Streams;

/// Dither of the three blocks relative to the case.
pub struct Dither {
    /// Turn of each block over each row, from its pickoff at the model's gain \[rad\].
    turn_rad: Vec<Vector3<f64>>,
    /// Angle of each block at the middle of each row \[rad\].
    angle_rad: Vec<Vector3<f64>>,
}

/// Number of regressors: turns and angles of three blocks.
const COLUMNS: usize = 6;

impl Dither {
    /// Reads the pickoffs; `None` for gyros without any.
    pub fn new(streams: &Streams, model: &Model) -> Option<Self> {
        let pickoff = streams.pickoff_rad.as_ref()?;
        let of_rows = |of: &dyn Fn(f64, f64) -> f64| -> Vec<Vector3<f64>> {
            let row = |row: usize| {
                Vector3::from_fn(|axis, _| {
                    let [before, after] = [row, row + 1].map(|end| pickoff[axis][end]);
                    model.pickoff_gain(axis) * of(before, after)
                })
            };
            (0..streams.rows).map(row).collect()
        };
        Some(Self {
            turn_rad: of_rows(&|before, after| after - before),
            angle_rad: of_rows(&|before, after| 0.5 * (before + after)),
        })
    }

    /// Turn of each block over a row \[rad\].
    pub fn turn_rad(&self, row: usize) -> Vector3<f64> {
        self.turn_rad[row]
    }

    /// Fits the residual dither of increments, linear in the dithers' angles and turns \[rad by row\]: residues of a wrong
    /// gain or a delayed pickoff are not motion, and their derivative would explain itself. Least squares on second
    /// differences, in which the case hardly moves.
    ///
    /// # Inputs
    /// `lost_before`: cumulative number of unmeasured rows at each row boundary.
    pub fn left_rad(
        &self,
        increments_rad: &[Vector3<f64>],
        lost_before: &[usize],
    ) -> Vec<Vector3<f64>> {
        let column = |row: usize| {
            SVector::<f64, COLUMNS>::from_fn(|k, _| match k < 3 {
                true => self.turn_rad[row][k],
                false => self.angle_rad[row][k - 3],
            })
        };
        let mut gram = SMatrix::<f64, COLUMNS, COLUMNS>::zeros();
        let mut moments = SMatrix::<f64, COLUMNS, 3>::zeros();
        let rows = increments_rad.len();
        let is_measured = |row: usize| lost_before[row + 2] == lost_before[row - 1];
        for row in (1..rows.saturating_sub(1)).filter(|row| is_measured(*row)) {
            let [before, now, after] = [row - 1, row, row + 1];
            let bent = column(before) - column(now) * 2.0 + column(after);
            let moved = increments_rad[before] - increments_rad[now] * 2.0 + increments_rad[after];
            gram += bent * bent.transpose();
            moments += bent * moved.transpose();
        }
        let sizes = gram
            .try_inverse()
            .map_or_else(SMatrix::zeros, |inverse| inverse * moments);
        (0..rows).map(|row| sizes.tr_mul(&column(row))).collect()
    }
}
