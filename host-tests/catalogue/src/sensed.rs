//! Values of design columns by row, each from one estimate of the motion.

use std::f64::consts::TAU;
use std::ops::Range;

use realfft::num_complex::Complex64;
use rlg_inference::sums::sums;
use rlg_signal::axes::add;
use rlg_signal::derivatives::{Spectrum, row_means};

use crate::column::Column;
use crate::low_pass;
use crate::resonance;
use crate::signals::{CaseMotion, Estimate, Path, Signals, Triad, late};

/// Column with the estimate of the motion from which it is computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensed {
    /// The column.
    pub column: Column,
    /// Estimate of the motion.
    pub of: Estimate,
}

impl Sensed {
    /// Column of a candidate effect on a gyro.
    pub fn tried(column: Column, gyro: usize, signals: &Signals) -> Self {
        let root = (signals.rows as f64).sqrt();
        let negligible = signals.plan.negligible_share;
        let is_shared =
            |axis: usize| axis == gyro || signals.shared[(gyro, axis)].abs() * root > negligible;
        let of = match column.axes() {
            Some(axes) if !axes.into_iter().flatten().any(is_shared) => Estimate::Likeliest,
            _ => Estimate::Independent,
        };
        Self { column, of }
    }

    /// Column of [`Estimate::Independent`].
    pub fn independent(column: Column) -> Self {
        Self {
            column,
            of: Estimate::Independent,
        }
    }

    /// Column of a known effect.
    pub fn known(column: Column) -> Self {
        let of = match column {
            Column::Increment(_) | Column::Late(..) | Column::LowPass(..) | Column::Mount(..) => {
                Estimate::Measured
            }
            _ => Estimate::Likeliest,
        };
        Self { column, of }
    }

    /// Computes the values by row; zero if the recording lacks a channel of the column.
    pub fn values(self, signals: &Signals) -> Vec<f64> {
        match self.of {
            Estimate::Independent => self
                .column
                .of_motion(Regressors::of(signals, &signals.independent)),
            Estimate::Likeliest => self
                .column
                .of_motion(Regressors::of(signals, &signals.likeliest)),
            Estimate::Measured => {
                let likeliest = || {
                    self.column
                        .of_motion(Regressors::of(signals, &signals.likeliest))
                };
                self.column.of_measured(signals).unwrap_or_else(likeliest)
            }
        }
    }

    /// Computes sums over blocks of `each` rows; rows behind the last whole block are dropped.
    pub fn sums(self, signals: &Signals, each: usize) -> Vec<f64> {
        // Increments of a wave add up to one over the block.
        if let Column::Wave(axis, order, is_cosine) = self.column {
            let motion = match self.of {
                Estimate::Independent => &signals.independent,
                Estimate::Likeliest | Estimate::Measured => &signals.likeliest,
            };
            return Regressors::of(signals, motion).wave(axis, order, is_cosine, each);
        }
        sums(&self.values(signals), each)
    }

    /// Part of a linear effect that the shrinkage gate removes, to be subtracted from the residual; `None` for other
    /// columns. The reference's noise after a filter is retained: with a different noise spectrum in every set, noise
    /// would decide between sets.
    pub fn hidden(self, signals: &Signals) -> Option<Vec<f64>> {
        let is_filtered = match self.column {
            Column::Increment(_) => false,
            Column::Late(gyro, _) => {
                let path = signals.path;
                path.low_pass[gyro].is_some() || path.mount != [None; 3]
            }
            Column::LowPass(.., low_pass::Part::Response)
            | Column::Mount(.., resonance::Part::Response) => true,
            _ => return None,
        };
        let mut hidden = if is_filtered {
            self.column
                .of_motion(Regressors::of(signals, &signals.likeliest))
        } else {
            self.column.of_measured(signals)?
        };
        add(&mut hidden, &self.values(signals), -1.0);
        Some(hidden)
    }
}

