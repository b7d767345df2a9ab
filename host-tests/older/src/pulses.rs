//! What counting in whole pulses leaves in step with the dither.
//!
//! A counter reports ⌊u/q⌋ of the sensed angle u. Over many pulses of motion its error is white noise of angle, q²/12. On
//! an axis that stands still but for its dither of amplitude A it is not: the error has a part in step with the
//! dither, in its first harmonic Σ_n (2q/πn) J₁(2πnA/q) cos(2πn u₀/q) for a mean angle u₀, which reads as a wrong
//! pickoff gain of a few parts in 1e4, and in its third, which reads as a cubic one. Fitted as white, it is an effect
//! at many deviations in a recording that has none.
//!
//! Enters: the bench with a first noise, the channels. Leaves: for each gyro the combinations of dither columns
//! that its counter excites by more than white noise does, each in units of what it excites: nuisances of unit
//! prior width (information.rs). The model's own angle, with the slow part of what the gyro sensed beyond it, is counted
//! from mean angles all over one pulse; how these project onto the columns gives the covariance.
//!
//! Left out: the noise of the pickoff, which blurs the pulses; projections without joints.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::columns;
use super::hypotheses::{find, no_effects};
use super::information::Nuisance;
use super::portion::Bins;
use super::regressor::{Regressor, gram};
use super::streams::Streams;
use super::workbench::{Parameters, Workbench};

/// Kinds whose columns are in step with a gyro's own dither.
const IN_STEP: [&str; 3] = ["dither_gain", "dither_delay", "dither_cubic"];

/// Mean angles, evenly over one pulse.
const MEAN_ANGLES: usize = 24;

/// A white error's largest share comes this far above one, of three among so many draws, once in 1e4.
const EXCITED: f64 = 2.5;

/// What is sensed beyond the model is averaged over this long \[s\]: some dozen cycles of the dither.
const AVERAGE_S: f64 = 0.05;

/// The nuisances of each gyro; none where it does not count, or nothing dithers.
pub fn in_step(bench: &Workbench, parameters: &Parameters) -> [Vec<Nuisance>; 3] {
    let streams = &bench.scene().streams;
    if streams.pickoff_rad.is_none() {
        return Default::default();
    }
    let kinds: Vec<usize> = IN_STEP
        .iter()
        .filter_map(|kind| find(kind).map(|(effect, _)| effect))
        .collect();
    let portion = &bench.portion;
    let columns = columns::make(bench.scene(), parameters, portion, &kinds, &no_effects());
    [0, 1, 2].map(|axis| {
        let pulse_rad = streams.pulse_rad[axis];
        let own: Vec<&Regressor> = columns::on(&columns, axis)
            .map(|column| &column.bins)
            .collect();
        if pulse_rad <= 0.0 || own.is_empty() {
            return Vec::new();
        }
        let weights = bench.noise[axis].weights(portion);
        let angle_rad = sensed_angle_rad(streams, &bench.residual_rad()[axis], axis);
        let filters: Vec<Vec<f64>> = own
            .iter()
            .map(|column| {
                let bins = column.to_bins();
                let whitened: Bins = bins.iter().zip(&weights).map(|(b, w)| b * *w).collect();
                portion.rows_of(&whitened)
            })
            .collect();
        let rights: Vec<DVector<f64>> = (0..MEAN_ANGLES)
            .into_par_iter()
            .map(|k| {
                let mean_rad = pulse_rad * k as f64 / MEAN_ANGLES as f64;
                let error = |angle: &f64| {
                    let angle = angle + mean_rad;
                    pulse_rad * (angle / pulse_rad).floor() - angle
                };
                let error_rad: Vec<f64> = angle_rad.iter().map(error).collect();
                let step_rad = |row: usize| error_rad[row + 1] - error_rad[row];
                DVector::from_iterator(
                    own.len(),
                    filters.iter().map(|filter| {
                        let rows = portion.ranges.iter().flat_map(Clone::clone);
                        rows.zip(filter).map(|(row, h)| h * step_rad(row)).sum()
                    }),
                )
            })
            .collect();
        let bins = own[0].to_bins();
        let fisher = gram(&own, &bins, &weights);
        excited(
            &fisher.view((0, 0), (own.len(), own.len())).into_owned(),
            &rights,
        )
        .iter()
        .map(|sizes| {
            let mut sum: Bins = vec![Default::default(); bins.len()];
            for (column, size) in own.iter().zip(sizes) {
                column.add_to(&mut sum, *size);
            }
            Nuisance::of_unit_width(Regressor::new(&sum))
        })
        .collect()
    })
}

/// The angle of one gyro at the rows' ends, one before the first row in front: what the model says it senses, and
/// slowly what it sensed beyond that.
fn sensed_angle_rad(streams: &Streams, residual_rad: &[f64], axis: usize) -> Vec<f64> {
    let rows = streams.rows;
    let mut beyond_rad = vec![0.0; rows + 1];
    let mut modelled_rad = vec![0.0; rows + 1];
    for row in 0..rows {
        let residual = residual_rad[row];
        let counted = if streams.usable[row] { residual } else { 0.0 };
        beyond_rad[row + 1] = beyond_rad[row] + counted;
        modelled_rad[row + 1] = modelled_rad[row] + streams.sensed_rad[axis][row] - residual;
    }
    let half = (0.5 * AVERAGE_S * streams.rate_hz).round().max(1.0) as usize;
    let mut sums = vec![0.0; rows + 2];
    for (row, angle) in beyond_rad.iter().enumerate() {
        sums[row + 1] = sums[row] + angle;
    }
    modelled_rad
        .iter()
        .enumerate()
        .map(|(row, modelled)| {
            let (first, end) = (row.saturating_sub(half), (row + half).min(rows) + 1);
            modelled + (sums[end] - sums[first]) / (end - first) as f64
        })
        .collect()
}

/// Of columns with information `fisher` the combinations that the draws excite by more than noise of the modelled
/// level would, each scaled to what is beyond that level.
fn excited(fisher: &DMatrix<f64>, rights: &[DVector<f64>]) -> Vec<Vec<f64>> {
    let count = fisher.nrows();
    // Gain and cube of one dither are nearly one column: in units of each the root stays well scaled.
    let scale = DVector::from_fn(count, |a, _| {
        fisher[(a, a)].max(f64::MIN_POSITIVE).sqrt().recip()
    });
    let scaled = DMatrix::from_fn(count, count, |a, b| fisher[(a, b)] * scale[a] * scale[b]);
    let Some(root) = scaled.cholesky().map(|root| root.l()) else {
        return Vec::new();
    };
    let mut spread = DMatrix::zeros(count, count);
    for right in rights {
        let Some(white) = root.solve_lower_triangular(&right.component_mul(&scale)) else {
            return Vec::new();
        };
        spread += &white * white.transpose() / rights.len() as f64;
    }
    let shares = spread.symmetric_eigen();
    let directions = shares
        .eigenvalues
        .iter()
        .zip(shares.eigenvectors.column_iter());
    directions
        .filter(|(share, _)| **share > EXCITED)
        .filter_map(|(share, direction)| {
            let sizes = root
                .transpose()
                .solve_upper_triangular(&direction.into_owned())?;
            let width = (share - 1.0).sqrt();
            Some(
                sizes
                    .component_mul(&scale)
                    .iter()
                    .map(|size| size * width)
                    .collect(),
            )
        })
        .collect()
}
