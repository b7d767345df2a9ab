//! A line of one or more gyros, and the phase of it and of its products.

use std::f64::consts::TAU;

use realfft::num_complex::Complex64;
use rlg_inference::phase_course::legendre;
use rlg_signal::streams::{Triad, each_axis};

/// Phase of an independent line \[rad\]: 2π f t and a course in Legendre polynomials from the second on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Phase {
    /// Frequency \[Hz\], the slope of the phase over the record.
    pub(crate) hz: f64,
    /// Its standard deviation \[Hz\].
    pub(crate) hz_std: f64,
    /// Coefficients from the second degree on \[rad\]; empty for a constant frequency.
    pub(crate) course_rad: Vec<f64>,
    /// Root mean square of the frequency about its mean, and its standard deviation \[Hz\].
    pub(crate) wander_hz: [f64; 2],
}

/// Order of each line in a product, by the line's place: 2, −1 is twice the first less the second.
pub(crate) type Orders = Vec<(usize, i32)>;

/// Origin of a line's phase.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Origin {
    /// Independent line.
    Own(Phase),
    /// Intermodulation product of other lines, whose phases it follows.
    Product(Orders),
}

/// A line.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Line {
    pub(crate) origin: Origin,
    /// Apparent frequency in the rows \[Hz\].
    pub(crate) shown_hz: f64,
    /// Amplitude and phase on each gyro \[rad a row\]; 0 on a gyro where it is not significant.
    pub(crate) amplitude_rad: [Complex64; 3],
    /// The same as it was measured on each gyro \[rad a row\].
    pub(crate) measured_rad: [Complex64; 3],
    /// Standard deviation of either quadrature \[rad\].
    pub(crate) std_rad: [f64; 3],
    /// 2 Δ ln L at its last fit, summed over the gyros that show it.
    pub(crate) gain: f64,
    /// ln of its false-alarm probability, trials counted.
    pub(crate) ln_chance: f64,
}

/// Number of rows, and their rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clock {
    pub(crate) rows: usize,
    pub(crate) rate_hz: f64,
}

impl Clock {
    /// The inverse of the record's length \[Hz\].
    pub(crate) fn resolution_hz(self) -> f64 {
        self.rate_hz / self.rows as f64
    }

    /// Folds a frequency to its apparent frequency in the rows \[Hz\].
    pub(crate) fn folded_hz(self, hz: f64) -> f64 {
        let rest = hz.rem_euclid(self.rate_hz);
        rest.min(self.rate_hz - rest)
    }
}

impl Phase {
    /// Phase in the middle of a row \[rad\].
    fn at_rad(&self, row: usize, clock: Clock) -> f64 {
        let middle = row as f64 + 0.5;
        let turn = TAU * (self.hz / clock.rate_hz * middle).fract();
        if self.course_rad.is_empty() {
            return turn;
        }
        let course: Vec<f64> = std::iter::once(0.0)
            .chain(self.course_rad.iter().copied())
            .collect();
        turn + legendre(&course, 2.0 * middle / clock.rows as f64 - 1.0)
    }
}

/// Returns the phase of a line by row \[rad\]; a product's phase is that of its lines.
pub(crate) fn phase_rad<'a>(
    origin: &'a Origin,
    lines: &'a [Line],
    clock: Clock,
) -> Box<dyn Fn(usize) -> f64 + Sync + 'a> {
    match origin {
        Origin::Own(phase) => Box::new(move |row| phase.at_rad(row, clock)),
        Origin::Product(orders) => {
            let parts: Vec<(&Phase, f64)> = orders
                .iter()
                .filter_map(|&(place, order)| match &lines[place].origin {
                    Origin::Own(phase) => Some((phase, f64::from(order))),
                    Origin::Product(_) => None,
                })
                .collect();
            Box::new(move |row| {
                let each = parts.iter();
                each.map(|(phase, order)| order * phase.at_rad(row, clock))
                    .sum()
            })
        }
    }
}

impl Line {
    /// True if a gyro shows it.
    pub(crate) fn is_on(&self, gyro: usize) -> bool {
        self.amplitude_rad[gyro] != Complex64::ZERO
    }

    /// True if any gyro shows it: not if pulse quantisation hides its angle on all.
    pub(crate) fn is_any(&self) -> bool {
        (0..3).any(|gyro| self.is_on(gyro))
    }

    /// Increments of the line on the gyros \[rad\].
    pub(crate) fn rows_rad(&self, lines: &[Line], clock: Clock) -> Triad {
        let phase_rad = phase_rad(&self.origin, lines, clock);
        let turns: Vec<Complex64> = (0..clock.rows)
            .map(|row| Complex64::cis(phase_rad(row)))
            .collect();
        each_axis(|gyro| match self.is_on(gyro) {
            true => turns
                .iter()
                .map(|turn| (self.amplitude_rad[gyro] * turn).re)
                .collect(),
            false => Vec::new(),
        })
    }

    /// Amplitude on a gyro without the bias by its noise, and its standard deviation \[rad\].
    pub(crate) fn size_rad(&self, gyro: usize) -> [f64; 2] {
        let (square, std) = (self.measured_rad[gyro].norm_sqr(), self.std_rad[gyro]);
        [(square - std * std).max(0.0).sqrt(), std]
    }
}
