//! Delays of single gyros beyond the delay that all share with the reference.

use nalgebra::{DMatrix, DVector};

use crate::gyros::gyro_times::{KIND, Late};
use crate::registration::gauss_newton::Registration;
use crate::rows::alignment::places;
use crate::selection::search::Found;

/// Delays of single gyros, by what was found: of each gyro its own delay, its low pass and the reference's delay together, less the
/// median of the three, which all share. `None` where no gyro is late by itself, whether by a delay or by a low pass.
///
/// # Inputs
/// `followed`: axis of the registration that each gyro follows; `shown`: least delay, in standard deviations.
pub(crate) fn of(
    found: &Found,
    registered: &Registration,
    followed: [usize; 3],
    shown: f64,
) -> Option<Late> {
    let named = found.physics.iter().find(|one| one.kind == KIND);
    let poles = registered
        .alignment
        .low_pass_s
        .map(|_| places("gyro_bandwidth"));
    if named.is_none() && poles.is_none() {
        return None;
    }
    let at = |place: usize| found.named_set.iter().position(|one| *one == place);
    // Delay of each gyro as a sum of estimates; the mean of the gyros' own delays is the reference's.
    let mut sums = DMatrix::zeros(3, found.named_set.len());
    for gyro in 0..3 {
        let own = named.map_or(&[][..], |named| &named.places);
        for (other, place) in own.iter().enumerate() {
            sums[(gyro, at(*place)?)] = f64::from(u8::from(other == gyro)) - 1.0 / 3.0;
        }
        if let Some(at) = poles
            .as_ref()
            .and_then(|poles| at(poles.start + followed[gyro]))
        {
            sums[(gyro, at)] = 1.0;
        }
        if let Some(at) = at(places("reference_delay").start) {
            sums[(gyro, at)] = -1.0;
        }
    }
    let late_s = &sums * DVector::from_column_slice(&found.of_named.values);
    let covariance = &sums * &found.of_named.covariance * sums.transpose();
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| late_s[*a].total_cmp(&late_s[*b]));
    let middle = order[1];
    let mut late = Late::default();
    for gyro in (0..3).filter(|gyro| *gyro != middle) {
        let beyond_s = late_s[gyro] - late_s[middle];
        let variance = covariance[(gyro, gyro)] + covariance[(middle, middle)]
            - 2.0 * covariance[(gyro, middle)];
        let std_s = variance.max(0.0).sqrt();
        late.stds_s[gyro] = std_s;
        if beyond_s.abs() > shown * std_s {
            late.values_s[gyro] = beyond_s;
        }
    }
    (late.values_s != [0.0; 3]).then_some(late)
}
