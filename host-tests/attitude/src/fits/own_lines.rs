//! Lines of the gyros that the attitudes do not have, taken out before anything is aligned: a filter would follow them.

use rlg_plan::OwnLinesPlan;
use std::borrow::Cow;

use nalgebra::Vector3;
use rlg_signal::axes::Triad;
use rlg_signal::own_lines::{OwnLine, find, of_motion};

use crate::gyros::channels;
use crate::gyros::gyro_times::{self, Late};
use crate::gyros::zeroing;
use crate::registration::observed::Observed;
use crate::rows::linearised_rows::Gyros;
use crate::selection::search::Scans;

impl Observed<'_> {
    /// Takes lines that are found in the rows that are `seen` out of the gyros, and keeps the frequencies of the motion's.
    ///
    /// # Inputs
    /// `reference_rad`: the reference's increments on the gyros' rows.
    pub(crate) fn take_lines(
        &mut self,
        (reference_rad, seen): (&Triad, &[bool]),
        plan: &OwnLinesPlan,
    ) {
        let Some(reference_hz) = channels::readings_hz(&self.samples) else {
            return;
        };
        let of_gyros: Triad = [0, 1, 2].map(|axis| self.gyros.along(axis));
        let others: Vec<&Triad> = std::iter::once(reference_rad)
            .chain(&self.streams.force_m_s2)
            .collect();
        let clocks = (self.gyros.rate_hz, reference_hz);
        let lines = find(&of_gyros, &others, seen, clocks, plan);
        self.occupied_hz = of_motion(&others, seen, clocks, plan);
        // The remainder of a line that was removed is no second line.
        self.occupied_hz.extend(lines.iter().map(|line| line.hz[0]));
        add(&mut self.gyros, &lines, -1.0);
        self.lines = lines;
    }

    /// Scans of the residual for effects outside the catalogue.
    pub(crate) fn scans(&self) -> Scans<'_> {
        let bin_hz = self.gyros.rate_hz / self.gyros.sensed_rad.len() as f64;
        let [first, about] = self.line_bins;
        Scans::All {
            least_hz: first as f64 * bin_hz,
            occupied_hz: &self.occupied_hz,
            about_hz: about as f64 * bin_hz,
        }
    }

    /// Gyros with the lines and the high passes that were found on them.
    pub(crate) fn gyros_as_read(&self) -> Cow<'_, Gyros> {
        let mut gyros = Cow::Borrowed(&self.gyros);
        if !self.lines.is_empty() {
            add(gyros.to_mut(), &self.lines, 1.0);
        }
        if self.zeroed != [None; 3] {
            zeroing::pass(gyros.to_mut(), zeroing::high_passes(&self.zeroed));
        }
        if self.late != Late::default() {
            gyro_times::advance(gyros.to_mut(), self.late.values_s.map(|late_s| -late_s));
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