/// Regressors of a column: channels of the recording, and one estimate of the motion.
#[derive(Clone, Copy)]
struct Regressors<'a> {
    signals: &'a Signals,
    motion: &'a CaseMotion,
    period_s: f64,
}

impl<'a> Regressors<'a> {
    fn of(signals: &'a Signals, motion: &'a CaseMotion) -> Self {
        let period_s = signals.period_s();
        Self {
            signals,
            motion,
            period_s,
        }
    }

    /// Values of a rate or a force, times T.
    fn times_period(self, values: &[f64]) -> Vec<f64> {
        values.iter().map(|value| value * self.period_s).collect()
    }

    /// Means over rows from values at their middles, times T.
    fn means(self, at_middles: &[f64]) -> Vec<f64> {
        self.times_period(&row_means(at_middles))
    }

    /// Law of the rate about an axis, times T.
    fn of_rate(self, axis: usize, law: impl Fn(f64) -> f64) -> Vec<f64> {
        let rates = self.motion.rate_rad_s(axis).iter();
        let at_middles: Vec<f64> = rates.map(|rate| law(*rate)).collect();
        self.means(&at_middles)
    }

    /// Product of an acceleration and the rate about an axis, times T.
    fn times_rate(self, acceleration: &[f64], axis: usize) -> Vec<f64> {
        self.means(&product(acceleration, self.motion.rate_rad_s(axis)))
    }

    fn derivative(self, spectrum: &Spectrum, order: i32) -> Vec<f64> {
        self.times_period(&spectrum.mean_derivative(order))
    }

    fn spectrum(self, values: &[f64]) -> Spectrum {
        Spectrum::new(values, self.signals.rate_hz)
    }

    fn zeros(self) -> Vec<f64> {
        vec![0.0; self.signals.rows]
    }

    /// Law of a measured channel; zero if the recording lacks it.
    fn channel(
        self,
        triad: &Option<Triad>,
        axis: usize,
        law: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Vec<f64> {
        let values = triad.as_ref().map(|triad| law(&triad[axis]));
        values.unwrap_or_else(|| self.zeros())
    }

    /// Increments about an axis after a linear system \[rad\].
    fn increments_behind(self, axis: usize, response: impl Fn(f64) -> Complex64) -> Vec<f64> {
        self.motion
            .spectrum(axis)
            .through(|hz| response(hz) * self.period_s)
    }

    /// Sensed increments of a gyro after a linear system \[rad\], without the factor 1/(1 − s_i).
    fn sensed_behind(self, gyro: usize, response: impl Fn(f64) -> Complex64) -> Vec<f64> {
        let along = |axis: usize| {
            let along = self.signals.sensing_from_body[(gyro, axis)];
            (self.motion.spectrum(axis), along)
        };
        Spectrum::sum_through(&[0, 1, 2].map(along), |hz| response(hz) * self.period_s)
    }

    /// Sensed increments of a gyro \[rad\], without the factor 1/(1 − s_i).
    fn sensed(self, gyro: usize) -> Vec<f64> {
        let mut sum = self.zeros();
        for axis in 0..3 {
            let along = self.signals.sensing_from_body[(gyro, axis)];
            add(&mut sum, &self.motion.case_rad[axis], along);
        }
        sum
    }

    /// Effect of a delay of a pickoff beyond a known one and beyond its linear term \[rad\].
    fn dither_beyond(self, axis: usize, known_s: f64, found_s: f64) -> Vec<f64> {
        let beyond = |hz: f64| {
            let slope = Complex64::new(1.0, -TAU * hz * found_s);
            late(-known_s - found_s, hz) * slope - late(-known_s, hz)
        };
        self.channel(&self.signals.dither_rad, axis, |dither| {
            self.spectrum(dither).through(beyond)
        })
    }

    /// Increments of the cosine or sine of an order times the table's angle about an axis, over blocks of `each` rows.
    fn wave(self, axis: usize, order: u32, is_cosine: bool, each: usize) -> Vec<f64> {
        let (signals, case_rad) = (self.signals, &self.motion.case_rad[axis]);
        let reference_rad = signals.path.before(axis, case_rad, signals.rate_hz);
        let mut angle = 0.0;
        let angles = reference_rad.chunks_exact(each).map(|block| {
            block.iter().for_each(|increment| angle += increment);
            angle
        });
        increments_of(angles, 0.0, |angle| {
            let turn = f64::from(order) * angle;
            if is_cosine { turn.cos() } else { turn.sin() }
        })
    }

    /// One value in a range of rows, 0 outside.
    fn constant_in(self, rows: Range<usize>, value: f64) -> Vec<f64> {
        let mut values = self.zeros();
        values[rows].fill(value);
        values
    }
}

/// Products by row.
fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

/// Increments of a law of an angle from row to row, from its value `first` before the first row.
fn increments_of(
    angles: impl Iterator<Item = f64>,
    first: f64,
    law: impl Fn(f64) -> f64,
) -> Vec<f64> {
    let mut before = law(first);
    let increments = angles.map(|angle| {
        let now = law(angle);
        let increment = now - before;
        before = now;
        increment
    });
    increments.collect()
}

impl Column {
    /// Computes the values by row from [`Estimate::Independent`].
    pub fn values(self, signals: &Signals) -> Vec<f64> {
        self.of_motion(Regressors::of(signals, &signals.independent))
    }

