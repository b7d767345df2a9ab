//! Resonances as linear combinations of few responses, and the columns of such a basis.

use std::cell::Cell;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use realfft::num_complex::Complex64;
use rlg_inference::{Columns, Hypothesis, Term};
use rlg_signal::derivatives::row_means;

use crate::candidates::along;
use crate::entry::tilt;
use crate::resonance::{CRITICAL, Part, Resonance};
use crate::signals::Signals;

/// Frequency response of a resonance at a frequency \[Hz\].
pub type Response = fn(Resonance, f64) -> Complex64;

/// Family of resonances as linear combinations of few responses (truncated singular value decomposition).
///
/// The grid's responses are nearly alike at frequencies without motion; the strongest singular vectors, weighted by the
/// motion's power over the noise, span the family.
pub struct Basis {
    /// Frequencies at which responses are tabulated \[Hz\].
    hz: Vec<f64>,
    /// Responses.
    responses: Vec<Vec<Complex64>>,
    /// Left singular vectors: real parts, then imaginary parts, by frequency.
    left: DMatrix<f64>,
    /// Root of the motion's power over the noise at the tabulated frequencies.
    root: Vec<f64>,
    law: Response,
}

/// Growth of ln L below which the climb stops.
const LEAST_STEP: f64 = 1e-3;

/// Real and imaginary parts of a response, each times the root of the motion's power over the noise.
fn weighed(law: Response, resonance: Resonance, hz: &[f64], root: &[f64]) -> DVector<f64> {
    let count = hz.len();
    DVector::from_fn(2 * count, |row, _| {
        let k = row % count;
        let value = law(resonance, hz[k]);
        root[k] * if row < count { value.re } else { value.im }
    })
}

/// Number of singular vectors kept; a grid of a hundred responses is then accurate to some 1e-3 of its strongest.
const DIRECTIONS: usize = 12;

impl Basis {
    /// Decomposes the responses of a grid.
    ///
    /// # Inputs
    /// `law`: response at a frequency \[Hz\]; `axes`: axes of the motion through it; `noise`: power of the observation
    /// noise at a frequency \[Hz\], in any unit.
    pub fn new(
        law: Response,
        grid: &[Resonance],
        signals: &Signals,
        axes: &[usize],
        noise: impl Fn(f64) -> f64,
    ) -> Self {
        const TABULATED: usize = 256;
        let half = 0.5 * signals.rate_hz;
        let lowest = (2.0 / (signals.rows as f64 * signals.period_s())).min(0.1 * half);
        let ratio = (half / lowest).powf(1.0 / (TABULATED - 1) as f64);
        let hz: Vec<f64> = (0..TABULATED)
            .map(|k| lowest * ratio.powi(k as i32))
            .collect();
        let mut power = vec![0.0; TABULATED];
        for &axis in axes {
            let of_axis = signals.independent.spectrum(axis).binned_power(&hz);
            for (sum, power) in power.iter_mut().zip(of_axis) {
                *sum += power;
            }
        }
        let root: Vec<f64> = power
            .iter()
            .zip(&hz)
            .map(|(power, hz)| (power / noise(*hz)).sqrt())
            .collect();
        let mut columns = DMatrix::zeros(2 * TABULATED, grid.len());
        for (mut column, resonance) in columns.column_iter_mut().zip(grid) {
            column.copy_from(&weighed(law, *resonance, &hz, &root));
        }
        let svd = columns.svd(true, false);
        let left = svd.u.expect("asked for");
        let left = left.columns(0, DIRECTIONS.min(left.ncols())).into_owned();
        let of_direction = |direction: usize| -> Vec<Complex64> {
            (0..TABULATED)
                .map(|k| {
                    let value =
                        Complex64::new(left[(k, direction)], left[(k + TABULATED, direction)]);
                    if root[k] > 0.0 {
                        value / root[k]
                    } else {
                        Complex64::ZERO
                    }
                })
                .collect()
        };
        Self {
            responses: (0..left.ncols()).map(of_direction).collect(),
            left,
            root,
            hz,
            law,
        }
    }

    /// Coefficients of a resonance along the directions.
    pub fn sizes(&self, resonance: Resonance) -> DVector<f64> {
        self.left
            .tr_mul(&weighed(self.law, resonance, &self.hz, &self.root))
    }

    /// Refines the best points of the grid to local maxima of the gain, the best first.
    ///
    /// A strong resonance has secondary maxima besides its own.
    pub fn best(
        &self,
        grid: &[Resonance],
        gain: impl Fn(&DVector<f64>) -> f64 + Sync,
    ) -> Vec<(Resonance, f64)> {
        const BEGINNINGS: usize = 8;
        let of = |resonance: Resonance| (resonance, gain(&self.sizes(resonance)));
        let by_gain = |a: &(Resonance, f64), b: &(Resonance, f64)| b.1.total_cmp(&a.1);
        let mut points: Vec<(Resonance, f64)> = grid.par_iter().copied().map(of).collect();
        points.sort_by(by_gain);
        points.truncate(BEGINNINGS);
        let mut tops: Vec<(Resonance, f64)> = Vec::new();
        let climbed: Vec<(Resonance, f64)> = points
            .into_par_iter()
            .map(|point| climb(point, &of))
            .collect();
        for top in climbed {
            let is_near = |other: &(Resonance, f64)| (other.0.hz / top.0.hz).ln().abs() < 0.05;
            if !tops.iter().any(is_near) {
                tops.push(top);
            }
        }
        tops.sort_by(by_gain);
        tops
    }

