//! Lines of the gyros that the attitudes do not have, taken out before anything is aligned: a filter would follow them.

use std::borrow::Cow;

use nalgebra::Vector3;
use rlg_signal::axes::Triad;
use rlg_signal::own_lines::{OwnLine, OwnLinesPlan, find};

use crate::about::Gyros;
use crate::channels;
use crate::observed::Observed;

/// Finds lines on the stamps that are fitted.
pub(crate) fn of(observed: &Observed, plan: &OwnLinesPlan) -> Vec<OwnLine> {
    let Observed {
        gyros,
        samples,
        streams,
        stamps,
        ..
    } = observed;
    let Some(reference_hz) = channels::readings_hz(samples) else {
        return Vec::new();
    };
    let rows = channels::reference_rows(samples, streams);
    let of_gyros: Triad = std::array::from_fn(|axis| {
        let each = gyros.sensed_rad.iter();
        each.map(|row| row[axis]).collect()
    });
    let pairs = streams.usable.iter().zip(&rows.doubtful);
    let mut seen: Vec<bool> = pairs
        .map(|(usable, doubtful)| *usable && !doubtful)
        .collect();
    let row_of = |time_s: f64| (time_s - gyros.start_s) * gyros.rate_hz;
    let mut is_fitted = vec![false; seen.len()];
    for pair in samples.windows(2).enumerate() {
        let (stamp, [from, to]) = (pair.0, [0, 1].map(|k: usize| row_of(pair.1[k].time_s)));
        if !stamps.left_out[stamp] && !stamps.left_out[stamp + 1] {
            let last = (to.ceil().max(0.0) as usize).min(seen.len());
            is_fitted[(from.max(0.0) as usize).min(last)..last].fill(true);
        }
    }
    for (seen, fitted) in seen.iter_mut().zip(is_fitted) {
        *seen &= fitted;
    }
    let force = streams.force_m_s2.as_ref();
    let others: Vec<&Triad> = std::iter::once(&rows.increments_rad).chain(force).collect();
    find(
        &of_gyros,
        &others,
        &seen,
        (gyros.rate_hz, reference_hz),
        plan,
    )
}

impl Observed<'_> {
    /// Takes lines out of the gyros.
    pub(crate) fn take_lines(&mut self, lines: Vec<OwnLine>) {
        add(&mut self.gyros, &lines, -1.0);
        self.lines = lines;
    }

    /// Gyros with the lines that were taken out of them.
    pub(crate) fn gyros_with_lines(&self) -> Cow<'_, Gyros> {
        let mut gyros = Cow::Borrowed(&self.gyros);
        if !self.lines.is_empty() {
            add(gyros.to_mut(), &self.lines, 1.0);
        }
        gyros
    }
}

/// Adds lines to what the gyros sensed, times a sign.
fn add(gyros: &mut Gyros, lines: &[OwnLine], sign: f64) {
    let rows = gyros.sensed_rad.len();
    for line in lines {
        let [x, y, z] = line.rows_rad(rows, gyros.rate_hz);
        for (row, sensed) in gyros.sensed_rad.iter_mut().enumerate() {
            *sensed += sign * Vector3::new(x[row], y[row], z[row]);
        }
    }
}