    /// Applies a linear effect to the measured reference \[rad\]: each part of the path after its predecessors (mount,
    /// low pass, delay), so that all parts together are the path; a part that is not on the path after the whole path.
    /// `None` for other columns.
    fn of_measured(self, signals: &Signals) -> Option<Vec<f64>> {
        let (path, rate_hz) = (signals.path, signals.rate_hz);
        let reference_rad = &*signals.measured_rad;
        match self {
            Self::Increment(axis) => {
                Some(path.along(axis, &reference_rad[axis], rate_hz).into_owned())
            }
            Self::Mount(axis, mount, part @ resonance::Part::Response) => {
                let before = |hz| match path.mount[axis] {
                    Some(_) => Complex64::ONE,
                    None => path.response(axis, hz),
                };
                let beyond = |hz| mount.beyond_mount(hz, part) * before(hz);
                Some(Path::through(&reference_rad[axis], rate_hz, beyond))
            }
            Self::LowPass(gyro, low_pass, part @ low_pass::Part::Response) => {
                let sensed = signals.measured_along_rad(gyro);
                let before = |hz| match path.low_pass[gyro] {
                    Some(_) => Complex64::ONE,
                    None => late(path.delay_s[gyro], hz),
                };
                let beyond = |hz| low_pass.beyond(hz, part) * before(hz);
                Some(Path::through(&sensed, rate_hz, beyond))
            }
            Self::Late(gyro, delay_s) => {
                let sensed = signals.measured_along_rad(gyro);
                let before = |hz| path.low_pass[gyro].map_or(Complex64::ONE, |one| one.whole(hz));
                let beyond = |hz| (late(delay_s, hz) - 1.0) * before(hz);
                Some(Path::through(&sensed, rate_hz, beyond))
            }
            _ => None,
        }
    }