    /// Number of directions.
    pub fn directions(&self) -> usize {
        self.responses.len()
    }

    /// Response of a direction at frequencies \[Hz\] that ascend, interpolated between tabulated ones.
    fn along(&self, direction: usize) -> impl Fn(f64) -> Complex64 {
        let response = &self.responses[direction];
        let reached = Cell::new(0);
        move |hz: f64| {
            let further = self.hz[reached.get()..].iter();
            let after = reached.get() + further.take_while(|other| **other <= hz).count();
            reached.set(after);
            if after == 0 {
                return Complex64::new(response[0].re, 0.0);
            }
            if after == self.hz.len() {
                return response[after - 1];
            }
            let share = (hz - self.hz[after - 1]) / (self.hz[after] - self.hz[after - 1]);
            response[after - 1] * (1.0 - share) + response[after] * share
        }
    }
}

/// Climbs to a local maximum of the gain by decreasing steps of frequency and damping.
fn climb(begin: (Resonance, f64), of: &impl Fn(Resonance) -> (Resonance, f64)) -> (Resonance, f64) {
    /// Ratios of neighbours: those of the grid, reduced by half in each pass.
    const FREQUENCY: f64 = 1.2;
    const DAMPING: f64 = 3.0;
    const HALVINGS: i32 = 10;
    let mut best = begin;
    for halving in 1..=HALVINGS {
        let share = 0.5_f64.powi(halving);
        let hz_by = [FREQUENCY.powf(-share), 1.0, FREQUENCY.powf(share)];
        let damping_by = [DAMPING.powf(-share), 1.0, DAMPING.powf(share)];
        loop {
            let (Resonance { hz, damping }, value) = best;
            let near = hz_by.iter().flat_map(|by_hz| {
                damping_by.iter().map(move |by_damping| Resonance {
                    hz: hz * by_hz,
                    damping: (damping * by_damping).min(CRITICAL),
                })
            });
            match near.map(of).max_by(|a, b| a.1.total_cmp(&b.1)) {
                Some(next) if next.1 > value + LEAST_STEP => best = next,
                _ => break,
            }
        }
    }
    best
}

/// Mounts about one axis: one column per direction of a basis.
pub struct MountColumns<'a> {
    /// Responses.
    pub basis: &'a Basis,
    /// Motion.
    pub signals: &'a Signals,
    /// Axis of the mount.
    pub axis: usize,
}

impl Columns for MountColumns<'_> {
    fn count(&self) -> usize {
        self.basis.directions()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        let period = self.signals.period_s();
        let mut values = self
            .signals
            .independent
            .spectrum(self.axis)
            .through(self.basis.along(place));
        values.iter_mut().for_each(|value| *value *= period);
        values
    }
}

impl MountColumns<'_> {
    /// Hypothesis of one parameter per direction, on every gyro.
    pub fn hypothesis(&self) -> Hypothesis {
        on_every_gyro(self.count(), self.axis, self.signals)
    }
}

/// Hypothesis of one parameter for each of `count` columns of the case's motion about an axis.
pub(crate) fn on_every_gyro(count: usize, axis: usize, signals: &Signals) -> Hypothesis {
    let terms = (0..count).flat_map(|column| {
        (0..3).map(move |gyro| Term {
            parameter: column,
            record: gyro,
            column,
            coefficient: along(signals, gyro, axis),
        })
    });
    Hypothesis::of_terms(
        count,
        terms.filter(|term| term.coefficient != 0.0).collect(),
    )
}

/// Resonant suspensions of one gyro: for each of its two tilts, one column per direction of a basis.
pub struct SuspensionColumns<'a> {
    /// Responses.
    pub basis: &'a Basis,
    /// Motion.
    pub signals: &'a Signals,
    /// Gyro of the block.
    pub gyro: usize,
}

impl SuspensionColumns<'_> {
    /// Two axes about which the block tilts.
    pub fn about(&self) -> [usize; 2] {
        match self.gyro {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        }
    }

    /// Hypothesis of one parameter per tilt and direction.
    pub fn hypothesis(&self) -> Hypothesis {
        let terms = (0..self.count()).map(|place| {
            let about = self.about()[place / self.basis.directions()];
            let (sign, _) = tilt(self.gyro, about);
            Term {
                parameter: place,
                record: self.gyro,
                column: place,
                coefficient: -sign / (1.0 - self.signals.scale_error[self.gyro]),
            }
        });
        Hypothesis::of_terms(self.count(), terms.collect())
    }
}

impl Columns for SuspensionColumns<'_> {
    fn count(&self) -> usize {
        2 * self.basis.directions()
    }

    fn column(&self, place: usize) -> Vec<f64> {
        let directions = self.basis.directions();
        let about = self.about()[place / directions];
        let (_, senses) = tilt(self.gyro, about);
        // Products of two other axes are free of the gyro's own noise.
        let motion = &self.signals.likeliest;
        let acceleration = motion
            .spectrum(about)
            .middle_derivative_behind(1, self.basis.along(place % directions));
        let period = self.signals.period_s();
        let products: Vec<f64> = acceleration
            .iter()
            .zip(motion.rate_rad_s(senses))
            .map(|(a, b)| a * b * period)
            .collect();
        row_means(&products)
    }
}

/// Frequency responses of the two resonant kinds.
pub const SUSPENSION: Response = |resonance, hz| resonance.suspension(hz, Part::Response);

/// See [`SUSPENSION`].
pub const MOUNT: Response = |resonance, hz| resonance.beyond_mount(hz, Part::Response);