    /// Computes the values by row from one estimate of the motion.
    fn of_motion(self, of: Regressors) -> Vec<f64> {
        let Regressors {
            signals,
            motion,
            period_s,
        } = of;
        let (force, warming) = (&signals.force_m_s2, &signals.warming_k);
        let (case, alpha) = (&motion.case_rad, |axis| motion.acceleration_rad_s2(axis));
        match self {
            Self::Constant => vec![period_s; signals.rows],
            Self::Increment(axis) => case[axis].clone(),
            Self::Delay(axis) => of.derivative(motion.spectrum(axis), 1),
            Self::Jerk(axis) => of.derivative(motion.spectrum(axis), 2),
            Self::Magnitude(axis) => of.of_rate(axis, f64::abs),
            Self::Square(axis) => of.of_rate(axis, |rate| rate * rate),
            Self::Cube(axis) => of.of_rate(axis, |rate| rate.powi(3)),
            Self::Flexure(about, senses) => of.times_rate(alpha(about), senses),
            Self::CubicFlexure(about, senses) => {
                let cubes: Vec<f64> = alpha(about).iter().map(|alpha| alpha.powi(3)).collect();
                of.times_rate(&cubes, senses)
            }
            Self::ResonantFlexure(about, senses, resonance, part) => {
                let spectrum = motion.spectrum(about);
                let suspension = |hz| resonance.suspension(hz, part);
                of.times_rate(&spectrum.middle_derivative_behind(1, suspension), senses)
            }
            Self::SpaceVector(at_start, axis) => {
                of.times_period(&signals.space_vector(at_start, axis))
            }
            Self::Force(axis) => of.channel(force, axis, |f| of.times_period(f)),
            Self::ForceSquare(axis) => of.channel(force, axis, |f| of.times_period(&product(f, f))),
            Self::ForceRate(axis) => of.channel(force, axis, |f| of.derivative(&of.spectrum(f), 1)),
            Self::ForceTimesIncrement(axis) => of.channel(force, axis, |f| product(f, &case[axis])),
            Self::Warming(axis) => of.channel(warming, axis, |t| of.times_period(t)),
            Self::WarmingRate(axis) => {
                of.channel(warming, axis, |t| of.derivative(&of.spectrum(t), 1))
            }
            Self::WarmingTimesIncrement(axis, with) => {
                of.channel(warming, axis, |t| product(t, &case[with]))
            }
            Self::Magnetic(axis) => of.channel(&signals.magnetic_t, axis, |b| of.times_period(b)),
            Self::OffVertical(axis) => {
                of.channel(&signals.off_vertical, axis, |off| of.times_period(off))
            }
            Self::Dither(axis) => of.channel(&signals.dither_rad, axis, <[f64]>::to_vec),
            Self::DitherDelay(axis, late_s) => of.channel(&signals.dither_rad, axis, |dither| {
                let slope = |hz: f64| Complex64::new(0.0, TAU * hz) * late(-late_s, hz);
                of.spectrum(dither).through(slope)
            }),
            Self::DitherBeyond(axis, known_s, found_s) => of.dither_beyond(axis, known_s, found_s),
            Self::DitherCube(axis) => of.channel(&signals.pickoff_rad, axis, |angles| {
                increments_of(angles.iter().copied(), angles[0], |angle| angle.powi(3))
            }),
            // The motion is after the path: the response of a part already on the path is divided out.
            Self::Mount(axis, mount, part) => of.increments_behind(axis, |hz| {
                let before = signals.path.mount[axis].map_or(Complex64::ONE, |one| one.whole(hz));
                mount.beyond_mount(hz, part) / before
            }),
            Self::LowPass(gyro, low_pass, part) => of.sensed_behind(gyro, |hz| {
                let on_path = signals.path.low_pass[gyro];
                low_pass.beyond(hz, part) / on_path.map_or(Complex64::ONE, |one| one.whole(hz))
            }),
            Self::HighPass(gyro, high_pass, part) => {
                let sensed_rad = of.sensed(gyro);
                high_pass.beyond(&sensed_rad, period_s, part)
            }
            Self::Late(gyro, delay_s) => of.sensed_behind(gyro, |hz| 1.0 - late(-delay_s, hz)),
            Self::LockIn(gyro, threshold, part) => {
                threshold.increments(gyro, part, signals, motion)
            }
            Self::Wave(axis, order, is_cosine) => of.wave(axis, order, is_cosine, 1),
            Self::Expression(expression) => {
                let values = expression.values(signals, motion);
                values.unwrap_or_else(|| of.zeros())
            }
            Self::Impulse(row) => of.constant_in(row..row + 1, 1.0),
            Self::Step(row) => of.constant_in(row..signals.rows, period_s),
        }
    }
}
